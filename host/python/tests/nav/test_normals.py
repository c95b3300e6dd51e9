"""Rows that carry the direction of the surface that a whisker touches: read, judged, used by filters; and rows that do not."""

import math
from dataclasses import replace

import numpy as np
import pytest

from crunchbot.nav import localise
from crunchbot.observation import Row, has_normals
from crunchbot.robot.network.inbox import Received
from crunchbot.robot.network.row_checks import RowChecks
from crunchbot.robot.network.rows import to_message
from crunchbot.robot.network.streams import Envelope
from crunchbot.tables import TableError
from crunchbot_lab import scenes
from crunchbot_lab.scenes import geometry

FAMILY = "anchor+normals"


@pytest.fixture(scope="module")
def made():
    return scenes.make(FAMILY, 3)


def written(made, folder):
    scenes.write_scene(folder, made.scene, made.observations)
    return localise.observations_path(folder)


def rows_of(observations, scene, k):
    """Row k as the pilot makes it."""
    row = {"t_s": observations.t_s[k]} | dict(zip(localise.ODOMETRY, observations.odometry[k], strict=True))
    for w, values in zip(scene.robot.of_role("texture"), observations.texture[k], strict=True):
        row |= dict(zip((f"{w.name}_{t}" for t in scene.arena.textures), values, strict=True))
    for n, w in enumerate(scene.robot.of_role("object")):
        distance, (normal, sd) = observations.radial_m[k, n], observations.normal[k, n]
        row[f"{w.name}_mm"] = None if np.isinf(distance) else 1000.0 * distance
        row |= {f"{w.name}_normal_rad": None if np.isnan(normal) else normal, f"{w.name}_normal_sd_rad": sd}
    return row


def test_directions_lie_as_the_faces_do(made):
    truth, rows = made.observations.truth, made.observations
    off = []
    for n, whisker in enumerate(made.scene.robot.of_role("object")):
        reported = np.isfinite(rows.normal[:, n, 0])
        turned = geometry.directions(made.scene.arena, truth, replace(whisker, length_m=0.145), 0.0)[reported]
        off += np.remainder(rows.normal[reported, n, 0] + truth[reported, 2] - turned + math.pi, 2 * math.pi).tolist()
    off = np.degrees(np.abs(np.array(off) - math.pi))
    assert len(off) > 50 and np.median(off) == pytest.approx(0.674 * 5.0, rel=0.3)
    assert np.array_equal(np.isnan(rows.normal[..., 0]), np.isnan(rows.normal[..., 1]))


@pytest.mark.parametrize("name", ["grid", "particle", "adaptive", "foveal", "ekf"])
def test_filters_use_them(made, name):
    with_them, without = (
        localise.run(name, made.scene, rows) for rows in (made.observations, replace(made.observations, normal=None))
    )
    assert with_them.bad_cells == with_them.bad_rows == 0 and np.isfinite(with_them.poses).all()
    assert not np.allclose(with_them.poses, without.poses, atol=1e-4)


def test_bad_directions_are_counted_and_the_run_goes_on(made, tmp_path):
    path = written(made, tmp_path)
    lines = [line.split(",") for line in path.read_text().splitlines()]
    column = lines[0].index("object1_normal_rad")
    for line, normal, sd in zip(
        lines[1:9],
        ("nan", "inf", "7", "x", "1", "1", "1", "1"),
        ("1", "1", "1", "1", "nan", "0", "-1", "9"),
        strict=True,
    ):
        line[column : column + 2] = normal, sd
    path.write_text("\n".join(map(",".join, lines)) + "\n")
    observations = localise.read_observations(path, made.scene)
    assert localise.run("particle", made.scene, observations).bad_cells == 8


def test_a_direction_without_its_deviation_is_no_structure(made, tmp_path):
    path = written(made, tmp_path)
    path.write_text(path.read_text().replace("object1_normal_sd_rad", "object1_unknown"))
    with pytest.raises(TableError, match="line 1: column 'object1_normal_sd_rad' is missing"):
        localise.read_observations(path, made.scene)


def test_rows_of_one_whisker_may_report_it_alone(made, tmp_path):
    path = written(made, tmp_path)
    path.write_text(path.read_text().replace("object2_", "stranger_").replace("stranger_mm", "object2_mm"))
    observations = localise.read_observations(path, made.scene)
    assert np.isnan(observations.normal[:, 1]).all() and np.isfinite(observations.normal[:, 0]).any()


def test_points_are_read_where_they_are_reported(made, tmp_path):
    point = np.round(np.random.default_rng(1).normal(size=(len(made.observations), 4, 3)), 6)
    rows = replace(made.observations, point=point)
    scenes.write_scene(tmp_path, made.scene, rows)
    again = localise.read_observations(localise.observations_path(tmp_path), made.scene)
    assert np.array_equal(again.point, point)


def test_pilot_rows_and_arrays_are_the_same_to_a_filter_that_takes_directions(made):
    one, other = (localise.Filter("particle", made.scene, normals=True) for _ in range(2))
    rows = made.observations
    for k in range(150):
        a = one.step(rows_of(rows, made.scene, k))
        b = other.step_values(rows.t_s[k], rows.odometry[k], rows.texture[k], rows.radial_m[k], normal=rows.normal[k])
        assert a.pose == pytest.approx(b.pose, abs=1e-9)
    assert np.isfinite(rows.normal[:150]).any()


def test_without_the_columns_a_filter_is_what_it_was(made):
    """A file without them, and one with empty ones: the same bits for particles, which have no tables."""
    plain = replace(made.observations, normal=None)
    empty = replace(made.observations, normal=np.full_like(made.observations.normal, np.nan))
    one, other = (localise.run("particle", made.scene, rows) for rows in (plain, empty))
    assert np.array_equal(one.poses, other.poses)


def test_rows_from_the_network_are_judged(made):
    row = rows_of(made.observations, made.scene, 0)
    assert has_normals(row) and not has_normals(["object1_mm"])

    def fault(cells):
        message = to_message(Row.of(cells), 0, np.zeros(3))
        return RowChecks(made.scene)(Received("observation", message, Envelope(0, 0, 0)))

    assert fault(row) == ""
    del row["object2_normal_sd_rad"]
    assert "cell object2_normal_sd_rad is missing" in fault(row)
