"""Ctrl-C, for every command that takes longer than a moment: it ends, with the exit code of the pages, and says nothing of
how it is made."""

import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from importlib.resources import files

import pytest
import writers
from patience import PATIENCE_S
from rings import ring_name
from rosbasekit import scene_folder

from crunchbot.cli import COMMANDS

BAG = files("crunchbot") / "data/first_minute.mcap"

# A function of the command says that it is called; one that works does so again and again, so that the signal comes while
# it does, however fast the machine is.
STARTER = """
import importlib, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # as a terminal starts it
module, name, again = sys.argv[1:4]
module = importlib.import_module(module)
real = getattr(module, name)

def called(*words, **named):
    if again:
        print("called", file=sys.stderr, flush=True)
    while again:
        real(*words, **named)
    made = real(*words, **named)
    print("called", file=sys.stderr, flush=True)
    return made

setattr(module, name, called)
from crunchbot.cli import main
sys.exit(main(sys.argv[4:]))
"""


@dataclass(frozen=True)
class Case:
    """where: a function, in the module by whose name it is called. again: it is the work; else what the work is behind."""

    words: tuple
    where: str
    again: bool = True


LAB, COMMANDS_OF = "crunchbot_lab.", "crunchbot.commands."


def working(folder) -> dict[str, Case]:
    s, contacts = folder / "s", folder / "w.csv"
    surface = ("texture", "classify", folder / "models/texture.json")
    post = (next(p for p in (folder / "models").iterdir() if p.stem != "texture"), contacts)
    return {
        "localise": Case(("localise", s, "--filter", "odometry"), "crunchbot.nav.localise:run"),
        "map": Case(("map", s, "--json", "--out", folder / "m"), "crunchbot.nav.mapping:run"),
        "scene make": Case(("scene", "make", "--family", "anchor", "--out", folder / "f"), f"{LAB}scenes:make"),
        "scene map": Case(
            ("scene", "map", s, folder / "map.yaml", "--out", folder / "g"), f"{LAB}commands.scene:read_observations"
        ),
        "scene from": Case(("scene", "from", BAG, "--out", folder / "h"), f"{LAB}scenes:read_recording"),
        "texture train": Case(
            ("texture", "train", folder / "d", "--out", folder / "t.json"),
            "crunchbot.touch.texture.model:read_training",
        ),
        "texture classify": Case((*surface, folder / "d/A/1.csv"), f"{COMMANDS_OF}texture:decisions"),
        "radial fit": Case(
            ("radial", "fit", contacts, "--model", "paper", "--out", folder / "p2.json"),
            "crunchbot.touch.radial.model:read_whisks",
        ),
        "radial predict": Case(("radial", "predict", *post), "crunchbot.touch.radial.model:load"),
        "radial follow": Case(("radial", "follow", *post), "crunchbot.touch.radial.model:load"),
        "export": Case(("export", folder / "r.mcap", folder / "x.csv"), f"{COMMANDS_OF}export:read"),
        "examples": Case(("examples", folder / "ex"), f"{COMMANDS_OF}examples:_held"),
        "doctor": Case(("doctor", "--ring", ring_name()), "crunchbot.bridge.doctor:examine"),
        **{
            name: Case(
                (name, *out, "--ring", ring_name(), "--wait", 3600), f"{COMMANDS_OF}{name}:stop_on_signals", again=False
            )
            for name, out in (("top", ()), ("record", (folder / "n.mcap",)), ("stream", ()))
        },
        "calibrate": Case(
            ("calibrate", "--ring", ring_name(), "--out", folder / "c", "--wait", 3600),
            f"{COMMANDS_OF}calibrate:claim",
            again=False,
        ),
    }


def serving(folder) -> dict[str, Case]:
    """Commands that Ctrl-C is the end of: what they have done is then whole."""
    s, ring = folder / "s", ring_name()
    alone = ("--connect", "none", "--listen", "none")
    words = {
        "replay": ("replay", folder / "r.mcap", "--ring", ring, "--speed", "0.001"),
        "navigator": ("navigator", s, *alone),
        "mapper": ("mapper", s, *alone),
        "bag": ("bag", folder / "b.mcap", *alone),
        "pyro": ("pyro", "--port", 0, *alone),
        "foxglove": ("foxglove", s, "--port", 0, *alone),
        "ros2": ("ros2", s, *alone),
    }
    cases = {name: Case(given, f"{COMMANDS_OF}{name}:stop_on_signals", again=False) for name, given in words.items()}
    base = ("base", scene_folder(folder / ring), "--socket", folder / "base.sock")
    cases["base"] = Case(base, "crunchbot.robot.rosbase.command:stop_on_signals", again=False)
    return cases | {"view": Case(("view", "--port", 0), "crunchbot.view.command:listen", again=False)}


WORKING = (
    "localise", "map", "scene make", "scene map", "scene from", "texture train", "texture classify", "radial fit",
    "radial predict", "radial follow", "export", "examples", "doctor", "calibrate", "top", "record", "stream",
)  # fmt: skip
SERVING = ("replay", "navigator", "mapper", "bag", "pyro", "foxglove", "ros2", "base", "view")
TRIED_WITH_A_ROBOT = {"robot", "bridge-sim", "pilot", "try"}  # by tests of their own
MOMENT = {"flash", "info"}  # one starts a program and waits for that, the other looks once


def test_every_command_is_tried():
    tried = {name.split()[0] for name in (*WORKING, *SERVING)}
    assert tried | TRIED_WITH_A_ROBOT | MOMENT == set(COMMANDS)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("inputs")
    writers.cases(made)
    return made


def ended(case: Case) -> tuple[int, str]:
    """Exit code, and what was said after the signal."""
    module, name = case.where.split(":")
    again = "again" if case.again else ""
    command = [sys.executable, "-c", STARTER, module, name, again, *map(str, case.words)]
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=os.environ | {"COLUMNS": "80"}
    )
    try:
        said = ""
        while "called" not in said:
            line = process.stderr.readline()
            assert line, (process.wait(), said)
            said += line
        process.send_signal(signal.SIGINT)
        return process.wait(PATIENCE_S), process.stderr.read()
    finally:
        process.kill()


@pytest.mark.parametrize("name", WORKING)
def test_work_that_is_interrupted_ends_at_once_and_says_so_by_its_exit_code(folder, name):
    code, said = ended(working(folder)[name])
    assert (code, "Traceback" in said) == (130, False), said


@pytest.mark.parametrize("name", SERVING)
def test_what_goes_on_until_it_is_stopped_ends_well(folder, name):
    code, said = ended(serving(folder)[name])
    assert (code, "Traceback" in said) == (0, False), said


# What is deleted here gets the signal while it is, where Python drops what the handler raises.
DROPPED = """
import signal, sys, threading
from crunchbot.ends import exit_code
signal.signal(signal.SIGINT, signal.default_int_handler)  # as a terminal starts it

class Deleted:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)

def work():
    Deleted()
    threading.Event().wait(float(sys.argv[1]))
    return 0

sys.exit(exit_code("test", work))
"""


def test_an_interrupt_of_a_destructor_is_obeyed():
    done = subprocess.run([sys.executable, "-c", DROPPED, str(PATIENCE_S)], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")
