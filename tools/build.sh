#!/bin/sh
# Compiles into BUILD (default build/release): C and C++ by CMake, all of it or one TARGET that holds what the two Python
# extension modules link, as `demo`; then these modules. Targets share the folder: what one compiled another does not.
# usage: tools/build.sh [BUILD [TARGET]]
set -eu
cd "$(dirname "$0")/.."
. tools/costs.sh
build=${1:-build/release}
target=${2:-all}
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

# What a Python module follows from: interpreter, script, headers and its static libraries; and the module as it is.
state() { # folder, module
    .venv/bin/python -VV
    {
        find "$1/build_ffi.py" "$1/$2".*.so host sim firmware/dspic/core protocol/gen \
            \( -name build_ffi.py -o -name "$2.*.so" -o -name '*.h' \) 2>/dev/null
        .venv/bin/python "$1/build_ffi.py" --build-dir "$build" --libraries
    } | sort | xargs sha256sum
}

module() { # description, folder of its build_ffi.py, module
    stamp="build/$3.state"
    [ "$(state "$2" "$3")" != "$(cat "$stamp" 2>/dev/null)" ] || return 0
    step "$1" .venv/bin/python "$2/build_ffi.py" --build-dir "$build"
    state "$2" "$3" >"$stamp"
}

: >"$log"
[ -e "$build/build.ninja" ] || step "configuring" cmake --preset "$(basename "$build")"
[ "$target" = demo ] && cost=$DEMO_COMPILE || cost=$ALL_COMPILE
echo "build: compiling (the first time takes $cost)"
if ! cmake --build "$build" --target "$target"; then
    echo "build: compiling failed; the lines above name the file" >&2
    exit 1
fi
module "Python module for the library and the filters" host/python/crunchbot _native &
module "Python module for the simulated world" lab/crunchbot_lab/signals _sim
wait $!
