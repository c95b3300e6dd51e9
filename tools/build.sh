#!/bin/sh
# Compiles everything into BUILD (default build/release): C and C++ by CMake, then the two Python extension modules.
set -eu
cd "$(dirname "$0")/.."
build=${1:-build/release}
log=build/build.log
mkdir -p build

step() { # description, command...
    description=$1
    shift
    echo "build: $description"
    "$@" >>"$log" 2>&1 || {
        tail -25 "$log" >&2
        echo "build: $description failed; the whole log is $log" >&2
        exit 1
    }
}

: >"$log"
[ -e "$build/build.ninja" ] || step "configuring" cmake --preset "$(basename "$build")"
echo "build: compiling (the first time takes about a minute)"
if ! cmake --build "$build"; then
    echo "build: compiling failed; the lines above name the file" >&2
    exit 1
fi
step "Python module for the library and the filters" .venv/bin/python host/python/crunchbot/build_ffi.py --build-dir "$build"
step "Python module for the simulated world" .venv/bin/python lab/crunchbot_lab/signals/build_ffi.py --build-dir "$build"
