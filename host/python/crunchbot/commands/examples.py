"""`whisker examples`: a small data set, with which the example in the help of every command works as it stands."""

import argparse
import io
import zipfile
from importlib.resources import files
from pathlib import Path

from ..arguments import add_output
from ..outputs import made

EXAMPLE = "whisker examples"
PLACE = Path("examples")
NEXT = "whisker localise examples/scene --json"


def add(parser: argparse.ArgumentParser) -> None:
    text = "a folder that is not there yet (default: %(default)s, where the examples look for it)"
    add_output(parser, "folder", own=_held(), nargs="?", type=Path, default=PLACE, metavar="DIR", help=text)
    parser.set_defaults(run=run)


def _data() -> zipfile.ZipFile:
    return zipfile.ZipFile(io.BytesIO((files("crunchbot") / "data/examples.zip").read_bytes()))


def _held() -> tuple[str, ...]:
    with _data() as data:
        return tuple(sorted({name.partition("/")[0] for name in data.namelist()}))


def run(arguments: argparse.Namespace) -> int:
    folder = arguments.folder
    with _data() as data, made(folder, arguments.overwrite, _held()) as place:
        data.extractall(place)
    print(f"{folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}; next: {NEXT}")
    return 0
