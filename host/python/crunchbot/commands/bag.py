"""`whisker bag`: everything a robot's processes say, in an MCAP file for ROS 2 tools (crunchbot.robot.bags.writing)."""

import argparse
from pathlib import Path

from .. import scene as scenes
from ..arguments import add_output, mcap_path
from ..outputs import claim, next_free
from ..recording.writing import TopicWriter
from ..robot.bags.played import RECORD
from ..robot.bags.writing import Bag, metadata
from ..robot.network.options import NAVIGATOR_ENDPOINT, PILOT_ENDPOINT, add_link, open_link
from ..stopping import stop_on_signals

EXAMPLE = "whisker bag run.mcap --scene robot-run/scene"


def add(parser: argparse.ArgumentParser) -> None:
    text = "what is written"
    add_output(parser, "file", own=None, type=mcap_path, metavar="FILE.MCAP", help=text)
    parser.add_argument(
        "--scene", type=Path, metavar="SCENE", help="keep this scene folder's files in the bag, and write /tf and /map"
    )
    add_link(parser, [], [PILOT_ENDPOINT, NAVIGATOR_ENDPOINT])
    parser.add_argument("--stay", action="store_true", help="go on after the end of a run")
    text = "if FILE.MCAP exists, leave it and write FILE-2.MCAP, FILE-3.MCAP ...: for a recorder that is started again"
    parser.add_argument("--next", action="store_true", help=text)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    reported = metadata(arguments.robot, arguments.scene)
    scene = scenes.load(arguments.scene) if arguments.scene else None
    if not arguments.next:
        claim(arguments.file, arguments.overwrite, inputs=[arguments.scene] if arguments.scene else [])
    stop = stop_on_signals()
    with open_link("bag", arguments) as link:
        file = next_free(arguments.file) if arguments.next else arguments.file
        with TopicWriter(file, RECORD, reported, arguments.overwrite) as writer:
            counted = Bag(writer, arguments.robot, scene).run(link, stop, arguments.stay)
    print(f"{file}: " + ", ".join(f"{name} {value}" for name, value in counted.items()))
    return 0
