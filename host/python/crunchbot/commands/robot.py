"""`whisker robot`: starts all processes of a robot, on hardware or simulated, and starts again what ends."""

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from .. import scene as scenes
from ..arguments import RING, add_output, add_zenoh_config, number_above, whole_number
from ..base_table import BaseTable, Topics
from ..errors import UserError
from ..lab import import_lab
from ..outputs import made, put
from ..progress import bar
from ..robot.models import load_models
from ..robot.network.link import read_config
from ..robot.network.options import link_that_warns
from ..robot.network.truth import TruthWatcher
from ..robot.policy import add_choices
from ..robot.processes import holders, parts
from ..robot.processes.logs import run_files, run_folder
from ..robot.processes.supervisor import Supervisor
from ..robot.processes.units import HELD, TARGET, Installed, units
from ..robot.rosbase.signing import sign
from ..robot.terminal import Terminal
from ..stopping import stop_on_signals

EXAMPLE = "whisker robot --simulated --desktop"
DAY_S = 86400.0
VIEW_PORT = 8028
PORT = Path("/dev/ttyUSB0")
SENSORS = {"bridge": "mlx90333", "pico": "tmag5170"}  # of a simulated robot's whiskers, by its board
CREATE, ROS2 = "create", "ros2"
SIMULATED_ROS2 = BaseTable(wheel_step_m_s=0.0285, topics=Topics())  # Create 2's wheels, which the simulation has


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", nargs="?", type=Path, metavar="SCENE", help="scene folder: arena, robot, prior")
    parser.add_argument("--models", type=Path, metavar="DIR", help="folder with texture.json and <whisker>.json")
    parser.add_argument("--create", type=whole_number(1, 2), choices=(1, 2), default=1, help="the base: iRobot Create")
    text = "what the base speaks (default: as robot.toml says); simulated, ros2 is a Create behind /cmd_vel and /odom"
    parser.add_argument("--base", choices=(CREATE, ROS2), help=text)
    parser.add_argument("--port", type=Path, default=PORT, metavar="PATH", help="the base's serial port")
    parser.add_argument("--ring", default=RING, metavar="NAME", help="whiskerd's ring")
    text = "use the whiskerd that runs, systemd's for instance, by its --ring"
    parser.add_argument("--no-daemon", action="store_true", help=text)
    text = "as --desktop, with a mapper in the navigator's place: of the scene only robot.toml is used, and the map is kept"
    parser.add_argument("--map", action="store_true", help=text)
    parser.add_argument("--desktop", action="store_true", help="also the desktop's side: navigator, bag, view")
    parser.add_argument("--view-port", type=whole_number(0, 65535), default=VIEW_PORT, metavar="N", help="of the page")
    parser.add_argument("--out", type=Path, default=Path("robot-run"), metavar="DIR", help="logs, bag, truth")
    parser.add_argument("--no-view", action="store_true", help="no page for a browser")
    parser.add_argument(
        "--seed", type=whole_number(0, 2**32 - 1), default=1, metavar="N", help="of turns and simulation"
    )
    add_choices(parser)
    text = "be reached at this address, by anyone who reaches it (default: this machine only)"
    parser.add_argument("--listen", default=parts.LOOPBACK, metavar="ADDRESS", help=text)
    text = "of three, for supervisor, pilot and navigator"
    parser.add_argument("--first-port", type=whole_number(1, 65533), default=parts.FIRST_PORT, metavar="N", help=text)
    add_zenoh_config(parser, "become tls/ADDRESS:PORT")
    text = "no hardware: the scene (default: the demo's of this seed) with a simulated robot, at the wall clock's pace"
    parser.add_argument("--simulated", action="store_true", help=text)
    text = "of the simulated robot: bridge, or pico: with the noise of the Pico's TMAG5170s behind the simulated bridge"
    parser.add_argument("--board", choices=list(SENSORS), default="bridge", help=text)
    parser.add_argument("--level", choices=("bytes", "rtl"), default="bytes", help="of the simulated bridge")
    parser.add_argument(
        "--seconds", type=number_above(0.0), default=DAY_S, metavar="S", help="simulated length (default: a day)"
    )
    text = "simulated seconds per second, at most (default: %(default)s); less, where this machine is too busy"
    parser.add_argument("--pace", type=number_above(0.0), default=1.0, metavar="X", help=text)
    text = "write systemd units that start these processes on a real robot into this folder, and start nothing"
    add_output(parser, "--units", own=HELD, type=Path, metavar="DIR", help=text)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    arguments.desktop |= arguments.map
    if arguments.units:
        return _write_units(arguments)
    stop = stop_on_signals()
    _look_first(arguments)
    files = run_files(arguments.out)
    logs = run_folder(arguments.out / "logs")
    with tempfile.TemporaryDirectory(prefix="whisker-") as folder:
        address = (arguments.listen, arguments.first_port, arguments.zenoh_config)
        meeting = parts.Meeting(arguments.ring, Path(folder), *address)
        table = _table(arguments, meeting, files)
        with link_that_warns("supervisor", [meeting.endpoint(0)], arguments.zenoh_config) as link:
            if arguments.simulated:
                TruthWatcher(meeting.simulation, link, stop).start()
            until = parts.BRIDGE if arguments.simulated else None
            print(f"starting {', '.join(program.name for program in table)}; logs: {logs}", flush=True)
            if arguments.desktop:
                print(f"bag: {files['bag']}" + (f"; map: {files['map']}" if arguments.map else ""), flush=True)
            page = logs / "view.log" if arguments.desktop and not arguments.no_view else None
            Terminal(arguments.ring, page, arguments.pace, stop, _tell).start()
            ended = Supervisor(table, logs, link, until, _tell).run(stop)
    print(f"all ended: {ended}")
    return 0


def _tell(line: str) -> None:
    print(f"whisker: {line}", file=sys.stderr, flush=True)


def _write_units(arguments) -> int:
    """Units of pilot and desktop; whiskerd and whisker-base have theirs by `cmake --install`."""
    if arguments.simulated or not (arguments.scene and arguments.models):
        raise UserError("robot: --units without SCENE and --models, or with --simulated; give the real robot's")
    robot = scenes.load(arguments.scene).robot
    load_models(arguments.models, robot)
    if _speaks_ros2(arguments, robot):
        raise UserError("robot: --units for a base of ROS 2: there is no unit; let one of yours run 'whisker robot'")
    address = (arguments.listen, arguments.first_port, arguments.zenoh_config and arguments.zenoh_config.resolve())
    meeting = Installed(arguments.ring, arguments.units, *address, port=arguments.port)
    scene, models = arguments.scene.resolve(), arguments.models.resolve()
    body = parts.Body(scene, models, arguments.create, arguments.port, arguments.seed, arguments.choose)
    table = [program for program in parts.netbook(body, meeting, _awaited(arguments)) if program.name != "base"]
    if arguments.desktop:
        view = None if arguments.no_view else arguments.view_port
        table += parts.desktop(body, meeting, meeting.bag, view, meeting.map_folder if arguments.map else None)
    described = units(table, meeting)
    with made(arguments.units, arguments.overwrite, HELD) as folder:
        folder.mkdir()
        for name, text in described.items():
            put(folder / name, text)
    print(
        f"{arguments.units}: {', '.join(described)}; next: copy them to /etc/systemd/system, systemctl enable --now {TARGET}"
    )
    return 0


def _look_first(arguments) -> None:
    """What would end a process over and over is said before any is started. UserError; warnings on standard error."""
    if arguments.simulated and arguments.no_daemon:
        raise UserError("robot: --simulated with --no-daemon: only a whiskerd of its own sees that bridge; give one")
    if not arguments.simulated and arguments.board != "bridge":
        raise UserError("robot: --board without --simulated: whiskerd finds out what is plugged in; leave it out")
    if not arguments.simulated and not (arguments.scene and arguments.models):
        raise UserError("robot: no SCENE or no --models; give both, or --simulated")
    arguments.ros2 = arguments.base == ROS2
    if arguments.scene:
        scene = scenes.load(arguments.scene)
        arguments.ros2 = _speaks_ros2(arguments, scene.robot)
        if arguments.models:
            load_models(arguments.models, scene.robot)
    read_config(arguments.zenoh_config)
    for number in range(3):
        holders.check_port(arguments.listen, arguments.first_port + number, "--first-port")
    if arguments.desktop and not arguments.no_view and arguments.view_port:
        holders.check_port(parts.LOOPBACK, arguments.view_port, "--view-port")
    if not arguments.no_daemon:
        holders.check_ring(arguments.ring)
    if not (arguments.simulated or arguments.ros2) and (warning := holders.check_serial(arguments.port)):
        print(f"whisker: warning: {warning}", file=sys.stderr)


def _speaks_ros2(arguments, robot: scenes.Robot) -> bool:
    """UserError where robot.toml does not say how."""
    if arguments.base == ROS2 and robot.base.topics is None:
        raise UserError(
            f"{arguments.scene / scenes.ROBOT}: --base ros2, but no [base.ros2]; add it (docs/another_base.md)"
        )
    return robot.base.topics is not None and arguments.base != CREATE


def _table(arguments, meeting: parts.Meeting, files: dict[str, Path]) -> list:
    if arguments.simulated:
        body, simulated = _simulated(arguments, meeting, files)
        table = [parts.bridge(simulated, body, meeting)]
        table += parts.simulated_base(body, meeting) if arguments.ros2 else []
    else:
        robot = (arguments.scene, arguments.models, arguments.create, arguments.port, arguments.seed, arguments.choose)
        body = parts.Body(*robot, arguments.ros2)
        table = []
    if arguments.desktop:
        view = None if arguments.no_view else arguments.view_port
        table += parts.desktop(body, meeting, files["bag"], view, files["map"] if arguments.map else None)
    if not arguments.no_daemon:
        table.append(parts.daemon(body, meeting, arguments.simulated))
    return table + parts.netbook(body, meeting, _awaited(arguments))


def _awaited(arguments) -> str | None:
    """The process that the pilot waits for."""
    return (parts.MAPPER if arguments.map else parts.NAVIGATOR) if arguments.desktop else None


def _simulated(arguments, meeting: parts.Meeting, files: dict[str, Path]) -> tuple[parts.Body, parts.Simulated]:
    """The simulated robot; what it needs is written below --out, its models learnt there if none are given."""
    out, seed, user = arguments.out, arguments.seed, "robot: --simulated"
    folder = arguments.scene or files["scene"]
    bridge = import_lab("simulation.bridge", user)
    scene, start = bridge.simulated_scene(
        arguments.scene and str(arguments.scene), seed, sensor=SENSORS[arguments.board]
    )
    if arguments.scene is None:
        if arguments.ros2:
            scene = replace(scene, robot=replace(scene.robot, base=SIMULATED_ROS2))
        with made(folder, False, scenes.HELD) as fresh:
            scenes.write(fresh, scene)
            if arguments.ros2:
                sign(fresh, "the simulation, whose base has a time-out")
    out.mkdir(parents=True, exist_ok=True)
    put(files["flat"], scene.flat(start), overwrite=False)
    models = arguments.models or out / "models"
    if arguments.models is None and not (models / "texture.json").exists():
        kept = import_lab("demo.kept_models", user)
        models_wanted = 1 + len(scene.robot.of_role("object"))
        print("learning textures and distances of this robot, or copying what was learnt before", flush=True)
        with (
            bar(total=models_wanted, desc="models", unit="model", disable=None) as done,
            made(models, False, ("texture.json", "*")) as fresh,
        ):
            fresh.mkdir()
            result = kept.learn_or_copy(fresh, scene, seed, lambda: done.update(1))
        print(f"models: {result}", flush=True)
    create = 2 if arguments.ros2 else arguments.create
    body = parts.Body(folder, models, create, meeting.serial, seed, arguments.choose, arguments.ros2)
    reported = (arguments.level, seed, arguments.seconds, arguments.pace, files["truth"], files["wheels"])
    return body, parts.Simulated(files["flat"], *reported)
