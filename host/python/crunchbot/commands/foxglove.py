"""`whisker foxglove`: a running robot in Foxglove (crunchbot.robot.foxglove)."""

import argparse
import time
from collections.abc import Callable
from pathlib import Path

from .. import scene as scenes
from ..arguments import warn
from ..guard import Guard, add_door, may_set_pose, warn_if_open
from ..robot.foxglove import ORIGINS, FoxgloveServer
from ..robot.network.options import NAVIGATOR_ENDPOINT, PILOT_ENDPOINT, add_link, open_link
from ..robot.standard.view import StandardView
from ..stopping import stop_on_signals

EXAMPLE = "whisker foxglove robot-run/scene"
PORT = 8765  # Foxglove's own


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE", help="the robot's scene folder")
    add_door(parser, PORT)
    text = "also answer pages and programs of this Origin, as of a Foxglove that you serve; repeatable"
    parser.add_argument("--allow-origin", action="append", default=[], metavar="ORIGIN", help=text)
    add_link(parser, [], [PILOT_ENDPOINT, NAVIGATOR_ENDPOINT])
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    view = StandardView(scenes.load(arguments.scene), time.time_ns())
    stop = stop_on_signals()
    with open_link("foxglove", arguments) as link:
        guard = Guard(arguments.host, arguments.allow_host, (*ORIGINS, *arguments.allow_origin))
        address, may = (arguments.host, arguments.port), may_set_pose(arguments)
        server = FoxgloveServer(view, arguments.robot, guard, *address, may, _once())
        warn_if_open("whisker", arguments.host, "watch" + (", and set the pose" if may else ""))
        address = f"ws://{arguments.host}:{server.port}"
        print(f"{address}: open it in Foxglove: Open connection, Foxglove WebSocket", flush=True)
        server.run(link, stop)
    print(f"{server.sent} messages, {server.poses_set} poses set, {server.poses_refused} refused")
    return 0


def _once() -> Callable[[str], None]:
    """A warning for each line, the first time that it comes: a page may ask for ever."""
    said: set[str] = set()

    def tell(line: str) -> None:
        if line not in said:
            said.add(line)
            warn(f"foxglove: a connection is refused: {line}")

    return tell
