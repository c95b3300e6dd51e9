"""docs/results/nav.md: every table and chart has its text, misses are shown, figures come from the data."""

import json
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
from benches.nav import page as nav_page  # noqa: E402

OURS = nav_page.OURS


def spread(value: float) -> dict:
    return {"median": value, "low": 0.9 * value, "high": 1.1 * value}


def ledger(error_m: float = 0.005, us: float = 20.0, covered: float = 0.9, near: float = 1.0) -> dict:
    return {
        "runs": 4,
        "error_median_m": spread(error_m),
        "error_rms_m": spread(2 * error_m),
        "near_at_end": near,
        "locked": near,
        "faulty_rows": 0,
        "coverage_90": covered,
        "region_90_m2": 0.002,
        "step_us_mean": us,
        "step_us_median": spread(us),
        "step_us_p99": spread(3 * us),
        "distinct_mean": 30.0,
        "touched_mean": 900.0,
        "touched_max": 1000,
        "peak_bytes": 10**6,
        "to_reference": spread(1.0),
    }


def lock(locked: int, ratio: float) -> dict:
    interval = {"median": ratio, "low": ratio - 0.1, "high": ratio + 0.1, "pairs": locked}
    return {"runs": 100, "locked": locked, "rows": [30], "ratio_to_grid": interval, "until_lock_us_mean": 90.0}


@pytest.fixture
def data() -> dict:
    """Every part, small; the default filter meets every limit."""
    both = {"grid": ledger(0.02, 100.0), OURS: ledger()}
    judged = {"auc": 0.9, "calibration_error": 0.02, "bins": []}
    cost = [{"x": 1.0, "step_us_median": 20.0}, {"x": 6.0, "step_us_median": 30.0}]
    bound = {"rows": 100_000, "step_us_p999": 100.0, "step_us_max": 300.0, "evaluations_max": 9, "touched_max": 1000}
    block = {"faulty": 0, "error_median_m": 0.01, "step_us_median": 20.0, "step_us_max": 300.0, "touched_max": 1000}
    modes = {"runs": 2, "judged": 100, "both_modes_hold": 90, "within_45_55": 1.0, "worst_share": 0.51}
    grid_pass = {"cell_m": 0.05, "cell_deg": 10, "ns_per_pose_p90": 1.2, "read_ns_per_float": 0.1} | {
        "scale_ns_per_float": 0.2,
        "ns_per_pose_median": 1.0,
    }
    made = {
        "matrix": {
            "filters": list(both),
            "rows": {"known start": both, "dead whisker": both},
            "confidence": {name: judged for name in both},
            "confidence_kidnap": {name: judged for name in both},
        },
        "tracking": {"families": {family: both | {"reference": ledger()} for family in ("anchor", "one-whisker")}},
        "locks": {"families": {"anchor+global": {OURS: lock(100, 1.1)}, "anchor+kidnap": {OURS: lock(100, 1.4)}}},
        "budgets": {OURS: bound},
        "balance": {name: modes | {"runs_never_outside": 2} for name in both},
        "variation": {"anchor": {t: {"mean": 0.01, "touched_mean": 9.0} for t in (OURS, "reference again")}},
        "soak": {OURS: {"rows": 1_000_000, "blocks": [block, block]}},
        "pareto": {"families": {"anchor": both}, "peers": {"anchor": {"mrpt 1000": ledger(0.004, 200.0)}}},
        "cost": {"arena": {"grid": cost}},
        "passes": [grid_pass | {"poses": poses} for poses in (90_000, 7_500_000)],
    }
    return json.loads(json.dumps(made))  # no two places are one object


def paragraphs(text: str) -> list[str]:
    return [part.strip() for part in text.split("\n\n") if part.strip()]


def is_prose(part: str) -> bool:
    return not part.startswith(("|", "#", "!")) and part.endswith((".", ":")) and len(part.split()) > 5


def test_every_table_and_chart_has_its_text(data):
    page = paragraphs(nav_page.document(data))
    assert sum(part.startswith("## ") for part in page) == len(data)
    for before, part, after in zip(page, page[1:], page[2:] + [""], strict=False):
        if part.startswith("|"):
            assert is_prose(before), part[:80]
        if part.startswith("!"):
            assert is_prose(after), part


def test_every_picture_is_one_that_the_bench_draws(data):
    drawn = set(re.findall(r'"(\w+)"[:,] charts', (ROOT / "tools/benches/nav/bench.py").read_text()))
    assert set(re.findall(r"charts/nav_(\w+)\.svg", nav_page.document(data))) == drawn


def test_what_meets_every_limit_has_no_miss(data):
    text = nav_page.document(data)
    assert "| no |" not in text and ": no |" not in text
    assert "| anchor | none | none |" in text  # points that dominate


def missed(data) -> list[str]:
    return [line for line in nav_page.document(data).splitlines() if line.endswith("| no |") or ": no |" in line]


@pytest.mark.parametrize(
    ("part", "path", "value"),
    [
        ("locks", ("families", "anchor+global", OURS, "locked"), 97),
        ("locks", ("families", "anchor+kidnap", OURS, "ratio_to_grid", "median"), 1.51),
        ("locks", ("families", "anchor+kidnap", OURS, "until_lock_us_mean"), 201.0),
        ("budgets", (OURS, "step_us_p999"), 151.0),
        ("budgets", (OURS, "touched_max"), 10**6),
        ("balance", (OURS, "worst_share"), 0.56),
        ("variation", ("anchor", OURS, "mean"), 0.051),
        ("soak", (OURS, "rows"), 999_999),
        ("tracking", ("families", "anchor", OURS, "coverage_90"), 0.951),
        ("tracking", ("families", "anchor", OURS, "error_median_m", "median"), 0.0076),
        ("matrix", ("rows", "known start", OURS, "coverage_90"), 0.84),
        ("matrix", ("rows", "dead whisker", OURS, "coverage_90"), 0.79),
        ("matrix", ("rows", "dead whisker", "grid", "faulty_rows"), 1),
        ("passes", (0, "ns_per_pose_median"), 1.21),
    ],
)
def test_a_miss_is_shown(data, part, path, value):
    data = {part: data[part]}
    place = data[part]
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    assert len(missed(data)) == 1


def test_a_point_that_is_quicker_and_nearer_is_named(data):
    data["pareto"]["peers"]["anchor"]["mrpt 1000"] = ledger(0.004, 10.0)
    assert "| anchor | mrpt 1000 (10 us, 4.0 mm) | none |" in nav_page.document(data)


def test_peers_that_were_not_run_are_not_said_to_be_worse(data):
    del data["pareto"]["peers"]
    assert "| anchor | not run | none |" in nav_page.document(data)


def test_the_page_of_unseen_families_is_what_was_measured():
    from benches import store
    from benches.markdown import wrap
    from benches.nav import unseen

    measured, *others = (store.read_result(f"nav_{name}") for name in ("unseen", "designs", "ablations", "left_out"))
    assert wrap(unseen.page(measured, *others)) == unseen.PAGE.read_text()
    family = next(iter(measured["families"].values()))
    family["locked"] = 0
    assert wrap(unseen.page(measured, *others)) != unseen.PAGE.read_text()
