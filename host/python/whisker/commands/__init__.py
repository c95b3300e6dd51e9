"""The subcommands of `whisker`, a module each, imported when it is called.

A module has `EXAMPLE`, a command line that works, and `add(parser)`, which adds its arguments and sets `run`, a function
of the parsed arguments that returns the exit code.
"""

import argparse

from ..errors import UserError


class Parser(argparse.ArgumentParser):
    """Complaints are one line; help keeps its line breaks."""

    def __init__(self, **options):
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False, **options)

    def error(self, message: str):
        self.exit(UserError.exit_code, f"{self.prog}: {message}; see '{self.prog} --help'\n")

    def show_example(self, command_line: str) -> None:
        """End the help with this."""
        self.epilog = f"example:\n  {command_line}"


def add_action(actions, name: str, text: str, example: str, run) -> Parser:
    """One action of a command that has several, such as `whisker texture train`."""
    parser = actions.add_parser(name, help=text, description=text)
    parser.show_example(example)
    parser.set_defaults(run=run)
    return parser


def plain(values: dict) -> dict:
    """JSON has no nan: what could not be read is null."""
    return {key: None if isinstance(value, float) and value != value else value for key, value in values.items()}
