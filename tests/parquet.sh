#!/usr/bin/env bash
# The rows of a study load in pyarrow and in DuckDB with their units, and are those of the journal. The
# two come from PyPI into a folder that is removed at the end.
#
#   tests/parquet.sh
#   METROTWIN=path tests/parquet.sh      with a program that is built already
set -euo pipefail
cd "$(dirname "$0")/.."

. tests/common/scripts.sh
find_program

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
make_venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check pyarrow==26.0.1 duckdb==2.0.0

"$METROTWIN" study run tests/studies/small.toml --out "$dir/small" --renderer cpu >/dev/null
"$dir/venv/bin/python" tests/studies/parquet.py "$dir/small"
echo "1 passed, 0 failed"
