#!/usr/bin/env bash
# Every test of metrotwin, on any Linux machine. The renderer's tests need a Vulkan adapter; where
# the machine has none, Mesa's software driver (lavapipe) is installed, so nothing is skipped.
#
#   tests/all.sh                       all tests
#   tests/all.sh --test program cli    what follows goes to `cargo test`
set -euo pipefail
cd "$(dirname "$0")/.."

say() { printf '\n== %s\n' "$*"; }

# A Vulkan driver announces itself by a manifest in one of these folders.
has_vulkan_driver() {
    [[ -n "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ]] && return 0
    compgen -G '/usr/share/vulkan/icd.d/*.json' >/dev/null ||
        compgen -G '/usr/local/share/vulkan/icd.d/*.json' >/dev/null ||
        compgen -G '/etc/vulkan/icd.d/*.json' >/dev/null
}

has_vulkan_loader() {
    ldconfig -p 2>/dev/null | grep -q 'libvulkan\.so\.1'
}

install_software_vulkan() {
    local root=()
    if [[ $(id -u) -ne 0 ]]; then
        command -v sudo >/dev/null && root=(sudo) || return 1
    fi
    command -v apt-get >/dev/null || return 1
    "${root[@]}" apt-get update -qq
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y --no-install-recommends mesa-vulkan-drivers libvulkan1
}

if [[ $(uname) == Linux ]] && ! { has_vulkan_driver && has_vulkan_loader; }; then
    say "no Vulkan driver found: installing Mesa's software driver"
    if ! install_software_vulkan; then
        cat >&2 <<'HELP'
The renderer's tests need a Vulkan driver and loader, and they could not be installed from here.
  Debian, Ubuntu:  apt-get install mesa-vulkan-drivers libvulkan1
  Fedora:          dnf install mesa-vulkan-drivers vulkan-loader
  Arch:            pacman -S vulkan-swrast vulkan-icd-loader
Then run tests/all.sh again.
HELP
        exit 1
    fi
fi

say "cargo test --release $*"
cargo test --release "$@"
