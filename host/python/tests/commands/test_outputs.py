"""What is written is whole or not there, over nothing that somebody may want: every output of the command line, found by its
parsers, is refused where something stands, and where a process ends or a disk fails, the old or the new is there."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import injector
import pytest
import writers
from commandkit import run, signals_as_before  # noqa: F401 - a fixture

from crunchbot import outputs
from crunchbot.arguments import actions_of, claim_outputs, is_path
from crunchbot.cli import COMMANDS, parser_of
from crunchbot.outputs import OutputError, claim, made, opened, put

TRIED_ELSEWHERE = {  # by what they share with those of writers.cases
    "bag file": "record file",
    "mapper --out": "map --out",
    "mapper --report": "navigator --report",
    "pilot --report": "navigator --report",
    "pilot --out": "navigator --out",
    "pilot --traces": "navigator --out",
    "scene from --out": "scene make --out",
}
# Every other argument that is a path, or may be one: what is read, or what only this run's process writes (its own tests: journal,
# checkpoint, run folder). An argument that is new is written down here, or is made by `add_output`.
INPUTS = {
    "base scene", "base --socket", "doctor --rest", "scene from --topics", "scene from --scene", "view --topics", "bridge-sim --fault", "bridge-sim --scene", "bag --scene", "bag --zenoh-config", "calibrate --nodes", "calibrate --scene",
    "export file", "flash image", "flash --uf2", "foxglove scene",  "foxglove --zenoh-config", "localise scene", "localise --map", "map scene",
    "mapper scene", "mapper --journal", "mapper --zenoh-config", "navigator scene", "navigator --checkpoint",
    "navigator --zenoh-config", "pilot scene", "pilot --models", "pilot --nodes", "pilot --base", "pilot --simulation",
    "pilot --zenoh-config", "pyro --zenoh-config", "radial fit contacts", "radial predict contacts", "radial predict model",
    "radial follow contacts", "radial follow model", "record --scene", "replay file", "robot scene", "robot --models", "robot --out",
    "robot --port", "robot --zenoh-config", "ros2 scene", "ros2 --zenoh-config", "scene from kind", "scene from recording",
    "scene map map", "scene map scene", "texture train folder", "texture train --drive", "texture train --scene", "texture train --way", "texture classify model", "texture classify recording",
    "top --scene", "view file", "view --records", "view --scene", "view --zenoh-config",
}  # fmt: skip
WORDS = {
    "KEY=VALUE",
    "PROCESS",
    "ENDPOINT",
    "ADDRESS",
    "ORIGIN",
    "tcp/HOST:PORT",
    "F",
    "LIST",
    "SHELL",
    "TEXT",
}  # metavars of no paths


def named(parser, name: str) -> dict[str, object]:
    """Actions by the words that lead to them."""
    found = {}
    for action in parser._actions:
        if action.__class__.__name__ == "_SubParsersAction":
            for word, inner in action.choices.items():
                found |= named(inner, f"{name} {word}")
        else:
            found[f"{name} {action.option_strings[0] if action.option_strings else action.dest}"] = action
    return found


ACTIONS = {}
for command in COMMANDS:
    chosen = parser_of(command)
    subparsers = next(action for action in chosen._actions if action.dest == "command")
    ACTIONS |= named(subparsers.choices[command], command)
OUTPUTS = {name for name, action in ACTIONS.items() if hasattr(action, "own")}


def test_every_path_of_the_command_line_is_known_as_an_input_or_an_output():
    paths = {name for name, a in ACTIONS.items() if is_path(a) and a.metavar not in WORDS}
    assert paths - OUTPUTS == INPUTS


def test_every_output_is_tried(tmp_path):
    tried = {case.option for case in writers.cases(tmp_path)}
    assert OUTPUTS - set(TRIED_ELSEWHERE) == tried - {"navigator --checkpoint"}
    assert set(TRIED_ELSEWHERE.values()) <= tried


@pytest.mark.parametrize("name", sorted(OUTPUTS))
def test_what_stands_there_is_refused_and_an_input_even_with_overwrite(tmp_path, name):
    """By the parsers alone, before any work."""
    *command, option = name.split()
    action, place, given = ACTIONS[name], tmp_path / "there", tmp_path / "input"
    if action.own is None:
        pytest.skip("a folder for files, each of which is claimed by itself")
    if action.own:
        place.mkdir()
    held = place / action.own[0].replace("*", "x") if action.own else place
    held.write_text("mine")
    chosen = parser_of(command[0])
    others = [o for n, o in ACTIONS.items() if n.split()[:-1] == command and is_path(o) and o.dest != action.dest]

    def refused(overwrite: bool, **inputs) -> str:
        arguments = chosen_arguments(chosen, command) | {action.dest: place, "overwrite": overwrite} | inputs
        with pytest.raises(OutputError) as error:
            claim_outputs(chosen, type("Arguments", (), arguments)())
        assert held.read_text() == "mine" and "\n" not in str(error.value) and str(place) in str(error.value)
        return str(error.value)

    assert "is there already; give --overwrite" in refused(False)
    (place / "not_ours.txt" if action.own else given).write_text("a person's")
    for other in others:
        if not hasattr(other, "own"):
            assert "which this command reads" in refused(True, **{other.dest: place})
            os.symlink(place, tmp_path / f"link-{other.dest}")
            assert "which this command reads" in refused(True, **{other.dest: [tmp_path / f"link-{other.dest}"]})
    if action.own and "*" not in action.own:
        assert "holds not_ours.txt" in refused(True)


def chosen_arguments(chosen, command) -> dict:
    """All arguments of a command as if none were given."""
    return {action.dest: None for action in actions_of(chosen)} | {"overwrite": False}


def test_a_command_that_is_refused_has_changed_nothing(capsys, tmp_path):
    for case in writers.cases(tmp_path):
        if case.call:
            continue
        place = tmp_path / "old" / case.out
        shutil.rmtree(tmp_path / "old", ignore_errors=True)
        place.parent.mkdir()
        case.old(place)
        before, option = case.seen(place), case.option.split()[-1]
        words = [*case.words, *([option] if option.startswith("--") else []), place]
        capsys.readouterr()
        code, out, err = run(capsys, *words)
        assert code == 2 and err.count("\n") == 1 and "is there already; give --overwrite" in err, (case.option, err)
        assert case.seen(place) == before and os.listdir(place.parent) == [place.name], case.option


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return injector.build(tmp_path_factory.mktemp("injector"))


def test_a_writer_that_ends_at_any_file_operation_leaves_the_old_or_the_new(library, tmp_path):
    done = subprocess.run(
        [sys.executable, writers.__file__, tmp_path],
        env=injector.environment(library) | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    found = [json.loads(line) for line in done.stdout.splitlines()]
    assert [line for each in found for line in each["lost"]] == []
    assert len(found) > 10 and all(each["operations"] >= 4 for each in found), found


def test_a_folder_changes_places_with_what_stood_there(tmp_path):
    own = ("a.toml", "*.csv")
    with made(tmp_path / "f", own=own) as place:
        assert not (tmp_path / "f").exists()
        place.mkdir()
        (place / "a.toml").write_text("1")
    (tmp_path / "f" / "more.csv").write_text("")
    with pytest.raises(OutputError, match="is there already"), made(tmp_path / "f", False, own):
        pass
    with pytest.raises(ZeroDivisionError), made(tmp_path / "f", own=own) as place:
        place.mkdir()
        (place / "a.toml").write_text(str(1 // 0))
    assert (tmp_path / "f" / "a.toml").read_text() == "1"
    with made(tmp_path / "f", True, own) as place:
        place.mkdir()
        (place / "a.toml").write_text("2")
        assert (tmp_path / "f" / "a.toml").read_text() == "1"
    assert {path.name for path in tmp_path.rglob("*")} == {"f", "a.toml"} and (tmp_path / "f/a.toml").read_text() == "2"
    (tmp_path / "f" / "notes.txt").write_text("a person's")
    with pytest.raises(OutputError, match="holds notes.txt"):
        claim(tmp_path / "f", True, own)
    for place, owned in ((tmp_path, own), (tmp_path / "f", ()), (tmp_path / "f/a.toml", own)):
        with pytest.raises(OutputError):
            claim(place, True, owned)


def test_where_folders_cannot_change_places_the_old_one_is_kept(monkeypatch, tmp_path):
    """As on file systems that know no exchange."""

    def refuse(*_):
        outputs.ctypes.set_errno(22)
        return -1

    monkeypatch.setattr(
        outputs.ctypes, "CDLL", lambda *_, **__: type("Library", (), {"renameat2": staticmethod(refuse)})
    )
    for text in ("1", "2"):
        with made(tmp_path / "f", True, ("a",)) as place:
            place.mkdir()
            (place / "a").write_text(text)
    assert (tmp_path / "f/a").read_text() == "2" and (tmp_path / "f-2/a").read_text() == "1"


def test_what_grows_has_its_name_at_once_and_what_it_replaces_until_it_is_whole(tmp_path):
    path = tmp_path / "a.csv"
    with opened(path) as file:
        print("1", file=file, flush=True)
        assert path.read_text() == "1\n"
    with pytest.raises(KeyboardInterrupt), opened(path, True) as file:
        print("2", file=file, flush=True)
        raise KeyboardInterrupt
    assert path.read_text() == "1\n" and (tmp_path / "a-2.csv").read_text() == "2\n"
    with opened(path, True) as file:
        print("3", file=file, flush=True)
        assert path.read_text() == "1\n"
    assert path.read_text() == "3\n" and len(list(tmp_path.iterdir())) == 2
    with opened("/dev/null") as file:
        print("nothing", file=file)


def test_a_link_stays_one_and_what_it_leads_to_is_replaced(tmp_path):
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    put(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "real").read_text() == "new"


def test_what_came_meanwhile_is_not_replaced(tmp_path):
    with pytest.raises(OutputError, match="is there already"), made(tmp_path / "a", False) as place:
        place.write_text("mine")
        (tmp_path / "a").write_text("another's")
    assert (tmp_path / "a").read_text() == "another's" and os.listdir(tmp_path) == ["a"]


def test_a_pipe_is_no_file_to_read(capsys, tmp_path):
    """It would be waited for without an end."""
    os.mkfifo(tmp_path / "pipe")
    for words in (
        ["radial", "predict", tmp_path / "pipe", tmp_path / "pipe"],
        ["texture", "classify", tmp_path / "pipe", tmp_path / "pipe"],
        ["localise", Path(tmp_path), "--map", tmp_path / "pipe"],
        ["replay", tmp_path / "pipe"],
        ["view", tmp_path / "pipe"],
        ["robot", "--simulated", "--zenoh-config", tmp_path / "pipe"],
        ["calibrate", "--lane", "0", "--radii", "90", "--nodes", tmp_path / "pipe", "--out", tmp_path / "c"],
    ):
        code, _, err = run(capsys, *words)
        assert code == 2 and "no regular file" in err and err.count("\n") == 1, err


def test_brackets_without_end_do_not_end_the_process(capsys, tmp_path):
    """zenoh's parser calls itself for each."""
    (tmp_path / "deep.json5").write_text("[" * 100_000)
    code, _, err = run(capsys, "robot", "--simulated", "--zenoh-config", tmp_path / "deep.json5")
    assert code == 2 and "brackets within more than 64 others" in err and err.count("\n") == 1
