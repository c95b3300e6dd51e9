"""Every command line in a page is one that its program accepts: subcommand, options, their values, make targets.

test_page_runs.py runs those that need neither hardware nor a person, test_examples.py the examples of the help texts.
"""

import contextlib
import io
import os
import re
import shlex
import subprocess
from functools import cache
from pathlib import Path

import pytest

from crunchbot import cli
from crunchbot.arguments import Parser
from crunchbot.view.command import add as add_view

ROOT = Path(__file__).resolve().parents[2]
APPS = Path(os.environ.get("WHISKER_BUILD", ROOT / "build/release")).resolve() / "host/apps"
PAGES = sorted(
    ROOT / name
    for name in subprocess.run(
        ["git", "-C", ROOT, "ls-files", "*.md"], capture_output=True, text=True, check=True
    ).stdout.split()
    if not name.startswith(("protocol/gen", "CHANGELOG"))
)
NATIVE = ("whiskerd", "whisker-log", "whisker-flash", "whisker-base")
PROGRAMS = ("whisker", "whisker-view", "make", *NATIVE)
OPERATORS = {"|", "||", "&", "&&", ";", ">", ">>", "<", "2>&1", "2>"}


def code_of(page: Path) -> list[tuple[str, bool]]:
    """What may be commands: lines of code blocks (True), what stands three spaces to the right left out, and code within
    sentences (False), which may name a command without all of its arguments."""
    text = page.read_text()
    fenced = re.findall(r"```[a-z]*\n(.*?)```", text, re.DOTALL)
    rest = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    lines = [line.strip() for block in fenced for line in block.splitlines()]
    lines += [line.strip() for line in rest.splitlines() if line.startswith("    ")]
    blocks = [(re.split(r" {3,}", line.removeprefix("$ "))[0], True) for line in lines]
    return blocks + [(span, False) for span in re.findall(r"`([^`\n]+)`", rest)]


def commands_in(line: str) -> list[list[str]]:
    """The words of each command of PROGRAMS in a line of shell; synopses, with brackets or dots, are none."""
    line = re.sub(r"(^|\s)#.*", "", line)
    if re.search(r"\.\.\.|\[|<\w|\{|…", line):
        return []
    if re.fullmatch(r"whisker( \w+)+ \d+", line):  # the name of a file's format
        return []
    found, command = [], []
    try:
        words = shlex.split(re.sub(r"([;&|]+)", r" \1 ", line))
    except ValueError:
        return []
    for word in [*words, ";"]:
        if word in OPERATORS or word.startswith(("2>", ">")):
            found.append(command)
            command = []
        elif command or not (word == "sudo" or re.fullmatch(r"[A-Z_]+=\S*", word)):
            command.append(word)
    return [words for words in found if words and Path(words[0]).name in PROGRAMS and len(words) > 1]


ALL = sorted(
    {
        (str(page.relative_to(ROOT)), tuple(words), whole)
        for page in PAGES
        for line, whole in code_of(page)
        for words in commands_in(line)
    }
)


@cache
def help_of(program: str) -> str:
    return subprocess.run([APPS / program, "--help"], capture_output=True, text=True, check=True).stdout


@cache
def targets() -> dict[str, str]:
    """The Makefile's targets, with what their line says of variables."""
    return dict(re.findall(r"^([a-z-]+):[^=].*?(?:## (.*))?$", (ROOT / "Makefile").read_text(), re.MULTILINE))


def complaint(words: tuple[str, ...], whole: bool = True) -> str:
    """Why a program refuses these words; empty: it does not. whole: nothing that it needs may be missing."""
    program, *rest = words
    program = Path(program).name
    if program == "make":
        wrong = [word for word in rest if "=" not in word and word not in targets()]
        given = [word.partition("=")[0] for word in rest if "=" in word]
        known = (ROOT / "Makefile").read_text()
        return ", ".join(wrong + [name for name in given if not re.search(rf"\b{name}\b", known)])
    if program in NATIVE:
        wrong = [word for word in rest if word.startswith("--") and not re.search(rf"{word}\b", help_of(program))]
        return ", ".join(wrong)
    if rest == ["--help"] or rest == ["--version"] or rest[-1] == "--help":
        return ""
    output = io.StringIO()
    with contextlib.redirect_stderr(output), contextlib.redirect_stdout(output):
        try:
            if program == "whisker-view":
                parser = Parser(prog=program)
                add_view(parser)
                parser.parse_args(rest)
            else:
                cli.parser_of(rest[0]).parse_args(rest)
        except SystemExit as end:
            missing = re.search("arguments are required|expected (one|at least one) argument", output.getvalue())
            return output.getvalue() if end.code and (whole or not missing) else ""
    return ""


def test_pages_hold_commands():
    assert len(ALL) > 100
    assert {Path(words[0]).name for _, words, _ in ALL} == set(PROGRAMS)


@pytest.mark.parametrize(("page", "words", "whole"), ALL, ids=[f"{page}: {' '.join(words)}" for page, words, _ in ALL])
def test_a_command_in_a_page_is_accepted(page, words, whole):
    assert complaint(words, whole) == ""


def test_a_wrong_command_is_seen():
    assert complaint(("whisker", "record", "a.mcap", "--second", "3"))
    assert complaint(("whiskerd", "--rings", "a")) and complaint(("make", "demos"))
    assert commands_in("sudo make demo SEED=2 && whisker top --once  # a comment") == [
        ["make", "demo", "SEED=2"],
        ["whisker", "top", "--once"],
    ]
