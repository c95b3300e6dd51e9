"""`whisker export`: a recording as CSV, Parquet or NWB (crunchbot.recording.exporting)."""

import argparse
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
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    with read(arguments.file) as recording:
        table = Table(recording, arguments.lanes)
        export(table, arguments.out)
        if lost := lost_in(recording):
            warn(f"{arguments.file}: {lost}")
        for line in recording.damage:
            warn(line)
    print(f"{arguments.out}: {table.frames} frames, lanes {', '.join(table.names)}")
    return 0


def lost_in(recording: Recording) -> str:
    """What was lost before it was written, by its events; empty: nothing."""
    lost = Counter()
    for event in recording.events():
        lost[event.kind] += event.frames
    missing, overrun = lost["missing"], lost["overrun"]
    why = f"{missing} never came, {overrun} were not read in time"
    return f"{missing + overrun} frames are lost, where tick jumps: {why}" if missing + overrun else ""
