"""Models are copied for the same robot and seed, and for nothing else; a cache that cannot be written costs nothing."""

import dataclasses

import pytest

from crunchbot_lab.demo import kept_models, training
from crunchbot_lab.simulation.scenes import make_scene

SCENE = make_scene(1)[0]


@pytest.fixture
def learnt(monkeypatch, tmp_path):
    """What was learnt, in order; the cache is this test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    calls = []

    def learn(folder, scene, seed, progress):
        calls.append(seed)
        folder.mkdir()
        (folder / "texture.json").write_text(f"model {len(calls)}")
        (folder / "radial").mkdir()  # recordings are not kept
        progress()

    monkeypatch.setattr(training, "learn", learn)
    return calls


def test_the_second_run_copies(learnt, tmp_path):
    done = []
    texts = [kept_models.learn_or_copy(tmp_path / n, SCENE, 1, lambda: done.append(1)) for n in ("a", "b")]
    assert learnt == [1] and len(done) == 2
    assert texts[0].startswith("kept in ") and texts[1].startswith("copied from ")
    assert (tmp_path / "b/texture.json").read_text() == "model 1"
    assert [path.name for path in (tmp_path / "b").iterdir()] == ["texture.json"]


def test_another_seed_scene_or_program_learns_its_own(learnt, monkeypatch, tmp_path):
    other = dataclasses.replace(SCENE, robot=dataclasses.replace(SCENE.robot, whiskers=SCENE.robot.whiskers[:-1]))
    kept_models.learn_or_copy(tmp_path / "a", SCENE, 1, lambda: None)
    kept_models.learn_or_copy(tmp_path / "b", SCENE, 2, lambda: None)
    kept_models.learn_or_copy(tmp_path / "c", other, 1, lambda: None)
    monkeypatch.setattr(kept_models, "_programs", lambda: b"changed")
    kept_models.learn_or_copy(tmp_path / "d", SCENE, 1, lambda: None)
    assert learnt == [1, 2, 1, 1]


def test_a_cache_that_cannot_be_written_is_reported_and_the_models_are_there(learnt, tmp_path):
    (tmp_path / "cache").write_text("a file")
    text = kept_models.learn_or_copy(tmp_path / "a", SCENE, 1, lambda: None)
    assert text.startswith("not kept for the next run: ") and "Not a directory" in text
    assert (tmp_path / "a/texture.json").exists()


def test_a_relative_cache_is_not_used(monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", "here")
    assert kept_models.cache_folder().is_absolute()
