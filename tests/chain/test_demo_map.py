"""demo-map: a short run of all processes with a mapper, its folder, the second run in it, and the page."""

import json

import pytest
from chainrun import BUILD
from quickmodels import quick_models

from crunchbot.scene import load
from crunchbot_lab.demo import mapping
from crunchbot_lab.report import map_page
from crunchbot_lab.report.run import read_columns


def quickly_learnt(out, scene, options):
    quick_models(out / "models", options.seed)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The folder, and the summary."""
    out = tmp_path_factory.mktemp("demo") / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mapping, "learn_models", quickly_learnt)
        words = ["--level", "bytes", "--seconds", "20", "--again", "12", "--seed", "3"]
        assert mapping.main([*words, "--build-dir", str(BUILD), "--out", str(out)]) == 0
    return out, json.loads((out / "summary.json").read_text())


def test_every_row_is_mapped_and_no_frame_is_lost(done):
    out, summary = done
    assert summary["map"]["rows"] == 200 and summary["map"]["rows_missed"] == 0
    assert summary["own"]["rows"] == 120
    for run in ("explore", "again"):
        assert summary[run]["frames_lost"] == 0 and summary[run]["records_bad_match"]
    assert len(read_columns(out / "map/est.csv")["x_m"]) == 200
    assert 0.0 <= summary["map"]["error_median_m"] < 0.3  # of 20 s; a pose in a frame that is turned is further off
    assert summary["map"]["free_right"] > 0.5


def test_the_second_run_gets_the_map_and_no_start(done):
    out, _ = done
    known, mapped, world = (load(out / name) for name in ("known", "map", "again/scene"))
    assert known.prior.kind == "uniform" and known.arena == mapped.arena != world.arena
    first, second = (read_columns(out / name / "truth.csv")["x_m"][0] for name in ("explore", "again"))
    assert abs(first - second) > 0.01


def test_the_page_shows_the_arena_beside_the_map_as_a_motion(done):
    out, summary = done
    page = (out / "report.html").read_text()
    assert page.count("<svg") == 4, "two figures, wide and narrow"
    data = map_page.motion_data(map_page.read(out))
    assert len(data["truth"]) == len(data["filters"]["map"]["poses"]) == 200
    maps = data["filters"]["map"]["maps"]
    assert maps[-1]["row"] >= 190 and [m["row"] for m in maps] == sorted(m["row"] for m in maps)
    assert maps[-1]["grid"]["turn"] == pytest.approx(summary["map"]["motion"][0], abs=1e-4)
