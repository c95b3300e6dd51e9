"""Ways to new floor over maps as they grow. The search's arithmetic is host/nav/tests/test_coverage.c's; closed loops are
lab/tests/scenes/test_map_policy.py's."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from crunchbot.nav.mapper import FACE
from crunchbot.pilot.whereabouts import Whereabouts
from crunchbot.planning.coverage import NOTHING_NEW, CoveragePlanner, Vehicle, Way, lanes, of_growing, sweep
from crunchbot.planning.mapping import DRIVE_M, NO_WHISKERS, REST_TICKS, Mapping
from crunchbot.scene import Robot, Whisker

VEHICLE = Vehicle(0.15, 0.71, 0.5, 0.25)
ROBOT = Robot(
    0.165,
    0.03,
    0.005,
    (
        Whisker("left", "texture", tip_m=(0.0, 0.2)),
        Whisker("right", "texture", tip_m=(0.0, -0.2)),
        Whisker("feeler", "object", base_m=(0.1, 0.0), yaw_rad=0.0, length_m=0.11),
    ),
)
NOWHERE, NEVER = np.zeros((0, 2)), np.zeros((0, 4))
CELL = 0.025


def grown(cells=None, faces=(), axes=None, frame=0):
    """A map with an occupancy (rows, columns) whose corner is at (-2, -2), and faces (x0, y0, x1, y1, normal)."""
    found = np.zeros(len(faces), FACE)
    for out, face in zip(found, faces, strict=True):
        out["x0"], out["y0"], out["x1"], out["y1"], out["normal"] = face
        out["normal_sigma"] = 0.01
    occupied = np.full((160, 160), 0.5) if cells is None else cells
    return SimpleNamespace(
        grid=SimpleNamespace(x=-2.0, y=-2.0, cell=CELL, occupied=occupied), faces=found, axes=axes, frame=frame
    )


def walls(*boxes):
    """Occupancy with solid boxes (x0, y0, x1, y1), m."""
    out = np.full((160, 160), 0.5)
    for x0, y0, x1, y1 in boxes:
        column, row = (slice(*(round((v + 2.0) / CELL) for v in ends)) for ends in ((x0, x1), (y0, y1)))
        out[row, column] = 0.99
    return out


def way_from(known, pose, been=NOWHERE, met=NEVER, **options):
    field, here = of_growing(known, been, met, np.array(pose), ROBOT)
    return CoveragePlanner(VEHICLE, lanes(ROBOT), **options).plan(field, here), here


def test_where_nothing_is_known_it_goes_straight_on():
    way, here = way_from(grown(), (0.0, 0.0, 0.0))
    turn, drive = way.first(here)
    assert abs(turn) < 0.2 and drive > 0.2 and way.seconds > 0.0


def test_where_it_was_nothing_is_new():
    line = np.column_stack([np.linspace(-0.8, 0.8, 160), np.zeros(160)])
    ahead, behind = (way_from(grown(), (0.0, 0.0, turn), line) for turn in (0.0, math.pi))
    for way, here in (ahead, behind):
        assert abs(way.first(here)[0]) > 0.4
    shut = walls((-0.9, -0.3, 0.9, -0.2), (-0.9, 0.2, 0.9, 0.3), (-0.9, -0.3, -0.8, 0.3), (0.8, -0.3, 0.9, 0.3))
    lane = np.column_stack([np.linspace(-0.7, 0.7, 80), np.zeros(80)])
    assert way_from(grown(shut), (0.0, 0.0, 0.0), lane)[0].refused == NOTHING_NEW
    assert not way_from(grown(shut), (0.0, 0.0, 0.0), lane[:40])[0].refused


def opened(field, x, y):
    return float(field.open[int((y - field.y_m) / field.cell_m), int((x - field.x_m) / field.cell_m)])


def test_a_face_is_taken_to_go_on():
    """A wall was felt at one place ahead: it is likely beside it, too, and less so further off."""
    known = grown(faces=[(0.4, 0.1, 0.4, -0.1, math.pi)])
    field, _ = of_growing(known, NOWHERE, NEVER, np.zeros(3), ROBOT)
    assert opened(field, 0.32, 0.0) < opened(field, 0.32, 0.3) < opened(field, 0.32, 0.55) < opened(field, -0.32, 0.0)
    field, _ = of_growing(known, np.array([[0.32, 0.3]]), NEVER, np.zeros(3), ROBOT)
    assert opened(field, 0.32, 0.3) == 1.0


def test_where_it_was_stopped_again_and_again_is_left_alone():
    stop = np.array([[0.2, 0.0, 0.0, 0.0]])
    never, once, thrice = (
        of_growing(grown(), NOWHERE, np.repeat(stop, n, axis=0), np.zeros(3), ROBOT)[0] for n in (0, 1, 3)
    )
    for ahead in (0.06, 0.1):
        assert 0.0 < opened(thrice, ahead, 0.0) < opened(once, ahead, 0.0) < opened(never, ahead, 0.0)
    assert opened(once, -0.1, 0.0) == opened(never, -0.1, 0.0)


def test_what_is_solid_is_closed_as_far_as_the_body_reaches():
    field, _ = of_growing(grown(walls((0.5, -0.5, 0.6, 0.5))), NOWHERE, NEVER, np.zeros(3), ROBOT)
    assert opened(field, 0.52, 0.0) == opened(field, 0.45, 0.0) == 0.0
    assert 0.0 < opened(field, 0.37, 0.0) < opened(field, 0.33, 0.0) < opened(field, 0.1, 0.0)


@pytest.mark.parametrize("axes", [0.3, -0.7])
def test_plans_do_not_depend_on_the_frame(axes):
    """A corridor that is turned: the way leads along it."""
    c, s = math.cos(axes), math.sin(axes)
    lane = np.linspace(0.0, 0.8, 80)[:, None] * [c, s]
    faces = [
        (-s * a - b * c, c * a - b * s, -s * a + b * c, c * a + b * s, axes - math.copysign(math.pi / 2, a))
        for a in (0.25, -0.25)
        for b in (0.9,)
    ]
    way, here = way_from(grown(faces=faces, axes=axes), (*lane[-1], axes), lane)
    turn, drive = way.first(here)
    assert abs(turn) < 0.1 and drive > 0.1


def test_corners_so_near_are_passed():
    way = Way(np.array([[0.02, 0.0], [0.02, 1.0]]))
    turn, drive = way.first(np.zeros(3))
    assert turn == pytest.approx(math.pi / 2, abs=0.05) and drive == pytest.approx(1.0, abs=0.01)


def test_asides_are_within_the_sweep():
    assert lanes(ROBOT)[0] == -lanes(ROBOT)[-1] and sweep(ROBOT) == 0.2 == pytest.approx(lanes(ROBOT)[-1])
    assert sweep(Robot(0.165, 0.03, 0.005, ())) == 0.165


class Body:
    """What a task asks of the behaviour."""

    def __init__(self):
        self.whereabouts, self.turned_away, self.contacts, self.sides = Whereabouts(), -1, {}, {}


class Otherwise:
    def turn(self, b, tick, least_deg, most_deg):
        return 0.7

    def distance(self, b, tick):
        return 0.9

    def whisk(self, b, tick):
        return True


def test_mapping_drives_on_without_a_stop_and_turns_where_a_thing_is():
    pose, known = np.zeros(3), grown()
    task, body = Mapping(ROBOT, VEHICLE, lambda: pose, lambda: known, Otherwise()), Body()
    assert 0.2 < task.on(body, 0) <= DRIVE_M and task.plans == 1
    assert task.turn(body, 0, 60.0, 150.0) == pytest.approx(0.0, abs=0.01)
    body.whereabouts.moved(200, 0.05, 0.0, 0.0)
    for tick in range(250, 254):
        body.whereabouts.meet(tick, 0.0)
    pose = np.array([0.05, 0.0, 0.0])
    assert abs(task.turn(body, 400, 60.0, 150.0)) > 0.5 and task.plans == 2


def test_mapping_without_a_pose_is_random():
    task, body = Mapping(ROBOT, VEHICLE, lambda: None, grown, Otherwise()), Body()
    assert task.turn(body, 0, 60.0, 150.0) == 0.7 and task.distance(body, 0) == 0.9 and task.plans == 0


def test_mapping_is_random_where_nothing_is_new_and_asks_again():
    shut = grown(
        walls((-0.4, -0.4, 0.4, -0.15), (-0.4, 0.15, 0.4, 0.4), (-0.4, -0.4, -0.15, 0.4), (0.15, -0.4, 0.4, 0.4))
    )
    task, body = Mapping(ROBOT, VEHICLE, lambda: np.zeros(3), lambda: shut, Otherwise()), Body()
    body.whereabouts.moved(0, 0.0, 0.0, 0.0)
    assert task.turn(body, 0, 60.0, 150.0) == 0.7 and task.way.refused == NOTHING_NEW
    assert task.distance(body, 10) == 0.9
    task.turn(body, REST_TICKS - 1, 25.0, 90.0)
    assert task.plans == 1
    task.turn(body, REST_TICKS, 25.0, 90.0)
    assert task.plans == 2


def test_mapping_refuses_where_nothing_can_be_read():
    task = Mapping(Robot(0.165, 0.03, 0.005, ()), VEHICLE, lambda: np.zeros(3), grown, Otherwise())
    assert task.turn(Body(), 0, 60.0, 150.0) == 0.0 and task.way.refused == NO_WHISKERS


def test_another_frame_is_another_map():
    pose, frame = np.zeros(3), 0
    task, body = Mapping(ROBOT, VEHICLE, lambda: pose, lambda: grown(frame=frame), Otherwise()), Body()
    for k in range(10):
        body.whereabouts.moved(200 * k, 0.05, 0.0, 0.0)
    task.turn(body, 2000, 25.0, 90.0)
    assert sum(map(len, task._been)) == 10
    frame = 1
    task.turn(body, 2200, 25.0, 90.0)
    assert sum(map(len, task._been)) <= 2
