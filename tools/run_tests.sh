#!/bin/sh
# Runs every test: C and C++ by CTest, host and firmware again under sanitizers, then Python, gateware and end to end by pytest.
# `--long` instead: the whole simulation under AddressSanitizer, a minute of fuzzing per decoder, and more.
set -eu
cd "$(dirname "$0")/.."

with_preset() { # preset
    echo "test: C and C++ with the $1 preset"
    [ -e "build/$1/build.ninja" ] || cmake --preset "$1" >/dev/null
    cmake --build "build/$1" >"build/$1.log" 2>&1 || { tail -25 "build/$1.log" >&2; exit 1; }
    ctest --test-dir "build/$1" --output-on-failure --no-tests=error --parallel 2
}

if [ "${1:-}" = --long ]; then
    with_preset asan-rtl
    for fuzzer in build/release/*/*/fuzz_* build/release/*/*/*/fuzz_*; do
        [ -x "$fuzzer" ] || continue
        echo "test: a minute of $(basename "$fuzzer")"
        "$fuzzer" -max_total_time=60 -verbosity=0 2>"build/$(basename "$fuzzer").log" || { tail -25 "build/$(basename "$fuzzer").log" >&2; exit 1; }
    done
    .venv/bin/python fpga/boards/build.py --list | while read -r board; do
        echo "test: place and route of $board"
        .venv/bin/python fpga/boards/build.py "$board"
    done
    echo "test: 40 faults of each board, and longer runs"
    build/release/tests/rigs/boards/test_boards 40 "$(date +%j)" 300
    echo "test: the netlist of a board from pin to pin"
    cmake --build build/release --target test_netlist >build/netlist.log 2>&1 || { tail -25 build/netlist.log >&2; exit 1; }
    build/release/tests/rigs/boards/test_netlist
    echo "test: larger models of the ring, and 100000 readers and writers killed"
    host/libwhisker/model/check.sh --long
    build/release/host/libwhisker/test/stress_ring 100000
    echo "test: the bridge's two levels by more seeds"
    build/release/sim/bridge/tests/test_bridge_mixed 100
    echo "test: the node's image, ten thousand ticks, each step of an update"
    WHISKER_BUILD=build/release WHISKER_IMAGE_LONG=1 .venv/bin/python -m pytest --quiet tests/rigs/node_image
    if command -v doxygen >/dev/null; then
        echo "test: the site of pages and API"
        (cd tools && ../.venv/bin/python -m handbook)
    fi
    echo "test: remedies that name a package, against the wheels alone"
    .venv/bin/python tools/wheels
    WHISKER_DIST=dist .venv/bin/python -m pytest --quiet tests/repository/test_remedies.py
    echo "test: mutated recordings"
    .venv/bin/python host/python/tests/fuzz.py recording --inputs 300000
    echo "test: a Linux kernel and the simulated bridge"
    WHISKER_BUILD=build/release .venv/bin/python tests/kernel/run.py
    # Of ten mutants seven killed: with nine of ten killed in the long run, fewer come once in eighty draws.
    echo "test: ten mutants"
    PYTHONPATH=tests .venv/bin/python -m mutants --count 10 --seed "$(date +%j)" --least 0.7
    echo "test: thirty minutes of drills"
    PYTHONPATH=tests WHISKER_BUILD=build/release .venv/bin/python -m drills --minutes 30 --out build/drills
    exit 0
fi
with_preset "$(basename "$1")"
with_preset asan
with_preset tsan
# The open FPGA tools compile themselves at their first start: once, before several processes do it at the same time.
(cd fpga && ../.venv/bin/python -c 'import toolchain; toolchain.warm_up("yosys", "nextpnr-himbaechel-gowin")')
echo "test: Python, gateware, end to end"
# Three processes for two cores: many tests wait for a simulated robot.
WHISKER_BUILD=$1 .venv/bin/python -m pytest --numprocesses 3 --dist loadfile --no-loadscope-reorder
