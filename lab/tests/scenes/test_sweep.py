"""The same bytes from any number of workers; what is done is not done again."""

import json

import pytest

from crunchbot_lab.scenes import trials
from crunchbot_lab.scenes.sweep import sweep

JOBS = {
    f"{name}-{seed}": {"family": "anchor+global", "seeds": [seed], "filter": name, "settings": {}, "rows": 120}
    for name in ("odometry", "foveal")
    for seed in (1, 2)
}


def untimed(results):
    for result in results.values():
        for one in result["trials"]:
            del one["timing"]
    return json.dumps(results, sort_keys=True)


@pytest.fixture(scope="module")
def in_turn(tmp_path_factory):
    return untimed(sweep(trials.trials, JOBS, tmp_path_factory.mktemp("serial"), 1))


@pytest.mark.parametrize("workers", [1, 2])
def test_processes_give_what_one_process_gives(workers, tmp_path, in_turn):
    assert untimed(sweep(trials.trials, JOBS, tmp_path, workers)) == in_turn


def count(mark):
    """A job that leaves a trace."""
    with open(mark, "a") as file:
        file.write("x")
    return {"mark": mark}


def fail(text):
    raise ValueError(text)


def test_what_is_done_is_not_done_again(tmp_path):
    jobs = {name: {"mark": str(tmp_path / name)} for name in ("a", "b")}
    sweep(count, {"a": jobs["a"]}, tmp_path / "out", 1)
    results = sweep(count, jobs, tmp_path / "out", 1)
    assert list(results) == ["a", "b"]
    assert [(tmp_path / name).read_text() for name in jobs] == ["x", "x"]


def test_a_failed_job_stops_the_sweep_and_leaves_no_file(tmp_path):
    with pytest.raises(ValueError, match="broken"):
        sweep(fail, {"a": {"text": "broken"}}, tmp_path, 1)
    assert list(tmp_path.iterdir()) == []
