"""The contact filter in contacts that sim/mechanics bends, vibration and all. Its parts: host/nav/tests/touch/test_contact_filter.c."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commandkit import run, signals_as_before  # noqa: F401 - a fixture
from whisks import whisk, whisks

from crunchbot import scene
from crunchbot.pilot.feel import Feeler
from crunchbot.touch.contact_filter import ContactFilter
from crunchbot.touch.radial import model as radial
from crunchbot.touch.radial.push import Contact
from crunchbot_lab.signals.mechanics import Whisker, touch

TICK_S = 5e-4


def swept(radius_m: float, ticks: int = 500, side: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A corner passed at 0.1 m/s: motion of the base (n, 3), tilt (n, 2) with noise, place of the corner (n, 2)."""
    bases = np.tile([0.0, -0.1 * side, 0.0], (ticks, 1))
    y = 0.1 * TICK_S * np.arange(1, ticks + 1)
    felt = touch(Whisker(), np.hypot(radius_m, y), side * np.arctan2(y, radius_m), seed=1)
    noise = np.random.default_rng(1).normal(0.0, 2e-4, (ticks, 2))
    return bases, felt.tilt_rad + noise, np.column_stack([np.full(ticks, radius_m), side * y])


@pytest.mark.parametrize(("radius_m", "side"), [(0.08, 1), (0.11, -1), (0.12, 1)])
def test_a_corner_is_placed_within_a_millimetre_while_it_is_swept(radius_m, side):
    bases, tilts, places = swept(radius_m, side=side)
    reported = ContactFilter().run(bases, tilts)
    late = reported.sample > 200
    off = reported.point[late] - places[reported.sample[late]]
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 1e-3
    far = np.einsum("ki,kij,kj->k", off, np.linalg.inv(reported.point_cov[late]), off)
    assert far.max() < 9.2  # all inside the 99 % region
    assert set(np.array(reported.motion)[late]) == {"drive-by"}
    assert reported.corner[-1] > 0.5
    assert reported.sweep[-1] < 0.05
    assert abs(reported.plane_rad[-1]) < 3 * reported.plane_sd[-1]


def test_reports_come_every_20_ms_and_lost_samples_are_counted():
    bases, tilts, places = swept(0.1)
    tilts[::5] = np.nan
    held = ContactFilter()
    reported = held.run(bases, tilts, good=np.arange(len(tilts)) % 7 > 0)
    assert set(np.diff(reported.sample)) == {40}
    assert held.not_read == {"bad": 100 + 57, "stuck": 0, "saturated": 0, "restarts": 0}
    assert np.hypot(*(reported.point[-1] - places[reported.sample[-1]])) < 2e-3


def test_a_whisker_at_rest_gives_no_report_and_a_new_contact_forgets_the_last():
    held = ContactFilter()
    noise = np.random.default_rng(2).normal(0.0, 2e-4, (400, 2))
    assert len(held.run(np.zeros((400, 3)), noise).sample) == 0
    bases, tilts, places = swept(0.12)
    held.run(bases, tilts)
    held.begin()
    bases, tilts, places = swept(0.08)
    reported = held.run(bases, tilts)
    assert np.hypot(*(reported.point[-1] - places[reported.sample[-1]])) < 1e-3


# Chains of 20 links in MuJoCo against shapes met at any angle, friction 0.1 to 0.5 and not given; a row: mean tilts of 20
# samples, the point and the normal in their middle. Made by `tools/benches contact --word work --each 8 --contacts FILE`.
CHAINS = Path(__file__).parent / "chains.jsonl"
HEAD_ON = "face, head-on"


def chained(head_on: bool) -> dict[str, np.ndarray]:
    """All reports from 0.1 s after the touch on: errors, whether 90 % regions hold, refused, taken by a pilot."""
    found: dict[str, list] = {name: [] for name in ("off_mm", "held", "turn_deg", "turn_held", "refused", "taken")}
    for contact in map(json.loads, CHAINS.read_text().splitlines()):
        if (contact["kind"] == HEAD_ON) != head_on:
            continue
        rows = np.array(contact["rows"])
        held = ContactFilter(creep=0.0, block=1, sample_s=20 * TICK_S, noise_rad=2e-4 / np.sqrt(20))
        said = held.run(np.tile(contact["base"], (len(rows), 1)), rows[:, :2])
        late = said.sample >= 9
        row = rows[said.sample + 1]  # a report of a block of one sample is dated to the one before
        off, turn = said.point - row[:, 2:4], said.normal_rad - row[:, 4]
        far = np.einsum("ki,kij,kj->k", off, np.linalg.inv(said.point_cov), off)
        found["off_mm"].append(1e3 * np.hypot(*off.T)[late])
        found["held"].append((far < 4.605)[late])
        found["turn_deg"].append(np.degrees(np.abs(turn))[late])
        found["turn_held"].append((np.abs(turn) < 1.645 * said.normal_sd)[late])
        found["refused"].append(~said.sure[late])
        found["taken"].append(said.faced[late])
    return {name: np.concatenate(parts) for name, parts in found.items()}


def test_regions_hold_at_any_angle_between_drive_and_surface():
    found = chained(head_on=False)
    known = ~found["refused"]
    assert found["refused"].mean() < 0.15
    assert np.median(found["off_mm"][known]) < 1.0
    assert 0.85 < found["held"][known].mean() < 0.97
    assert 0.85 < found["turn_held"][known].mean() < 0.97
    assert found["taken"].mean() > 0.3
    assert np.median(found["turn_deg"][found["taken"]]) < 5.0
    assert found["turn_held"][found["taken"]].mean() > 0.85


def test_a_whisker_that_may_bend_as_a_column_is_not_sure():
    found = chained(head_on=True)
    assert found["refused"].mean() > 0.85
    assert found["taken"].mean() < 0.05


@pytest.mark.parametrize("back_at", [290, 297, 304, 311])
def test_a_place_of_what_moves_is_sure_once_the_base_has_changed_its_motion(back_at):
    """Where it moves as the base stands, and where the whisker still rings from the base's jump, it is not."""
    ticks, radius_m = 700, 0.116
    bases = np.zeros((ticks, 3))
    bases[back_at:, 1] = 0.024
    y = TICK_S * np.cumsum(0.04 - bases[:, 1])
    noise = np.random.default_rng(1).normal(0.0, 2e-4, (ticks, 2))
    said = ContactFilter().run(
        bases, touch(Whisker(), np.hypot(radius_m, y), np.arctan2(y, radius_m), seed=1).tilt_rad + noise
    )
    assert not said.sure[said.sample < back_at + 40].any() and said.sure[-1] and said.sweep[-1] > 0.9
    off = said.point - np.column_stack([np.full(len(said.sample), radius_m), y[said.sample]])
    far = np.einsum("ki,kij,kj->k", off, np.linalg.inv(said.point_cov), off)
    assert far[said.sure].max() < 9.2  # all inside the 99 % region


def test_what_is_uncertain_is_not_sure():
    bases, tilts, _ = swept(0.12)
    said = ContactFilter().run(bases, tilts)
    assert said.sure[-1]
    column = {
        "along": said.along + 0.8,
        "normal_rad": said.normal_rad * 0.0 - 2.3,
        "normal_sd": said.normal_sd * 0.0 + 0.1,
    }
    assert said._replace(**(column | {"along": said.along})).sure[-1]
    assert said._replace(**(column | {"normal_rad": said.normal_rad})).sure[-1]
    for doubt in ({"point_cov": said.point_cov + 1e-4 * np.eye(2)}, {"other": said.other + 0.5}, column):
        assert not said._replace(**doubt).sure.any()
    known = dict.fromkeys(("tip", "sweep", "normal_sd"), np.zeros(len(said.sample))) | {
        "tip": np.ones(len(said.sample))
    }
    assert said._replace(**known).faced[-1]
    for doubt in ({"tip": 0.8}, {"sweep": 0.6}, {"normal_sd": 0.2}):
        name, value = doubt.popitem()
        assert not said._replace(**(known | {name: known[name] * 0.0 + value})).faced.any()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"speed": 1.0}, "speed: no setting of the contact filter; use one of cone_m"),
        ({"noise_rad": np.nan}, "noise_rad: nan; give a number above 0"),
        ({"kappa": 0.0}, "kappa: 0.0; give a number above 0"),
        ({"block": 0}, "block: 0; give a number of at least 1"),
        ({"cone_m": 0.1}, "length_m 0.14, cone_m 0.1: no whisker"),
        ({"friction": 0.9}, "friction: 0.9; give 0 to 0.5"),
    ],
)
def test_a_setting_out_of_range_is_named(settings, message):
    with pytest.raises(ValueError, match=message):
        ContactFilter(**settings)


def test_arrays_of_other_shapes_are_named():
    with pytest.raises(ValueError, match=r"tilts: shape \(3, 2\); give shape \(4, 2\)"):
        ContactFilter().run(np.zeros((4, 3)), np.zeros((3, 2)))


def test_a_calibration_by_whisks_is_enough_to_follow_a_whisk(tmp_path, capsys):
    rng = np.random.default_rng(3)
    radial.save(radial.fit(whisks(rng, 5), "rational").model, tmp_path / "model.json")
    pressed = whisk(115.0, rng)
    rows = np.column_stack([pressed.t_s, pressed.samples, pressed.whisk_rad_s])
    head = "contact,t_s,x,y,whisk_rad_s\n"
    (tmp_path / "contacts.csv").write_text(head + "".join("a," + ",".join(map(str, row)) + "\n" for row in rows))
    status, out, _ = run(capsys, "radial", "follow", tmp_path / "model.json", tmp_path / "contacts.csv", "--json")
    reported = [json.loads(line) for line in out.splitlines()]
    assert status == 0
    assert len(reported) > 20
    last = reported[-1]
    assert last["motion"] == "body whisk"
    assert abs(np.hypot(*last["point_mm"]) - 115.0) < min(5.0, 3.0 * last["point_sd_mm"][0])
    assert reported[2]["point_sd_mm"][0] > 2.0 * last["point_sd_mm"][0]


@pytest.mark.parametrize("cone_mm", [141.0, 1000.0])
def test_a_calibrated_cone_is_limited_to_the_beams_tables(cone_mm):
    """A fit has wider limits."""
    rng = np.random.default_rng(4)
    plug = replace(radial.fit(whisks(rng, 5), "linear").model.plug, cone_mm=cone_mm)
    follower, bases, tilts = ContactFilter.calibrated(plug, whisk(115.0, rng))
    assert len(follower.run(bases, tilts).sample) > 20
    whisker = scene.Whisker("front", "object", None, (0.0, 0.0), 0.0, 0.14)
    Feeler(whisker, 1.0, plug, 1.0)


def test_what_cannot_be_followed_is_one_line(tmp_path, capsys):
    rng = np.random.default_rng(3)
    plug = radial.fit(whisks(rng, 5), "linear").model.plug
    pressed = whisk(115.0, rng)
    with pytest.raises(ValueError, match="no motion of the base; give the column whisk_rad_s or push_mm_s"):
        ContactFilter.calibrated(plug, Contact(pressed.t_s, pressed.samples))
    with pytest.raises(ValueError, match="50 samples; give at least 100"):
        ContactFilter.calibrated(plug, pressed.until(50))
    line = radial.fit(whisks(rng, 5), "linear").model
    line.plug = None
    radial.save(line, tmp_path / "line.json")
    (tmp_path / "contacts.csv").write_text("contact,t_s,x\na,0,1\n")
    status, _, said = run(capsys, "radial", "follow", tmp_path / "line.json", tmp_path / "contacts.csv")
    assert status == 2
    assert "line.json" in said
    assert "it holds no plug; fit it anew, with the column whisk_rad_s, push_mm_s or depth_mm" in said
