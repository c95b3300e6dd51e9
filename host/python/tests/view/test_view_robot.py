"""What whisker-view knows of the robot, and what it sends to a page about it."""

import asyncio
import base64
import json
import math
import random
import struct
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linkkit import free_endpoint
from test_view_http import mutated
from viewkit import PATIENCE_S, nothing_logged, page
from viewrobot import (
    ARENA,
    ROW_NS,
    SCENE,
    Clock,
    MadeUpRun,
    Post,
    at,
    belief_message,
    estimate,
    reach,
    robot_view,
    route,
    touch_map,
)

from crunchbot.observation import CARRIED
from crunchbot.robot.network import initial_pose
from crunchbot.robot.network.link import Link
from crunchbot.robot.network.messages import (
    Contact,
    End,
    Header,
    KeyValue,
    Localisation,
    MapMetaData,
    Observation,
    OccupancyGrid,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    ProcessHealth,
    Time,
    encode,
)
from crunchbot.scene import FARTHEST_M, Scene
from crunchbot.sensor_tables import SensorTable
from crunchbot.view.command import ROBOT
from crunchbot.view.hub import Hub
from crunchbot.view.robot import (
    CONTACTS_MOST,
    COUNTERS_MOST,
    PATH_MOST,
    PROCESSES_MOST,
    SILENT_S,
    TEXT_MOST,
    RobotModel,
)
from crunchbot.view.robot_source import join
from crunchbot.view.robot_topics import BELIEF_HEAD, BELIEF_ID, POINTS_MOST, BeliefFeed, MapFeed, RobotFeed, SceneFeed

FUZZ_INPUTS = 5000
WIDE = np.array([[0.0009, 0.0003, 0.0], [0.0003, 0.0016, 0.0], [0.0, 0.0, 0.04]])  # 3 cm by 4 cm, 0.2 rad
__all__ = ["nothing_logged"]  # a fixture that every test here uses


def reported_model(rows: int, scene=SCENE, **options) -> RobotModel:
    model = RobotModel(scene)
    Post().play(MadeUpRun(**options), range(rows), model)
    return model


def health(name="pilot", pid=7, state="running", counters=(), error="") -> ProcessHealth:
    return ProcessHealth(Header.at(0), name, pid, state, [KeyValue(*pair) for pair in counters], error)


def test_what_no_message_has_reported_is_not_known():
    model = RobotModel()
    assert (model.now_s, model.pose, model.truth, model.behaviour, model.row, model.belief) == (None,) * 6
    assert model.age() is None and model.rows == {"missed": None, "unseen": 0}
    assert [(p["name"], p["age_s"], p["silent"]) for p in model.health()] == [
        ("navigator", None, False),
        ("pilot", None, False),
    ]
    assert reported_model(50, simulated=False).truth is None


def test_a_row_is_reported_by_whisker_whatever_the_names():
    model = reported_model(1)
    tips = {tip["name"]: dict(tip["loglik"]) for tip in model.row["tips"]}
    assert set(tips) == {"floor_left", "floor_right"} and all(set(tip) == set(ARENA.textures) for tip in tips.values())
    assert [ray["name"] for ray in model.row["rays"]] == ["object_1", "object_2", "object_3", "object_4"]
    without = reported_model(1, scene=None)
    assert without.row["tips"] == model.row["tips"], "names can be distinguished without a scene unless textures have _"


def test_cells_not_read_and_no_contact_are_different_things():
    touched = next(row for row in range(2000) if row % 100 < 80 and reach(SCENE.robot.of_role("object")[1], row))
    exploring, whisking = reported_model(touched + 1), reported_model(91)
    states = {ray["name"]: (ray["state"], ray["mm"]) for ray in exploring.row["rays"]}
    assert states["object_2"] == ("contact", round(1e3 * reach(SCENE.robot.of_role("object")[1], touched), 1))
    assert states["object_4"] == ("none", None)
    assert all(ray["state"] == "unread" and ray["mm"] is None for ray in whisking.row["rays"])
    assert all(value is None for tip in whisking.row["tips"] for _, value in tip["loglik"])
    assert whisking.row["kind"] == "body whisk"


def test_rows_that_never_came_are_counted():
    model = reported_model(40, skip={10, 11, 30})
    assert model.rows == {"missed": 3, "unseen": 3}


def test_a_pose_is_as_wide_as_its_spread_over_both_axes():
    model, pose = RobotModel(), PoseWithCovariance.planar((1.0, 2.0, 0.5), WIDE)
    model.take("localisation", Localisation(Header.at(ROW_NS, "map"), "grid", pose, 0.5, 1))
    assert (model.pose["sigma_m"], model.pose["sigma_rad"]) == (0.05, 0.2)
    assert (model.pose["x"], model.pose["y"], model.pose["theta"]) == (1.0, 2.0, 0.5)


def test_a_clock_that_began_anew_forgets_the_run_and_not_the_health():
    model = reported_model(100)
    Post().play(MadeUpRun(), range(2), model)
    assert model.run == 1 and model.now_s == 0.1
    assert len(model.path.points) == len(model.true_path.points) == 2 and model.path.end == 2
    assert not model.contacts and model.rows["unseen"] == 0 and model.health()[1]["pid"]


def test_a_contact_is_placed_where_the_whisker_meets_something():
    ray = SCENE.robot.of_role("object")[1]
    onset = next(n for n in range(1, 2000) if not reach(ray, n - 1) and all(reach(ray, n + k) for k in range(4)))
    post, model = Post(), RobotModel(SCENE)
    post.play(MadeUpRun(), range(onset + 1), model)
    (first,) = [contact for contact in model.touching() if contact["whisker"] == ray.name]
    assert (first["x"], first["radius_m"], first["part"], first["release_s"]) == (None, None, None, None)
    post.play(MadeUpRun(), range(onset + 1, onset + 3), model)
    (contact,) = [contact for contact in model.touching() if contact["whisker"] == ray.name]
    t_s, out = (onset + 1) / 10, reach(ray, onset + 1)
    true = at(route(t_s), np.add(ray.base_m, (out * np.cos(ray.yaw_rad), out * np.sin(ray.yaw_rad))))
    error = np.hypot(*np.subtract(estimate(t_s)[:2], route(t_s)[:2]))
    away = np.hypot(contact["x"] - true[0], contact["y"] - true[1])
    assert away < error + 0.02, "further from where it is than the estimate's error explains"
    assert contact["part"] in ("tip", "shaft") and contact["surface"] in ("face", "corner")
    over = next(row for row in range(onset + 1, 4000) if reach(ray, row) is None)
    post.play(MadeUpRun(), range(onset + 3, over + 1), model)
    ended = model.contacts[(ray.name, onset * ROW_NS)]
    assert ended["release_s"] == over / 10 and ended["radius_m"] == contact["radius_m"]
    assert ended not in model.touching()


def surface_row(seq: int, **cells: float) -> Observation:
    names = [f"object_1_{name}" for name in cells]
    kinds = np.full(len(names), 2, np.uint8)
    return Observation(
        Header.at(seq * ROW_NS), seq, 2, np.zeros(3), np.zeros(3), names, kinds, np.array([*cells.values()])
    )


def test_a_robot_that_was_carried_is_shown():
    model = RobotModel(SCENE)
    model.take("observation", replace(surface_row(1), kind=CARRIED))
    assert model.row["kind"] == "carried"


def test_a_surface_is_placed_by_the_estimate_of_its_own_row():
    reported = {"normal_rad": np.pi, "normal_sd_rad": 0.1, "point_x_m": 0.2, "point_y_m": 0.1, "point_sd_m": 0.001}
    model = RobotModel(SCENE)
    model.take("observation", surface_row(4, **reported))
    for seq in (3, 4, 4):
        pose = PoseWithCovariance.planar((1.0 + seq, 2.0, np.pi / 2), np.diag([1e-4, 1e-4, 0.01]))
        model.take("localisation", Localisation(Header.at(seq * ROW_NS, "map"), "grid", pose, 0.5, seq))
    (surface,) = model.surfaces.reported
    assert (surface["x"], surface["y"]) == pytest.approx((4.9, 2.2))
    assert surface["normal"] == pytest.approx(-np.pi / 2, abs=1e-3)
    assert surface["normal_sd"] == 0.1
    assert model.row["tips"] == [] and model.row["rays"] == []  # and is no texture


def test_a_surface_without_a_direction_is_not_drawn():
    model, pose = RobotModel(SCENE), PoseWithCovariance.planar((1.0, 2.0, 0.0), WIDE)
    model.take("observation", surface_row(1, point_x_m=0.2, point_y_m=0.1, point_sd_m=0.001))
    model.take("localisation", Localisation(Header.at(ROW_NS, "map"), "grid", pose, 0.5, 1))
    assert not model.surfaces.reported


def test_a_process_that_fell_silent_is_reported_from_one_that_ended_and_one_never_heard():
    clock = Clock()
    model = RobotModel(clock=clock)
    for name in ("pilot", "bag"):
        model.take(f"health/{name}", health(name, counters=[("rows", "12")], error="disk full"))
    model.take("health/bag", End(Header.at(0), 1, "asked to"))
    clock.now += SILENT_S + 1.0
    reported = {process["name"]: process for process in model.health()}
    assert reported["pilot"]["silent"] and reported["pilot"]["age_s"] == 4 and reported["pilot"]["error"] == "disk full"
    assert reported["pilot"]["counters"] == {"rows": "12"}
    assert not reported["bag"]["silent"] and reported["bag"]["ended"] and reported["bag"]["state"] == "ended: asked to"
    assert reported["navigator"]["age_s"] is None
    model.take("health/pilot", health(pid=8))
    (pilot,) = [process for process in model.health() if process["name"] == "pilot"]
    assert (pilot["silent"], pilot["restarts"], pilot["pid"], pilot["age_s"]) == (False, 1, 8, 0)


def test_a_pose_that_no_arena_can_have_is_not_known():
    model = reported_model(5)
    model.take("truth", PoseStamped(Header.at(6 * ROW_NS), Pose.planar(2 * FARTHEST_M, 0.0, 0.0)))
    assert model.truth is None and len(model.true_path.points) == 5


def test_nothing_grows_without_bound():
    model = RobotModel(SCENE)
    for n in range(PATH_MOST + 100):
        model.take("truth", PoseStamped(Header.at(n * ROW_NS), Pose.planar(1.0, 1.0, 0.0)))
        model.take("contact", Contact(Header.at(n * ROW_NS), "object_1", False, Time.of(n), Time.of(n + 1)))
        model.take(f"health/{n}", health(f"p{n}", counters=[(f"{k}", "1") for k in range(2 * COUNTERS_MOST)]))
    model.take("health/pilot", health(state="x\n" * 4000))
    assert len(model.true_path.points) == PATH_MOST and len(model.contacts) == CONTACTS_MOST
    assert len(model.processes) == PROCESSES_MOST
    assert max(len(process.counters) for process in model.processes.values()) == COUNTERS_MOST
    assert len(model.processes["pilot"].state) == TEXT_MOST and "\n" not in model.processes["pilot"].state


def test_a_page_gets_the_whole_path_in_parts_and_then_only_what_is_new(monkeypatch):
    monkeypatch.setattr("crunchbot.view.robot_topics.ROBOT_S", 0.0)
    post = Post()
    hub = Hub([], post.source, SCENE)
    post.play(MadeUpRun(), range(POINTS_MOST + 40), hub.robot)
    feed = RobotFeed(hub, {})
    first, second = json.loads(feed.take()), json.loads(feed.take())
    assert first["path"]["begin"] and len(first["path"]["points"]) == POINTS_MOST and first["pose"]
    assert not second["path"]["begin"] and len(second["path"]["points"]) == 40
    assert set(second) <= {"topic", "path", "true_path", "ages", "heard_s", "processes"}, "the rest has not changed"
    post.play(MadeUpRun(), range(POINTS_MOST + 40, POINTS_MOST + 41), hub.robot)
    third = json.loads(feed.take())
    assert len(third["path"]["points"]) == 1 and "pose" in third and "name" not in third
    feed.close()
    assert hub.robot_watchers == 0


def test_a_slow_page_gets_the_newest_belief_and_none_that_it_missed(monkeypatch):
    monkeypatch.setattr("crunchbot.view.robot_topics.BELIEF_S", 0.0)
    post = Post()
    hub = Hub([], post.source, SCENE)
    feed = BeliefFeed(hub, {})
    assert feed.take() is None
    for n in range(50):
        hub.robot.take("belief", belief_message(n * ROW_NS, [(1.0, 1.0, 2.0, 0.5, 0.0)], number=10, mass=0.75))
    message = feed.take()
    assert feed.take() is None
    assert BELIEF_HEAD.unpack_from(message) == (6, 0, 10, 10, 4.9, 0.75), "not as docs/view.md has it"
    poses = np.frombuffer(message, "<f4", -1, BELIEF_HEAD.size).reshape(10, 6)
    assert np.allclose(poses[:, :2], (1.0, 2.0)) and np.allclose(poses[:, 3], 0.1)


def test_a_page_that_does_not_acknowledge_holds_nothing_back():
    async def scenario():
        post = Post()
        async with robot_view(post, rows=10) as (port, hub), page(port) as slow, page(port) as quick:
            for script in (slow, quick):
                for topic in ("scene", "robot", "belief"):
                    await script.ask(type="subscribe", topic=topic)
            await slow.next("scene", acknowledge=False)
            assert (await quick.next("scene"))["arena"]["floor"] == list(ARENA.floor)
            reported = await quick.next("robot")
            for row in range(10, 60):
                post.play(MadeUpRun(), range(row, row + 1), hub.robot)
            points = len(reported["path"]["points"])
            async with asyncio.timeout(PATIENCE_S):
                while points < 60:
                    points += len((await quick.next("robot")).get("path", {"points": []})["points"])
            assert points == 60 and (await quick.next("traces"))[0] == BELIEF_ID

    asyncio.run(scenario())


def test_a_page_is_reported_of_unknown_ground_and_not_of_tables():
    sensor = SensorTable("light", (0.0, 0.0), 0.0, 0.0, np.zeros((5, 5), np.uint8))
    arena = replace(ARENA, unknown=((0.0, 0.0, 0.5, 0.5),))
    reported = json.loads(SceneFeed(Hub([], scene=Scene(arena, replace(SCENE.robot, sensors=(sensor,)))), {}).take())
    assert reported["arena"]["unknown"] == [[0.0, 0.0, 0.5, 0.5]] and reported["robot"]["sensors"] == []


@pytest.mark.parametrize(
    "may, pose, said",
    [
        (True, {"x": 0.3, "y": 2, "theta": -1.5}, ""),
        (True, {"x": 2.6, "y": 2, "theta": 0}, "set_pose: (2.6, 2) is outside the arena"),
        (
            True,
            {"x": 0.75, "y": 1.75, "theta": 0},
            "set_pose: (0.75, 1.75) is in an obstacle; give a place that is free",
        ),
        (True, {"x": "1", "y": 2, "theta": 0}, "set_pose: field 'x' must be a number from -3000 to 3000, not '1'"),
        (True, {"x": True, "y": 2, "theta": 0}, "set_pose: field 'x' must be a number"),
        (True, {"x": 1, "y": 2}, "set_pose: field 'theta' is missing"),
        (False, {"x": 0.3, "y": 2, "theta": -1.5}, "set_pose: not allowed here"),
    ],
)
def test_a_page_reports_a_pose_where_it_may(may, pose, said):
    async def scenario():
        post = Post()
        async with robot_view(post, may_set_pose=may) as (port, _), page(port) as script:
            await script.ask(type="set_pose", **pose)
            await script.ask(type="nothing of this name")  # answered after the pose
            errors = [(await script.next("error"))["text"] for _ in range(2 if said else 1)]
            assert errors[0].startswith(said or "type: ")
            assert post.poses == ([] if said else [(0.3, 2.0, -1.5)])

    asyncio.run(scenario())


def fuzz_robot(inputs: int, seed: int) -> int:
    """So many mutated messages to a view; what it then sends is still JSON. Gives how many were refused."""
    rng = random.Random(seed)
    post = Post()
    hub = Hub([], post.source, SCENE)
    reported = [pair for row in range(0, 400, 7) for pair in MadeUpRun(seed).messages(row)]
    feeds = RobotFeed(hub, {}), BeliefFeed(hub, {})
    for _ in range(inputs):
        topic, message = rng.choice(reported)
        data = encode(message)
        broken = mutated(rng, data) if rng.random() < 0.5 else poked(rng, data)
        post.put(rng.choice([topic, topic, topic, "", "health/x/y", "truth"]), message, data=broken)
        for name, message in post.source.poll():
            hub.robot.take(name, message)
        for feed in feeds:
            feed._due = 0.0
            said = feed.take()
            if isinstance(said, str):
                json.loads(said, parse_constant=pytest.fail)
    return hub.source.refused()["count"]


def poked(rng: random.Random, data: bytes) -> bytes:
    """One number of it is another, of the same size: the message stays well-formed."""
    at = 4 * rng.randrange(1, len(data) // 4)
    value = rng.choice([b"\xff" * 8, b"\0" * 8, struct.pack("<d", 1e308), struct.pack("<d", -1e9), rng.randbytes(8)])
    return data[:at] + value[: len(data) - at] + data[at + 8 :]


def test_no_message_brings_it_down():
    assert FUZZ_INPUTS / 20 < fuzz_robot(FUZZ_INPUTS, seed=1) < FUZZ_INPUTS


def test_over_a_real_network_a_page_sees_what_a_pilot_sends():
    pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed (make setup)")
    endpoint, run = free_endpoint(), MadeUpRun()

    async def scenario(source):
        hub = Hub([], source, SCENE)
        publishers = {topic: pilot.publish(topic) for row in range(11) for topic, _ in run.messages(row)}
        row = 0
        async with asyncio.timeout(PATIENCE_S):
            while hub.robot.belief is None or hub.robot.pose is None or not hub.robot.health()[1]["pid"]:
                for topic, message in run.messages(row):
                    publishers[topic].send(message)
                row += 1
                await asyncio.sleep(0.01)
                for topic, message in source.poll():
                    hub.robot.take(topic, message)
        assert hub.robot.rows["unseen"] == 0 and hub.robot.row["tips"]
        assert source.refused()["count"] == 0
        source.set_pose((0.3, 1.5, 2.0))
        assert initial_pose.prior_of(reported.take(PATIENCE_S)[0].message, SCENE).mean == pytest.approx((0.3, 1.5, 2.0))

    with Link("pilot", ROBOT, listen=[endpoint]) as pilot:
        reported = pilot.subscribe(initial_pose.TOPIC)
        source = join(ROBOT, [endpoint])
        try:
            asyncio.run(scenario(source))
        finally:
            source.close()


def test_a_mappers_map_is_shown_and_the_truth_in_its_frame():
    model = RobotModel(SCENE)
    feed = MapFeed(SimpleNamespace(robot=model), {})
    assert feed.take() is None
    true = [(2.0, 1.0, 1.5), (2.0, 1.5, 1.5 + 0.25)]
    for n, (place, felt) in enumerate(zip(true, [(0.1, 0.0, 0.0), (0.6, 0.0, 0.2)], strict=True)):
        header = Header.at((n + 1) * ROW_NS)
        model.take("truth", PoseStamped(header, Pose.planar(*place)))
        pose = PoseWithCovariance.planar(felt, np.diag([1e-4, 1e-4, 1e-4]))
        model.take("localisation", Localisation(header, "mapper", pose, 1.0, n, prior="origin"))
    forward = 0.5 * math.sin(1.5)
    expected = (0.1 + forward, 0.5 * math.cos(1.5), 0.25)
    assert [model.truth[name] for name in ("x", "y", "theta")] == pytest.approx(expected, abs=1e-3)
    info = MapMetaData(resolution=0.03125, width=3, height=2, origin=Pose.planar(-0.5, 0.25, 0.0))
    model.take("map", OccupancyGrid(Header.at(ROW_NS), info, np.array([-1, 0, 50, 99, 100, 1], "i1")))
    tiles = [(-1, 1, 0, 0.5), (0, -2, 1, 0.9), (2, 3, 1, 1.0)]
    model.take("touch_map", touch_map(tiles, [[0.5] * 7] * 4, [[0.25] * 3] * 2))
    reported = json.loads(feed.take())
    assert reported["topic"] == "map" and feed.take() is None
    shown = reported["map"]
    assert shown["textures"] == ["VINYL", "ROUGH"] and shown["lattice"][3] > 0.0
    assert [tile[:3] for tile in shown["tiles"]] == [[-1, 1, 0], [0, -2, 1], [2, 3, 1]]
    assert len(shown["faces"]) == 4 and len(shown["faces"][0]) == 7 and len(shown["corners"][0]) == 3
    assert shown["part"] == 0
    grid = shown["grid"]
    assert list(base64.b64decode(grid["cells"])) == [255, 0, 50, 99, 100, 1]
    assert (grid["columns"], grid["rows"], grid["x"], grid["y"]) == (3, 2, -0.5, 0.25)
    assert [process["name"] for process in model.health()] == ["navigator", "pilot"]
    model.take("health/mapper", ProcessHealth(Header.at(0), "mapper", 7, "running"))
    assert [process["name"] for process in model.health()] == ["mapper", "pilot"]
    model.begin_anew()
    feed._due = 0.0
    assert json.loads(feed.take()) == {"topic": "map", "map": None}
