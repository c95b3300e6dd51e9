"""What the programs say of themselves: those in C by the --help that their table of options prints, those in Python by
their argparse parsers. Manual pages and completion are made of this and of nothing else."""

import argparse
import os
import re
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

from crunchbot import cli
from crunchbot.arguments import Parser
from crunchbot.view import __main__ as view

IN_C = ("whiskerd", "whisker-base", "whisker-flash", "whisker-log", "whisker-bridge-sim", "whisker-create-sim")
OPTION = re.compile(r"  (--[\w-]+)(?: (\S+))?(?:  +| (?=\S))(.*)")
PLACE = re.compile(
    r"FILE|PATH|DIR|FOLDER|SCENE|BAG|IMAGE|FLAT|\.\w+$|^folder$|^recording$|^contacts$|^model$", re.IGNORECASE
)
HELP = "this text"


@dataclass
class Option:
    """An option, or with a name that has no dashes a positional argument."""

    name: str
    value: str = ""  # what stands for its value; empty: it takes none
    text: str = ""
    choices: tuple[str, ...] = ()

    @property
    def is_place(self) -> bool:
        """Whether its value is a file or a folder."""
        return not self.choices and bool(PLACE.search(self.value or self.name))


@dataclass
class Program:
    """A program, or one of its commands."""

    name: str  # of a command: with the words before it
    usage: str
    summary: str  # one line
    description: str = ""
    options: list[Option] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)  # lines
    examples: list[str] = field(default_factory=list)  # lines
    commands: list["Program"] = field(default_factory=list)

    def walk(self) -> list["Program"]:
        """This one and all commands below it, in order."""
        return [self, *(one for command in self.commands for one in command.walk())]


def all_programs(build: Path) -> list[Program]:
    """Every program, by name; those in C as built below `build`."""
    made = [from_help(name, help_of(build, name)) for name in IN_C]
    return sorted([*made, whisker(), from_parser(view.parser())], key=lambda program: program.name)


def help_of(build: Path, name: str) -> str:
    """What --help prints."""
    path = next(p for p in sorted(build.rglob(name)) if p.is_file() and os.access(p, os.X_OK))
    return subprocess.run([path, "--help"], capture_output=True, text=True, check=True).stdout


def from_help(name: str, text: str) -> Program:
    """A program in C from its help: usage and description, options, notes with examples."""
    lines = text.splitlines()
    first = next(n for n, line in enumerate(lines) if line.startswith("  --"))
    last = next(n for n, line in enumerate(lines) if OPTION.match(line) and line.endswith(HELP))
    end = next((n for n, line in enumerate(lines[:first]) if n and line[:1] not in (" ", "")), first)
    usage = "\n".join(line.removeprefix("Usage:").removeprefix("usage:").strip() for line in lines[:end] if line)
    said = " ".join(" ".join(lines[end:first]).split())
    program = Program(name, usage, said.partition(". ")[0].rstrip("."), said)
    for line in lines[first : last + 1]:
        if found := OPTION.match(line):
            value = found[2] or ""
            choices = tuple(value.split("|")) if "|" in value else ()
            program.options.append(Option(found[1], value, found[3].strip(), choices))
        else:
            program.options[-1].text += " " + line.strip()
    _take_notes(program, lines[last + 1 :])
    return program


def _take_notes(program: Program, lines: list[str]) -> None:
    """Examples are apart, each with what is indented below it."""
    in_example = False
    for line in lines:
        in_example = line.lower().startswith("example:") or (in_example and line.startswith(" "))
        text = line.partition(":")[2].strip() if line.lower().startswith("example:") else line.rstrip()
        (program.examples if in_example else program.notes).append(text)


def whisker() -> Program:
    """The command line `whisker` with all its commands."""
    program = from_parser(cli.parser_of(""))
    program.description = program.description.partition("\n")[0]
    program.commands = []
    for name, text in cli.COMMANDS.items():
        parser = cli.parser_of(name)
        chosen = next(a for a in parser._actions if isinstance(a, argparse._SubParsersAction)).choices[name]
        command = from_parser(chosen)
        command.summary = text
        program.commands.append(command)
    return program


def from_parser(parser: Parser) -> Program:
    """A program in Python, and its commands, from its parser."""
    said = parser.description or ""
    usage = re.sub(r"\s+", " ", parser.format_usage().removeprefix("usage: ")).strip()
    summary = " ".join(said.split("\n\n")[0].split())
    program = Program(parser.prog, usage, summary.partition(". ")[0].rstrip("."), said)
    formatter = parser._get_formatter()
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            program.commands = [from_parser(one) for one in action.choices.values()]
        elif action.help != argparse.SUPPRESS:
            program.options += _options(
                action, " ".join((formatter._expand_help(action) if action.help else "").split())
            )
    program.examples = [line.strip() for line in (parser.epilog or "").splitlines()[1:]]
    return program


def _options(action: argparse.Action, text: str) -> list[Option]:
    """One for each of an action's names."""
    choices = tuple(map(str, action.choices or ()))
    value = "" if action.nargs == 0 else str(action.metavar or "|".join(choices) or action.dest.upper())
    if not action.option_strings:
        return [Option(str(action.metavar or action.dest), "", text, choices)]
    return [Option(name, value, text, choices) for name in action.option_strings]
