"""A full disk behind standard output: one line and exit code 1 in every command that prints; a reader that goes ends it well."""

import os
import subprocess
import sys

import pytest
from commandkit import command, live_ring, signals_as_before  # noqa: F401 - a fixture
from folders import folder, recorded  # noqa: F401 - fixtures
from models import model
from patience import PATIENCE_S
from rings import make_frames
from whisks import write_whisks

from crunchbot.cli import COMMANDS, main
from crunchbot.ends import exit_code
from crunchbot.programs import program
from crunchbot.touch.radial.model import RadialModel
from crunchbot.view.__main__ import main as view

# ruff: noqa: F811 - fixtures are taken by their names

COMPLAINT = "standard output: No space left on device; make room there, or send it to another place\n"
PROGRAMS = ["whiskerd", "whisker-log", "whisker-flash", "whisker-base"]


@pytest.fixture
def into_full(monkeypatch, capsys):
    """Runs a program in this process with /dev/full behind its output; gives exit code and what it complains."""

    def run(program, *words):
        with open("/dev/full", "w") as full:
            monkeypatch.setattr("sys.stdout", full)
            code = program([str(word) for word in words])
            assert sys.stdout is full
        return code, capsys.readouterr().err

    return run


@pytest.mark.parametrize("name", COMMANDS)
def test_help_that_finds_no_room_is_one_line(into_full, name):
    assert into_full(main, name, "--help") == (1, f"whisker: {COMPLAINT}")


@pytest.mark.parametrize(
    "words", [["info"], ["info", "--json"], ["top", "--once"], ["stream", "--frames", "5", "--backlog"]]
)
def test_what_a_ring_reports_finds_no_room(into_full, words):
    with live_ring(make_frames(300)) as name:
        assert into_full(main, *words, "--ring", name) == (1, f"whisker: {COMPLAINT}")


@pytest.mark.parametrize("words", [[], ["--json"], ["--list-filters"], ["--list-settings"]])
def test_what_a_filter_reports_finds_no_room(into_full, folder, words):
    assert into_full(main, "localise", folder, "--filter", "odometry", *words) == (1, f"whisker: {COMPLAINT}")


def test_what_models_report_finds_no_room(into_full, tmp_path):
    model().save(tmp_path / "t.json")
    RadialModel(-0.011, 181.5, 2.5, 90.0, 138.0).save(tmp_path / "r.json")
    write_whisks(tmp_path / "w.csv", [500.0, 400.0], [90, 100])
    (tmp_path / "d.csv").write_text(
        "t_s,x,y\n" + "".join(f"{n / 2000},{100 + n % 7},{100 + n % 5}\n" for n in range(1000))
    )
    for words in (["texture", "classify", tmp_path / "t.json", tmp_path / "d.csv"],):
        assert into_full(main, *words) == (1, f"whisker: {COMPLAINT}")
    assert into_full(main, "radial", "predict", tmp_path / "r.json", tmp_path / "w.csv") == (1, f"whisker: {COMPLAINT}")


def test_a_page_whose_address_finds_no_room_is_not_served(into_full):
    assert into_full(view, "--port", "0") == (1, f"whisker-view: {COMPLAINT}")


def test_a_process_of_its_own_says_it_once():
    with open("/dev/full", "w") as full:
        done = subprocess.run(command("--help"), stdout=full, stderr=subprocess.PIPE, text=True, timeout=PATIENCE_S)
    assert (done.returncode, done.stderr) == (1, f"whisker: {COMPLAINT}")


def test_what_was_printed_before_the_work_comes_before_what_the_work_prints(monkeypatch, tmp_path):
    with open(tmp_path / "out.txt", "w") as out:
        monkeypatch.setattr("sys.stdout", out)
        print("first")
        assert exit_code("whisker", lambda: print("second") or 0) == 0
        print("third")
    assert (tmp_path / "out.txt").read_text() == "first\nsecond\nthird\n"


def test_a_reader_that_goes_is_no_fault():
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(command("--help"), stdout=writer, stderr=subprocess.PIPE, text=True, timeout=PATIENCE_S)
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("name", PROGRAMS)
def test_programs_whose_help_finds_no_room_say_so(name):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [program(name), "--help"], stdout=full, stderr=subprocess.PIPE, text=True, timeout=PATIENCE_S
        )
    assert (done.returncode, done.stderr) == (1, f"{name}: {COMPLAINT}")
