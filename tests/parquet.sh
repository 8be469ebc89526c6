#!/usr/bin/env bash
# The rows of a study load in pyarrow and in DuckDB with their units, and are those of the journal. The
# two come from PyPI into a folder that is removed at the end.
#
#   tests/parquet.sh
#   METROTWIN=path tests/parquet.sh      with a program that is built already
set -euo pipefail
cd "$(dirname "$0")/.."

if [[ -z "${METROTWIN:-}" ]]; then
    cargo build --release
    METROTWIN=${CARGO_TARGET_DIR:-target}/release/metrotwin
fi
METROTWIN=$(realpath "$METROTWIN")

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
if ! python3 -m venv "$dir/venv" >/dev/null 2>&1; then
    if [[ $(id -u) -ne 0 ]] || ! command -v apt-get >/dev/null; then
        echo "tests/parquet.sh: install Python 3 with its venv (on Debian: python3-venv)" >&2
        exit 1
    fi
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends python3-venv >/dev/null
    python3 -m venv --clear "$dir/venv"
fi
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check pyarrow==26.0.1 duckdb==2.0.0

"$METROTWIN" study run tests/studies/small.toml --out "$dir/small" --renderer cpu >/dev/null
"$dir/venv/bin/python" tests/studies/parquet.py "$dir/small"
echo "1 passed, 0 failed"
