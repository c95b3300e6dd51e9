"""`whisker bench touch`: an engine's CSV scored on a scene of the list, on a log in the user's folder, peers beside."""

import json

import pytest
from commandkit import run
from thymiologs import write_published

from crunchbot.nav.observations import observations_path, read_observations
from crunchbot.scene import load
from crunchbot_lab.scenes import benchmark

ROWS = 30


@pytest.fixture
def logs(tmp_path):
    """A folder with a Thymio's log of few rows."""
    write_published(tmp_path / "data/thymio/random_1", ROWS)
    return tmp_path / "data"


def test_a_scene_of_the_list_is_written_and_an_estimate_of_it_scored(tmp_path, capsys):
    out, peers, chart, est = (tmp_path / name for name in ("scene", "peers.json", "chart.svg", "est.csv"))
    assert run(capsys, "bench", "touch", "--scene", "anchor", "--out", out)[0] == 0
    rows = read_observations(observations_path(out), load(out))
    lines = [f"{x + 0.02:.6f},{y},{theta},0.5" for x, y, theta in rows.truth]
    est.write_text("\n".join(["x_m,y_m,theta_rad,confidence", *lines]) + "\n")
    peers.write_text(json.dumps({"anchor": [{"engine": "theirs", "near_share": 0.5}]}))
    words = ("bench", "touch", "--estimate", est, "--peers", peers)
    code, reported, error = run(capsys, *words, "--scene", "anchor", "--json", "--chart", chart)
    assert (code, error) == (0, "") and "svg" in chart.read_text()
    mine, theirs = json.loads(reported)["scores"]
    assert mine["error_median_m"] == pytest.approx(0.02) and mine["brier"] == 0.25 and theirs["near_share"] == 0.5
    lines = run(capsys, *words, "--scene", "anchor")[1].splitlines()
    assert lines[1].startswith("est") and lines[2].startswith("theirs")
    assert json.loads(run(capsys, *words, "--scene", out, "--json")[1])["scores"] == [mine]


def test_a_log_is_read_from_the_users_folder_with_what_was_published(logs, capsys):
    for data in (logs, logs / "thymio"):
        words = ("bench", "touch", "--scene", "thymio/random_1", "--data", data, "--filter", "odometry", "--json")
        code, reported, error = run(capsys, *words)
        assert (code, error) == (0, "")
        mine, theirs = json.loads(reported)["scores"][:2]
        assert mine["rows"] == ROWS - 1 and mine["coverage_90"] is not None and theirs["engine"] == "published theirs"
        assert (theirs["rows"], theirs["near_share"], theirs["step_us_mean"]) == (2, 1.0, 2.5e6)


@pytest.mark.parametrize(
    "words, reported",
    [
        ((), "needs --scene"),
        (("--scene", "anchor"), "needs --estimate or --filter"),
        (("--scene", "nowhere", "--filter", "odometry"), "neither on the list nor a scene folder"),
        (("--scene", "thymio/random_2", "--filter", "odometry"), "give its folder by --data"),
        (("--scene", "anchor", "--estimate", "nothing.csv"), "nothing.csv"),
        (("--scene", "anchor", "--chart", "chart.gif", "--filter", "odometry"), "name a file .svg or .png"),
        (("--scene", "anchor", "--filter", "odometry", "--near", "-1"), "--near"),
    ],
)
def test_what_is_missing_is_one_line(capsys, words, reported):
    try:
        code, _, error = run(capsys, "bench", "touch", *words)
    except SystemExit as end:  # a word that is no argument
        code, error = end.code, capsys.readouterr().err
    assert code == 2 and reported in error and error.count("\n") == 1


def test_stored_figures_that_are_damaged_are_reported(tmp_path):
    (tmp_path / "touch.json").write_text("{")
    with pytest.raises(benchmark.BenchmarkError, match="make it anew"):
        benchmark.stored(tmp_path / "touch.json")
