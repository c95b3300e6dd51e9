#!/bin/sh
# Runs every test: C and C++ by CTest, then Python, gateware and end to end by pytest. `--long`: the sanitized builds.
set -eu
cd "$(dirname "$0")/.."

sanitized() { # preset
    echo "test: whole tree with the $1 preset"
    [ -e "build/$1/build.ninja" ] || cmake --preset "$1" >/dev/null
    cmake --build "build/$1" && ctest --preset "$1"
}

if [ "${1:-}" = --long ]; then
    sanitized asan
    sanitized tsan
    exit 0
fi
echo "test: C and C++"
ctest --test-dir "$1" --output-on-failure --no-tests=error --parallel 2
echo "test: sanitizers (libraries and firmware)"
tools/run_sanitized.sh
echo "test: Python, gateware, end to end"
WHISKER_BUILD=$1 .venv/bin/python -m pytest
