"""`whisker pilot`: the netbook's part of a robot: samples to wheel speeds and observation rows (crunchbot.robot)."""

import argparse
import json
import threading
import time
from contextlib import ExitStack, closing
from pathlib import Path
from types import SimpleNamespace

from whisker_protocol import LANES

from ..arguments import RING, add_output, add_ring_owner, whole_number
from ..base_table import BaseTable
from ..bridge.nodes import NodeError
from ..bridge.ring import Reader
from ..errors import UserError
from ..outputs import opened, put
from ..pilot.base import Base
from ..pilot.pilot import Pilot
from ..pilot.wheels import Wheels
from ..robot.blocks import LiveRing
from ..robot.models import check_nodes, load_models
from ..robot.network.health import Health
from ..robot.network.link import Link
from ..robot.network.options import NAVIGATOR_ENDPOINT, PILOT_ENDPOINT, add_link, open_link
from ..robot.pilot_process import Flight, LiveFlight, LiveWheels, fly_in_step
from ..robot.policy import add_choices, choices_of
from ..robot.processes.lifeline import Heartbeat
from ..robot.publisher import Publisher
from ..robot.rowfiles import Rows, Traces
from ..robot.simulation_link import SimLink
from ..robot.wheels import RETRY_S, IdealWheels, LiveBase, SteppedBase, wheels_of
from ..scene import load
from ..stopping import stop_on_signals

EXAMPLE = "whisker pilot robot-run/scene --models robot-run/models --base base.sock"
RING_WAIT_S = 10.0  # for the ring of a simulation that waits for us
OTHERS_WAIT_S = 60.0
NOWHERE = "/dev/null"
GREETING_S = 10.0  # a live pilot goes on without them


class PilotError(UserError):
    """Something the pilot needs is not there; one line."""

    exit_code = 1


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scene",
        type=Path,
        metavar="SCENE",
        help="scene folder, of which robot.toml is read",
    )
    parser.add_argument(
        "--models", type=Path, required=True, metavar="DIR", help="folder with texture.json and <whisker>.json"
    )
    parser.add_argument(
        "--nodes", metavar="FILE", help="what 'whisker info --nodes' printed: models of other nodes are refused"
    )
    parser.add_argument("--ring", default=RING, metavar="NAME", help="the ring to read")
    add_ring_owner(parser)
    parser.add_argument("--base", metavar="SOCKET", help="of whisker-base")
    text = "of a simulation that waits for the pilot; without --base its wheels are driven directly"
    parser.add_argument("--simulation", metavar="SOCKET", help=text)
    parser.add_argument("--seed", type=whole_number(0), default=1, metavar="N", help="of the random turns")
    add_choices(parser)
    add_link(parser, [PILOT_ENDPOINT], [NAVIGATOR_ENDPOINT])
    parser.add_argument(
        "--await", action="append", default=[], dest="others", metavar="PROCESS", help="begin when it is there, too"
    )
    add_output(parser, "--out", default=NOWHERE, metavar="FILE", help="observations.csv, as in docs/formats.md")
    add_output(parser, "--traces", default=NOWHERE, metavar="FILE", help="CSV of the floor whiskers' deflection")
    add_output(parser, "--report", type=Path, metavar="FILE", help="JSON of what was used, skipped and measured")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    if not (arguments.base or arguments.simulation):
        raise UserError("pilot: no wheels; give --base SOCKET, or --simulation SOCKET")
    with ExitStack() as stack:
        try:
            parts = (_fly_in_step if arguments.simulation else _fly_live)(arguments, stack)
        except NodeError:
            raise
        except (OSError, ValueError) as error:
            raise error if isinstance(error, UserError) else PilotError(f"pilot: {error}") from error
    if arguments.report:
        _write_report(arguments.report, parts)
    return 0


def _body(arguments) -> tuple:
    """The scene and the models of its robot (scene, texture, radial), read before anything is waited for."""
    scene = load(arguments.scene)
    robot = scene.robot
    if len(robot.whiskers) > LANES:
        raise UserError(f"{arguments.scene}: its robot has {len(robot.whiskers)} whiskers; a bridge has {LANES} lanes")
    texture, radial = load_models(arguments.models, robot)
    if arguments.nodes:
        check_nodes(arguments.nodes, robot, radial)
    return scene, texture, radial


def _parts(arguments, body: tuple, link: Link, wheels: Wheels, stack: ExitStack) -> SimpleNamespace:
    scene, texture, radial = body
    pilot = Pilot(scene.robot, texture, radial, arguments.seed, wheels)
    made = choices_of(arguments.choose, scene.robot, wheels, pilot.behaviour.choices)
    pilot.behaviour.choices, taker = made
    out, traces = (stack.enter_context(opened(path, arguments.overwrite)) for path in (arguments.out, arguments.traces))
    parts = {"rows": Rows(out), "traces": Traces(traces, pilot), "publisher": Publisher(link, pilot, taker)}
    return SimpleNamespace(pilot=pilot, flight=None, base_health={}, **parts)


def _fly_in_step(arguments, stack: ExitStack) -> SimpleNamespace:
    """Everybody must be there before the first tick, for what is sent then must reach them."""
    body = _body(arguments)
    link = stack.enter_context(open_link("pilot", arguments))
    base = stack.enter_context(Base(arguments.base)) if arguments.base else None
    table = body[0].robot.base
    able = wheels_of(base.health(), table) if base else Wheels.without_driver(table)
    parts = _parts(arguments, body, link, able, stack)
    link.announce()
    if not link.wait_for(arguments.others, OTHERS_WAIT_S):
        gone = ", ".join(sorted(set(arguments.others) - link.peers))
        raise PilotError(f"pilot: {gone} did not come in {OTHERS_WAIT_S:g} s; start it, and connect it to this pilot")
    reader = stack.enter_context(Reader(arguments.ring, RING_WAIT_S, arguments.ring_owner))
    sim = stack.enter_context(SimLink(arguments.simulation))
    wheels = SteppedBase(sim, base) if base else IdealWheels(sim)
    parts.flight = Flight(parts.pilot, wheels, parts.rows, parts.traces, parts.publisher)
    fly_in_step(parts.flight, reader, parts.publisher)
    parts.base_health = wheels.health()
    return parts


def _fly_live(arguments, stack: ExitStack) -> SimpleNamespace:
    stop, heartbeat, body = stop_on_signals(), Heartbeat.of_environment(), _body(arguments)
    link = stack.enter_context(open_link("pilot", arguments))
    base = LiveBase(arguments.base)
    parts = _parts(arguments, body, link, _known_wheels(base, body[0].robot.base, link, stop), stack)
    wheels = LiveWheels(base)
    ring = stack.enter_context(closing(LiveRing(arguments.ring, len(parts.pilot.names), owner=arguments.ring_owner)))
    parts.flight = Flight(parts.pilot, wheels, parts.rows, parts.traces, parts.publisher)
    live = LiveFlight(parts.flight, ring, wheels, link, heartbeat)
    link.announce()
    _greet(arguments.others, link, stop)
    live.run(stop.is_set)
    parts.publisher.end("stopped")
    parts.base_health = base.health()
    return parts


def _greet(others: list[str], link: Link, stop: threading.Event) -> None:
    """Gives the others a while to come: a navigator that takes the first row knows where the run begins."""
    give_up = time.monotonic() + GREETING_S
    while not link.wait_for(others, RETRY_S) and time.monotonic() < give_up and not stop.is_set():
        continue


def _known_wheels(base: LiveBase, table: BaseTable, link: Link, stop: threading.Event) -> Wheels:
    """Waits for the base to say what it can do; meanwhile the pilot's health says so."""
    health = Health(link, dict)
    while not (reported := base.health()) and not stop.wait(RETRY_S):
        health.report(0, base.trouble, base.trouble)
    return wheels_of(reported, table) if reported else Wheels.of(table)


def _write_report(path: Path, parts: SimpleNamespace) -> None:
    pilot = parts.pilot
    content = {"ticks_used": parts.flight.ticks_used, "rows": parts.publisher.rows, "bad_samples": pilot.bad_samples}
    put(path, json.dumps(content | {"whisks": pilot.whisks, "base": parts.base_health}, indent=1) + "\n")
