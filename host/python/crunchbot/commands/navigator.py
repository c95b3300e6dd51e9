"""`whisker navigator`: the desktop's filters on the rows of a robot (crunchbot.robot.navigator)."""

import argparse
import sys
from pathlib import Path

from ..arguments import add_output, seconds
from ..nav import localise
from ..robot.navigator import Navigator, Settings, write_report
from ..robot.network.options import NAVIGATOR_ENDPOINT, PILOT_ENDPOINT, add_link, open_link
from ..scene import load
from ..stopping import stop_on_signals

EXAMPLE = "whisker navigator robot-run/scene --connect tcp/127.0.0.1:7458"


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", metavar="SCENE", help="scene folder: arena, robot and prior")
    text = f"repeatable; the first one's pose is the robot's (default: {localise.default_filter()})"
    parser.add_argument("--filter", action="append", metavar="NAME", choices=localise.filter_names(), help=text)
    add_link(parser, [NAVIGATOR_ENDPOINT], [PILOT_ENDPOINT])
    text = "folder for est_<filter>.csv and covariance_<filter>.csv"
    add_output(parser, "--out", own=None, type=Path, metavar="DIR", help=text)
    add_output(parser, "--report", type=Path, metavar="FILE", help="JSON of what was weighed, skipped and missed")
    parser.add_argument("--stay", action="store_true", help="after the end of a run wait for the next")
    text = "what is believed, kept in this file and gone on from; a new run wants a new file"
    parser.add_argument("--checkpoint", type=Path, metavar="FILE", help=text)
    text = "drill: every step takes at least so long (1 is ten times the rows' period)"
    parser.add_argument("--drill-step", type=seconds, default=0.0, metavar="S", help=text)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    filters = tuple(dict.fromkeys(arguments.filter or [localise.default_filter()]))
    scene = load(arguments.scene)
    for warning in scene.warnings():
        print(f"whisker: warning: {warning}", file=sys.stderr)
    stop = stop_on_signals()
    settings = Settings(
        filters, arguments.out, arguments.stay, arguments.drill_step, arguments.checkpoint, arguments.overwrite
    )
    with open_link("navigator", arguments) as link:
        counters = Navigator(link, scene, settings).run(stop)
    if arguments.report:
        write_report(arguments.report, counters)
    print(", ".join(f"{name} {value}" for name, value in counters.items()))
    return 0
