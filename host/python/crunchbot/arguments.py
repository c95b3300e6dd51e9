"""What command lines have in common: the parser, arguments that several take, and types of arguments.

The parser is argparse's and no library's: a subcommand is imported only when it is called, and the core has no dependency for it.
"""

import argparse
import difflib
import math
import pwd
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NoReturn

from .errors import UserError
from .outputs import claim

NO_USER = 2**32 - 1  # as a user id: nobody's
UNKNOWN = "unrecognized arguments: "  # as argparse begins it
NAME = "NAME"  # metavar of what is no path
LIKE = 0.7  # share of letters that two words have in common: localize and localise, not gates and bytes
SHOWN = 12  # choices in one line
RING = "whisker"  # the name whiskerd's unit gives its ring


class Help(argparse.RawDescriptionHelpFormatter):
    """One style: arguments in capitals, and a default beside each text that does not tell it."""

    def _get_help_string(self, action: argparse.Action) -> str:
        text = action.help or ""
        is_plain = (
            action.nargs != 0 and action.default not in (None, argparse.SUPPRESS, "", []) and "default" not in text
        )
        return f"{text} (default: %(default)s)" if is_plain and action.option_strings else text


class Parser(argparse.ArgumentParser):
    """Complaints are one line; help keeps its line breaks."""

    def __init__(self, **options: Any):
        super().__init__(formatter_class=Help, allow_abbrev=False, **options)

    def error(self, message: str) -> NoReturn:
        words = message.removeprefix(UNKNOWN).split() if message.startswith(UNKNOWN) else []
        hint = nearest(words[0].partition("=")[0], options_of(self)) if words else ""
        self.exit(UserError.exit_code, f"{self.prog}: {message}{hint}; see '{self.prog} --help'\n")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As argparse's, but that nothing unknown is left for the command above, whose help would not show it."""
        words = sys.argv[1:] if args is None else list(args)
        first = words[0] if words else ""
        if (
            self.takes_commands()
            and first.startswith("-")
            and first.partition("=")[0] not in self._option_string_actions
        ):
            self.error(UNKNOWN + first)  # before the word behind it is taken for a command
        found, unknown = super().parse_known_args(words, namespace)
        if unknown:
            self.error(UNKNOWN + " ".join(unknown))
        return found, unknown

    def takes_commands(self) -> bool:
        return any(isinstance(action, argparse._SubParsersAction) for action in self._actions)

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """As argparse's, with the nearest choice in place of all where one is near."""
        choices = list(map(str, action.choices or ()))
        if choices and value not in (action.choices or ()):
            shown = f" (choose from {', '.join(choices)})" if len(choices) <= SHOWN else ""
            hint = nearest(str(value), choices) or shown
            raise argparse.ArgumentError(action, f"invalid choice: {value!r}{hint}")

    def _get_positional_kwargs(self, dest: str, **options: Any) -> dict[str, Any]:
        """As argparse's, in capitals where it has no name of its own: in help and in complaints."""
        given = super()._get_positional_kwargs(dest, **options)
        return given if given.get("choices") else {"metavar": dest.upper(), **given}

    def show_example(self, command_line: str) -> None:
        """End the help with this."""
        self.epilog = f"example:\n  {command_line}"


def nearest(word: str, choices: list[str]) -> str:
    """ "; did you mean ...?" where one of the choices is like the word, else nothing."""
    part = word.strip("-")
    found = difflib.get_close_matches(word, choices, 1, LIKE) or [c for c in choices if len(part) > 2 and part in c]
    return f"; did you mean {found[0]}?" if found else ""


def options_of(parser: argparse.ArgumentParser) -> list[str]:
    """The option words of a parser and its subcommands."""
    found = list(parser._option_string_actions)
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            found += [word for inner in action.choices.values() for word in options_of(inner)]
    return found


def warn(line: str) -> None:
    """What a command goes on in spite of, on standard error."""
    print(f"whisker: warning: {line}", file=sys.stderr)


def add_action(actions: Any, name: str, text: str, example: str, run: Callable[[argparse.Namespace], int]) -> Parser:
    """One action of a command that has several, such as `whisker texture train`."""
    parser = actions.add_parser(name, help=text, description=text)
    parser.show_example(example)
    parser.set_defaults(run=run)
    return parser


def add_output(parser: Any, *names: str, own: tuple[str, ...] | None = (), **options: Any) -> None:
    """An argument that names what is written, with --overwrite beside it. own: as of `outputs.claim`; None: a folder in which
    the command claims each file itself."""
    parser.add_argument(*names, **options).own = own
    if "--overwrite" not in parser._option_string_actions:
        parser.add_argument("--overwrite", action="store_true", help="replace what is there already")


def claim_outputs(parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
    """OutputError when an output of the chosen command may not be written to: before any of its work."""
    actions = list(actions_of(parser))
    outputs = {action.dest: action.own for action in actions if hasattr(action, "own")}
    inputs = [a.dest for a in actions if is_path(a) and a.dest not in outputs]
    read = [path for dest in inputs for path in _paths(getattr(arguments, dest, None))]
    for dest, own in outputs.items():
        path = getattr(arguments, dest, None)
        if path is not None and own is not None:
            claim(path, arguments.overwrite, own, read)


def _paths(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [] if value is None else [value]


def actions_of(parser: argparse.ArgumentParser) -> Iterator[Any]:
    """Every argument, those of subcommands too."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                yield from actions_of(inner)


def is_path(action: Any) -> bool:
    """Whether an argument names a file or a folder, as far as its parser can know."""
    return (
        action.type in (Path, None, mcap_path) and action.nargs != 0 and not action.choices and action.metavar != NAME
    )


def plain(values: dict) -> dict:
    """JSON has no nan: what could not be read is null."""
    return {key: None if isinstance(value, float) and value != value else value for key, value in values.items()}


def add_ring(parser: argparse.ArgumentParser) -> None:
    """--ring, --ring-owner and --wait, for commands that read a ring."""
    parser.add_argument("--ring", default=RING, metavar="NAME", help="the ring to read")
    add_ring_owner(parser)
    parser.add_argument("--wait", type=seconds, default=0.0, metavar="S", help="wait so long for the ring to come up")


def add_ring_owner(parser: argparse.ArgumentParser) -> None:
    """--ring-owner, for commands that read a ring; None: no other user's."""
    text = "accept a ring of this user, too, not only root's, your own and the service's"
    parser.add_argument("--ring-owner", type=user, metavar="USER", help=text)


def add_topics(parser: argparse.ArgumentParser) -> None:
    """--topics, for commands that read a robot's bag."""
    text = "table of which topic is which column, for a bag of ordinary topics (docs/formats.md); needs --scene"
    parser.add_argument("--topics", type=Path, metavar="TABLE.TOML", help=text)


def add_zenoh_config(parser: argparse.ArgumentParser, endpoints: str = "are those given here") -> None:
    """--zenoh-config, for commands on the robot's network. `endpoints`: what becomes of theirs."""
    text = f"zenoh's own configuration (JSON5): TLS and access control, see docs/remote.md; endpoints {endpoints}"
    parser.add_argument("--zenoh-config", type=Path, metavar="FILE", help=text)


def user(text: str) -> int:
    """An argument's type: a user of this machine, by name or number; gives the id."""
    try:
        return pwd.getpwnam(text).pw_uid
    except (KeyError, ValueError):
        if text.isascii() and text.isdigit() and int(text) < NO_USER:
            return int(text)
    raise argparse.ArgumentTypeError(f"there is no user '{text}'; give a user's name or number")


def mcap_path(text: str) -> Path:
    """An argument's type: a recording or bag that is written."""
    if Path(text).suffix.lower() != ".mcap":
        raise argparse.ArgumentTypeError(f"'{text}' does not end in .mcap; a recording is an MCAP file")
    return Path(text)


def whole_number(least: int, most: int | None = None) -> Callable[[str], int]:
    """An argument's type: a whole number of at least `least`, at most `most`."""

    def whole_number_in_range(text: str) -> int:
        value = int(text) if text.isascii() and text.isdigit() else least - 1
        if value < least or (most is not None and value > most):
            bounds = f"of {least} or more" if most is None else f"from {least} to {most}"
            raise argparse.ArgumentTypeError(f"'{text}' is not a whole number {bounds}")
        return value

    return whole_number_in_range


def seconds(text: str) -> float:
    """An argument's type: a length of time, 0 included, at most a day."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value <= 86400.0:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of seconds from 0 to 86400")
    return value


def number_above(bound: float) -> Callable[[str], float]:
    """An argument's type: a finite number greater than `bound`."""

    def number(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and value > bound):
            raise argparse.ArgumentTypeError(f"'{text}' is not a number above {bound:g}")
        return value

    return number


def number_list(text: str) -> list[float]:
    """An argument's type: positive numbers, as in 90,100,110."""
    return [number_above(0.0)(part) for part in text.split(",")]


def lane_list(most: int) -> Callable[[str], list[int]]:
    """An argument's type: lanes such as 0,2,5-7, all below `most`."""

    def lanes(text: str) -> list[int]:
        found: list[int] = []
        for part in text.split(","):
            first, dash, last = part.partition("-")
            ends = [first, last if dash else first]
            if not all(end.isascii() and end.isdigit() and int(end) < most for end in ends):
                raise argparse.ArgumentTypeError(f"'{part}' is no lane; give lanes from 0 to {most - 1}, as in 0,2,5-7")
            found += range(int(ends[0]), int(ends[1]) + 1)
        return list(dict.fromkeys(found))

    return lanes
