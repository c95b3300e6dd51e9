"""Recordings made with the world: formats, and the spread of their peaks."""

import numpy as np
import pytest
from demo_robot import flat

from crunchbot_lab.signals import recordings

SPREADS = {"left_outer": 0.082, "left_inner": 0.040, "right_inner": 0.026, "right_outer": 0.063}


def _peak(contact) -> float:
    """Largest deflection from rest, the white noise smoothed away over 5 ms."""
    alpha = contact.counts[:, 0].astype(float)
    smooth = np.convolve(alpha - alpha[:400].mean(), np.full(10, 0.1), mode="valid")
    return float(np.abs(smooth).max())


@pytest.mark.parametrize("whisker", SPREADS)
def test_peaks_at_a_radius_spread_as_predicted(whisker):
    """The whisks' repeatability, not noise or quantisation, makes the spread; so sigma_r = (Lc - a) rho."""
    contacts = recordings.radial_contacts(flat(), whisker, seed=3, repeats=100)
    radius = np.array([contact.radius_mm for contact in contacts])
    peak = np.array([_peak(contact) for contact in contacts])
    relative = np.concatenate([peak[radius == r] / peak[radius == r].mean() for r in np.unique(radius)])
    assert relative.std() == pytest.approx(SPREADS[whisker], rel=0.1)


def test_a_contact_is_rest_push_back_rest():
    contact = recordings.radial_contacts(flat(), "right_inner", seed=1, repeats=1, radii_mm=[138.0])[0]
    alpha = contact.counts[:, 0].astype(float)
    deflection = np.abs(alpha - alpha[:400].mean())
    assert len(alpha) == 800 + 2 * 1200 + 2 * round(recordings.GAP_RAD / recordings.WHISK_RAD_S / 500e-6 + 0.5)
    assert 0.2 + 0.6 < deflection.argmax() * 500e-6 < 0.2 + 0.7
    assert deflection[:400].max() < 100 and deflection[-400:].max() < 100
    assert alpha[deflection.argmax()] < 0x8000  # a right whisker is pushed to its right


def test_longer_push_deflects_more():
    peaks = [
        _peak(recordings.radial_contacts(flat(), "left_inner", 1, 1, push_s, [100.0])[0]) for push_s in (0.3, 0.6, 1.2)
    ]
    assert peaks[1] == pytest.approx(2 * peaks[0], rel=0.05)
    assert peaks[2] == pytest.approx(4 * peaks[0], rel=0.05)


def test_each_contact_has_its_own_amplitude_and_each_seed_its_own():
    one = [_peak(c) for c in recordings.radial_contacts(flat(), "left_outer", 1, 5, radii_mm=[90.0])]
    other = [_peak(c) for c in recordings.radial_contacts(flat(), "left_outer", 2, 5, radii_mm=[90.0])]
    assert len({round(peak) for peak in one + other}) == 10


def test_radial_file(tmp_path):
    path = tmp_path / "radial" / "left_inner.csv"
    contacts = recordings.radial_contacts(flat(), "left_inner", seed=1, repeats=2, radii_mm=[90.0, 138.0])
    recordings.write_radial_contacts(path, contacts)
    assert path.read_text().startswith("contact,radius_mm,t_s,whisk_rad_s,x,y\n0,90,0.0000,0,")
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    assert sorted(set(table[:, 0])) == [0, 1, 2, 3]
    for n, contact in enumerate(contacts):
        rows = table[table[:, 0] == n]
        assert np.all(rows[:, 1] == contact.radius_mm)
        assert np.allclose(rows[:, 2], np.arange(len(rows)) * 500e-6)
        assert np.allclose(rows[:, 3], contact.whisk_rad_s) and np.array_equal(rows[:, 4:], contact.counts)


def test_texture_folders(tmp_path):
    recordings.write_surface_drives(tmp_path, flat(), ["VINYL", "ROUGH"], seed=1, seconds=2.0, speeds=(0.05, 0.2))
    names = {"left_floor_1.csv", "left_floor_2.csv", "right_floor_1.csv", "right_floor_2.csv"}
    assert {p.name for p in (tmp_path / "VINYL").iterdir()} == names
    assert (tmp_path / "ROUGH" / "left_floor_1.csv").read_text().startswith("t_s,x,y\n0.0000,")
    spread = {}
    for surface in ("VINYL", "ROUGH"):
        table = np.loadtxt(tmp_path / surface / "left_floor_2.csv", delimiter=",", skiprows=1)
        assert table.shape == (4000, 3)
        spread[surface] = table[:, 2].std()
    assert spread["ROUGH"] > 3 * spread["VINYL"]


def test_drives_are_long_as_asked_and_repeat():
    one, again = (recordings.surface_drive(flat(), "SMOOTH", 0.1, 9.5, seed=4) for _ in range(2))
    assert one["left_floor"].shape == (19000, 2)
    assert np.array_equal(one["right_floor"], again["right_floor"])
    assert not np.array_equal(one["right_floor"], one["left_floor"])


def test_sweeps_differ_by_the_wall_and_repeat(tmp_path):
    """The rougher the wall, the more a sliding tip shakes; only the tip's own wall counts."""
    shaken = {}
    for surface in ("VINYL", "ROUGH"):
        for whisk in (False, True):
            counts = recordings.surface_sweep(flat(), "left_outer", surface, 5, whisk).astype(float)
            shaken[surface, whisk] = np.diff(counts[:, 0].reshape(-1, 20).mean(axis=1), 2).std()
            assert len(counts) >= 200
    assert all(shaken["ROUGH", whisk] > 2 * shaken["VINYL", whisk] for whisk in (False, True)), shaken
    recordings.write_surface_sweeps(tmp_path, flat(), ["VINYL"], seed=2, count=2)
    assert sorted(f.name for f in (tmp_path / "VINYL").iterdir()) == sorted(
        f"{w}_{k}.csv" for w in SPREADS for k in (1, 2)
    )
