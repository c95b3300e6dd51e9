"""`whisker flash`: loads firmware into the nodes, or gateware into the bridge. The work is whisker-flash's, which speaks USB."""

import argparse
import os

from ..programs import program

EXAMPLE = "whisker flash examples/node.whex"


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("image", help="firmware image (.whex) for the nodes, or gateware image (.wgw) for the bridge")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--lane", type=int, metavar="N", help="only the node on this lane")
    which.add_argument("--serial", type=int, metavar="S", help="only the node with this serial number")
    parser.add_argument("--bridge", metavar="TEXT", help="the bridge with this serial number")
    parser.add_argument("--dry-run", action="store_true", help="say what would be done, change nothing")
    parser.add_argument(
        "--force", action="store_true", help="also an image that is older, or of another build (sensor)"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    words = [program("whisker-flash"), arguments.image]
    for option, value in (("lane", arguments.lane), ("node", arguments.serial), ("bridge", arguments.bridge)):
        words += [f"--{option}", str(value)] if value is not None else []
    words += ["--dry-run"] if arguments.dry_run else []
    words += ["--force"] if arguments.force else []
    return os.spawnv(os.P_WAIT, words[0], words)
