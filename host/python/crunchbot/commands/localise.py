"""`whisker localise`: runs a filter over a scene folder (crunchbot.nav.localise)."""

import argparse
import json
import sys

from ..arguments import add_output, whole_number
from ..nav import localise
from ..nav.faults import ground_faults, row_faults
from ..nav.fit import fit_faults
from ..nav.localise import SettingError
from ..scene import PRIOR, SceneError, load
from ..tables import TableError

EXAMPLE = "whisker localise examples/scene --filter grid --set grid.cell_m=0.1 --out est.csv --json"


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", nargs="?", help="folder with arena.toml, robot.toml, prior.toml, observations.csv")
    named = parser.add_argument(
        "--filter", default=localise.default_filter(), metavar="NAME", help="see --list-filters"
    )
    vars(named)["values"] = localise.filter_names()  # for a shell's completion
    parser.add_argument("--seed", type=whole_number(0), default=0, metavar="N", help="of every random draw")
    text = "change a setting, see --list-settings"
    setting = parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help=text)
    vars(setting)["values"] = [f"{name}=" for name, *_ in localise.settings_list()]
    add_output(parser, "--out", metavar="EST.CSV", help="write t_s, x_m, y_m, theta_rad, confidence of every row")
    text = "occupancy map (a ROS map server's YAML file): its boxes in place of arena.toml's, or of all of it where there is none"
    parser.add_argument("--map", metavar="MAP.YAML", help=text)
    parser.add_argument("--json", action="store_true", help="print the summary as one line of JSON")
    parser.add_argument("--list-filters", action="store_true", help="print the filters' names and leave")
    parser.add_argument(
        "--list-settings", action="store_true", help="print the settings, their values and ranges, and leave"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    if arguments.list_filters:
        print("\n".join(localise.filter_names()))
        return 0
    if arguments.list_settings:
        for name, standard, low, high in localise.settings_list():
            print(f"{name}={standard:g} ({low:g} to {high:g})")
        return 0
    if arguments.scene is None:
        raise SettingError("localise: no scene folder given; name one, or use --list-filters")
    scene = load(arguments.scene, arguments.map)
    if scene.prior is None:
        raise SceneError(f'{arguments.scene}/{PRIOR}: missing; write one, kind = "uniform" if nothing is known')
    for warning in scene.warnings():
        print(f"whisker: warning: {warning}", file=sys.stderr)
    path = localise.observations_path(arguments.scene)
    observations = localise.read_observations(path, scene)
    if not len(observations):
        raise TableError(path, None, "no rows; record some")
    for fault in row_faults(observations, scene.robot):
        print(f"whisker: warning: {path}: {fault}", file=sys.stderr)
    settings, regions = _settings(arguments.set), localise.REGION_ROWS
    result = localise.run(arguments.filter, scene, observations, settings, arguments.seed, regions)
    fits = fit_faults(scene, observations, result.table)
    for warning in (*ground_faults(result.poses, scene), *fits, *localise.warnings(result)):
        print(f"whisker: warning: {warning}", file=sys.stderr)
    if arguments.out:
        localise.write_estimates(arguments.out, result, observations)
    if arguments.json:
        print(json.dumps(localise.summary(result, observations.truth)))
    else:
        print("\n".join(localise.spoken(result, observations.truth)))
    return 0


def _settings(pairs: list[str]) -> dict[str, float]:
    settings = {}
    for pair in pairs:
        key, _, value = pair.partition("=")
        try:
            settings[key] = float(value)
        except ValueError:
            raise SettingError(f"--set {pair}: not KEY=NUMBER, as in grid.cell_m=0.05") from None
    return settings
