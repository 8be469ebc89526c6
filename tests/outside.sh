#!/usr/bin/env bash
# Figures in a test that another program computed, computed again: the ride of a textbook car, by numpy, which
# comes from PyPI into a folder that is removed at the end.
#
#   tests/outside.sh
set -euo pipefail
cd "$(dirname "$0")/.."

. tests/common/scripts.sh

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
make_venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check numpy
"$dir/venv/bin/python" tests/validation/ride.py >"$dir/ride.txt"
rows=$(grep -o '\[.*\]' "$dir/ride.txt")
[[ $(wc -l <<<"$rows") -eq 6 ]]
while read -r row; do
    if ! grep -qF "$row" src/twin/physics/validation/ride.rs; then
        echo "$row, by tests/validation/ride.py, is not in src/twin/physics/validation/ride.rs" >&2
        exit 1
    fi
done <<<"$rows"
echo "1 passed, 0 failed"
