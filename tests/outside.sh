#!/usr/bin/env bash
# The figures that src/twin/physics/validation/ride.rs holds the ride against, computed again by numpy, which
# comes from PyPI into a folder that is removed at the end.
#
#   tests/outside.sh
set -euo pipefail
cd "$(dirname "$0")/.."

. tests/common/scripts.sh

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
make_venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check numpy==2.4.6
"$dir/venv/bin/python" tests/validation/ride.py >"$dir/ride.txt"
diff <(grep -o '\[[0-9., ]*\]' "$dir/ride.txt") \
    <(grep 'check(&' src/twin/physics/validation/ride.rs | grep -o '\[[0-9., ]*\]')
echo "1 passed, 0 failed"
