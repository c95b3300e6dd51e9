"""`whisker ros2`: a running robot as a node of ROS 2 (crunchbot.robot.ros2)."""

import argparse
import os
import sys
import time
from pathlib import Path

from .. import scene as scenes
from ..arguments import whole_number
from ..robot.network.options import NAVIGATOR_ENDPOINT, PILOT_ENDPOINT, add_link, open_link
from ..robot.ros2 import ROUTER, RosNode
from ..robot.standard.view import StandardView
from ..stopping import stop_on_signals

EXAMPLE = "whisker ros2 robot-run/scene"
DOMAIN_VARIABLE, DOMAIN_MOST = "ROS_DOMAIN_ID", 232


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE", help="the robot's scene folder")
    domain = os.environ.get(DOMAIN_VARIABLE) or "0"
    text = f"of ROS 2 (default: {DOMAIN_VARIABLE}, or 0)"
    parser.add_argument("--domain", type=whole_number(0, DOMAIN_MOST), default=domain, metavar="N", help=text)
    text = "of rmw_zenoh, tcp/HOST:PORT (default: %(default)s)"
    parser.add_argument("--router", default=ROUTER, metavar="ENDPOINT", help=text)
    add_link(parser, [], [PILOT_ENDPOINT, NAVIGATOR_ENDPOINT])
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    view = StandardView(scenes.load(arguments.scene), time.time_ns())
    stop = stop_on_signals()
    with open_link("ros2", arguments) as link:
        node = RosNode(view, arguments.robot, arguments.domain, arguments.router)
        print(f"node {node.name} in domain {arguments.domain}, by {arguments.router}", flush=True)
        if not node.has_router():
            text = f"{arguments.router}: no router answers yet; start one: ros2 run rmw_zenoh_cpp rmw_zenohd"
            print(f"whisker: warning: {text}", file=sys.stderr, flush=True)
        node.run(link, stop)
    print(f"{node.sent} messages, {node.poses_set} poses set, {node.poses_refused} refused")
    return 0
