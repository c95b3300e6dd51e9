"""Faulty calibration recordings: one line that names file, column and remedy, and a model of the contacts that are good."""

import json

import numpy as np
import pytest
from commandkit import run
from whisks import whisks


def rows_of(made) -> list[list]:
    return [
        [name, radius, t, rate, *sample]
        for name, radius, c in zip(made.contact, made.radius_mm, made.recorded, strict=True)
        for t, rate, sample in zip(c.t_s, c.whisk_rad_s, c.samples, strict=True)
    ]


def write(path, rows, header="contact,radius_mm,t_s,whisk_rad_s,x,y"):
    path.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n")


@pytest.fixture(scope="module")
def good():
    return rows_of(whisks(np.random.default_rng(1), 3, 0.02, hz=200.0))


def of(rows, contact: int) -> list[list]:
    return [row for row in rows if row[0] == str(contact)]


WARNED = {
    "constant": (lambda r: [[*row[:5], 100.0] for row in r], "column 'y' never changes; check"),
    "nan rows": (lambda r: [[*row[:4], *(("nan", 0) if i % 9 == 0 else row[4:])] for i, row in enumerate(r)], "no number"),
    "saturated": (lambda r: [[*row[:4], min(row[4], 33100), row[5]] for row in r], "'x' is saturated in 18 contacts"),
    "stuck": (
        lambda r: [[*row[:4], 33000 if row[0] == "4" else row[4], row[5]] for row in r],
        "'x' is stuck in 1 contact (4); check",
    ),
    "stuck from the middle": (
        lambda r: [[*row[:4], 34000 if row[0] == "7" and row[2] > 0.5 else row[4], row[5]] for row in r],
        "'x' is stuck in 1 contact (7)",
    ),
    "two rates": (lambda r: [row for i, row in enumerate(r) if row[0] != "3" or i % 2], "100 Hz (contact 3) to 200 Hz"),
    "three samples": (lambda r: [*of(r, 0)[:3], *(row for row in r if row[0] != "0")], "fewer than 8 samples in 1 contact (0)"),
}  # fmt: skip


@pytest.mark.parametrize("how", WARNED)
def test_a_fault_is_reported_in_a_line_and_the_rest_is_fitted(capsys, tmp_path, good, how):
    spoil, reported = WARNED[how]
    write(tmp_path / "c.csv", spoil(good))
    code, out, err = run(
        capsys, "radial", "fit", tmp_path / "c.csv", "--out", tmp_path / "m.json", "--model", "rational"
    )
    assert code == 0 and err.count("\n") == 1 and str(tmp_path / "c.csv") in err and reported in err
    left_out = how in ("stuck", "stuck from the middle", "three samples")
    assert f"{17 if left_out else 18} contacts" in out


REFUSED = {
    "only three samples": (lambda r: [row for n in range(18) for row in of(r, n)[:3]], "no contact has 8 rows"),
    "all constant": (lambda r: [[*row[:4], 5.0, 100.0] for row in r], "no channel ever changes (x, y); check sensor"),
    "backwards": (lambda r: [[*row[:2], -row[2], *row[3:]] for row in r], "column 't_s' does not increase in 18 contacts"),
    "two radii": (lambda r: [[row[0], row[1] + i % 2, *row[2:]] for i, row in enumerate(r)], "'radius_mm' holds 90 and 91"),
    "no radius": (lambda r: [[row[0], "", *row[2:]] for row in r], "'radius_mm' holds no number above 0; give"),
    "negative radius": (lambda r: [[row[0], -row[1], *row[2:]] for row in r], "'radius_mm' holds no number above 0; give"),
    "no rows": (lambda r: [], "no rows; record"),
}  # fmt: skip


@pytest.mark.parametrize("how", REFUSED)
def test_what_cannot_be_learned_from_is_refused_in_a_line(capsys, tmp_path, good, how):
    spoil, reported = REFUSED[how]
    write(tmp_path / "c.csv", spoil(good))
    code, _, err = run(capsys, "radial", "fit", tmp_path / "c.csv", "--out", tmp_path / "m.json")
    assert code == 2 and err.count("\n") == 1 and reported in err and not (tmp_path / "m.json").exists()


def test_good_recordings_are_read_without_a_word(capsys, tmp_path, good):
    write(tmp_path / "c.csv", good)
    assert run(capsys, "radial", "fit", tmp_path / "c.csv", "--out", tmp_path / "m.json")[2] == ""
    assert run(capsys, "radial", "predict", tmp_path / "m.json", tmp_path / "c.csv")[2] == ""


@pytest.mark.filterwarnings("error")
def test_another_whisker_is_doubted_in_a_line_and_every_contact_still_reported(capsys, tmp_path, good):
    write(tmp_path / "c.csv", good)
    run(capsys, "radial", "fit", tmp_path / "c.csv", "--out", tmp_path / "m.json", "--model", "press")
    swapped = [[*row[:4], row[5], row[4]] for row in good]
    write(tmp_path / "s.csv", swapped)
    code, out, err = run(capsys, "radial", "predict", tmp_path / "m.json", tmp_path / "s.csv", "--json")
    assert code == 0 and len(out.splitlines()) == 18 and err.count("\n") == 1
    assert "18 of 18 contacts are unlike those of calibration; if whisker" in err
    assert all(json.loads(line)["confidence"] < 0.5 for line in out.splitlines())
