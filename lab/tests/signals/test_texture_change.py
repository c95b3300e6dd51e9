"""A whisker, a mount or a speed that is not the model's is named in one line; the right ones are not."""

import numpy as np
import pytest
from commandkit import run, signals_as_before  # noqa: F401 - a fixture
from known_drive import floor_scene, record, wander, write_way

from crunchbot import scene as scenes
from crunchbot.cli import main
from crunchbot.touch.floor import CHANGE_WINDOWS, WINDOW_SAMPLES, floor_whisker
from crunchbot.touch.texture import model as texture
from crunchbot.touch.texture.change import FASTER, GAINS, TURNS, Watch, notice, windows_of
from crunchbot.touch.texture.classifier import Reducer
from crunchbot.touch.texture.novelty import of_one_in_a_thousand

SPEED_M_S = 0.15
REST = 32768


def turned(counts, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return REST + (counts - REST) @ np.array([[c, -s], [s, c]])


def stiffer(counts, gain):
    """In the static simulation tilts are proportional to deflections, and the plug's stiffness is the factor."""
    return REST + gain * (counts - REST)


CHANGES = {
    "": {},
    "whisker": {"change": lambda counts: stiffer(counts, 1.4)},
    "mount": {"change": lambda counts: turned(counts, 40.0)},
    "speed": {"speed_m_s": 0.27},
}


def added(folder, scene, seed, seconds, speed_m_s=SPEED_M_S, change=lambda counts: counts):
    """A drive's recordings, put into FOLDER/set."""
    counts, poses, _ = wander(scene, seed, seconds, speed_m_s)
    folder.mkdir()
    scenes.write(folder / "scene", scene)
    record(folder / "drive.mcap", np.round(change(counts.astype(float))).astype(np.uint16))
    write_way(folder / "way.csv", poses)
    command = "texture", "train", folder / "set", "--drive", folder / "drive.mcap", "--scene", folder / "scene"
    assert main([*map(str, command), "--way", str(folder / "way.csv"), "--out", str(folder / "m.json")]) == 0
    return folder


@pytest.fixture(scope="module")
def learnt(tmp_path_factory):
    return added(tmp_path_factory.mktemp("drives") / "learnt", floor_scene(1), 1, 80.0) / "m.json"


@pytest.mark.parametrize("cause", CHANGES)
def test_what_is_not_the_models_is_named_and_what_is_the_models_is_not(capsys, tmp_path, learnt, cause):
    """On another drive, in another arena. Where the recordings do not hold their speed, it shows in the signal."""
    folder = added(tmp_path / "new", floor_scene(1, seed=5), 9, 40.0, **CHANGES[cause]) / "set"
    assert texture.load(learnt).speed_m_s[1] < FASTER * 0.2
    capsys.readouterr()
    _, _, error = run(capsys, "texture", "classify", learnt, folder)
    named = [line.split(": ")[3] for line in error.splitlines()]
    assert set(named) == ({cause} if cause else set())
    for file in folder.glob("*/*.csv"):
        lines = file.read_text().splitlines()
        file.write_text("\n".join(line.rpartition(",")[0] for line in lines) + "\n")
    _, _, error = run(capsys, "texture", "classify", learnt, folder)
    assert {line.split(": ")[3] for line in error.splitlines()} == ({cause} if cause else set())


def test_a_pilots_whisker_names_it_once_after_a_few_seconds(learnt):
    model = texture.load(learnt)
    for change, cause in ((lambda x: x, ""), (lambda x: turned(x, 40.0), "mount")):
        counts = change(wander(floor_scene(1, seed=6), 8, 20.0, SPEED_M_S)[0][:, 0].astype(float))
        whisker = floor_whisker(model, np.random.default_rng(0))
        for n, window in enumerate(counts.reshape(-1, WINDOW_SAMPLES, 2)):
            whisker.look(window)
            assert n >= CHANGE_WINDOWS - 1 or not whisker.changed
        assert whisker.changed.split(":")[0] == cause


def test_a_window_costs_a_pilot_one_look_and_one_for_each_cause_while_they_are_sought(monkeypatch, learnt):
    """A block of a pilot is 20 ms; a look is 20 us of C. Windows thrown out together would be as many looks in one block."""
    looks, work = [], Reducer.features
    monkeypatch.setattr(Reducer, "features", lambda self, window: looks.append(self) or work(self, window))
    model = texture.load(learnt)
    counts = wander(floor_scene(1, seed=6), 8, 20.0, SPEED_M_S)[0][:, 0].astype(float)
    for change, most in ((lambda x: x, 1), (lambda x: turned(x, 40.0), 1 + len(GAINS) + len(TURNS))):
        whisker, each = floor_whisker(model, np.random.default_rng(0)), []
        for window in change(counts).reshape(-1, WINDOW_SAMPLES, 2):
            looks.clear()
            whisker.look(window)
            each.append(len(looks))
        assert max(each) == most and bool(whisker.changed) == (most > 1)
        assert not whisker.changed or each[-1] == 0


def test_a_watch_that_is_far_once_and_then_near_says_nothing(learnt):
    model = texture.load(learnt)
    near = windows_of(model, wander(floor_scene(1, seed=6), 8, 20.0, SPEED_M_S)[0][:, 0].astype(float))[:64]
    far, watch = np.array([turned(window, 40.0) for window in near]), Watch(model, len(near))
    for windows, named in ((far, ""), (near, ""), (far, ""), (far, "mount")):
        for window in windows:
            watch.take(window)
        assert watch.line.split(":")[0] == named


def test_few_windows_or_a_model_that_does_not_know_say_nothing(learnt):
    model = texture.load(learnt)
    counts = stiffer(wander(floor_scene(1), 8, 8.0, SPEED_M_S)[0][:, 0].astype(float), 2.0)
    windows = windows_of(model, counts)
    assert notice(model, windows).startswith("whisker: ") and not notice(model, windows[:31])
    model.novelty.drive = 0.0
    assert not notice(model, windows)


def test_a_limit_of_one_in_a_thousand_is_that():
    rng = np.random.default_rng(3)
    for count in (6, 20, 100):
        beyond = [np.exp(rng.normal()) > of_one_in_a_thousand(np.exp(rng.normal(size=count))) for _ in range(20_000)]
        assert np.mean(beyond) < 0.0025
    assert of_one_in_a_thousand(np.ones(2)) == 0.0
