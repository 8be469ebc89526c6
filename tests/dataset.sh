#!/usr/bin/env bash
# The example in a data set's README.md runs, and its rays go through the lamps as the world has them,
# with a wide lens. OpenCV, pyarrow and pandas come from PyPI into a folder that is removed at the end.
#
#   tests/dataset.sh
#   METROTWIN=path tests/dataset.sh      with a program that is built already
set -euo pipefail
cd "$(dirname "$0")/.."

. tests/common/scripts.sh
find_program

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
make_venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check \
    opencv-python-headless==5.0.0.93 pyarrow==26.0.1 pandas pycocotools
"$METROTWIN" frames scenarios/forgotten_toolbox.toml --out "$dir/set" --renderer cpu --limit 1 --cameras left \
    --set train.start_chainage_m=700 --set 'rig.distortion={k1=-0.28, k2=0.074, p1=2e-4, p2=2e-5}' >/dev/null
"$dir/venv/bin/python" tests/dataset.py "$dir/set"
echo "1 passed, 0 failed"
