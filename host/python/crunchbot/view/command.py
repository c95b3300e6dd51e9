"""Arguments of whisker-view and of `whisker view`, and what they start."""

import argparse
import asyncio
import contextlib
import ipaddress
import logging
import webbrowser
from functools import partial
from pathlib import Path

from ..arguments import add_ring_owner, add_topics, add_zenoh_config
from ..errors import UserError
from ..guard import add_door, may_set_pose, warn_if_open
from ..robot.bags.played import read_bag
from ..robot.bags.topic_rows import read_by_table
from ..robot.processes.parts import whisker
from ..scene import load
from ..stopping import listen
from .hub import Hub
from .playback import Playback
from .recorder import Recorder
from .rings import is_name
from .robot_source import WANTED, NoRobot, join
from .server import ViewError, serving

EXAMPLE = "whisker-view --ring whisker --open --robot"
PORT = 8028
RING = "whisker"
ROBOT = "robot"


class PlaybackError(UserError):
    """Options that do not go with a recording; one line."""

    exit_code = 2


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments and set `run`."""
    text = "a robot's bag to play, in place of what runs now: of 'whisker bag', 'whisker robot' or 'ros2 bag record'"
    parser.add_argument("file", nargs="?", type=Path, metavar="BAG", help=text)
    add_topics(parser)
    parser.add_argument(
        "--ring", action="append", metavar="NAME", help=f"a ring to read from the start; repeatable (default: {RING})"
    )
    add_ring_owner(parser)
    parser.add_argument(
        "--robot",
        nargs="?",
        const=ROBOT,
        metavar="NAME",
        help=f"also show the whole robot: arena, belief, path, health (NAME: {ROBOT} if not given)",
    )
    parser.add_argument("--scene", metavar="SCENE", help="folder with the robot's arena.toml and robot.toml")
    parser.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="a process of the robot, tcp/HOST:PORT or tls/HOST:PORT; repeatable (default: pilot and navigator of this machine)",
    )
    add_zenoh_config(parser)
    text = "where the page's button records to, each time a new file"
    parser.add_argument("--records", type=Path, default=Path(), metavar="DIR", help=text)
    add_door(parser, PORT)
    parser.add_argument("--open", action="store_true", help="open the page in a browser")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace, part: str = "") -> int:
    """Serve until interrupted or terminated. part: what follows the page's address, as "#tour"."""
    logging.getLogger("crunchbot.view").addHandler(logging.NullHandler())
    rings = [] if arguments.file else list(dict.fromkeys(arguments.ring or [RING]))
    for name in rings:
        if not is_name(name):
            raise ViewError(f"--ring {name!r}: not the name of a ring; use letters, digits, dash and dot")
    scene = None if arguments.scene is None else load(arguments.scene)
    source = _source(arguments)
    if arguments.file:
        wanted = [topic.removesuffix("/*") for topic in WANTED]
        table = arguments.topics
        played = read_by_table(arguments.file, table, scene) if table else read_bag(arguments.file, wanted)
        source, scene = Playback(played), scene or played.scene
    may = may_set_pose(arguments)
    recorder = Recorder(arguments.records, partial(_recording, arguments)) if may and not arguments.file else None
    try:
        return asyncio.run(_serve(arguments, Hub(rings, source, scene, arguments.ring_owner, may, recorder), part))
    finally:
        if recorder:
            recorder.close()
        source.close()


def _recording(arguments: argparse.Namespace, ring: str | None, file: Path) -> list[str]:
    """The command that records what a page looks at."""
    scene = ["--scene", arguments.scene] if arguments.scene else []
    if ring is not None:
        owner = [] if arguments.ring_owner is None else ["--ring-owner", str(arguments.ring_owner)]
        return [*whisker("record"), str(file), "--ring", ring, *owner, *scene]
    if not _is_asked(arguments):
        raise UserError("no robot is looked at; look at its whiskers, or start whisker-view with --robot")
    ends = [word for end in arguments.connect for word in ("--connect", end)]
    config = ["--zenoh-config", str(arguments.zenoh_config)] if arguments.zenoh_config else []
    return [*whisker("bag"), str(file), "--stay", "--robot", arguments.robot or ROBOT, *ends, *config, *scene]


def _source(arguments: argparse.Namespace) -> NoRobot:
    """The robot, if any option asks for it."""
    config = arguments.zenoh_config
    if arguments.file:
        if arguments.ring or arguments.robot or arguments.connect or config:
            text = "a recording is played without --ring, --robot, --connect and --zenoh-config"
            raise PlaybackError(f"{arguments.file}: {text}")
        return NoRobot()
    if arguments.topics:
        raise PlaybackError("--topics: no bag to read by it; name one")
    return join(arguments.robot or ROBOT, arguments.connect, config) if _is_asked(arguments) else NoRobot()


def _is_asked(arguments: argparse.Namespace) -> bool:
    return bool(arguments.robot or arguments.scene or arguments.connect or arguments.zenoh_config)


async def _serve(arguments: argparse.Namespace, hub: Hub, part: str) -> int:
    over, loop = asyncio.Event(), asyncio.get_running_loop()

    def end() -> None:
        with contextlib.suppress(RuntimeError):  # the loop has been closed already
            loop.call_soon_threadsafe(over.set)

    listen(end)
    async with serving(hub, arguments.host, arguments.port, arguments.allow_host) as port:
        address = ipaddress.ip_address(arguments.host)
        may = ["watch", *["set the pose, stop the robot"] * hub.may_set_pose, *["record"] * bool(hub.recorder)]
        warn_if_open("whisker-view", arguments.host, ", ".join(may))
        host = "127.0.0.1" if address.is_unspecified else f"[{address}]" if address.version == 6 else str(address)
        url = f"http://{host}:{port}/{part}"
        print(url, flush=True)
        if arguments.open:
            webbrowser.open(url)
        await over.wait()
    return 0
