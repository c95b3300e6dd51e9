"""Maps from rows that are broken, missing or many: counted, not read, and in bounded memory."""

import json
import multiprocessing
import resource
from dataclasses import replace

import numpy as np

from crunchbot import cli
from crunchbot.nav import mapping
from crunchbot_lab.scenes import write_scene
from crunchbot_lab.scenes.making import make

ROWS, HALF_HOUR = 600, 18000
MOST_BYTES = 256e6


def run(made, rows):
    return mapping.run(made.scene.robot, made.scene.arena.textures, rows)


def broken(rows, impossible: bool):
    """Rows with a tenth of the distances and windows lost, or in their place numbers that no whisker reads; and how many
    cells that is. The first row is whole."""
    draw = np.random.default_rng(5)
    radial, texture = rows.radial_m.copy(), rows.texture.copy()
    lost, blind = draw.random(radial.shape) < 0.1, draw.random(texture.shape[:2]) < 0.1
    lost[0], blind[0] = False, False
    lost &= ~np.isnan(radial)
    blind &= np.isfinite(texture).all(axis=2)
    radial[lost] = np.where(draw.random(lost.sum()) < 0.5, -0.01, 9.0) if impossible else np.nan
    texture[blind] = np.inf if impossible else np.nan
    cells = int(lost.sum() + blind.sum() * texture.shape[2])
    return replace(rows, radial_m=radial, texture=texture), cells


def test_readings_out_of_range_are_counted_and_count_as_not_read():
    made = make("anchor", 31, ROWS)
    bad, cells = broken(made.observations, True)
    missing, _ = broken(made.observations, False)
    read, unread, whole = (run(made, rows) for rows in (bad, missing, made.observations))
    assert cells > 100
    assert (read.bad_cells, unread.bad_cells, whole.bad_cells) == (cells, 0, 0)
    assert np.array_equal(read.table["pose"], unread.table["pose"])
    assert np.array_equal(read.table["covariance"], unread.table["covariance"])
    assert not np.array_equal(read.table["pose"], whole.table["pose"])


def test_a_scene_with_broken_cells_is_mapped_and_they_are_reported(tmp_path, capsys):
    made = make("anchor", 32, ROWS)
    bad, cells = broken(made.observations, True)
    write_scene(tmp_path / "scene", made.scene, bad)
    words = ["map", str(tmp_path / "scene"), "--out", str(tmp_path / "map"), "--json"]
    assert cli.main(words) == 0
    assert json.loads(capsys.readouterr().out)["bad_cells"] == cells


def test_where_the_robot_was_carried_a_new_map_begins():
    rows = make("anchor", 33, ROWS).observations
    motion = rows.odometry.copy()
    motion[[0, 200, 201, 400]] = np.inf
    made = run(make("anchor", 33, ROWS), replace(rows, odometry=motion))
    assert [(part.first, part.noticed) for part in made.parts[1:]] == [(200, 200), (400, 400)]
    assert made.bad_cells == 0 and np.isfinite(made.table["pose"]).all()


def test_rows_that_never_came_make_it_less_sure():
    made = make("anchor", 34, ROWS)
    rows, kept = made.observations, np.r_[0:300, 360:ROWS]
    names = ("t_s", "odometry", "texture", "radial_m", "truth")
    gap = replace(rows, t_text=[rows.t_text[k] for k in kept], **{n: getattr(rows, n)[kept] for n in names})
    spread = np.trace(run(made, gap).table["covariance"][:, :2, :2], axis1=1, axis2=2)
    assert spread[300] > 4.0 * spread[299]


def half_an_hour(report) -> None:
    """Peak memory in bytes above that of a few rows, what the mapper says of it, and the work of its rows."""
    made = make("anchor", 35, HALF_HOUR)
    few = replace(
        made.observations, **{n: getattr(made.observations, n)[:2] for n in ("t_s", "t_text", "odometry", "texture")}
    )
    few = replace(few, radial_m=few.radial_m[:2], truth=few.truth[:2])
    mapping.run(made.scene.robot, made.scene.arena.textures, few)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    mapped = run(made, made.observations)
    peak = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
    finite = bool(np.isfinite(mapped.table["pose"]).all())
    report.send((peak, int(mapped.table["bytes"].max()), mapped.table["evaluations"], finite))


def test_half_an_hour_takes_bounded_memory_and_no_more_work_a_row():
    context = multiprocessing.get_context("spawn")  # the peak of this process is that of all tests before
    here, there = context.Pipe()
    process = context.Process(target=half_an_hour, args=(there,))
    process.start()
    there.close()
    peak, said, evaluations, finite = here.recv()
    process.join()
    third = HALF_HOUR // 3
    assert finite
    assert peak < MOST_BYTES and said < MOST_BYTES
    assert evaluations[-third:].max() <= evaluations[:third].max()
