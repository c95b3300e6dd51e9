"""`whisker flash`: loads firmware into the nodes, or gateware into the bridge. The work is whisker-flash's, which speaks USB.

`whisker flash pico` copies the Pico's image to its boot drive.
"""

import argparse
import os
from pathlib import Path

from whisker_protocol import LANES

from ..arguments import whole_number
from ..bridge import pico_drive
from ..programs import SOURCE_TREE, program

EXAMPLE = "whisker flash examples/node.whex"
PICO_IMAGE = SOURCE_TREE / "firmware/images/pico/pico.uf2"


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "image", help="firmware image (.whex) for the nodes, gateware image (.wgw) for the bridge, or pico"
    )
    parser.add_argument(
        "--uf2", type=Path, default=PICO_IMAGE, metavar="FILE", help="of pico: this image, not the release's"
    )
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--lane", type=whole_number(0, LANES - 1), metavar="N", help="only the node on this lane")
    which.add_argument("--serial", type=whole_number(0), metavar="N", help="only the node with this serial number")
    parser.add_argument("--bridge", metavar="TEXT", help="the bridge with this serial number")
    parser.add_argument("--dry-run", action="store_true", help="say what would be done, change nothing")
    parser.add_argument(
        "--force", action="store_true", help="also an image that is older, or of another build (sensor)"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    if arguments.image == "pico":
        return flash_pico(arguments)
    words = [program("whisker-flash"), arguments.image]
    for option, value in (("lane", arguments.lane), ("node", arguments.serial), ("bridge", arguments.bridge)):
        words += [f"--{option}", str(value)] if value is not None else []
    words += ["--dry-run"] if arguments.dry_run else []
    words += ["--force"] if arguments.force else []
    return os.spawnv(os.P_WAIT, words[0], words)


def flash_pico(arguments: argparse.Namespace) -> int:
    if arguments.dry_run:
        size = len(pico_drive.check_image(arguments.uf2))
        board = pico_drive.board(arguments.bridge)
        print(f"{arguments.uf2}, {size} bytes, would go into {board.serial if board else 'the drive of a Pico'}")
        return 0

    def ask(serial: str | None) -> int:
        words = [program("whisker-flash"), "--boot-drive", *(["--bridge", serial] if serial else [])]
        return os.spawnv(os.P_WAIT, words[0], words)

    pico_drive.flash(arguments.uf2, arguments.bridge, ask)
    print("the Pico runs the new image")
    return 0
