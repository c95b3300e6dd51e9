"""demo-long: when an estimate counts as lost, and a short run at level 1 with its summary and page."""

import json

import numpy as np
import pytest
from quickmodels import quick_models

from crunchbot_lab.demo import long
from crunchbot_lab.report.run import FILTERS, read_columns

NEAR, FAR = 0.1, 0.3


@pytest.mark.parametrize(
    "error, expected",
    [
        ([NEAR] * 30, []),
        ([NEAR] * 5 + [FAR] * 3 + [NEAR] * 20, [(5, 8)]),
        ([NEAR] * 5 + [FAR] * 3 + [NEAR] * 9 + [FAR] + [NEAR] * 10, [(5, 18)]),  # not near for long enough between
        ([FAR] * 2 + [NEAR] * 10 + [FAR] * 4, [(0, 2), (12, 16)]),  # the last one lasts to the end
    ],
)
def test_a_loss_ends_when_the_estimate_has_been_near_for_a_second(error, expected):
    assert long.losses(np.array(error)) == expected


def quickly_learnt(out, scene, options):
    quick_models(out / "models", options.seed)
    (out / "radial_points.csv").write_text("whisker,set,radius_mm,peak_counts,predicted_mm\n")
    (out / "radial_lines.json").write_text("{}\n")


def test_a_short_run_at_level_1_leaves_its_summary_and_its_page(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(long, "learn_models", quickly_learnt)
    out = tmp_path / "run"
    assert long.main(["--level", "signals", "--seconds", "20", "--seed", "4", "--out", str(out)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == str(out / "report.html")
    summary = json.loads((out / "summary.json").read_text())
    truth = read_columns(out / "truth.csv")
    for name in FILTERS:
        reported = read_columns(out / f"est_{name}.csv")
        error = np.hypot(reported["x_m"] - truth["x_m"], reported["y_m"] - truth["y_m"])
        scores = summary["filters"][name]
        assert scores["median_m"] == pytest.approx(np.median(error), abs=1e-5)
        assert scores["lost_share"] == pytest.approx(np.mean(error > 0.25), abs=1e-6)
    assert summary["driven_m"] > 0.5
    assert 1 <= summary["tiles_visited"] <= summary["tiles"] <= 25
    page = (out / "report.html").read_text()
    assert "foveal (eqs. 5-7)" in page
    assert page.count("<svg") == 6, "three figures, wide and narrow"


def test_a_folder_of_somebody_elses_is_not_touched(tmp_path, capsys):
    (tmp_path / "mine").write_text("mine")
    assert long.main(["--level", "signals", "--out", str(tmp_path)]) == 1
    assert "choose another --out" in capsys.readouterr().err
