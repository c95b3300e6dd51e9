"""What a pressed whisker may say, for the demo's four object whiskers."""

import math

import pytest

from crunchbot.touch.mount import NEAREST_MM, Mount
from crunchbot_lab.simulation.scenes import make_robot

MOUNTS = [Mount.of(whisker) for whisker in make_robot().of_role("object")]


def test_inner_whiskers_report_corner_from_face_by_the_turn():
    assert [(m.corner_turn, m.face_turn) for m in MOUNTS[1:3]] == [(1.0, -1.0), (-1.0, 1.0)]


def test_outer_whiskers_cannot():
    assert all(m.corner_turn == m.face_turn for m in (MOUNTS[0], MOUNTS[3]))


@pytest.mark.parametrize(
    ("line_mm", "towards_corner", "distance"),
    [(100.0, True, 100.0), (155.0, True, 140.0), (100.0, False, 140.0), (NEAREST_MM - 1.0, True, None)],
)
def test_distance_of_an_inner_whisker(line_mm, towards_corner, distance):
    mount = MOUNTS[1]
    turn = mount.corner_turn if towards_corner else -mount.corner_turn
    assert mount.distance(line_mm, turn) == pytest.approx(distance)


def test_outer_whisker_is_sure_only_of_its_tip():
    mount = MOUNTS[0]
    assert mount.distance(100.0, mount.corner_turn) is None
    assert mount.distance(150.0, mount.corner_turn) == pytest.approx(140.0)
    assert mount.distance(mount.length_mm, mount.corner_turn) == mount.length_mm


@pytest.mark.parametrize("mount", MOUNTS)
@pytest.mark.parametrize(
    ("arc_mm", "sd_m", "faces", "distance"),
    [
        (110.0, 0.001, (0.02, 0.0), 110.0),
        (110.0, 0.001, (0.98, 0.97), 140.0),
        (110.0, 0.001, (0.02, 0.97), None),  # the kind is not known
        (110.0, 0.001, (0.5, 0.02), None),
        (math.nan, math.inf, (0.98,), 140.0),
        (math.nan, math.inf, (0.02,), None),
        (110.0, 0.006, (0.02, 0.02), None),  # nor the place
        (75.0, 0.001, (0.02, 0.02), None),
    ],
)
def test_what_the_filter_places_is_reported_where_it_is_sure(mount, arc_mm, sd_m, faces, distance):
    """Whichever way it is pressed."""
    x, y = mount.base_m
    point = x + 1e-3 * arc_mm * math.cos(mount.yaw_rad), y + 1e-3 * arc_mm * math.sin(mount.yaw_rad)
    found = mount.felt(faces, point, sd_m, 76.0, 0.005)
    assert found is None if distance is None else found == pytest.approx(distance)
