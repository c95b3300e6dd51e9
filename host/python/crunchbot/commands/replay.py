"""`whisker replay`: from a recording to a ring (crunchbot.recording.replay)."""

import argparse

from ..arguments import RING, number_above, seconds, warn, whole_number
from ..bridge.ring import CAPACITY, Writer
from ..recording import read
from ..recording.replay import Replay
from ..stopping import stop_on_signals

EXAMPLE = "whisker replay examples/drive.mcap --speed 2 --ring replayed"


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE.MCAP", help="of 'whisker record'")
    parser.add_argument("--ring", default=RING, metavar="NAME", help="the ring to make")
    text = "how many times as fast as it was recorded, or max: as fast as the machine can; readers that fall behind by more than the ring lose frames"
    parser.add_argument("--speed", type=_speed, default=1.0, metavar="X", help=text)
    parser.add_argument(
        "--ring-frames",
        type=_power_of_two,
        default=CAPACITY,
        metavar="N",
        help="a power of two",
    )
    parser.add_argument("--lead", type=seconds, default=0.5, metavar="S", help="let readers attach for so long first")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    stop = stop_on_signals()
    with read(arguments.file) as recording, Writer(arguments.ring, arguments.ring_frames) as writer:
        replay = Replay(recording, writer, arguments.speed)
        stop.wait(arguments.lead)
        replay.run(stop)
        for line in recording.damage:
            warn(line)
    print(f"ring {arguments.ring}: {replay.frames} frames replayed")
    return 0


def _power_of_two(text: str) -> int:
    value = whole_number(64, 1 << 20)(text)
    if value & (value - 1):
        below = 1 << (value.bit_length() - 1)
        raise argparse.ArgumentTypeError(f"'{text}' is no power of two; give {below} or {2 * below}")
    return value


def _speed(text: str) -> float | None:
    if text == "max":
        return None
    try:
        return number_above(0.0)(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"{error}, nor max") from None
