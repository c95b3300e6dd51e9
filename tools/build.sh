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

# What a Python module follows from: interpreter, script, headers and static libraries; and the module as it is.
state() { # folder, module
    .venv/bin/python -VV
    find "$1/build_ffi.py" "$1/$2".*.so host sim firmware/dspic/core protocol/gen "$build/host" "$build/sim" \
        \( -name build_ffi.py -o -name "$2.*.so" -o -name '*.h' -o -name '*.a' \) -exec sha256sum {} + 2>/dev/null | sort -k 2
}

module() { # description, folder of its build_ffi.py, module
    stamp="build/$3.state"
    [ "$(state "$2" "$3")" != "$(cat "$stamp" 2>/dev/null)" ] || return 0
    step "$1" .venv/bin/python "$2/build_ffi.py" --build-dir "$build"
    state "$2" "$3" >"$stamp"
}

: >"$log"
[ -e "$build/build.ninja" ] || step "configuring" cmake --preset "$(basename "$build")"
echo "build: compiling (the first time takes about a minute)"
if ! cmake --build "$build"; then
    echo "build: compiling failed; the lines above name the file" >&2
    exit 1
fi
module "Python module for the library and the filters" host/python/crunchbot _native
module "Python module for the simulated world" lab/crunchbot_lab/signals _sim
