"""The pilot in closed loop with the level-1 world: where it drives, what it reports, what it ignores."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from models import model as texture_model

from crunchbot.nav import localise
from crunchbot.observation import has_normals
from crunchbot.pilot.behaviour import BLOCK_TICKS, ODOMETRY_TICKS
from crunchbot.pilot.pilot import Pilot, compose
from crunchbot.pilot.states import Whisk
from crunchbot.robot.models import load_models
from crunchbot.scene import Arena, Scene
from crunchbot.touch.contact import Contact
from crunchbot_lab.demo import kept_models, training
from crunchbot_lab.demo.level1 import explore
from crunchbot_lab.demo.study import study
from crunchbot_lab.scenes.geometry import directions
from crunchbot_lab.signals import World
from crunchbot_lab.simulation.scenes import TEXTURES, make_robot, make_scene

SEED = 11
TICKS = 80_000
BESIDE_M = 0.005  # between a corner and the shaft it has just let go
ODOMETRY = ("odo_x_m", "odo_y_m", "odo_theta_rad")


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")
    kept_models.learn_or_copy(folder, make_scene(SEED)[0], SEED, lambda: None)
    return folder


@pytest.fixture(scope="module")
def flown(models):
    """Scene, pilot, rows, truth and reported odometry of one exploration."""
    return fly(models, TICKS)


def fly(models, ticks, seed=SEED, **options):
    scene, start = make_scene(seed)
    pilot = Pilot(scene.robot, *load_models(models, scene.robot), seed)
    reported, take = [], pilot.odometry
    pilot.odometry = lambda tick, *motion: reported.append(motion) or take(tick, *motion)
    rows, truth = explore(scene, start, pilot, seed, ticks, **options)
    return scene, pilot, rows, truth, reported


def range_along(scene, whisker, pose) -> float:
    """Distance from a whisker's base to what it touches or all but touches, mm: the truth for a radial reading.

    A corner beside the shaft is met at its projection on the shaft, a face where the whisker's line meets it.
    """
    x, y, theta = pose
    bx, by = whisker.base_m
    base = np.array([x + math.cos(theta) * bx - math.sin(theta) * by, y + math.sin(theta) * bx + math.cos(theta) * by])
    along = np.array([math.cos(theta + whisker.yaw_rad), math.sin(theta + whisker.yaw_rad)])
    beside = [
        (float(along @ (corner - base)), abs(float(along[0] * (corner - base)[1] - along[1] * (corner - base)[0])))
        for corner in corners(scene)
    ]
    met = [reach for reach, gap in beside if 0.0 < reach <= whisker.length_m and gap < BESIDE_M]
    met += [hit for box in scene.arena.obstacles if (hit := enters(base, along, box)) is not None]
    walls = (0.0, 0.0, *scene.arena.size_m)
    return 1000.0 * min([*met, leaves(base, along, walls)])


def corners(scene):
    return [np.array([x, y]) for x0, y0, x1, y1 in scene.arena.obstacles for x in (x0, x1) for y in (y0, y1)]


def crossings(base, along, box):
    """Where the line is within the box's x range, and its y range: two (near, far)."""
    return [sorted((box[axis + end] - base[axis]) / along[axis] for end in (0, 2)) for axis in (0, 1)]


def enters(base, along, box):
    (near_x, far_x), (near_y, far_y) = crossings(base, along, box)
    near, far = max(near_x, near_y), min(far_x, far_y)
    return near if 0.0 <= near <= far else None


def leaves(base, along, box):
    return min(far for _, far in crossings(base, along, box))


def readings(rows, scene):
    """(row number, whisker, mm) of every measured distance."""
    for number, row in enumerate(rows):
        for whisker in scene.robot.of_role("object"):
            value = row[f"{whisker.name}_mm"]
            if value is not None and not math.isnan(value):
                yield number, whisker, value


def test_stays_inside_the_arena_and_off_the_blocks(flown):
    scene, _, _, truth, _ = flown
    for row in truth:
        assert scene.arena.is_free(row["x_m"], row["y_m"], scene.robot.body_radius_m - 0.001)


def test_truth_reports_how_far_a_floor_whiskers_tip_went_in_each_row(flown):
    """At least the straight line between its two places; hardly more on the whole, for few rows have a bend in them."""
    scene, _, _, truth, _ = flown
    poses = [[row[key] for key in ("x_m", "y_m", "theta_rad")] for row in truth]
    for whisker in scene.robot.of_role("texture"):
        tips = np.array([compose(pose, (*whisker.tip_m, 0.0))[:2] for pose in poses])
        straight_mm = 1000.0 * np.hypot(*np.diff(tips, axis=0).T)
        moved_mm = np.array([row[f"{whisker.name}_moved_mm"] for row in truth[1:]])
        assert (moved_mm > straight_mm - 1e-6).all() and np.ptp(moved_mm) > 1.0
        assert np.sum(moved_mm) < 1.2 * np.sum(straight_mm)


def test_explores_and_whisks(flown):
    _, pilot, _, truth, _ = flown
    path = sum(math.dist((a["x_m"], a["y_m"]), (b["x_m"], b["y_m"])) for a, b in zip(truth, truth[1:], strict=False))
    assert path > 1.5
    assert len(pilot.whisks) >= 2


def test_radial_readings_are_the_distance_at_their_row(flown, models):
    scene, _, rows, truth, _ = flown
    found = [(scene, rows, truth)]
    for seed in (12, 13, 14):
        made = fly(models, TICKS, seed)
        found.append((made[0], made[2], made[3]))
    errors = [
        value - range_along(scene, whisker, [truth[n][key] for key in ("x_m", "y_m", "theta_rad")])
        for scene, rows, truth in found
        for n, whisker, value in readings(rows, scene)
    ]
    assert len(errors) >= 6
    assert np.median(np.abs(errors)) < 6.0
    assert np.max(np.abs(errors)) < 30.0


def test_rows_report_how_the_surface_lies_where_a_whiskers_tip_met_it(models):
    """By chance a direction is within 15 degrees once in twelve times."""
    errors = []
    for seed in range(1, 8):
        scene, start = make_scene(seed)
        pilot = Pilot(scene.robot, *load_models(models, scene.robot), seed)
        rows, truth = explore(scene, start, pilot, seed, TICKS)
        for whisker in scene.robot.of_role("object"):
            poses = np.array([[row[key] for key in ("x_m", "y_m", "theta_rad")] for row in truth])
            longer = replace(whisker, length_m=whisker.length_m + BESIDE_M)
            true = directions(scene.arena, poses, longer, BESIDE_M) - poses[:, 2]
            reported = np.array([row[f"{whisker.name}_normal_rad"] for row in rows], float)
            assert all(
                (row[f"{whisker.name}_normal_sd_rad"] is None) == np.isnan(t)
                for row, t in zip(rows, reported, strict=True)
            )
            off = reported - true
            errors += [math.degrees(math.remainder(e, 2 * math.pi)) for e in off[np.isfinite(off)]]
    assert len(errors) >= 5
    assert np.median(np.abs(errors)) < 5.0
    assert np.mean(np.abs(errors) < 15.0) >= 0.8


def test_rows_report_no_direction_of_a_corner_under_the_shaft(models):
    """In the turn alone it bends as at a tip on a face; the filter follows the object over the gap after driving into it."""
    scene = room((2.5, 2.5), [(1.25, 1.12, 1.29, 1.16)])
    pilot = Pilot(scene.robot, *load_models(models, scene.robot), SEED)
    rows, _ = explore(scene, (0.75, 1.25, 0.0), pilot, SEED, 14_000)
    (row,) = [row for row in rows if row["object_3_mm"] is not None and row["object_3_mm"] < 130.0]
    assert row["object_3_normal_rad"] is None
    assert pilot.whisks[0]["type"] == "shaft" and pilot.whisks[0]["face"] < 0.1


@pytest.mark.parametrize(
    ("beside_m", "heading", "tip"), [(0.1, 0.0, False), (0.08, 0.0, False), (0.07, 0.15, True), (0.12, 0.0, None)]
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_corner_is_reported_where_it_is_or_not_at_all(models, beside_m, heading, tip, side):
    """0.12 m beside the robot's middle it is met 40 mm from the whisker's base, and bends it as one far out would."""
    low, high = sorted((1.25 - side * beside_m, 1.25 - side * (beside_m + 0.04)))
    scene = room((2.5, 2.5), [(1.25, low, 1.29, high)])
    pilot = Pilot(scene.robot, *load_models(models, scene.robot), SEED)
    rows, truth = explore(scene, (0.75, 1.25, side * heading), pilot, SEED, 12_000)
    poses = [[row[key] for key in ("x_m", "y_m", "theta_rad")] for row in truth]
    found = [(mm, mm - range_along(scene, whisker, poses[n])) for n, whisker, mm in readings(rows, scene)]
    assert all(abs(off) < 5.0 for _, off in found)
    assert len(found) == (tip is not None) and all((mm > 130.0) == tip for mm, _ in found)


def line_models(models, scene):
    """The texture models, and the paper's lines of the same whisks."""
    texture, radial = load_models(models, scene.robot)
    return texture, {name: line for name, line in training.calibrations(models)[0].items() if name in radial}


def test_rows_hold_no_normals_where_a_model_is_the_papers_line(models):
    scene, start = make_scene(SEED)
    pilot = Pilot(scene.robot, *line_models(models, scene), SEED)
    rows, _ = explore(scene, start, pilot, SEED, 2_000)
    assert not pilot.feelers and not has_normals(rows[0])


def test_every_reported_motion_reaches_a_row_once(flown):
    _, pilot, rows, _, reported = flown
    total, carried = np.zeros(3), np.zeros(3)
    for motion in reported:
        total = compose(total, motion)
    for row in rows:
        carried = compose(carried, [row[key] for key in ODOMETRY])
    assert compose(carried, pilot._pending) == pytest.approx(total, abs=1e-9)


def test_rows_of_a_whisk_hold_everything_back(flown):
    scene, _, rows, _, _ = flown
    objects = [f"{w.name}_mm" for w in scene.robot.of_role("object")]
    textures = [f"{w.name}_{t}" for w in scene.robot.of_role("texture") for t in scene.arena.textures]
    held = [row for row in rows[5:] if all(row[key] is not None and math.isnan(row[key]) for key in objects)]
    assert len(held) > 10
    for row in held:
        assert [row[key] for key in ODOMETRY] == [0.0, 0.0, 0.0]
        assert all(row[key] is None for key in textures)


def test_release_row_carries_the_whisks_odometry(flown):
    scene, _, rows, _, _ = flown
    for number, whisker, _ in readings(rows, scene):
        assert any(rows[number][key] != 0.0 for key in ODOMETRY)
        others = [rows[number][f"{w.name}_mm"] for w in scene.robot.of_role("object") if w != whisker]
        assert all(value is None or math.isnan(value) for value in others)


def test_rows_fit_the_filters(flown):
    scene, _, rows, _, _ = flown
    grid = localise.Filter("grid", scene)
    for row in rows:
        grid.step(row)
    assert grid.bad_cells == 0 and grid.bad_rows == 0
    assert [row["t_s"] for row in rows[:3]] == [0.1, 0.2, 0.3]


def test_bad_samples_are_counted_and_their_counts_never_used(models):
    ticks = 24_000
    random = np.random.default_rng(3)
    bad = random.random((ticks, 6)) < 0.02

    def status(first):
        return bad[first : first + BLOCK_TICKS].astype(np.uint16) << 10

    class Spoilt(Pilot):
        """Sees other counts wherever the status is bad."""

        value = 0

        def block(self, first_tick, alpha, beta, status):
            alpha, beta = alpha.copy(), beta.copy()
            alpha[status != 0] = self.value
            beta[status != 0] = self.value
            self.drives.append(super().block(first_tick, alpha, beta, status))
            return self.drives[-1]

    flights = []
    for value in (0, 0xFFFF):
        scene, start = make_scene(SEED)
        pilot = Spoilt(scene.robot, *load_models(models, scene.robot), SEED)
        pilot.value, pilot.drives = value, []
        rows, _ = explore(scene, start, pilot, SEED, ticks, status=status)
        assert pilot.bad_samples == bad.sum()
        flights.append((repr(rows), pilot.drives))
    assert flights[0] == flights[1]


@pytest.mark.parametrize(("onset", "measured"), [(838, False), (839, False), (840, True), (3000, True), (3001, False)])
def test_only_what_was_met_in_the_turn_and_pushed_to_the_end_is_measured(monkeypatch, onset, measured):
    """The turn follows the block that ends with tick 839; a whisker may have met something in the retreat before it."""
    robot = make_robot()
    texture = {whisker.name: texture_model() for whisker in robot.of_role("texture")}
    pilot, reported = Pilot(robot, texture, {}, SEED), []
    lane = pilot.object_lanes[0]
    monkeypatch.setattr(pilot, "_measure", reported.append)
    pilot.behaviour.whisk = Whisk(lane, 1.0, start=839, push_end=3000 + pilot.behaviour.wheels.push_ticks)
    met = SimpleNamespace(onset=onset, release=5000, touching=False, settled=True, block=lambda *_: None)
    monkeypatch.setitem(pilot.contacts, lane, met)
    rest = np.full((BLOCK_TICKS, len(pilot.names)), 0x8000, np.uint16)
    pilot.block(5000, rest, rest, np.zeros_like(rest))
    assert (len(reported) == 1) == measured


def test_onset_and_release_are_dated_to_the_sample():
    contact = Contact()
    rest, pushed = [32768.0, 32768.0], [32768.0, 33268.0]
    samples = np.array([rest] * 500 + [pushed] * 300 + [rest] * 200)
    for first in range(0, 1000, BLOCK_TICKS):
        block = samples[first : first + BLOCK_TICKS]
        contact.block(np.arange(first, first + len(block)), block, np.ones(len(block), bool))
    assert (contact.onset, contact.release, contact.touching) == (500, 800, False)


@pytest.mark.parametrize("size", [1, 2, 7, 1000])
def test_contacts_are_dated_alike_whatever_the_blocks(size):
    rest, pushed = [32768.0, 32768.0], [32768.0, 33268.0]
    samples = np.array([rest] * 500 + [pushed] * 300 + [rest] * 200)
    contact = Contact()
    for first in range(0, 1000, size):
        block = samples[first : first + size]
        contact.block(np.arange(first, first + len(block)), block, np.ones(len(block), bool))
    assert (contact.onset, contact.release) == (500, 800)


def test_same_seed_same_figures(models):
    first, second = (study(SEED, 8.0, models) for _ in range(2))
    assert first == second
    assert first != study(SEED + 1, 8.0, models) | {"seed": SEED}


def test_grid_beats_odometry(models):
    figures = study(SEED, 40.0, models)
    assert figures["pose_error_median_m"] <= 0.08
    assert figures["pose_error_median_m"] <= 0.5 * figures["odometry_error_median_m"]
    assert figures["texture_accuracy"] >= 0.9


def test_odometry_is_asked_for_after_each_fifth_block(flown):
    _, _, rows, truth, reported = flown
    assert len(rows) == len(truth) == len(reported) == TICKS // ODOMETRY_TICKS


def test_motions_compose_in_the_frame_they_start_in():
    quarter = math.pi / 2
    assert compose((1.0, 0.0, quarter), (2.0, 0.5, 0.1)) == pytest.approx([0.5, 2.0, quarter + 0.1])


def room(size_m, boxes=()):
    """An arena without a pattern: every tile vinyl; the whiskers are those that `models` learnt."""
    tiles = [math.ceil(side / 0.5) for side in size_m]
    whiskers = make_scene(SEED)[0].simulated
    return Scene(
        Arena(size_m, 0.5, TEXTURES, ("V" * tiles[0],) * tiles[1], tuple(boxes)), make_robot(), simulated=whiskers
    )


def fly_in(scene, start, models, ticks, seed=SEED):
    pilot = Pilot(scene.robot, *load_models(models, scene.robot), seed)
    _, truth = explore(scene, start, pilot, seed, ticks)
    return pilot, [(row["x_m"], row["y_m"]) for row in truth]


@pytest.mark.parametrize("size_m", [(1.0, 1.0), (1.5, 0.8)])
def test_does_not_stay_in_a_corner(models, size_m):
    start = (0.25, 0.25, -0.75 * math.pi)
    pilot, path = fly_in(room(size_m), start, models, TICKS)
    for first in range(0, len(path) - 210, 10):
        assert any(math.dist(path[first], place) > 0.2 for place in path[first : first + 210])  # 21 s
    assert len(pilot.whisks) >= 1


def test_a_contact_of_the_shaft_is_followed_by_one_of_the_tip(models):
    """By the world's truth: a whisk that slips off the last millimetres is not reported."""
    start = (0.75, 1.25, 0.0)
    for side, beside in ((1.0, 0.09), (-1.0, 0.1), (1.0, 0.11)):
        low, high = sorted((1.25 - side * beside, 1.25 - side * (beside + 0.04)))
        scene, met = room((2.5, 2.5), [(1.25, low, 1.29, high)]), []
        world = World(scene.flat(start), SEED)
        pilot = Pilot(scene.robot, *line_models(models, scene), SEED)

        def watch(first, _, world=world, met=met):
            met += [(first, lane, world.contact(lane).radius_m) for lane in range(2, 6) if world.contact(lane).touching]

        explore(scene, start, pilot, SEED, 18_000, on_block=watch, world=world)
        shaft = pilot.whisks[0]
        assert (shaft["type"], shaft["tries"]) == ("shaft", 0)
        next_mm = next(1e3 * radius for first, _, radius in met if first > shaft["release"])
        assert next_mm > 130.0
