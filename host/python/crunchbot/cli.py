"""The command line `whisker`: finds the subcommand, runs it, and turns what a person can mend into one line.

Subcommands live in `crunchbot.commands`, those of the laboratory in `crunchbot_lab.commands`; only the one that is called is
imported, so that help is quick.
"""

import argparse
import contextlib
import importlib
import sys
from types import ModuleType
from typing import Any

from . import __version__
from .arguments import Parser, actions_of, claim_outputs, is_path
from .ends import exit_code
from .errors import UserError
from .lab import import_lab

# name (its module has underscores for dashes): what it does
COMMANDS = {
    "try": "a minute of a robot in the browser, with a tour",
    "examples": "a small data set, with which every example works",
    "info": "what ring, daemon and bridge say of themselves",
    "top": "lanes, rates and losses in the terminal",
    "view": "traces, losses and health in a browser; the same as whisker-view",
    "doctor": "find out why it does not work",
    "calibrate": "measure rest and noise, record contacts at known distances",
    "bridge-sim": "a simulated bridge to try everything with",
    "flash": "load firmware into the nodes, or gateware into the bridge",
    "record": "write a ring to an MCAP file",
    "replay": "feed a ring from a recording, as the device would",
    "export": "a recording as CSV, Parquet or NWB",
    "stream": "print frames as CSV or JSON lines",
    "robot": "all processes of a robot, on hardware or simulated",
    "pilot": "the netbook's part of a robot: samples to wheel speeds and observations",
    "navigator": "pose and belief of a robot as its rows come, over the network",
    "mapper": "map and pose of a robot in an unknown arena as its rows come, over the network",
    "base": "a base that speaks ROS 2 in place of a Create, behind the same socket as whisker-base",
    "ros2": "a running robot as a node of ROS 2, by Zenoh or Cyclone DDS, without ROS: standard messages, frames, /initialpose",
    "foxglove": "a running robot in Foxglove: pose, belief, whiskers, map, health; a pose set there is obeyed",
    "bag": "record everything a robot's processes say, for ROS 2 tools",
    "pyro": "a robot's results as a Pyro object, the paper's interface",
    "localise": "where the robot was, row by row of a scene folder",
    "map": "a map of an unknown arena by touch alone, from the rows of a scene folder",
    "scene": "make scene folders for localise",
    "texture": "learn and classify floor surfaces",
    "radial": "learn and estimate the distance of contacts along a whisker",
}
# Commands that need more than numpy: the extra that installs it
EXTRAS = {
    **dict.fromkeys(("record", "replay"), "record"),
    **dict.fromkeys(("try", "view"), "view"),
    **dict.fromkeys(("robot", "pilot", "navigator", "mapper", "bag", "pyro", "top"), "robot"),
    "base": "cyclonedds",
    **{name: name for name in ("export", "ros2", "foxglove")},
    **dict.fromkeys(("localise", "map", "calibrate", "scene"), "scenes"),
}
PACKAGE_EXTRAS = {"cyclonedds": "cyclonedds"}  # of a package that only one way of a command needs
SHELLS = ("bash", "zsh", "tcsh")
PARTS = ("pilot", "navigator", "mapper", "bag")  # processes that `robot` starts: not in the list of --help
LAB_COMMANDS = ("bridge-sim", "scene")  # of the package crunchbot_lab
OTHER_PLACES = {"base": "robot.rosbase.command"}


def main(argv: list[str] | None = None) -> int:
    return exit_code("whisker", lambda: _run(sys.argv[1:] if argv is None else argv))


def _run(words: list[str]) -> int:
    try:
        return _run_command(words)
    except ModuleNotFoundError as error:
        command, package = next(iter(words), ""), (error.name or "").partition(".")[0]
        if command not in EXTRAS or package.startswith("crunchbot"):
            raise
        extra = PACKAGE_EXTRAS.get(package, EXTRAS[command])
        text = f"{command}: needs the package {package}; run: pip install 'crunchbot[{extra}]'"
        raise UserError(text) from error


def _run_command(words: list[str]) -> int:
    parser = parser_of(next(iter(words), ""))
    arguments = parser.parse_args(words)
    claim_outputs(parser, arguments)
    return arguments.run(arguments)


class PrintCompletion(argparse.Action):
    """Prints what a shell needs to complete the command line, by shtab, and ends."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: Any, shell: Any, option: str | None = None) -> None:
        import shtab

        whole = parser_of()
        for action in actions_of(whole):
            action.choices = action.choices or getattr(action, "values", None)
            if is_path(action):
                action.complete = shtab.FILE
        print(shtab.complete(whole, shell))
        parser.exit()


def parser_of(chosen: str | None = None) -> Parser:
    """The parser of the whole command line, with the arguments of the chosen subcommand only; None: of all whose packages
    are installed."""
    width = max(map(len, COMMANDS))
    listed = "\n".join(f"  {name:{width}}  {text}" for name, text in COMMANDS.items() if name not in PARTS)
    started = f"'whisker robot' starts {', '.join(PARTS)}; each has its own --help"
    purpose = "Whiskered robots: sensing, tactile perception, localisation by touch."
    parser = Parser(
        prog="whisker",
        usage="whisker [--version] [--print-completion SHELL] COMMAND ...",
        description=f"{purpose}\n\ncommands:\n{listed}\n\n{started}",
    )
    parser.show_example("whisker bridge-sim &  whisker top")
    parser.add_argument("--version", action="version", version=f"whisker {__version__}")
    text = f"print completion for a shell ({', '.join(SHELLS)}) and exit"
    parser.add_argument("--print-completion", action=PrintCompletion, choices=SHELLS, metavar="SHELL", help=text)
    hidden = None if chosen is None else argparse.SUPPRESS  # the list above is of them; shtab asks for an entry
    commands = parser.add_subparsers(prog="whisker", dest="command", required=True, metavar="COMMAND", help=hidden)
    for name, text in COMMANDS.items():
        command = commands.add_parser(name, help=text, description=text)
        if name == chosen:
            _fill(command, name)
        elif chosen is None:
            with contextlib.suppress(ModuleNotFoundError, UserError):
                _fill(command, name)
    return parser


def _fill(command: Parser, name: str) -> None:
    module = command_module(name)
    command.show_example(module.EXAMPLE)
    module.add(command)


def command_module(name: str) -> ModuleType:
    """The module of a subcommand. UserError for one of the laboratory where that package is not installed."""
    path = OTHER_PLACES.get(name, f"commands.{name.replace('-', '_')}")
    if name in LAB_COMMANDS:
        return import_lab(path, f"whisker {name}")
    return importlib.import_module(f".{path}", __package__)


if __name__ == "__main__":
    sys.exit(main())
