"""The program whisker-view; also python -m crunchbot.view."""

import sys

from .. import __version__
from ..arguments import Parser
from ..ends import exit_code
from .command import EXAMPLE, add


def main(argv: list[str] | None = None) -> int:
    return exit_code("whisker-view", lambda: _run(argv))


def _run(argv: list[str] | None) -> int:
    arguments = parser().parse_args(argv)
    return arguments.run(arguments)


def parser() -> Parser:
    """The parser of the command line."""
    made = Parser(
        prog="whisker-view", description="Serves a local page of a ring: traces, loss, health. Prints its address."
    )
    made.show_example(EXAMPLE)
    made.add_argument("--version", action="version", version=f"whisker-view {__version__}")
    add(made)
    return made


if __name__ == "__main__":
    sys.exit(main())
