"""The world at level 1: counts, closed-loop stepping, refusals."""

import numpy as np
import pytest
from demo_robot import flat

from crunchbot_lab.signals import World

SPAN = 65536 / 180  # counts per degree of field


def test_counts_have_a_row_per_tick_and_lane():
    world = World(flat(), 1)
    counts = world.run(50)
    assert counts.shape == (50, 6, 2) and counts.dtype == np.uint16
    assert world.lanes == ("left_floor", "left_outer", "left_inner", "right_inner", "right_outer", "right_floor")


def test_counts_are_in_steps_of_twelve_bits_about_the_middle():
    counts = World(flat(), 1).run(2000).astype(int)
    assert np.all(counts % 16 == 0)
    assert np.all(np.abs(counts - 0x8000) < 1.2 * SPAN)


def test_same_seed_same_counts_in_blocks_of_any_size():
    whole, parts = World(flat(), 3), World(flat(), 3)
    for world in (whole, parts):
        world.drive(0.1, 0.2)
    assert np.array_equal(whole.run(1000), np.concatenate([parts.run(n) for n in (1, 39, 0, 960)]))
    assert not np.array_equal(World(flat(), 4).run(100), World(flat(), 3).run(100))


def test_closed_loop_drives_to_the_wall_and_backs_off():
    world = World(flat(start=(1.25, 1.25, 0.0)), 1)
    lane = world.lanes.index("left_inner")
    rest = world.run(400)[:, lane, 0].mean()
    world.drive(0.15, 0.0)
    while abs(world.run(40)[:, lane, 0].mean() - rest) < SPAN:  # a degree of field
        assert world.pose[0] < 2.4
    assert world.contact(lane).touching and not world.contact(lane).corner
    assert world.contact(lane).radius_m == pytest.approx(0.14)
    world.drive(-0.15, 0.0)
    world.run(1000)
    assert not world.contact(lane).touching


def test_odometry_reports_what_was_driven():
    world = World(flat(), 1)
    world.drive(0.1, 0.0)
    world.run(4000)
    x, y, theta = world.odometry()
    assert x == pytest.approx(world.pose[0] - 0.75, abs=0.2 * 0.09)
    assert (y, theta) == (0.0, 0.0)


def test_tip_knows_its_tile():
    tip = World(flat(start=(0.75, 0.25, 0.0)), 1).tip(0)
    assert (tip.texture, round(tip.inside_m, 6)) == ("SMOOTH", 0.04)  # 0.46 m up in the second tile of the lowest row
    assert tip.travelled_m == 0.0


def test_malformed_scene_is_refused_with_one_line():
    with pytest.raises(ValueError, match=r"^scene:\d+: unknown item 'wheel'; [^\n]*$"):
        World(flat() + "wheel 1\n", 1)


def test_spreads_are_the_papers_by_object_whisker():
    world = World(flat(), 1)
    spreads = [world.spread(lane) for lane, name in enumerate(world.lanes) if "floor" not in name]
    assert spreads == [0.082, 0.040, 0.026, 0.063]
    assert all(world.spread(lane) == 0.0 for lane, name in enumerate(world.lanes) if "floor" in name)


def test_catches_are_reported():
    rough = flat(start=(0.4, 1.25, 0.0)).replace(
        "texture_whisker left_floor", "mechanics modes\ntexture_whisker left_floor"
    )
    caught = []
    for seed in range(6):
        world = World(rough, seed)
        world.drive(0.15, 0.0)
        for _ in range(2000):
            world.run(8)
            caught.append(world.tip(0).caught or world.tip(5).caught)
        assert not world.blocked
    # Some 4 borders of two tips in 8 s, a third of them steps up of 0.06 to 0.4 mm that hold a tip for 2 to 20 ms.
    assert 0.0005 < np.mean(caught) < 0.01


def test_textures_of_faces_change_nothing_but_a_tip_that_slides_along_one():
    """Bit for bit: before the touch all counts are those of smooth faces, and after it those of the other whiskers."""
    start = (1.9, 1.25, 0.0)
    faces = "obstacle 0.1 0.1 0.2 0.2"
    smooth = World(flat(start) + f"{faces}\n", 1)
    rough = World(flat(start) + f"wall ROUGH\n{faces} ROUGH\n", 1)
    lane = smooth.lanes.index("right_inner")
    for world in (smooth, rough):
        world.drive(0.1, 0.05)
    while not smooth.contact(lane).touching:
        assert np.array_equal(smooth.run(1), rough.run(1))
    apart = np.zeros(6, bool)
    for _ in range(25):
        one, other = smooth.run(40), rough.run(40)
        assert smooth.pose == rough.pose and smooth.odometry() == rough.odometry()
        apart |= np.any(one != other, axis=(0, 2))
    touching = np.array([smooth.contact(n).touching for n in range(1, 5)])
    assert apart[lane] and not touching.all() and not apart[1:5][~touching].any() and not apart[[0, 5]].any()
