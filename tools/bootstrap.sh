#!/bin/sh
# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
#
# Makes .venv ready, from a bare Debian or Ubuntu: system packages, virtual environment, this package.
# usage: tools/bootstrap.sh [EXTRA]     EXTRA is one of the extras in setup.py, such as dev
#
# Installs system packages itself when run by root, else prints the command and stops. Quiet and quick
# when nothing is to be done: a stamp in .venv holds the checksum of what the installation depends on.
# PYTHON=/path/to/python3.11 chooses the interpreter (for a new .venv).
set -eu
cd "$(dirname "$0")/.."

extra=${1:-}
needed_modules="cv2, numba"
case $extra in
    dev) needed_modules="$needed_modules, open3d" ;;
    ros) needed_modules="$needed_modules, rclpy" ;;
esac
stamp=.venv/.installed-${extra:-plain}

say() { printf '%s\n' "$*" >&2; }
fail() { say "bootstrap: $*"; exit 1; }

checksum() { { cat setup.py setup.cfg package.xml tools/bootstrap.sh; pwd; } | cksum; }

is_current() { [ -f "$1" ] && [ "$(cat "$1")" = "$(checksum)" ]; }

supported() { "$1" -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 12))' 2>/dev/null; }

find_python() {
    for candidate in ${PYTHON:-python3 python3.12 python3.11 python3.10}; do
        if supported "$candidate"; then echo "$candidate"; return; fi
    done
}

# The shared libraries that numba and, for the tests, open3d load but do not bring, and their packages.
needed_libraries() {
    echo "libgomp.so.1 libgomp1"
    if [ "$extra" = dev ]; then
        echo "libEGL.so.1 libegl1"
        echo "libGL.so.1 libgl1"
        echo "libX11.so.6 libx11-6"
        echo "libusb-1.0.so.0 libusb-1.0-0"
    fi
}

missing_libraries() {
    known=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null) || return 0  # no ldconfig: pip's import tells
    needed_libraries | while read -r library package; do
        case $known in *"$library "*) ;; *) echo "$package" ;; esac
    done
}

missing_python() {
    if supported .venv/bin/python; then return; fi
    python=$(find_python)
    if [ -n "$python" ]; then
        # Debian keeps ensurepip in a package apart.
        "$python" -c 'import ensurepip, venv' 2>/dev/null \
            || "$python" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])'
    elif [ -z "${PYTHON:-}" ] && ! command -v python3 >/dev/null; then
        echo python3 python3-venv
    else
        fail "needs Python 3.10, 3.11 or 3.12, which ${PYTHON:-python3} is not. Choose one by PYTHON=/path/to/it."
    fi
}

install_system_packages() {
    if ! command -v apt-get >/dev/null; then
        fail "please install what Debian calls: $* (there is no apt-get here), then run this again."
    elif [ "$(id -u)" -ne 0 ]; then
        say "Some system packages are missing. Please run, then repeat:"
        say ""
        say "    sudo apt-get update && sudo apt-get install -y --no-install-recommends $*"
        say ""
        exit 1
    fi
    say "Installing system packages: $*"
    log=$(mktemp)
    export DEBIAN_FRONTEND=noninteractive
    if ! { apt-get update && apt-get install -y --no-install-recommends "$@"; } >"$log" 2>&1 </dev/null; then
        tail -n 20 "$log" >&2
        fail "apt-get could not install $* (log: $log)"
    fi
    rm -f "$log"
}

make_environment() {
    if supported .venv/bin/python && .venv/bin/python -m pip --version >/dev/null 2>&1; then return; fi
    python=$(find_python)
    rm -rf .venv
    "$python" -m venv .venv || fail "could not create .venv with $python"
}

install_package() {
    say "Installing vigg_ros${extra:+ [$extra]} into .venv (up to 2 GB on disk the first time, some minutes) ..."
    .venv/bin/python -m pip install -qq --disable-pip-version-check --editable ".${extra:+[$extra]}" \
        || fail "pip could not install the package; its message stands above."
    .venv/bin/python -c "import $needed_modules" \
        || fail "a library of this system is missing; the last line above names it."
}

if is_current "$stamp" || is_current .venv/.installed-dev; then exit 0; fi  # dev holds what the others do
packages=$(missing_python)
packages="$packages $(missing_libraries)"
# shellcheck disable=SC2086  # a list of names
set -- $packages
if [ $# -gt 0 ]; then install_system_packages "$@"; fi
make_environment
install_package
checksum >"$stamp"
