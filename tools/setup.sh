#!/bin/sh
# Installs what the build needs and this machine lacks: Debian packages, then Python packages locked by hash into .venv.
# `--demo`: only the Python packages that the demo and the command line need. `--tests`: also the Debian packages that the
# tests alone need. The names are Debian's, tried on 12 and 13; Ubuntu has the same from 24.04 on as far as known, not tried.
set -eu
cd "$(dirname "$0")/.."
. tools/costs.sh
for_what=${1:-}

# command, file or pkg-config module -> Debian package
wanted_to_build() {
    cat <<'LIST'
cmd:gcc gcc
cmd:g++ g++
cmd:cmake cmake
cmd:ninja ninja-build
cmd:ccache ccache
cmd:pkg-config pkg-config
cmd:python3 python3
cmd:perl perl
cmd:umockdev-wrapper umockdev
mod:libusb-1.0 libusb-1.0-0-dev
mod:hidapi-libusb libhidapi-dev
mod:umockdev-1.0 libumockdev-dev
mod:cmocka libcmocka-dev
mod:libsystemd libsystemd-dev
mod:libudev libudev-dev
py:ensurepip python3-venv
py:Python.h python3-dev
LIST
}

wanted_to_test() {
    cat <<'LIST'
cmd:clang clang
file:/usr/lib/llvm-*/lib/clang/*/lib/linux/libclang_rt.fuzzer-*.a libclang-rt-dev
cmd:dbus-daemon dbus-daemon
cmd:spin spin
cmd:avr-gcc gcc-avr
file:/usr/lib/avr/include/avr/io.h avr-libc
cmd:simavr simavr
LIST
}

# Without what Debian recommends beside them: a C library for ARM, compilers for npm.
wanted_bare() {
    cat <<'LIST'
cmd:arm-none-eabi-gcc gcc-arm-none-eabi
cmd:node nodejs
cmd:npm npm
LIST
}

wanted() {
    wanted_to_build
    [ "$for_what" != --tests ] || wanted_to_test
}

present() {
    case "$1" in
    cmd:*) command -v "${1#cmd:}" >/dev/null 2>&1 ;;
    mod:*) pkg-config --exists "${1#mod:}" 2>/dev/null ;;
    file:*) ls ${1#file:} >/dev/null 2>&1 ;;
    py:Python.h) python3 -c 'import os, sysconfig, sys; sys.exit(not os.path.exists(sysconfig.get_path("include") + "/Python.h"))' 2>/dev/null ;;
    py:*) python3 -c "import ${1#py:}" 2>/dev/null ;;
    esac
}

of_missing() { while read -r what package; do present "$what" || printf '%s ' "$package"; done; }
missing=$(wanted | of_missing)
bare=
[ "$for_what" != --tests ] || bare=$(wanted_bare | of_missing)
if [ -n "$missing$bare" ]; then
    echo "setup: installing Debian packages: $missing$bare"
    sudo=
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null 2>&1 || { echo "setup: cannot install packages; as root run: apt-get install $missing$bare" >&2; exit 1; }
        sudo=sudo
    fi
    install() { [ $# = 0 ] || $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "$@"; }
    # shellcheck disable=SC2086
    if ! { $sudo apt-get update -qq && install $missing && install ${bare:+--no-install-recommends $bare}; } >build-packages.log 2>&1; then
        tail -3 build-packages.log >&2
        echo "setup: package installation failed; check the package mirror, then run: apt-get install $missing$bare" >&2
        exit 1
    fi
    # What was configured without them is configured again.
    rm -f build-packages.log build/*/build.ninja
fi

python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "setup: python3 is older than 3.11; install Python 3.11 or newer" >&2; exit 1; }

# A copy of a lock in .venv says that all of it is installed; the lock of everything includes the demo's.
installed() { # lock...
    for lock; do cmp -s "$lock" ".venv/$lock" || return 1; done
}

install_locked() { # what it costs, lock, locks that are installed then...
    echo "setup: installing the Python packages of $2 into .venv ($1)"
    lock=$2
    shift 2
    python3 -m venv .venv
    # Python compiles what is imported; compiling all here takes longer than installing it.
    .venv/bin/pip install --quiet --disable-pip-version-check --no-compile --require-hashes -r "$lock" ||
        { echo "setup: Python packages could not be installed; check the package index or proxy, then run make again" >&2; exit 1; }
    cp "$@" .venv/
}

if [ "$for_what" = --demo ]; then
    installed requirements-demo.lock || install_locked "$DEMO_PACKAGES" requirements-demo.lock requirements-demo.lock
else
    installed requirements-demo.lock requirements.lock ||
        install_locked "$ALL_PACKAGES" requirements.lock requirements-demo.lock requirements.lock
fi
# The editable installs follow pyproject.toml: names of packages and programs stand there.
stamp=.venv/.installed
if ! cat pyproject.toml lab/pyproject.toml | cmp -s - "$stamp"; then
    .venv/bin/pip install --quiet --disable-pip-version-check --no-compile --no-deps --no-build-isolation --editable . --editable lab ||
        { echo "setup: the packages of this tree could not be installed into .venv; delete .venv and run make again" >&2; exit 1; }
    cat pyproject.toml lab/pyproject.toml >"$stamp"
fi
# The emulator of the Pico, by its lock.
if [ "$for_what" = --tests ] && ! cmp -s sim/pico/package-lock.json sim/pico/node_modules/.lock; then
    npm ci --silent --ignore-scripts --no-audit --no-fund --prefix sim/pico ||
        { echo "setup: the emulator of the Pico could not be installed; check the npm registry, then run make again" >&2; exit 1; }
    cp sim/pico/package-lock.json sim/pico/node_modules/.lock
fi
