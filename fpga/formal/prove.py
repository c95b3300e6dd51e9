"""Proves what the .vh files here state of the modules of bridge_rtl: `prove.py [MODULE ...]`.

A module's properties are read in at the end of its body, so that they see its registers. Yosys makes an SMT problem of it;
yosys-smtbmc searches for a counter-example from reset (bounded) and then shows by induction that there is none at all.
A mutation changes a line of the module before: the proof must then fail.
"""

import argparse
import sys
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPO = HERE.parents[1]
RTL = REPO / "fpga" / "bridge_rtl"
sys.path.insert(0, str(HERE.parent))

from toolchain import ToolError, find, gather, must, run  # noqa: E402

TOOLS = ("yosys", "yosys-smtbmc", "yices-smt2")


@dataclass(frozen=True)
class Proof:
    """A module with its properties. `depth` counts cycles from reset, `induction` the steps of the induction, `cover` the
    cycles from reset within which what the properties speak of can happen."""

    module: str
    depth: int
    induction: int
    cover: int
    parameters: dict[str, int] = field(default_factory=dict)
    also: tuple[str, ...] = ()  # other modules it is made of
    mutations: tuple[tuple[str, str], ...] = ()  # text in the module, what to put in its place


# Small sizes where the argument does not depend on them: pointers and marks are what the properties are about.
PROOFS = {
    proof.module: proof
    for proof in (
        Proof(
            "frame_fifo",
            depth=16,
            induction=3,
            cover=16,
            parameters={"ADDRESS_BITS": 4, "FRAME_BYTES": 4},
            mutations=(
                ("used <= DEPTH - FRAME", "used <= DEPTH - FRAME + ONE"),
                ("used <= DEPTH - FRAME", "used < DEPTH - FRAME"),
                ("used <= DEPTH - FRAME", "used <= DEPTH - FRAME - FRAME"),
                ("commit_at <= write_at + ONE", "commit_at <= write_at"),
                ("if (!empty) read_at <= read_at + ONE", "read_at <= read_at + ONE"),
                ("taken && !drop) memory", "taken) memory"),
                ("!(in_first && in_keep && !room)", "1'b1"),
                ("(in_keep || every), in_data", "in_keep, in_data"),
            ),
        ),
        Proof(
            "framer",
            depth=6,
            induction=2,
            cover=45,
            parameters={"LANES": 2},
            also=("crc8",),
            mutations=(
                ("make && frame_ends) in_records", "make && at_crc) in_records"),
                ("LIMIT_LANES[4:0] - 5'd1", "LANES[4:0] - 5'd1"),
                ("out_last  <= frame_ends", "out_last  <= at_crc"),
                ("(!out_valid || out_ready)", "1'b1"),
                ("record_code == CODE_OK", "record_code != CODE_OK"),
                ("out_keep <= is_last", "out_keep <= 1'b0"),
                ("gone[0] ? CODE_ABSENT[5:0]", "gone[0] ? CODE_LINK_CRC[5:0]"),
                ("stale   <= tick_wrong", "stale   <= {LANES{1'b0}}"),
                (".clear(start || (make && at_crc))", ".clear(start)"),
                ("in_header && (at_byte == 5'd0)", "in_header"),
            ),
        ),
        Proof(
            "lane_receiver",
            depth=10,
            induction=3,
            cover=70,
            parameters={"LANES": 2},
            also=("pattern_source",),
            mutations=(
                ("bits       <= pattern ? own : sampled", "bits       <= pattern ? own : miso"),
                ("tick_wrong <= tick_wrong | (bits ^ {LANES{tick[7]}})", "tick_wrong <= bits ^ {LANES{tick[7]}}"),
                ("{tick[6:0], 1'b0}", "tick"),
                ("RECORD_TICK[2:0])", "RECORD_STATUS[2:0])"),
                ("absent & bits", "bits"),
                ("lower ^ (feedback", "lower ^ (bits"),
                ("if (clear) crc[i]", "if (rst) crc[i]"),
            ),
        ),
        Proof(
            "node_link",
            depth=60,
            induction=2,
            cover=60,
            mutations=(
                ("else if (!waited) wait_left", "else if (!waited && state != GAP) wait_left"),
                ("word_ends) state <= GAP", "word_ends) state <= SETUP"),
                ("bit_index == (in_service", "bit_index - 9'd1 == (in_service"),
                ("phase == sample_at - 6'd1", "phase == sample_at"),
                ("bit_to_send <= next_bit", "bit_to_send <= source_bit"),
            ),
        ),
    )
}


class ProofError(Exception):
    """A mutation's text is not in the module, or the solver did not decide."""


def model(proof: Proof, out: Path, mutation: tuple[str, str] | None = None) -> Path:
    """The SMT problem of a module, changed by the mutation if there is one."""
    out.mkdir(parents=True, exist_ok=True)
    text = (RTL / f"{proof.module}.v").read_text()
    if mutation:
        if text.count(mutation[0]) != 1:
            raise ProofError(f"{proof.module}.v does not hold once: {mutation[0]}")
        text = text.replace(*mutation)
    properties = (HERE / f"{proof.module}.vh").read_text()
    (out / "dut.sv").write_text(text.replace("\nendmodule", f"\n{properties}\nendmodule", 1))
    parameters = "".join(f" -set {name} {value}" for name, value in proof.parameters.items())
    gather(out, RTL / "crc8.vh", REPO / "protocol/gen/whisker_protocol.vh")
    others = gather(out, *(RTL / f"{name}.v" for name in proof.also))
    script = [
        f"read_verilog -sv -formal dut.sv {' '.join(others)}",
        *([f"chparam{parameters} {proof.module}"] if parameters else []),
        f"prep -flatten -top {proof.module}",
        "memory_map",
        "async2sync",
        "dffunmap",
        "write_smt2 -wires dut.smt2",
    ]
    (out / "model.ys").write_text("\n".join(script) + "\n")
    must("yosys", "-q", "-s", "model.ys", log=out / "model.log")
    return out / "dut.smt2"


def verdict(smt2: Path, name: str, *options: object) -> bool:
    """What yosys-smtbmc says; ProofError if it says neither."""
    find("yices-smt2")
    log = smt2.parent / f"{name}.log"
    output = run("yosys-smtbmc", "-s", "yices", *options, smt2.name, log=log).stdout
    if "Status: PASSED" in output:
        return True
    if "Assert failed" in output:
        return False
    raise ProofError(f"yosys-smtbmc did not decide: see {log}")


def bounded(proof: Proof, smt2: Path) -> bool:
    """No counter-example within `depth` cycles of reset."""
    return verdict(smt2, "bounded", "-t", proof.depth)


def inductive(proof: Proof, smt2: Path) -> bool:
    """What held for `induction` cycles holds in the next."""
    return verdict(smt2, "induction", "-i", "-t", proof.induction)


def holds(proof: Proof, out: Path, mutation: tuple[str, str] | None = None) -> bool:
    """Both halves of the proof."""
    smt2 = model(proof, out, mutation)
    return inductive(proof, smt2) and bounded(proof, smt2)


def check(proof: Proof, out: Path, mutate: bool) -> int:
    """Proves a module, or shows that each of its mutations breaks the proof; prints a line each, counts what went wrong."""
    failed = 0
    for number, mutation in enumerate(proof.mutations if mutate else (None,)):
        good = holds(proof, out / f"{proof.module}_{number}", mutation) == (mutation is None)
        failed += not good
        what = f"{proof.module} with '{mutation[1]}'" if mutation else proof.module
        print(f"{'ok    ' if good else 'FAILED'} {what}", flush=True)
    return failed


def main() -> int:
    parser = argparse.ArgumentParser(
        description="Prove the properties of bridge_rtl.", epilog="example: prove.py frame_fifo"
    )
    parser.add_argument("module", nargs="*", help=f"of {', '.join(PROOFS)} (default: all)")
    parser.add_argument("--mutate", action="store_true", help="show instead that each seeded fault breaks its proof")
    parser.add_argument("--out", type=Path, default=REPO / "build" / "formal", help="folder (default: build/formal)")
    arguments = parser.parse_args()
    failed = 0
    try:
        for name in arguments.module or PROOFS:
            failed += check(PROOFS[name], arguments.out, arguments.mutate)
    except (ProofError, ToolError) as error:
        print(f"prove: {error}", file=sys.stderr)
        return 2
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
