"""--choose and --tile, for commands that start a pilot."""

import argparse

from ..errors import UserError
from .policy import CHECK, POLICIES, RANDOM

TEXT = (
    "turns and distances: at random; plan: by what the navigator's belief is expected to gain; map: to new floor, by a map of "
    "the pilot's own; check: to the tile of --tile, by that belief; along walls; in lanes (random)"
)


def add_choices(parser: argparse.ArgumentParser, more: str) -> None:
    """--choose and --tile; `more` ends the help of --choose."""
    parser.add_argument("--choose", choices=POLICIES, default=RANDOM, help=TEXT + more)
    text = "for --choose check: the tile, 0,0 at x = y = 0 (the one that the windows say most against)"
    parser.add_argument("--tile", type=tile, metavar="COLUMN,ROW", help=text)


def tile(text: str) -> tuple[int, int]:
    """Column and row, from "2,1"."""
    try:
        column, row = map(int, text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no tile; give column and row, such as 2,1") from None
    return column, row


def refuse_tile(arguments: argparse.Namespace) -> None:
    """UserError where a tile is given and no task checks one."""
    if arguments.tile is not None and arguments.choose != CHECK:
        column, row = arguments.tile
        raise UserError(f"--tile {column},{row}: only --choose {CHECK} looks at a tile; give that, or no --tile")
