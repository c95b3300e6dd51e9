"""Sixty mistakes of a beginner: each is one line with the remedy, and an exit code of its own."""

import argparse
import os
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

from crunchbot.cli import parser_of

PATIENCE_S = 60.0
APPS = Path(os.environ.get("WHISKER_BUILD", "build/release")).resolve() / "host/apps"
# What is typed, and what the line says: the thing that is wrong, then the remedy.
MISTAKES = {
    "whisker": ("COMMAND", "see 'whisker --help'"),
    "whisker localize examples/scene": ("invalid choice: 'localize'", "see 'whisker --help'"),
    "whisker examples": ("examples: is there already", "give --overwrite, or another name"),
    "whisker localise": ("no scene folder given", "name one, or use --list-filters"),
    "whisker localise nosuch": ("nosuch: no such folder", "give a scene folder"),
    "whisker localise examples": ("examples/arena.toml: cannot be read", "a scene folder needs it"),
    "whisker localise examples/drive.mcap": ("no such folder", "whisker scene from examples/drive.mcap --out SCENE"),
    "whisker localise examples/scene --filter kalman": ("filter 'kalman' is unknown", "choose one of odometry, "),
    "whisker localise examples/scene --filter grid --set grid.cell_m=2": (
        "outside 0 to 1",
        "choose a value inside",
    ),
    "whisker localise examples/scene --filter grid --set cell=0.1": (
        "cell: no such setting",
        "did you mean grid.cell_m?",
    ),
    "whisker localise examples/scene --set grid.cell_m": ("not KEY=NUMBER", "as in grid.cell_m=0.05"),
    "whisker localise examples/scene --out nosuch/est.csv": ("nosuch/est.csv: cannot be written", "choose another"),
    "whisker texture train nosuch --out m.json": ("nosuch: no such folder", "give one with a folder per surface"),
    "whisker texture train examples --out m.json": ("'surfaces' holds no CSV", "give each surface a folder"),
    "whisker texture train examples/surfaces": ("required: --out", "see 'whisker texture train --help'"),
    "whisker texture classify nosuch.json a.csv": ("nosuch.json: ", "make one with 'whisker texture train'"),
    "whisker texture classify examples/radial.json a.csv": (
        "no texture model",
        "make one with 'whisker texture train'",
    ),
    "whisker texture classify examples/drive.mcap a.csv": ("not a text file", "make one with 'whisker texture train'"),
    "whisker texture classify examples/texture.json nosuch.csv": ("nosuch.csv: cannot be read", "give a readable CSV"),
    "whisker texture classify examples/texture.json a.csv --window-ms 0": ("'0' is not a number above 0", "--help"),
    "whisker radial fit nosuch.csv --out m.json": ("nosuch.csv: cannot be read", "give a readable CSV"),
    "whisker radial fit examples/surfaces/ROUGH/1.csv --out m.json": ("'contact' is missing", "add it to the header"),
    "whisker radial predict examples/texture.json a.csv": ("no radial model", "make one with 'whisker radial fit'"),
    "whisker scene make --seed 1": ("needs --family and --out", "see --list-families"),
    "whisker scene make --family ancor --seed 1 --out s": ("family 'ancor' is unknown", "the names are anchor, "),
    "whisker scene make --family anchor+nap --seed 1 --out s": ("no modifier 'nap'", "the names are global, "),
    "whisker scene make --family anchor --seed -1 --out s": ("'-1' is not a whole number of 0 or more", "--help"),
    "whisker scene from nosuch --out s": ("no recording with observation rows", "give the folder of a run"),
    "whisker scene from examples/drive.mcap --out s": ("of no robot", "for ordinary topics give --topics"),
    "whisker scene map examples/scene examples/home.pgm --out s": ("not a text file", "give a map server's YAML"),
    "whisker info --ring nosuch": ("there is no ring of this name", "start whiskerd with this --ring"),
    "whisker record": ("required: FILE.MCAP", "see 'whisker record --help'"),
    "whisker record mine.mcap --ring nosuch": ("there is no ring", "start whiskerd with this --ring"),
    "whisker replay nosuch.mcap": ("nosuch.mcap: cannot be read", "give a recording made by 'whisker record'"),
    "whisker replay examples/contacts.csv": ("not an MCAP file", "give a file of 'whisker record'"),
    "whisker replay examples/drive.mcap --speed fast": ("'fast' is not a number above 0", "--help"),
    "whisker calibrate --out cal --lane 99": ("'99' is not a whole number from 0 to 27", "--help"),
    "whisker view --port 99999": ("'99999' is not a whole number from 0 to 65535", "--help"),
    "whisker flash": ("required: IMAGE", "see 'whisker flash --help'"),
    "whisker flash nosuch.whex": ("nosuch.whex: cannot be read", "check the name, or make it"),
    "whisker flash examples/texture.json": ("no firmware image", "build it again"),
    "whisker flash examples/node.whex": ("no bridge is connected", "plug it in; check its power and cable"),
    "whisker bridge-sim --lanes 40": ("'40' is not a whole number from 1 to 28", "--help"),
    "whisker bridge-sim --fault nosuch.toml": ("nosuch.toml: cannot be read", "give a TOML file of [[fault]] tables"),
    "whisker robot": ("no SCENE or no --models", "give both, or --simulated"),
    "whisker robot nosuch --models examples": ("nosuch: no such folder", "give a scene folder"),
    "whisker robot --simulated --first-port 70000": ("'70000' is not a whole number", "--help"),
    "whisker pilot nosuch --models examples --base b": ("nosuch: no such folder", "give a scene folder"),
    "whisker navigator examples/scene --connect netbook": ("'netbook': not an endpoint", "give tcp/HOST:PORT"),
    "whisker bag run.mcap --scene nosuch": ("nosuch: no such folder", "give a scene folder"),
    "whisker localise examples/scene --filters grid": (
        "--filters",
        "did you mean --filter?; see 'whisker localise --help'",
    ),
    "whisker try --prot 80": ("unrecognized arguments: --prot", "see 'whisker try --help'"),
    "whisker --completion bash": ("unrecognized arguments: --completion", "did you mean --print-completion?"),
    "whisker robot --simulated --level gates": ("invalid choice: 'gates'", "choose from "),
    "whisker robot --simulated --listen nohost": ("nohost: ", "give an address of this machine"),
    "whisker robot --simulated --listen 192.0.2.1": ("192.0.2.1: ", "give an address of this machine"),
    "whisker bag run.txt": ("'run.txt' does not end in .mcap", "a recording is an MCAP file"),
    "whisker record run.csv": ("'run.csv' does not end in .mcap", "a recording is an MCAP file"),
    "whisker localise examples/scene --seed one": ("'one' is not a whole number", "--help"),
    "whisker flash examples/node.whex --lane left": ("'left' is not a whole number from 0 to 27", "--help"),
    "whiskerd": ("--ring NAME is missing", "see whiskerd --help"),
    "whiskerd --ring a/b": ("the name of a ring", "use letters, digits, dash and dot"),
    "whiskerd --serial": ("its value is missing", "see whiskerd --help"),
    "whiskerd --colour": ("no such option", "see whiskerd --help"),
    "whisker-log --lanes 40": ("--lanes 40", "give a whole number from 1 to 28"),
    "whisker-base --port /dev/nosuch --socket b.sock": ("there is no such port", "plug the adapter in"),
    "whisker-flash": ("one image", "see --help"),
}


def attempt(words: list[str], place: Path) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "crunchbot.cli"] if words[0] == "whisker" else [APPS / words[0]]
    given = {"cwd": place, "capture_output": True, "text": True, "timeout": PATIENCE_S}
    return subprocess.run([*command, *words[1:]], stdin=subprocess.DEVNULL, **given)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("place")
    assert attempt(["whisker", "examples"], folder).returncode == 0
    return folder


def test_there_are_sixty():
    assert len(MISTAKES) >= 60


@pytest.mark.parametrize("line", MISTAKES)
def test_a_mistake_is_one_line_with_its_remedy(place, line):
    done = attempt(line.split(), place)
    wrong, remedy = MISTAKES[line]
    assert done.returncode in (1, 2), done.stdout
    assert re.fullmatch(r"whisker[a-z-]*( [a-z-]+)*: .*\n", done.stderr), done.stderr
    assert wrong in done.stderr and remedy in done.stderr[done.stderr.index(wrong) + len(wrong) :], done.stderr


OF_A_KIND = {  # what one option word takes in different commands, where it cannot be the same
    "--out": "a folder, or a file of one format",
    "--port": "of the base, or of TCP",
    "--lanes": "how many, or which",
    "--drive": "of bridge-sim: how it moves; of texture train: a recording",
    "--base": "of robot: which kind; of pilot: its socket",
    "--listen": "of robot: an address for all its processes",
    "--serial": "of a bridge, which is a text, or of a node",
    "file": "a recording, or a bag",
}


def parsers(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                yield from parsers(inner)


def test_arguments_are_described_in_one_style():
    no_argument = (argparse._HelpAction, argparse._SubParsersAction, argparse._VersionAction)
    named = defaultdict(set)
    for parser in parsers(parser_of()):
        for action in parser._actions:
            if isinstance(action, no_argument):
                continue
            word = (action.option_strings or [action.dest])[0]
            where, text = f"{parser.prog} {word}", action.help or ""
            assert text and not text.endswith("."), f"{where}: says nothing, or ends in a stop"
            assert "default" not in re.sub(r"\(default: [^)]+\)", "", text), f"{where}: default beside '(default: X)'"
            if action.nargs == 0:
                continue
            metavar = action.metavar or (None if action.choices else action.dest.upper())
            assert action.choices or not action.option_strings or action.metavar, f"{where}: has no metavariable"
            assert metavar is None or metavar == metavar.upper(), f"{where}: {metavar} is not in capitals"
            assert action.type not in (int, float), f"{where}: takes any number; give it a type with a range"
            named[word].add(metavar)
    differ = {word for word, metavars in named.items() if len(metavars) > 1}
    assert differ == set(OF_A_KIND)
