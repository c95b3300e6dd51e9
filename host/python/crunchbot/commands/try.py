"""`whisker try`: a minute of a simulated robot, recorded before, played in the browser at once with a tour of six marks."""

import argparse
from importlib.resources import as_file, files

from ..view import command as view

EXAMPLE = "whisker try"
BAG = "data/first_minute.mcap"
TOUR = "#tour"


def add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--no-open", action="store_true", help="print the page's address only")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Serve on a free port of this machine until interrupted."""
    with as_file(files("crunchbot") / BAG) as bag:
        words = [str(bag), "--port", "0"] + ([] if arguments.no_open else ["--open"])
        parser = argparse.ArgumentParser()
        view.add(parser)
        return view.run(parser.parse_args(words), TOUR)
