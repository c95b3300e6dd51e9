"""The pilot as a process of its own: reads the ring, drives, and writes observation rows as they come.

python -m whisker.demo.pilot_process --ring NAME --socket PATH --scene DIR --models DIR --out observations.csv
"""

import argparse
import csv
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

import numpy as np

from .. import scene as scenes
from ..behaviour import BLOCK_TICKS, ODOMETRY_TICKS, TICK_S
from ..nodes import NodeError, check_node, read_nodes
from ..observations import cell
from ..pilot import Pilot
from ..protocol import CODES, STATUS_CODE_SHIFT
from ..radial import load as load_radial
from ..ring import Reader, RingError
from ..simlink import SimLink
from ..texture import load

LOST = CODES["absent"] << STATUS_CODE_SHIFT  # status of a tick that never came
DEGREES_PER_COUNT = 180.0 / 65536.0


def blocks(reader: Reader, lanes: int) -> Iterator[tuple[int, np.ndarray]]:
    """(first tick, samples (40, lanes) of ring.SAMPLE) block by block; lost ticks are marked bad. The last may be short."""
    first, block, filled = None, None, 0
    for frames in reader.frames():
        ticks = frames["tick"].astype(np.int64)
        while len(ticks) > 0:
            if block is None:
                first = int(ticks[0]) // BLOCK_TICKS * BLOCK_TICKS if first is None else first + BLOCK_TICKS
                block, filled = _empty_block(frames.dtype["lane"].base, lanes), 0
            mine = ticks < first + BLOCK_TICKS
            block[ticks[mine] - first] = frames["lane"][mine, :lanes]
            filled = int(ticks[mine].max(initial=first + filled - 1)) - first + 1
            frames, ticks = frames[~mine], ticks[~mine]
            if filled == BLOCK_TICKS or len(ticks) > 0:
                yield first, block
                block = None
    if block is not None:
        yield first, block[:filled]


def _empty_block(sample: np.dtype, lanes: int) -> np.ndarray:
    block = np.zeros((BLOCK_TICKS, lanes), sample)
    block["status"] = LOST
    return block


def trace_header(pilot: Pilot) -> list[str]:
    """Columns of traces.csv: per block, the range of each floor whisker's deflection from the middle of its scale."""
    return ["t_s", *(f"{pilot.names[lane]}_{end}_deg" for lane in pilot.texture_lanes for end in ("min", "max"))]


def trace_row(pilot: Pilot, first: int, samples: np.ndarray) -> list[str]:
    cells = []
    for lane in pilot.texture_lanes:
        good = samples[samples[:, lane]["status"] == 0, lane]
        about = np.hypot(good["alpha"] - 32768.0, good["beta"] - 32768.0) * DEGREES_PER_COUNT
        cells += [f"{about.min():.3f}", f"{about.max():.3f}"] if len(about) else ["", ""]
    return [f"{first * TICK_S:.3f}", *cells]


def load_models(folder: Path, robot: scenes.Robot) -> tuple[dict, dict]:
    """Texture and radial models by whisker name, as training left them."""
    texture = load(folder / "texture.json")
    radial = {w.name: load_radial(folder / f"{w.name}.json") for w in robot.of_role("object")}
    return {w.name: texture for w in robot.of_role("texture")}, radial


def check_nodes(path: str, robot: scenes.Robot, radial: dict) -> None:
    """NodeError when a radial model is of another node than the list names on its whisker's lane."""
    nodes = read_nodes(path)
    for lane, whisker in enumerate(robot.whiskers):
        if whisker.name in radial:
            check_node(radial[whisker.name].node, nodes.get(lane), whisker.name)


class Rows:
    """Observation rows into several files, line by line, the header first."""

    def __init__(self, *files: TextIO):
        self._files, self._begun = files, False

    def write(self, row: dict[str, float | None]) -> None:
        lines = [] if self._begun else [list(row)]
        lines.append([cell(value) for value in row.values()])
        for file in self._files:
            csv.writer(file, lineterminator="\n").writerows(lines)
            file.flush()
        self._begun = True


def fly(pilot: Pilot, reader: Reader, link: SimLink, rows: Rows, traces: TextIO) -> int:
    """From the ring to drives and rows until the ring is closed; returns the ticks used."""
    trace_rows = csv.writer(traces, lineterminator="\n")
    trace_rows.writerow(trace_header(pilot))
    used = 0
    for first, samples in blocks(reader, len(pilot.names)):
        drive = pilot.block(first, samples["alpha"], samples["beta"], samples["status"])
        trace_rows.writerow(trace_row(pilot, first, samples))
        last = first + len(samples) - 1
        used = last + 1
        if len(samples) == BLOCK_TICKS:
            link.drive(last, *drive)
        if used % ODOMETRY_TICKS != 0 or (motion := link.odometry(last)) is None:
            continue
        rows.write(pilot.odometry(last, *motion))
    return used


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ring", required=True)
    parser.add_argument("--socket", required=True, help="the simulation's socket: drive out, odometry in")
    parser.add_argument("--scene", required=True, type=Path)
    parser.add_argument("--models", required=True, type=Path)
    parser.add_argument("--nodes", help="what 'whisker info --nodes' printed: models of other nodes are refused")
    parser.add_argument("--seed", type=int, default=1, help="of the random turns")
    parser.add_argument("--out", required=True, type=Path, help="observations.csv")
    parser.add_argument("--rows", type=Path, default="/dev/null", help="the same rows once more, for the navigator")
    parser.add_argument(
        "--traces", type=Path, default="/dev/null", help="CSV of the floor whiskers' deflection, for the report"
    )
    parser.add_argument("--report", type=Path, help="JSON of what was used, skipped and measured")
    options = parser.parse_args(argv)
    try:
        robot = scenes.load(options.scene).robot
        texture, radial = load_models(options.models, robot)
        if options.nodes:
            check_nodes(options.nodes, robot, radial)
        pilot = Pilot(robot, texture, radial, options.seed)
        with (
            Reader(options.ring, wait_s=10.0) as reader,
            SimLink(options.socket) as link,
            open(options.out, "w", newline="") as out,
            open(options.rows, "w", newline="") as live,
            open(options.traces, "w", newline="") as traces,
        ):
            used = fly(pilot, reader, link, Rows(out, live), traces)
    except (OSError, ValueError, RingError, NodeError) as error:
        print(f"pilot: {error}", file=sys.stderr)
        return 1
    if options.report:
        content = {"ticks_used": used, "bad_samples": pilot.bad_samples, "whisks": pilot.whisks}
        options.report.write_text(json.dumps(content, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
