"""`whisker examples`: a small data set, with which the example in the help of every command works as it stands."""

import argparse
import zipfile
from importlib.resources import files
from pathlib import Path

from ..errors import UserError
from ..tables import unwritable

EXAMPLE = "whisker examples"
PLACE = Path("examples")
NEXT = "whisker localise examples/scene --json"


class ExamplesError(UserError):
    """Something stands where the data set belongs; one line."""


def add(parser: argparse.ArgumentParser) -> None:
    text = "a folder that is not there yet (default: %(default)s, where the examples look for it)"
    parser.add_argument("folder", nargs="?", type=Path, default=PLACE, metavar="DIR", help=text)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    folder = arguments.folder
    if folder.exists():
        raise ExamplesError(f"examples: {folder} is there already; remove it, or name another folder")
    try:
        with (files("crunchbot") / "data/examples.zip").open("rb") as packed, zipfile.ZipFile(packed) as data:
            data.extractall(folder)
    except OSError as error:
        raise unwritable(folder, error) from error
    print(f"{folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}; next: {NEXT}")
    return 0
