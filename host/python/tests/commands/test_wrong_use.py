"""Every command and subcommand, used wrongly in every way that its parser knows: one line, exit code 2."""

import argparse
from pathlib import Path

import pytest

from crunchbot.arguments import is_path
from crunchbot.cli import COMMANDS, main, parser_of

PLAIN = Path(__file__).parents[1] / "nav/cases/plain"
NO_INPUTS = {"ring", "robot", "connect", "listen", "router", "serial", "bridge", "allow_host", "allow_origin"}
NO_INPUTS |= {"filter", "set", "family", "socket", "base", "simulation", "others"}
# Of `view`: its page's records, and a bag's table. Of `flash`: it is of a Pico only. Looked for when they are needed: behind
# the ring, the port or the network.
LATE = {("view", "records"), ("flash", "uf2"), ("calibrate", "nodes"), ("pilot", "nodes"), ("robot", "port")}
LATE |= {("navigator", "checkpoint"), ("mapper", "journal"), ("robot", "out")}


def leaves(parser, words):
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            yield from (leaf for name, inner in action.choices.items() for leaf in leaves(inner, (*words, name)))
            return
    yield words, parser


def of_command(name):
    (commands,) = (a for a in parser_of(name)._actions if isinstance(a, argparse._SubParsersAction))
    return leaves(commands.choices[name], (name,))


LEAVES = dict(leaf for name in COMMANDS for leaf in of_command(name))


def named(action):
    return action.option_strings[-1:]


def needed(parser):
    return [a for a in parser._actions if a.required]


def wrong_words(words, parser):
    yield (*words, "--nosuch")
    if needed(parser):
        yield words
    for action in parser._actions:
        if not action.option_strings or action.nargs == 0:
            continue
        if action.nargs not in ("?", "*"):
            yield (*words, *named(action))
        if action.choices or action.type not in (Path, None):
            yield (*words, *named(action), "?")


def missing_inputs(words, parser, nowhere):
    """Each input in turn is not there; the others that are needed are, or are not there either."""
    for action in parser._actions:
        if not is_path(action) or hasattr(action, "own") or action.dest in NO_INPUTS or (words[0], action.dest) in LATE:
            continue
        given = [*words]
        for other in {*needed(parser), action}:
            place = nowhere if other is action or other.dest != "scene" else PLAIN
            given += [*named(other), place]
        yield given


def assert_refused(capfd, words):
    capfd.readouterr()
    code = main([str(word) for word in words])
    said = capfd.readouterr()
    assert (code, said.err.count("\n"), said.out) == (2, 1, ""), (words, said)


@pytest.mark.parametrize("words", LEAVES, ids=" ".join)
def test_wrong_words_are_one_line_and_exit_2(capfd, words):
    for wrong in wrong_words(words, LEAVES[words]):
        assert_refused(capfd, wrong)


@pytest.mark.parametrize("words", LEAVES, ids=" ".join)
def test_an_input_that_is_not_there_is_one_line_and_exit_2(capfd, tmp_path, words):
    for given in missing_inputs(words, LEAVES[words], tmp_path / "nosuch"):
        assert_refused(capfd, given)
