"""`whisker export`: a recording as CSV, Parquet or NWB (crunchbot.recording.exporting)."""

import argparse
import json
from collections import Counter
from pathlib import Path

from whisker_protocol import LANES

from ..arguments import add_output, lane_list, warn
from ..recording import Recording, read
from ..recording.exporting import FORMATS, export
from ..recording.table import Table

EXAMPLE = "whisker export examples/drive.mcap drive.parquet"


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE.MCAP", help="of 'whisker record'")
    text = f"to be written; the format is that of its ending: {', '.join(FORMATS)}"
    add_output(parser, "out", type=Path, metavar="OUT", help=text)
    text = "such as 0,2,5-7 (default: those in use)"
    parser.add_argument("--lanes", type=lane_list(LANES), metavar="LIST", help=text)
    parser.add_argument("--json", action="store_true", help="print what was written as one line of JSON")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    with read(arguments.file) as recording:
        table = Table(recording, arguments.lanes)
        export(table, arguments.out)
        missing, overrun = lost_in(recording)
        damage = list(recording.damage)
    if arguments.json:
        said = {"out": str(arguments.out), "frames": table.frames, "lanes": list(table.names)}
        print(json.dumps(said | {"missing": missing, "overrun": overrun, "damage": damage}))
        return 0
    if missing + overrun:
        why = f"{missing} never came, {overrun} were not read in time"
        warn(f"{arguments.file}: {missing + overrun} frames are lost, where tick jumps: {why}")
    for line in damage:
        warn(line)
    print(f"{arguments.out}: {table.frames} frames, lanes {', '.join(table.names)}")
    return 0


def lost_in(recording: Recording) -> tuple[int, int]:
    """Frames that never came, and those that were not read in time, by the recording's events."""
    lost = Counter()
    for event in recording.events():
        lost[event.kind] += event.frames
    return lost["missing"], lost["overrun"]
