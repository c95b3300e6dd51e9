"""One map, far from its image's corner and turned, through every door: files, navigator, messages, bag, page. Poses agree."""

import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from commandkit import run, signals_as_before  # noqa: F401 - a fixture
from patience import PATIENCE_S
from PIL import Image
from robotkit import Robot, take_until, to_rows

from crunchbot import scene as scene_folder
from crunchbot.nav import localise
from crunchbot.observation import Row
from crunchbot.occupancy import from_map, read_map, spread_on_map, to_map
from crunchbot.recording.writing import TopicWriter
from crunchbot.robot.bags.played import RECORD, read_bag
from crunchbot.robot.bags.writing import Bag, metadata
from crunchbot.robot.network import initial_pose
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.inbox import Received
from crunchbot.robot.network.rows import to_message
from crunchbot.robot.network.streams import Envelope
from crunchbot.robot.standard.view import StandardView
from crunchbot.scene import Prior
from crunchbot.view.hub import Hub, RequestError
from crunchbot.view.robot_topics import SceneFeed
from crunchbot_lab import scenes
from crunchbot_lab.simulation.bridge import simulated_scene

ROWS, FILTER = 60, "foveal"
ORIGIN = (-10.0, -3.0, 1.0)
PIXEL_M = 0.05
YAML = "image: map.pgm\nresolution: 0.05\norigin: [{}, {}, {}]\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """A folder with robot.toml, and prior and rows on the map, without arena.toml; its map; and where the robot truly was."""
    folder = tmp_path_factory.mktemp("room")
    made = scenes.make("robot", 4, ROWS)
    rows, arena = scenes.files.rounded(made.observations), made.scene.arena
    start = rows.truth[0]
    rows.truth = to_map(rows.truth, ORIGIN)
    mean = tuple(to_map(start[None], ORIGIN)[0].tolist())
    known = scene_folder.Scene(arena, made.scene.robot, Prior("gaussian", mean, (0.1, 0.1, 0.1)))
    scenes.write_scene(folder, known, rows)
    (folder / "arena.toml").unlink()
    cells = np.full([round(side / PIXEL_M) for side in arena.size_m[::-1]], 254, np.uint8)
    for x0, y0, x1, y1 in np.round(np.array(arena.obstacles) / PIXEL_M).astype(int):
        cells[len(cells) - y1 : len(cells) - y0, x0:x1] = 0
    Image.fromarray(cells).save(folder / "map.pgm")
    (folder / "map.yaml").write_text(YAML.format(*ORIGIN))
    return SimpleNamespace(folder=folder, map=folder / "map.yaml", truth=rows.truth, arena=arena)


@pytest.fixture(scope="module")
def mapped(room, tmp_path_factory):
    """The same as a scene folder, by `whisker scene map`."""
    folder = tmp_path_factory.mktemp("mapped")
    scene = scene_folder.load(room.folder, room.map)
    rows = localise.read_observations(room.folder / "observations.csv", scene)
    scenes.write_scene(folder, scene, rows)
    return folder


def estimates(capsys, folder: Path, out: Path, *options) -> np.ndarray:
    code, said, err = run(capsys, "localise", folder, "--filter", FILTER, "--json", "--out", out, *options)
    assert code == 0, err
    assert json.loads(said)["pose_error_median_m"] < 0.15
    return np.genfromtxt(out, delimiter=",", skip_header=1)[:, 1:4]


def test_files_answer_on_the_map(room, mapped, capsys, tmp_path):
    by_map = estimates(capsys, room.folder, tmp_path / "a.csv", "--map", room.map)
    assert np.hypot(*(by_map - room.truth)[:, :2].T).max() < 0.3
    assert run(capsys, "scene", "map", room.folder, room.map, "--out", tmp_path / "put")[0] == 0
    assert scene_folder.load(tmp_path / "put").origin == ORIGIN == scene_folder.load(mapped).origin
    assert np.array_equal(estimates(capsys, tmp_path / "put", tmp_path / "b.csv"), by_map)
    assert np.array_equal(estimates(capsys, tmp_path / "put", tmp_path / "c.csv", "--map", room.map), by_map)
    code, _, err = run(capsys, "localise", tmp_path / "put", "--map", other_map(room, tmp_path, -10.0, -3.0, 0.9))
    assert code == 2 and "the yaw must be that of the origin in arena.toml, 1" in err


def other_map(room, folder: Path, *origin: float) -> Path:
    (folder / "map.pgm").write_bytes((room.folder / "map.pgm").read_bytes())
    (folder / "map.yaml").write_text(YAML.format(*origin))
    return folder / "map.yaml"


def test_a_map_that_is_turned_changes_nothing_but_the_frame(room, capsys, tmp_path):
    """The same rows on the same image, once seen from the corner of the image."""
    flat = tmp_path / "flat"
    scene = scene_folder.load(room.folder, room.map)
    start = tuple(from_map(np.array([scene.prior.mean]), ORIGIN)[0].tolist())
    rows = localise.read_observations(room.folder / "observations.csv", scene)
    rows.truth = from_map(rows.truth, ORIGIN)
    scenes.write_scene(flat, scene_folder.Scene(scene.arena, scene.robot, Prior("gaussian", start, (0.1,) * 3)), rows)
    plain = estimates(capsys, flat, tmp_path / "flat.csv")
    turned = estimates(capsys, room.folder, tmp_path / "turned.csv", "--map", room.map)
    assert np.allclose(to_map(plain, ORIGIN), turned, atol=1e-4)


def test_the_navigator_answers_on_the_map_and_takes_a_pose_there(room, mapped, capsys, tmp_path):
    by_file = estimates(capsys, mapped, tmp_path / "file.csv")
    scene = scene_folder.load(mapped)
    rows = to_rows(localise.read_observations(mapped / "observations.csv", scene), scene)
    names = ("pose", "localisation", "belief")
    options = ("--filter", FILTER, "--out", tmp_path, "--checkpoint", tmp_path / "kept")
    with Robot(*names) as robot, robot.started("navigator", mapped, *options):
        robot.send(rows)
        got = take_until(robot.inbox, lambda got: sum(r.topic == "pose" for r in got) == ROWS, PATIENCE_S)
        by_topic = {name: [r.message for r in got if r.topic == name] for name in names}
        assert np.allclose([p.pose.pose.xytheta for p in by_topic["pose"]], by_file, atol=2e-6)
        reported = by_topic["belief"][-1]
        centre = np.average(np.column_stack([reported.x, reported.y]), axis=0, weights=reported.weight)
        assert np.hypot(*(centre - by_file[reported.observation_seq, :2])) < 0.1
        initial_pose.send(robot.link, tuple(room.truth[-1]), (0.02, 0.02, 0.02))
        while not any(r.topic == "localisation" and r.message.prior == "given" for r in got):
            robot.send([{**rows[-1], "t_s": rows[-1]["t_s"] + 0.1}])
            got = take_until(robot.inbox, len, PATIENCE_S)
        answer = next(r.message for r in got if r.topic == "localisation" and r.message.prior == "given")
        assert np.hypot(*np.subtract(answer.pose.pose.xytheta, room.truth[-1])[:2]) < 0.1
    assert np.allclose(np.genfromtxt(tmp_path / f"est_{FILTER}.csv", delimiter=",", skip_header=1)[:ROWS, 1:4], by_file)
    assert (tmp_path / "kept").stat().st_size > 500, "what was believed was in the arena, and was kept"
    again = localise.Filter(FILTER, scene, components=scene_components(scene, by_file[-1]))
    assert np.hypot(*(np.array(again.step(rows[0]).pose) - by_file[-1])[:2]) < 0.1, "a kept belief is on the map too"


def scene_components(scene, pose) -> np.ndarray:
    out = np.zeros(1, localise.Filter("odometry", scene).components().dtype)
    out["pose"], out["sigma_m"], out["sigma_rad"], out["mass"] = pose, 0.02, 0.02, 1.0
    return out


def test_a_covariance_is_turned_with_its_pose(mapped):
    scene = scene_folder.load(mapped)
    narrow = Prior("gaussian", scene.prior.mean, (0.3, 0.02, 0.05))
    made = localise.Filter("odometry", scene)
    made.set_prior(narrow)
    motionless = (0.0, (0.0, 0.0, 0.0), np.zeros((0, 1)), np.full(len(scene.robot.whiskers), math.nan))
    covariance = made.step_values(*motionless).covariance
    left = covariance - np.diag(np.square(narrow.sigma))
    assert np.linalg.eigvalsh(left).min() > -1e-6, "in no direction narrower than it was given"
    assert made.region(*scene.prior.mean[:2])[0] < 0.1, "the mean of a belief is in its own region"
    points = np.random.default_rng(1).multivariate_normal(np.zeros(3), np.diag([0.09, 0.01, 0.01]), 20_000)
    turned = spread_on_map(np.cov(points.T)[None], ORIGIN)[0]
    assert np.allclose(np.cov(to_map(points, (0.0, 0.0, ORIGIN[2])).T), turned, atol=1e-9)


def test_standard_messages_have_the_map_of_the_map_server(room, mapped):
    scene = scene_folder.load(mapped)
    view = StandardView(scene, 10**18)
    (grid,) = [standard.message for standard in view.first()]
    x, y, yaw = grid.info.origin.xytheta
    cells = np.asarray(grid.data).reshape(grid.info.height, grid.info.width)
    x0, y0, x1, y1 = read_map(room.map).solid[0]
    places = np.array([((x0 + x1) / 2, (y0 + y1) / 2, 0.0), from_map(room.truth[:1], ORIGIN)[0]])
    columns, rows, _ = (from_map(to_map(places, ORIGIN), (x, y, yaw)) / grid.info.resolution).astype(int).T
    assert cells[rows, columns].tolist() == [100, 0] and yaw == pytest.approx(ORIGIN[2])
    place = room.truth[5]
    reported = m.Localisation(m.Header.at(1), FILTER, m.PoseWithCovariance.planar(place, np.eye(3)), 1.0, 0)
    list(view.take("localisation", reported))
    belief = m.Belief(m.Header.at(1), FILTER, 0, 1, 1.0, *np.array([*place, 1.0, 0.01, 0.01])[:, None])
    (shown,) = [standard.message for standard in view.take("belief", belief)]
    row, column = divmod(int(np.argmax(shown.data)), shown.info.width)
    middle = np.array([[(column + 0.5) * shown.info.resolution, (row + 0.5) * shown.info.resolution, 0.0]])
    found = to_map(middle, shown.info.origin.xytheta)[0]
    assert np.hypot(*(found - place)[:2]) <= shown.info.resolution


def test_a_bag_keeps_the_frame(room, mapped, tmp_path):
    path, scene = tmp_path / "robot.mcap", scene_folder.load(mapped)
    rows = to_rows(localise.read_observations(mapped / "observations.csv", scene), scene)
    with TopicWriter(path, RECORD, metadata("robot", mapped)) as writer:
        bag = Bag(writer, "robot", scene)
        row = to_message(Row.of(rows[0]), 0, np.zeros(3))
        reported = {"observation": row, "truth": m.PoseStamped(row.header, m.Pose.planar(*room.truth[0]))}
        bag.take([Received(topic, message, Envelope(0, 0, 0)) for topic, message in reported.items()])
        writer.finish()
    assert read_bag(path, ["truth"]).scene.origin == ORIGIN
    made, kept = scenes.read_recording(path)
    assert made.origin == ORIGIN and made.prior == scene.prior
    assert np.allclose(kept.truth[0], room.truth[0], atol=1e-5)


def test_the_page_is_told_where_the_arena_is_and_takes_poses_on_the_map(room, mapped):
    scene, sent = scene_folder.load(mapped), []
    hub = Hub([], scene=scene)
    hub.may_set_pose, hub.source = True, SimpleNamespace(set_pose=sent.append)
    assert json.loads(SceneFeed(hub, {}).take())["origin"] == list(ORIGIN)
    place = dict(zip(("x", "y", "theta"), room.truth[0].tolist(), strict=True))
    hub.set_pose(place)
    assert sent == [tuple(room.truth[0].tolist())]
    with pytest.raises(RequestError, match=r"set_pose: \(1, 1\) is outside the arena, which is within \(-1"):
        hub.set_pose({"x": 1.0, "y": 1.0, "theta": 0.0})


def test_a_simulated_robot_starts_where_the_prior_has_it(mapped):
    scene, start = simulated_scene(str(mapped), 1)
    x, y, _ = to_map(np.array([start]), ORIGIN)[0]
    assert scene.arena.is_free(start[0], start[1], scene.robot.body_radius_m)
    assert math.hypot(x - scene.prior.mean[0], y - scene.prior.mean[1]) < 1e-9
