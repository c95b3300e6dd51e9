"""`whisker bag`: everything a robot's processes say, in an MCAP file for ROS 2 tools (crunchbot.robot.bag)."""

import argparse
from itertools import chain, count
from pathlib import Path

from .. import scene as scenes
from ..recording.writing import TopicWriter
from ..robot.bag import Bag, metadata
from ..robot.network.options import NAVIGATOR_ENDPOINT, PILOT_ENDPOINT, add_link, open_link
from ..robot.played import RECORD
from ..stopping import stop_on_signals

EXAMPLE = "whisker bag run.mcap --scene robot-run/scene"


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE.MCAP")
    parser.add_argument(
        "--scene", type=Path, metavar="SCENE", help="keep this scene folder's files in the bag, and write /tf and /map"
    )
    add_link(parser, [], [PILOT_ENDPOINT, NAVIGATOR_ENDPOINT])
    parser.add_argument("--stay", action="store_true", help="go on after the end of a run")
    parser.add_argument("--overwrite", action="store_true", help="replace FILE.MCAP if it exists")
    text = "if FILE.MCAP exists, leave it and write FILE-2.MCAP, FILE-3.MCAP ...: for a recorder that is started again"
    parser.add_argument("--next", action="store_true", help=text)
    parser.set_defaults(run=run)


def next_free(path: Path) -> Path:
    """This path, or the first of it with -2, -3, ... that does not exist."""
    numbered = (path.with_name(f"{path.stem}-{number}{path.suffix}") for number in count(2))
    return next(candidate for candidate in chain([path], numbered) if not candidate.exists())


def run(arguments: argparse.Namespace) -> int:
    reported = metadata(arguments.robot, arguments.scene)
    scene = scenes.load(arguments.scene) if arguments.scene else None
    stop = stop_on_signals()
    with open_link("bag", arguments) as link:
        file = next_free(Path(arguments.file)) if arguments.next else arguments.file
        with TopicWriter(file, RECORD, reported, arguments.overwrite) as writer:
            counted = Bag(writer, arguments.robot, scene).run(link, stop, arguments.stay)
    print(f"{file}: " + ", ".join(f"{name} {value}" for name, value in counted.items()))
    return 0
