"""`whisker map`: a map from the rows of a scene folder alone (crunchbot.nav.mapping)."""

import argparse
import json
import sys

from ..arguments import add_output
from ..nav import mapping
from ..nav.faults import row_faults
from ..scene import OBSERVATIONS

EXAMPLE = "whisker map examples/scene --out touched --json"


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", help="folder with robot.toml and observations.csv; nothing else of it is read")
    text = "folder to write: a scene for localise, and map.yaml"
    add_output(parser, "--out", own=mapping.HELD, required=True, metavar="MAP", help=text)
    parser.add_argument("--no-lattice", action="store_true", help="do not look for a lattice of tiles")
    parser.add_argument("--json", action="store_true", help="print the summary as one line of JSON")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    robot, textures, rows = mapping.read(arguments.scene)
    for fault in row_faults(rows, robot):
        print(f"whisker: warning: {arguments.scene}/{OBSERVATIONS}: {fault}", file=sys.stderr)
    mapped = mapping.run(robot, textures, rows, not arguments.no_lattice, arguments.json)
    reported = mapping.summary(mapped, mapping.write_map(arguments.out, mapped, arguments.overwrite))
    print(json.dumps(reported) if arguments.json else "\n".join(mapping.spoken(reported)))
    return 0
