"""Radial distance from how a press grows: partial presses, drifting rest, directions, choice among models, model files."""

import json

import numpy as np
import pytest

from crunchbot import cli
from crunchbot.tables import TableError
from crunchbot.touch.radial import model as radial
from crunchbot.touch.radial.model import Contact, Whisks
from crunchbot.touch.radial.press import PressModel, press_of

RADII, DEPTH_MM, HZ, PACE = (50.0, 60.0, 70.0, 80.0, 90.0, 100.0), 40.0, 100.0, 10.0


def press(radius, rng, onset_s=2.0, turn=0, depth_mm=DEPTH_MM, noise=0.5) -> Contact:
    """A push by translation over three channels that saturate differently; the rest drifts. turn: channels are permuted."""
    t = np.arange(0.0, onset_s + depth_mm / PACE + 0.5, 1.0 / HZ)
    depth = np.minimum(PACE * t, PACE * onset_s + depth_mm)
    pushed = np.clip(depth - PACE * onset_s, 0.0, None)
    bend = 3e6 / radius**2 * pushed / (pushed + radius)
    channels = np.column_stack([bend, -0.5 * bend, -0.3 * bend + 0.02 * bend**2 / (1.0 + bend / 100.0)])
    drift = np.array([40.0, -20.0, 10.0]) * np.exp(-t / 3.0)[:, None]
    samples = (
        np.roll(channels, turn, axis=1) * (1.0 + 0.01 * rng.normal()) + drift + rng.normal(0.0, noise, (len(t), 3))
    )
    return Contact(t, samples, depth_mm=depth)


def presses(seed=1, repeats=4, radii=RADII, turns=(0,), **options) -> Whisks:
    rng = np.random.default_rng(seed)
    found = [(r, turn, press(r, rng, turn=turn, **options)) for turn in turns for r in radii for _ in range(repeats)]
    peaks = np.array([radial.peak_of(c.samples) for _, _, c in found])
    directions = np.array([120.0 * turn for _, turn, _ in found]) if len(turns) > 1 else None
    names = [str(n) for n in range(len(found))]
    return Whisks(names, [c for *_, c in found], peaks, np.array([r for r, *_ in found]), 0, None, directions)


@pytest.fixture(scope="module")
def fitted():
    return radial.fit(presses(), "press").model


def errors(model, held: Whisks) -> np.ndarray:
    return np.array([model.predict(c).radius_mm for c in held.recorded]) - held.radius_mm


def test_the_push_begins_at_the_onset_whatever_the_rest_does(fitted):
    contact = press(70.0, np.random.default_rng(2))
    found = press_of(contact, fitted.window)
    assert found.unit == "mm" and found.depth[-1] == pytest.approx(DEPTH_MM, abs=1.0)


def test_a_late_slip_is_no_onset(fitted):
    contact = press(70.0, np.random.default_rng(6))
    slipped = np.clip((contact.depth_mm - 45.0) / 6.0, 0.0, 1.0)[:, None]  # half of the bend goes within 0.6 s
    late = Contact(contact.t_s, contact.samples * (1.0 - 0.5 * slipped), depth_mm=contact.depth_mm)
    assert press_of(late, fitted.window).depth[-1] == pytest.approx(DEPTH_MM, abs=1.5)


def test_radii_and_their_spread_are_right_at_places_never_calibrated(fitted):
    held = presses(3, radii=(55.0, 65.0, 75.0, 85.0, 95.0))
    off = errors(fitted, held)
    sigma = np.array([fitted.predict(c).sigma_mm for c in held.recorded])
    assert np.abs(off).mean() < 1.0
    assert np.mean(np.abs(off) < 1.645 * sigma) >= 0.8
    assert all(fitted.predict(c).confidence > 0.5 for c in held.recorded)


def test_it_answers_during_the_press_and_knows_when_it_cannot_yet(fitted):
    contact = press(80.0, np.random.default_rng(4))
    at = {mm: fitted.predict(contact.until(int(HZ * (2.0 + mm / PACE)))) for mm in (-10.0, 12.0, 38.0)}
    assert at[-10.0].confidence < 0.1 and at[-10.0].sigma_mm > 10.0
    assert at[12.0].confidence > 0.5 and at[12.0].radius_mm == pytest.approx(80.0, abs=6.0)
    assert at[38.0].sigma_mm <= at[12.0].sigma_mm < at[-10.0].sigma_mm


def test_directions_are_reported_apart_and_each_has_its_own_regression():
    model = radial.fit(presses(turns=(0, 1, 2)), "press").model
    held = presses(5, repeats=2, turns=(0, 1, 2))
    found = [model.predict(c) for c in held.recorded]
    assert [f.direction_deg for f in found] == held.direction_deg.tolist()
    assert np.abs(errors(model, held)).mean() < 1.0


def doubted(kind: str) -> Contact:
    """A whole contact at 70 mm, unlike those calibrated: its channels exchanged, or most of its bend comes in a late slip."""
    contact = press(70.0, np.random.default_rng(2), turn=kind == "turned")
    if kind == "late slip":
        late = np.clip((contact.depth_mm - 55.0) / 2.0, 0.0, 1.0)[:, None]
        contact.samples[:] = contact.samples[0] + (contact.samples - contact.samples[0]) * (0.05 + 0.95 * late)
    return contact


@pytest.mark.parametrize("kind", ["turned", "late slip"])
def test_below_half_confidence_the_rational_curve_answers_with_its_deviation(fitted, kind):
    contact, curve = doubted(kind), radial.fit(presses(), "rational").model
    found = fitted.predict(contact)
    assert found.confidence < 0.5  # still says that the contact is unlike those calibrated
    assert (found.radius_mm, found.sigma_mm) == curve.predict(radial.peak_of(contact.samples))
    assert found.radius_mm == pytest.approx(70.0, abs=3.0 * found.sigma_mm) and found.sigma_mm < 5.0


@pytest.mark.parametrize("spoil", ["so far", "few rows", "beyond"])
def test_what_the_curve_cannot_know_may_be_anywhere(fitted, spoil):
    contact = doubted("turned")
    if spoil == "so far":
        contact = contact.until(3 * len(contact.t_s) // 5)
    if spoil == "few rows":
        contact.samples[5:400] = contact.samples[415:] = np.nan
    if spoil == "beyond":
        contact.samples[:] = contact.samples[0] + 0.1 * (contact.samples - contact.samples[0])
    found = fitted.predict(contact)
    assert found.confidence < 0.5 and found.sigma_mm > 10.0


def test_the_model_is_chosen_by_places_left_out_and_both_errors_are_given():
    found = radial.fit(presses())
    assert set(found.tried) == {"linear", "rational", "press"}
    assert found.place_mm == min(place for place, _ in found.tried.values())
    assert isinstance(found.model, PressModel)
    whole = radial.fit(presses(), "rational")
    assert (whole.place_mm, whole.contact_mm) == found.tried["rational"] and whole.place_mm != whole.contact_mm


def test_a_press_of_another_kind_of_motion_is_refused(fitted):
    contact = press(70.0, np.random.default_rng(2))
    with pytest.raises(ValueError, match="column depth_mm or push_mm_s"):
        fitted.predict(Contact(contact.t_s, contact.samples))
    by_rate = Contact(contact.t_s, contact.samples, push_mm_s=np.gradient(contact.depth_mm, contact.t_s))
    assert fitted.predict(by_rate).radius_mm == pytest.approx(fitted.predict(contact).radius_mm, abs=2.0)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("spoil", ["nan", "stuck", "empty", "short", "huge", "one time"])
def test_spoilt_contacts_give_a_number_and_little_confidence(fitted, spoil):
    contact = press(70.0, np.random.default_rng(2))
    if spoil == "nan":
        contact.samples[:] = np.nan
    if spoil == "stuck":
        contact.samples[:] = 100.0
    if spoil == "huge":
        contact.samples *= 1e200
    if spoil == "one time":
        contact.t_s[:] = 1.0
    found = fitted.predict(contact.until({"empty": 0, "short": 5}.get(spoil, len(contact.t_s))))
    assert np.isfinite([found.radius_mm, found.sigma_mm]).all() and found.confidence < 0.5


def test_single_bad_samples_change_little(fitted):
    contact = press(70.0, np.random.default_rng(2))
    clean = fitted.predict(contact).radius_mm
    contact.samples[::50] = 9e4
    contact.samples[7::90] = np.nan
    assert fitted.predict(contact).radius_mm == pytest.approx(clean, abs=1.0)


@pytest.mark.parametrize("repeats, radii", [(1, RADII), (6, RADII[:2])])
def test_too_few_contacts_are_one_clear_line(repeats, radii):
    with pytest.raises(ValueError, match="at least 8, at 4 radii"):
        radial.fit(presses(repeats=repeats, radii=radii), "press")


def test_saved_models_load_alike_and_nonsense_names_its_field(tmp_path, fitted):
    path, contact = tmp_path / "m.json", press(70.0, np.random.default_rng(2))
    radial.save(fitted, path)
    assert radial.load(path).predict(contact) == fitted.predict(contact)
    content = json.loads(path.read_text())
    for field, value in [("unit", "inch"), ("low_mm", -1), ("stages", []), ("axes", 9)]:
        path.write_text(json.dumps(content | {field: value}))
        with pytest.raises(TableError, match=field):
            radial.load(path)
    content["stages"][0]["scale"][0] = 0.0
    path.write_text(json.dumps(content))
    with pytest.raises(TableError, match="stages.*scale"):
        radial.load(path)
    content["stages"][0]["scale"][0] = 1.0
    content["curve"]["scale"] = 0.0
    path.write_text(json.dumps(content))
    with pytest.raises(TableError, match="curve"):
        radial.load(path)


def test_the_command_reads_pushes_and_answers_during_them(capsys, tmp_path):
    whisks = presses(repeats=3, turns=(0, 1))
    lines = ["contact,radius_mm,t_s,depth_mm,direction_deg,x,y,z"]
    for name, radius, c, at in zip(
        whisks.contact, whisks.radius_mm, whisks.recorded, whisks.direction_deg, strict=True
    ):
        for t, depth, row in zip(c.t_s, c.depth_mm, c.samples, strict=True):
            lines.append(",".join(map(str, (name, radius, t, depth, at, *row))))
    (tmp_path / "c.csv").write_text("\n".join(lines) + "\n")
    assert cli.main(["radial", "fit", str(tmp_path / "c.csv"), "--out", str(tmp_path / "m.json")]) == 0
    assert "chosen" in capsys.readouterr().out
    assert cli.main(["radial", "predict", str(tmp_path / "m.json"), str(tmp_path / "c.csv"), "--json", "--during"]) == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert len(rows) == 10 * len(whisks.contact)
    assert rows[9]["direction_deg"] == 0.0 and rows[9]["radius_mm"] == pytest.approx(50.0, abs=3.0)
    assert rows[0]["sigma_mm"] > rows[9]["sigma_mm"]
