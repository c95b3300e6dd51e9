"""`whisker mapper`: a map by touch alone from the rows of a running robot (crunchbot.robot.mapper)."""

import argparse
from pathlib import Path

from ..arguments import add_output
from ..nav.mapping import HELD
from ..robot.mapper import MapperProcess, Settings
from ..robot.navigator import write_report
from ..robot.network.options import NAVIGATOR_ENDPOINT, PILOT_ENDPOINT, add_link, open_link
from ..scene import load_robot
from ..stopping import stop_on_signals

EXAMPLE = "whisker mapper robot-run/scene --out touched-live --connect tcp/127.0.0.1:7458"


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", metavar="SCENE", help="folder with robot.toml; nothing else of it is read")
    add_link(parser, [NAVIGATOR_ENDPOINT], [PILOT_ENDPOINT])
    text = "folder of the map, written at the end of a run: as of whisker map"
    add_output(parser, "--out", own=HELD, type=Path, metavar="MAP", help=text)
    add_output(parser, "--report", type=Path, metavar="FILE", help="JSON of what was taken and missed")
    parser.add_argument("--stay", action="store_true", help="after the end of a run wait for the next")
    text = "what was taken, kept in this file and gone on from; a new run wants a new file"
    parser.add_argument("--journal", type=Path, metavar="FILE", help=text)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    robot = load_robot(arguments.scene)
    stop = stop_on_signals()
    settings = Settings(arguments.out, arguments.stay, arguments.journal)
    with open_link("mapper", arguments) as link:
        counters = MapperProcess(link, robot, settings).run(stop)
    if arguments.report:
        write_report(arguments.report, counters)
    print(", ".join(f"{name} {value}" for name, value in counters.items()))
    return 0
