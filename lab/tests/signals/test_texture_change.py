"""A whisker, a mount or a speed that is not the model's is named in one line; the right ones are not."""

import numpy as np
import pytest
from commandkit import run, signals_as_before  # noqa: F401 - a fixture
from known_drive import ROW_TICKS, floor_scene, wander

from crunchbot.cli import main
from crunchbot.touch.floor import WINDOW_SAMPLES, floor_whisker
from crunchbot.touch.texture import model as texture
from crunchbot.touch.texture.change import DRIVES, FASTER, GAINS, LEAST, LEVEL, LOOKS, TURNS, Passes, notice, student
from crunchbot.touch.texture.drive import Drive, Way, over_tiles, write
from crunchbot.touch.texture.spectral import Stream
from crunchbot_lab.signals.world import TICK_S

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


def driven(folder, scene, seed, seconds, speed_m_s=SPEED_M_S, change=lambda counts: counts):
    """A drive's recordings, put into FOLDER."""
    counts, poses, _ = wander(scene, seed, seconds, speed_m_s)
    drive = Drive(TICK_S * np.arange(1, len(counts) + 1), np.round(change(counts.astype(float))))
    way = Way(ROW_TICKS * TICK_S * np.arange(len(poses)), poses, np.zeros(len(poses)), np.zeros(len(poses)))
    write(folder, "drive", over_tiles(drive, way, dict(enumerate(scene.robot.whiskers)), scene.arena, 0.1), ("x", "y"))
    return folder


@pytest.fixture(scope="module")
def learnt(tmp_path_factory):
    folder = driven(tmp_path_factory.mktemp("drives") / "learnt", floor_scene(1), 1, 80.0)
    assert main(["texture", "train", str(folder), "--out", str(folder / "m.json")]) == 0
    return folder / "m.json"


@pytest.mark.parametrize("cause", CHANGES)
def test_what_is_not_the_models_is_named_and_what_is_the_models_is_not(capsys, tmp_path, learnt, cause):
    """On another drive, in another arena. Where the recordings do not hold their speed, it may show in the signal: the robot
    turns as it did in training."""
    folder = driven(tmp_path / "new", floor_scene(1, seed=5), 9, 60.0, **CHANGES[cause])
    assert texture.load(learnt).speed_m_s[1] < FASTER * 0.2
    capsys.readouterr()
    _, _, error = run(capsys, "texture", "classify", learnt, folder)
    named = [line.split(": ")[3] for line in error.splitlines()]
    assert set(named) == ({cause} if cause else set())
    for file in folder.glob("*/*.csv"):
        lines = file.read_text().splitlines()
        file.write_text("\n".join(line.rpartition(",")[0] for line in lines) + "\n")
    _, _, error = run(capsys, "texture", "classify", learnt, folder)
    named = {line.split(": ")[3] for line in error.splitlines()}
    assert named == ({cause} if cause else set()) or (cause == "speed" and not named)


def test_a_pilots_whisker_names_it_once_after_a_few_passes(learnt):
    model = texture.load(learnt)
    for change, cause in ((lambda x: x, ""), (lambda x: turned(x, 40.0), "mount")):
        counts = change(wander(floor_scene(1, seed=6), 8, 60.0, SPEED_M_S)[0][:, 0].astype(float))
        whisker = floor_whisker(model, np.random.default_rng(0))
        for n, window in enumerate(counts.reshape(-1, WINDOW_SAMPLES, 2)):
            whisker.look(window)
            assert n >= LOOKS[0] * LEAST or not whisker.changed
        assert whisker.changed.split(":")[0] == cause


def test_a_window_costs_a_pilot_one_judgement_and_one_for_each_cause_while_they_are_sought(monkeypatch, learnt):
    """A block of a pilot is 20 ms, and a judgement some 40 us."""
    judged, work = [], Stream.push
    monkeypatch.setattr(Stream, "push", lambda self, window: judged.append(self) or work(self, window))
    model = texture.load(learnt)
    counts = wander(floor_scene(1, seed=6), 8, 60.0, SPEED_M_S)[0][:, 0].astype(float)
    for change, most in ((lambda x: x, 1), (lambda x: turned(x, 40.0), 1 + len(GAINS) + len(TURNS))):
        whisker, each = floor_whisker(model, np.random.default_rng(0)), []
        for window in change(counts).reshape(-1, WINDOW_SAMPLES, 2):
            judged.clear()
            whisker.look(window)
            each.append(len(judged))
        assert max(each) == most and bool(whisker.changed) == (most > 1)
        assert not whisker.changed or each[-1] == 1


def test_few_passes_or_a_model_that_does_not_know_say_nothing(learnt):
    model = texture.load(learnt)
    counts = stiffer(wander(floor_scene(1), 8, 60.0, SPEED_M_S)[0][:, 0].astype(float), 2.0)
    drives = [counts[start : start + LEAST * WINDOW_SAMPLES] for start in range(0, len(counts), len(counts) // 12)]
    tiles = [f"c{n}r0" for n in range(len(drives))]
    assert notice(model, drives, tiles).startswith("whisker: ")
    assert not notice(model, drives[:5], tiles[:5])
    assert not notice(model, drives, ["c0r0"] * len(drives))  # one tile, however often
    model.passes = {}
    assert not notice(model, drives, tiles)


def test_of_drives_like_those_of_training_no_more_are_named_than_was_said():
    """Few places of a surface, distances of its own, drives that differ; 150 passes a drive."""
    rng, drives = np.random.default_rng(3), 2000
    named = 0
    for _ in range(drives):
        passes = Passes([np.expm1(rng.normal(k, 0.2, size=m)) for k, m in enumerate((5, 7, 4, 1), 1)])
        drive = rng.normal(0.0, DRIVES)
        looks = [passes.take(k, float(np.expm1(drive + rng.normal(k + 1, 0.2)))) for k in rng.integers(4, size=150)]
        named += any(look[1] for look in looks if look)
    assert 0 < named <= LEVEL * drives + 3.0 * np.sqrt(LEVEL * drives)
    far = Passes([np.expm1(rng.normal(k, 0.2, size=6)) for k in range(1, 4)])
    assert [look for n in range(6) if (look := far.take(n % 3, 9.0 * np.exp(n % 3 + 1)))] == [(True, True)]


@pytest.mark.parametrize(("chance", "freedom", "known"), [(0.05, 8, 1.860), (0.005, 8, 3.355), (0.005, 20, 2.845)])
def test_students_quantiles(chance, freedom, known):
    assert student(chance, freedom) == pytest.approx(known, rel=0.01)
