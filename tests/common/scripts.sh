# What the scripts beside this folder share.

# METROTWIN is the program's path; it is built where none is given.
find_program() {
    if [[ -z "${METROTWIN:-}" ]]; then
        cargo build --release
        METROTWIN=${CARGO_TARGET_DIR:-target}/release/metrotwin
    fi
    METROTWIN=$(realpath "$METROTWIN")
}

# make_venv FOLDER: a virtual environment of Python; on Debian and Ubuntu what it needs is installed.
make_venv() {
    if ! python3 -m venv "$1" >/dev/null 2>&1; then
        if [[ $(id -u) -ne 0 ]] || ! command -v apt-get >/dev/null; then
            echo "$0: install Python 3 with its venv (on Debian: python3-venv)" >&2
            exit 1
        fi
        apt-get update -qq
        DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends python3-venv >/dev/null
        python3 -m venv --clear "$1"
    fi
}
