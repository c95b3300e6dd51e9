"""Radial distance: equations 2 and 3, model files, calibration recordings."""

import numpy as np
import pytest
from whisks import write_whisks

from crunchbot.tables import TableError
from crunchbot.touch.radial.model import RadialModel, _best, peak, read_whisks


def test_peak_is_the_largest_length_about_rest():
    assert peak(np.array([[1.0, 2.0], [4.0, 6.0], [np.nan, 9e9]]), [1, 2]) == pytest.approx(5.0)


def test_fit_equals_numpys_least_squares():
    rng = np.random.default_rng(5)
    radius = np.repeat(np.arange(90.0, 141.0, 10.0), 5)
    counts = (181.7 - radius) * 100 * (1 + rng.normal(0, 0.05, radius.size))
    model = RadialModel.fit(counts, radius)
    a1, a0 = np.polyfit(counts, radius, 1)
    residual = radius - (a1 * counts + a0)
    assert (model.a1, model.a0) == pytest.approx((a1, a0))
    assert model.sigma_mm == pytest.approx(np.sqrt((residual**2).sum() / (radius.size - 2)))
    assert model.predict(5000.0) == pytest.approx((a1 * 5000 + a0, model.sigma_mm))


def test_tip_and_shaft_are_reported_by_the_outermost_radius():
    model = RadialModel(-0.01, 180.0, 3.0, 90.0, 138.0)
    assert [model.contact_type(mm) for mm in (100.0, 134.0, 136.0, 150.0)] == ["shaft", "shaft", "tip", "tip"]


def test_too_few_contacts_are_refused():
    with pytest.raises(ValueError, match="at more radii"):
        RadialModel.fit([1.0, 2.0], [100.0, 90.0])
    with pytest.raises(ValueError, match="radius_mm: shape"):
        RadialModel.fit([1.0, 2.0, 3.0], [100.0, 90.0])


def test_a_calibration_file_gives_its_peaks(tmp_path):
    path = tmp_path / "w.csv"
    write_whisks(path, [500.0, 400.0, 300.0], [90, 100, 110])
    whisks = read_whisks(path, with_radius=True)
    assert whisks.contact == ["0", "1", "2"]
    assert whisks.peak_counts == pytest.approx([500.0, 400.0, 300.0])
    assert whisks.radius_mm == pytest.approx([90.0, 100.0, 110.0])
    assert RadialModel.fit(whisks.peak_counts, whisks.radius_mm).sigma_mm == pytest.approx(0.0, abs=1e-6)


def test_predicting_never_reads_the_radius(tmp_path):
    path = tmp_path / "w.csv"
    write_whisks(path, [500.0], ["secret"])
    assert read_whisks(path, with_radius=False).radius_mm is None


def test_cells_that_are_no_numbers_are_left_out_and_counted(tmp_path):
    path = tmp_path / "w.csv"
    write_whisks(path, [500.0], [90])
    lines = path.read_text().splitlines()
    lines[50] = "0,90,0.1,oops,2000"
    path.write_text("\n".join(lines))
    whisks = read_whisks(path, with_radius=True)
    assert whisks.bad_rows == 1 and whisks.peak_counts == pytest.approx([500.0])


@pytest.mark.parametrize(
    ("header", "complaint"),
    [
        ("contact,radius_mm,t_s,x,x", "appears twice"),
        ("touch,radius_mm,t_s,x,y", "'contact' is missing"),
        ("contact,radius,t_s,x,y", "'radius_mm' is missing"),
        ("contact,radius_mm,t_s,x", "line 2: 5 cells but 4 columns"),
    ],
)
def test_malformed_calibrations_are_one_clear_line(tmp_path, header, complaint):
    write_whisks(tmp_path / "w.csv", [500.0], [90], header)
    with pytest.raises(TableError, match=complaint):
        read_whisks(tmp_path / "w.csv", with_radius=True)


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"format": "whisker radial model 1", "a1": "x"}', "\x00"])
def test_spoiled_model_files_are_one_clear_line(tmp_path, text):
    (tmp_path / "m.json").write_text(text)
    with pytest.raises(TableError, match="whisker radial fit"):
        RadialModel.load(tmp_path / "m.json")


def test_saved_models_load_alike(tmp_path):
    model = RadialModel(-0.011, 181.5, 2.5, 90.0, 138.0)
    model.save(tmp_path / "m.json")
    assert RadialModel.load(tmp_path / "m.json").predict(4000.0) == model.predict(4000.0)


def test_models_whose_errors_at_left_out_places_are_alike_are_reported_apart_by_left_out_contacts():
    errors = {"far": (2.5, 1.0), "near": (2.0, 1.9), "nearly": (2.2, 1.6), "none": (np.inf, np.inf)}
    errors = {name: np.array(pair) for name, pair in errors.items()}
    assert _best(errors, 30) == "nearly"  # 2.0 is known to 13 %
    assert _best(errors, 1000) == "near"
    assert _best(errors, 5) == "far"
