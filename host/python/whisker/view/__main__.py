"""The program whisker-view; also python -m whisker.view."""

import sys

from ..arguments import Parser
from ..errors import UserError
from .command import EXAMPLE, add


def main(argv: list[str] | None = None) -> int:
    parser = Parser(
        prog="whisker-view", description="Serves a local page of a ring: traces, loss, health. Prints its address."
    )
    parser.show_example(EXAMPLE)
    add(parser)
    arguments = parser.parse_args(argv)
    try:
        return arguments.run(arguments)
    except UserError as error:
        print(f"whisker-view: {error}", file=sys.stderr)
        return error.exit_code


if __name__ == "__main__":
    sys.exit(main())
