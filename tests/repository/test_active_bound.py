"""The bound of nav_active: worked out by hand for one arena, and above 0 only where bits are missing."""

import math
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))

from benches import store  # noqa: E402
from benches.nav import active  # noqa: E402
from benches.nav import bound as bounds  # noqa: E402

from crunchbot_lab.scenes.closed import Loop  # noqa: E402


def loop_of(family):
    return Loop(family, 5, lambda loop, random: random, 10)


def test_a_row_holds_a_crossing_or_none():
    p = 4.0 * 0.1 * 2.0 * math.hypot(0.05, 0.2) / (math.pi * 0.5)
    by_hand = 2.0 * (-p * math.log2(p) - (1.0 - p) * math.log2(1.0 - p) + p * math.log2(2.0))
    found = bounds.bound(loop_of("anchor+global"))
    assert found["row_bits"] == pytest.approx(by_hand) and found["first_bits"] == pytest.approx(2.0 * math.log2(3.0))
    most = 0.1 + 0.1 * (found["wanted_bits"] - found["first_bits"]) / by_hand
    assert 0.1 < found["bound_s"] < most


def test_one_texture_leaves_the_way_to_the_nearest_touch():
    plain, tiled = (bounds.bound(loop_of(family)) for family in ("one-texture+global", "anchor+global"))
    assert plain["first_bits"] == plain["row_bits"] == 0.0
    assert plain["bound_s"] > tiled["bound_s"]


def test_a_body_whisk_must_end_first():
    plain = bounds.bound(loop_of("robot+global"))
    assert plain["bound_s"] == pytest.approx(
        0.1 + 0.1 * (plain["wanted_bits"] - plain["first_bits"]) / plain["row_bits"]
    )


def test_a_mean_below_the_bound_fails_the_bench():
    families = {"anchor": {"random": {"mean_s": 0.3, "bound_s": 0.2}, "greedy": {"mean_s": 0.19, "bound_s": 0.2}}}
    with pytest.raises(SystemExit, match=r"^nav_active: anchor, greedy: mean 0.19 s, bound 0.20 s; mend [^\n]*$"):
        active.refuse_below_bound(families)
    families["anchor"]["greedy"]["mean_s"] = 0.21
    active.refuse_below_bound(families)
    active.refuse_below_bound(store.read_result("nav_active")["families"])
