"""Radial distance by the default model: what is taken out, how sure it is, what spoils it; curves, plugs, model files."""

import json
import math

import numpy as np
import pytest
from commandkit import run
from whisks import CONE_MM, COUNTS, TIP_MM, whisks

from crunchbot.tables import TableError
from crunchbot.touch.radial import model as radial
from crunchbot.touch.radial.model import Contact, Whisks
from crunchbot.touch.radial.plug import Plug
from crunchbot.touch.radial.push import presses_of


def errors(model, held: Whisks) -> np.ndarray:
    reported = [radial.estimate(model, c).radius_mm for c in held.recorded]
    return np.array(reported) - held.radius_mm


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.fixture(scope="module")
def calibrated():
    """A default model of whisks with 4 % of spread, and its calibration."""
    made = whisks(np.random.default_rng(1), 5)
    return radial.fit(made).model, made


def test_the_angle_turned_is_taken_out():
    """Where the base turns for a longer or shorter time, and where it turns faster or slower and says so."""
    rng = np.random.default_rng(2)
    for split in ("time", "rate"):
        cal, held = (whisks(rng, n, 0.08, split) for n in (5, 25))
        paper, best = (rms(errors(radial.fit(cal, name).model, held)) for name in ("paper", "default"))
        assert best < 0.85 * paper


def test_it_is_as_sure_as_it_is_right(calibrated):
    held = whisks(np.random.default_rng(4), 40)
    reported = [radial.estimate(calibrated[0], c) for c in held.recorded]
    off = np.array([t.radius_mm for t in reported]) - held.radius_mm
    within = [np.mean(np.abs(off) < k * np.array([t.sigma_mm for t in reported])) for k in (0.6745, 1.645)]
    assert 0.4 < within[0] < 0.65 and 0.82 < within[1] < 0.97
    assert np.mean([t.confidence for t in reported]) > 0.97


def test_tip_and_shaft(calibrated):
    held = whisks(np.random.default_rng(5), 40, radii=(100.0, 120.0, 131.0, TIP_MM))
    said = np.array([radial.estimate(calibrated[0], c).type == "tip" for c in held.recorded])
    assert np.mean(said == (held.radius_mm == TIP_MM)) > 0.93


@pytest.mark.parametrize(("hz", "channels"), [(2000.0, 1), (35.0, 2)])
def test_any_rate_and_number_of_channels(hz, channels):
    rng = np.random.default_rng(6)
    cal, held = (whisks(rng, n, hz=hz, channels=channels) for n in (5, 10))
    assert rms(errors(radial.fit(cal).model, held)) < 2.6


@pytest.mark.parametrize("kappa", [0.3, 3.0])
def test_curves_bend_with_the_plug(kappa):
    rng = np.random.default_rng(7)
    cal = whisks(rng, 5, 0.001, kappa=kappa)
    line, rational = (rms(errors(radial.fit(cal, m).model, cal)) for m in ("linear", "rational"))
    assert line > 1.0 and rational < 0.55 * line


def spoil(contact: Contact, how: str, rng) -> Contact:
    samples = contact.samples.copy()
    middle = len(samples) // 3
    if how == "saturated":
        samples = np.clip(samples, 32768 - 400, 32768 + 400)
    elif how == "stuck":
        samples[middle:] = samples[middle]
    elif how == "dead":
        samples[:] = samples[0]
    elif how == "nan":
        samples[rng.random(len(samples)) < 0.2] = np.nan
    elif how == "all nan":
        samples[:] = np.nan
    elif how == "bad records":
        hit = rng.random(len(samples)) < 0.01
        samples[hit] = rng.uniform(0, 65535, (hit.sum(), samples.shape[1]))
    elif how == "flipped":
        samples = 65536 - samples
    elif how == "swapped axes":
        samples = samples[:, ::-1]
    elif how == "drift":
        samples += np.linspace(0, 20, len(samples))[:, None]
    return Contact(contact.t_s, samples, contact.whisk_rad_s)


@pytest.mark.parametrize("how", ["saturated", "dead", "all nan", "flipped", "swapped axes"])
def test_confidence_falls_when_a_whisker_is_broken(calibrated, how):
    rng = np.random.default_rng(8)
    reported = [radial.estimate(calibrated[0], spoil(c, how, rng)) for c in calibrated[1].recorded]
    assert np.isfinite([t[:2] for t in reported]).all()
    assert np.median([t.confidence for t in reported]) < 0.5


@pytest.mark.parametrize("how", ["nan", "bad records", "drift", "stuck"])
def test_what_can_be_mended_is_mended(calibrated, how):
    rng = np.random.default_rng(9)
    found = whisks(rng, 10)
    found.recorded = [spoil(c, how, rng) for c in found.recorded]
    assert rms(errors(calibrated[0], found)) < 3.0


@pytest.mark.parametrize("name", radial.MODELS)
def test_saved_models_load_alike(tmp_path, calibrated, name):
    model = radial.fit(calibrated[1], name).model
    radial.save(model, tmp_path / "m.json")
    again = radial.load(tmp_path / "m.json")
    contact = calibrated[1].recorded[7]
    assert radial.estimate(again, contact) == radial.estimate(model, contact)


@pytest.mark.parametrize(
    "change", [{"spread": "x"}, {"kappa": -1.0}, {"direction": []}, {"unit": "m"}, {"counts_per": math.inf}]
)
def test_a_spoiled_plug_is_one_clear_line(tmp_path, calibrated, change):
    radial.save(calibrated[0], tmp_path / "m.json")
    content = json.loads((tmp_path / "m.json").read_text())
    content["plug"] |= change
    (tmp_path / "m.json").write_text(json.dumps(content))
    with pytest.raises(TableError, match="field 'plug.*; make one with 'whisker radial fit'"):
        radial.load(tmp_path / "m.json")


def test_a_model_of_whole_whisks_is_told_what_it_is_and_what_to_do(tmp_path):
    (tmp_path / "m.json").write_text('{"format": "whisker radial whisk model 1", "axes": 2}')
    with pytest.raises(TableError, match="whisk model 1', of an earlier version; make one with 'whisker radial fit'$"):
        radial.load(tmp_path / "m.json")


@pytest.mark.parametrize("kappa", [0.5, 1.0, 2.0])
def test_the_plug_is_learnt_from_pushes(kappa):
    """Plug and counts trade; what the filter uses of them is the tilt per angle at each radius."""
    made = whisks(np.random.default_rng(4), 5, 0.01, kappa=kappa)
    plug = Plug.fit(presses_of(made.recorded)[0], made.radius_mm)
    x, learnt = made.radius_mm / CONE_MM, made.radius_mm / plug.cone_mm
    tilts = plug.counts_per_rad(1.0) * (1 - learnt) / (1 - learnt + plug.kappa * learnt)
    assert tilts == pytest.approx(COUNTS * (1 - x) / (1 - x + kappa * x), rel=0.1)  # creep, which these lack, is 0.03
    assert plug.direction == pytest.approx([0.8, -0.6], abs=0.01)


def test_a_plug_needs_contacts_at_three_places_that_tell_how_the_base_moved_alike():
    made = whisks(np.random.default_rng(4), 3)
    presses, _ = presses_of(made.recorded)
    assert Plug.fit(presses[:6], made.radius_mm[:6]) is None
    assert Plug.fit([None] * len(presses), made.radius_mm) is None
    made.recorded[0] = Contact(made.recorded[0].t_s, made.recorded[0].samples)
    assert Plug.fit(presses_of(made.recorded)[0], made.radius_mm) is None


def write(path, made: Whisks, columns="contact,radius_mm,t_s,whisk_rad_s,x,y"):
    lines = [columns]
    for name, radius, c in zip(made.contact, made.radius_mm, made.recorded, strict=True):
        cells = zip(c.t_s, c.whisk_rad_s, *c.samples.T, strict=True)
        lines += [f"{name},{radius},{t:.5f},{rate:.5f},{','.join(f'{v:.0f}' for v in v)}" for t, rate, *v in cells]
    path.write_text("\n".join(lines) + "\n")


def test_the_command_reports_how_sure_it_is(capsys, tmp_path, calibrated):
    write(tmp_path / "c.csv", calibrated[1])
    assert run(capsys, "radial", "fit", tmp_path / "c.csv", "--out", tmp_path / "m.json")[0] == 0
    code, out, _ = run(capsys, "radial", "predict", tmp_path / "m.json", tmp_path / "c.csv", "--json")
    reported = [json.loads(line) for line in out.splitlines()]
    assert code == 0 and len(reported) == 30
    assert set(reported[0]) == {"contact", "radius_mm", "sigma_mm", "type", "confidence"}
    assert rms([t["radius_mm"] for t in reported] - calibrated[1].radius_mm) < 2.6
    one = whisks(np.random.default_rng(11), 1, channels=1)
    write(tmp_path / "one.csv", one, "contact,radius_mm,t_s,whisk_rad_s,x")
    code, _, err = run(capsys, "radial", "predict", tmp_path / "m.json", tmp_path / "one.csv")
    assert code == 2 and "1 channels, but the model has 2" in err and err.count("\n") == 1
