"""`whisker ros2`: a running robot as a node of ROS 2 (crunchbot.robot.ros2)."""

import argparse
import time
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING

from .. import scene as scenes
from ..arguments import warn
from ..errors import UserError
from ..robot.network.options import NAVIGATOR_ENDPOINT, PILOT_ENDPOINT, add_link, open_link
from ..robot.ros2 import LOCALHOST, ROUTER
from ..robot.ros2.options import add_domain, reach_of
from ..robot.standard.view import StandardView
from ..stopping import stop_on_signals

if TYPE_CHECKING:
    from ..robot.standard.outlet import Outlet

EXAMPLE = "whisker ros2 robot-run/scene"
ZENOH, CYCLONE = "zenoh", "cyclonedds"


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE", help="the robot's scene folder")
    text = "which implementation of ROS 2's middleware reads it"
    parser.add_argument("--rmw", choices=(ZENOH, CYCLONE), default=ZENOH, help=text)
    text = f"of rmw_zenoh, tcp/HOST:PORT (default: {ROUTER})"
    parser.add_argument("--router", metavar="ENDPOINT", help=text)
    add_domain(parser)
    add_link(parser, [], [PILOT_ENDPOINT, NAVIGATOR_ENDPOINT])
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    open_node = {ZENOH: _zenoh_node, CYCLONE: _cyclone_node}[arguments.rmw]
    foreign = {ZENOH: "range", CYCLONE: "router"}[arguments.rmw]
    if getattr(arguments, foreign) is not None:
        raise UserError(f"--{foreign}: --rmw {arguments.rmw} has none; leave it out, or choose the other --rmw")
    view = StandardView(scenes.load(arguments.scene), time.time_ns())
    stop = stop_on_signals()
    with open_link("ros2", arguments) as link:
        node = open_node(view, arguments, stop)
        node.run(link, stop)
    print(f"{node.sent} messages, {node.poses_set} poses set, {node.poses_refused} refused")
    return 0


def _zenoh_node(view: StandardView, arguments: argparse.Namespace, stop: Event) -> "Outlet":
    from ..robot.ros2.rmw_zenoh import ZenohNode

    router = arguments.router or ROUTER
    node = ZenohNode(view, arguments.robot, arguments.domain, router)
    print(f"node {node.name} in domain {arguments.domain}, by {router}", flush=True)
    if not node.has_router(stop) and not stop.is_set():
        warn(f"{router}: no router answers yet; start one: ros2 run rmw_zenoh_cpp rmw_zenohd")
    return node


def _cyclone_node(view: StandardView, arguments: argparse.Namespace, stop: Event) -> "Outlet":
    reach = reach_of(arguments)
    from ..robot.ros2.rmw_cyclonedds import CycloneNode

    node = CycloneNode(view, arguments.robot, arguments.domain, reach)
    print(f"node {node.name} in domain {arguments.domain}, by Cyclone DDS, range {reach}", flush=True)
    if reach != LOCALHOST:
        warn("anyone in the domain on this machine's networks can watch, and set the pose")
    return node
