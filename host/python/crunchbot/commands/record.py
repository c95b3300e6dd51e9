"""`whisker record`: from a ring to an MCAP file (crunchbot.recording)."""

import argparse

from whisker_protocol import LIMITS

from ..arguments import add_output, add_ring, mcap_path, number_above, whole_number
from ..bridge.ring import Reader, await_reader
from ..recording.recorder import Tally, describe, record
from ..recording.writing import RecordingWriter
from ..scene import load
from ..stopping import stop_on_signals

EXAMPLE = "whisker record drive.mcap --seconds 60"


def add(parser: argparse.ArgumentParser) -> None:
    add_output(parser, "file", type=mcap_path, metavar="FILE.MCAP", help="what is written")
    add_ring(parser)
    parser.add_argument("--frames", type=whole_number(1), metavar="N", help="stop after so many frames")
    parser.add_argument("--seconds", type=number_above(0.0), metavar="S", help="stop after so many seconds of frames")
    parser.add_argument("--scene", metavar="SCENE", help="scene folder whose robot.toml names the lanes, lane 0 first")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    names = [whisker.name for whisker in load(arguments.scene).robot.whiskers] if arguments.scene else []
    stop = stop_on_signals()
    with await_reader(arguments.ring, arguments.wait, stop, arguments.ring_owner) as reader:
        writer = RecordingWriter(arguments.file, describe(reader), names, arguments.overwrite)
        tally = record(reader, writer, stop, _frames(arguments, reader))
    print(f"{arguments.file}: {_summary(tally)}")
    return 0


def _summary(tally: Tally) -> str:
    """In one line; lanes that gave nothing good all the time, as those without a node, are counted apart."""
    dead = tally.records_bad == tally.frames
    text = f"{tally.frames} frames, {tally.missing + tally.overrun} lost, {tally.records_bad[~dead].sum()} bad samples"
    return f"{text}; {dead.sum()} lanes without a good one" if tally.frames and dead.any() else text


def _frames(arguments, reader: Reader) -> int | None:
    """The limit in frames: the smaller of --frames and --seconds; None: none."""
    stats = reader.stats
    period = stats.tick_period if stats and stats.tick_period else LIMITS["tick_period"]
    by_time = None if arguments.seconds is None else max(1, round(arguments.seconds * LIMITS["clock_hz"] / period))
    return min((limit for limit in (arguments.frames, by_time) if limit is not None), default=None)
