"""`whisker foxglove`: a running robot in Foxglove (crunchbot.robot.foxglove)."""

import argparse
import time
from pathlib import Path

from .. import scene as scenes
from ..arguments import whole_number
from ..robot.foxglove import FoxgloveServer
from ..robot.network.options import NAVIGATOR_ENDPOINT, PILOT_ENDPOINT, add_link, open_link
from ..robot.standard.view import StandardView
from ..stopping import stop_on_signals

EXAMPLE = "whisker foxglove robot-run/scene"
PORT = 8765  # Foxglove's own


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE", help="the robot's scene folder")
    parser.add_argument("--host", default="127.0.0.1", metavar="ADDRESS", help="to be reached at")
    parser.add_argument("--port", type=whole_number(0, 65535), default=PORT, metavar="N", help="of the WebSocket")
    add_link(parser, [], [PILOT_ENDPOINT, NAVIGATOR_ENDPOINT])
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    view = StandardView(scenes.load(arguments.scene), time.time_ns())
    stop = stop_on_signals()
    with open_link("foxglove", arguments) as link:
        server = FoxgloveServer(view, arguments.robot, arguments.host, arguments.port)
        address = f"ws://{arguments.host}:{server.server.port}"
        print(f"{address}: open it in Foxglove: Open connection, Foxglove WebSocket", flush=True)
        server.run(link, stop)
    print(f"{server.sent} messages, {server.poses_set} poses set, {server.poses_refused} refused")
    return 0
