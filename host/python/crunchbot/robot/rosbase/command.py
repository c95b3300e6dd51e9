"""`whisker base`: drives a base that speaks ROS 2, behind the same socket as whisker-base (crunchbot.robot.rosbase)."""

import argparse
import sys
from pathlib import Path

from ... import scene as scenes
from ...errors import UserError
from ...stopping import stop_on_signals
from ..ros2.options import add_domain, reach_of

EXAMPLE = "whisker base examples/scene --socket base.sock"


def add(parser: argparse.ArgumentParser) -> None:
    text = "scene folder, whose robot.toml has the tables [base] and [base.ros2]"
    parser.add_argument("scene", type=Path, metavar="SCENE", help=text)
    parser.add_argument("--socket", type=Path, metavar="PATH", help="Unix socket to make (messages: docs/create.md)")
    text = "wheels up: one order to drive, then silence; whether the base stops by itself is kept in SCENE"
    parser.add_argument("--trial", action="store_true", help=text)
    add_domain(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    base = scenes.load_robot(arguments.scene).base
    if base.topics is None:
        raise UserError(f"{arguments.scene / scenes.ROBOT}: no table [base.ros2]; add it (docs/another_base.md)")
    if bool(arguments.socket) == arguments.trial:
        raise UserError("base: give --socket PATH to drive, or --trial to see whether the base stops by itself")
    return _try(arguments, base) if arguments.trial else _drive(arguments, base)


def _try(arguments: argparse.Namespace, base: scenes.BaseTable) -> int:
    from .signing import note
    from .trial import Trial
    from .wire import Wire

    stop = stop_on_signals()
    print("the wheels must not touch the ground: they will turn", flush=True)
    stands_after_s = Trial(Wire(base.topics, arguments.domain, reach_of(arguments)), base, stop.is_set).run()
    path = note(arguments.scene, base.topics, stands_after_s)
    print(f"after one order the wheels stood within {stands_after_s:.2f} s; noted in {path}")
    return 0


def _drive(arguments: argparse.Namespace, base: scenes.BaseTable) -> int:
    from .guard import Guard
    from .listening import listening

    def publish():
        from .wire import Orders

        return Orders(base.topics, arguments.domain, reach)

    stop, reach = stop_on_signals(), reach_of(arguments)
    with listening(arguments.socket) as opened:
        words = [str(arguments.scene), str(arguments.domain), reach]
        return Guard(publish, opened, words, _tell).run(stop.is_set)


def _tell(line: str) -> None:
    print(f"whisker base: {line}", file=sys.stderr, flush=True)
