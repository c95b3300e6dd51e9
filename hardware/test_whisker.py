"""Field at the sensor, drawing and printable parts: all three from the same measures, and these from the simulation's."""

import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "whisker"))
import drawing  # noqa: E402
import printed  # noqa: E402
from mount import CONSTANTS, Mount, constants  # noqa: E402


@pytest.fixture(scope="module")
def mount() -> Mount:
    return Mount.read()


def remanences(mount: Mount) -> tuple[float, float]:
    return mount.given["magnet"]["remanence_low"], mount.given["magnet"]["remanence_high"]


def test_field_turns_as_much_as_the_simulation_says(mount):
    assert -mount.field_angle(0.01) / 0.01 == pytest.approx(constants()["SIM_FIELD_GAIN"], rel=1e-4)
    assert -mount.field_angle(5) == pytest.approx(13.68, abs=0.01)


def test_field_stays_in_the_sensors_range_up_to_the_stop(mount):
    for remanence in remanences(mount):
        for tilt in np.linspace(-mount.stop, mount.stop, 31):
            strength = np.hypot(*mount.field(tilt, remanence))
            assert mount.given["chip"]["field_low"] < strength < mount.given["chip"]["field_high"], tilt


def test_dipole_formula_is_the_disc_from_far_away(mount):
    far = Mount(**{**vars(mount), "magnet_to_sensor": 40.0})
    assert far.field(0, 1.3)[1] == pytest.approx(far.on_axis(1.3), rel=2e-3)
    assert mount.field(0, 1.3)[1] == pytest.approx(mount.on_axis(1.3), rel=0.15)


def test_whisker_meets_the_rim_at_the_stop(mount):
    angle = math.radians(mount.stop)
    inside = mount.whisker_length - mount.whisker_outside
    # The rim's corner lies on the side of the tilted whisker: its distance from the whisker's axis is the radius there.
    away = mount.rim_radius * math.cos(angle) - (mount.rim - mount.pivot) * math.sin(angle)
    assert away == pytest.approx(mount.diameter(inside) / 2, abs=1e-9)


def outlines(text: str) -> dict[str, np.ndarray]:
    """Name -> corners in mm (from the axis, above the board) of what the section names."""
    found = {}
    for name, path in re.findall(r'<path id="([\w-]+)" d="([^"]+)"', text):
        points = np.array([[float(v) for v in pair] for pair in re.findall(r"[ML]([-\d.]+),([-\d.]+)", path)])
        found[name] = (points - (drawing.AXIS, drawing.BOARD)) / (drawing.SECTION, -drawing.SECTION)
    return found


def test_drawing_is_made_from_these_measures_and_shows_the_printed_parts(mount):
    text = drawing.draw(mount)
    assert text == (HERE / "whisker/whisker.svg").read_text(encoding="utf-8"), "whisker.svg is old: run drawing.py"
    assert "NOT YET BUILT" in text
    shapes = outlines(text)
    magnet, chip = shapes["magnet"], shapes["chip"]
    assert magnet[:, 1].min() - chip[:, 1].max() == pytest.approx(mount.given["chip"]["air_gap"], abs=1e-3)
    assert shapes["whisker"][:, 1].min() == pytest.approx(magnet[:, 1].max(), abs=1e-3)
    for name, bottom in (("follicle", 0), ("plug_holder", mount.holder_bottom)):
        solid = printed.PARTS[name](mount).translate((0, 0, bottom))
        shape = shapes[f"{name.removeprefix('plug_')}-right"]
        # A cut of the solid through the axis, in the plane y = 0, right of the axis.
        cut = solid.rotate((-90, 0, 0)).slice(0)
        x0, z0, x1, z1 = cut.bounds()
        assert (x1, z0, z1) == pytest.approx((shape[:, 0].max(), shape[:, 1].min(), shape[:, 1].max()), abs=0.01)
        half = [p for polygon in cut.to_polygons() for p in polygon if p[0] > 0]
        for corner in shape:
            assert min(math.dist(corner, p) for p in half) < 0.02, (name, corner)


@pytest.mark.parametrize("name", printed.PARTS)
def test_printed_part_is_watertight_and_as_large_as_its_measures(name, mount, tmp_path):
    printed.write_stl(tmp_path / "part.stl", printed.PARTS[name](mount))
    data = (tmp_path / "part.stl").read_bytes()
    count = int.from_bytes(data[80:84], "little")
    rows = np.frombuffer(data[84:], [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
    assert len(rows) == count > 100
    names: dict[bytes, int] = {}
    faces = [[names.setdefault(corner.tobytes(), len(names)) for corner in row] for row in rows["corners"]]
    edges = [(face[n], face[(n + 1) % 3]) for face in faces for n in range(3)]
    assert len(set(edges)) == len(edges) and {(b, a) for a, b in edges} == set(
        edges
    )  # each edge once in either direction
    corners = rows["corners"].astype(float)
    volume = np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    size = corners.reshape(-1, 3).max(axis=0) - corners.reshape(-1, 3).min(axis=0)
    ring = math.pi * (mount.rim_radius - mount.given["holder"]["clearance"]) ** 2 * mount.holder_height
    plug = math.pi * (mount.given["plug"]["diameter"] / 2) ** 2 * mount.given["plug"]["length"]
    if name == "follicle":
        flange = mount.given["follicle"]["flange"]
        assert size == pytest.approx((flange, flange, mount.rim), abs=1e-3)
        assert volume > 1000
    else:
        assert size[2] == pytest.approx(mount.holder_height, abs=1e-3)
        assert 0.5 * (ring - plug) < volume < ring - plug


def test_holder_slides_into_the_follicle_and_the_magnet_swings_free(mount):
    follicle = printed.follicle(mount)
    holder = printed.plug_holder(mount).translate((0, 0, mount.holder_bottom))
    assert (follicle ^ holder).volume() == pytest.approx(0, abs=1e-6)
    magnet = mount.given["magnet"]
    disc = printed.bore(magnet["diameter"], mount.magnet_bottom, mount.base).translate((0, 0, -mount.pivot))
    tilted = disc.rotate((0, mount.stop, 0)).translate((0, 0, mount.pivot))
    assert (tilted ^ (follicle + holder)).volume() == 0
    assert tilted.bounding_box()[2] > mount.given["chip"]["height"] + 0.5


@pytest.mark.parametrize("old, new, says", [
    ("air_gap = 0.75", "air_gap = 1.6", "chip.air_gap"), ("throat = 5.0", "throat = 3.0", "follicle.throat"),
    ("9.0, 2.2]", "9.0, 4.2]", "follicle.cavity"),
])  # fmt: skip
def test_measures_that_do_not_fit_are_refused_by_name(tmp_path, old, new, says):
    text = (HERE / "whisker/mount.toml").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "mount.toml").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ValueError, match=says):
        Mount.read(tmp_path / "mount.toml", CONSTANTS)
