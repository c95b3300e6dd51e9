"""Standard messages of ROS 2: they encode as ROS has them, their frames are REP 105's, and Foxglove gets and sets them."""

import asyncio
import contextlib
import json
import math
import socket
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from linkkit import free_endpoint
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

from crunchbot.robot.network import messages as m
from crunchbot.robot.network.link import Link
from crunchbot.robot.network.ros import Odometry
from crunchbot.robot.standard import shapes, types
from crunchbot.robot.standard.view import KINDS, StandardView
from crunchbot.scene import Arena, Prior, Robot, Scene, Whisker, write

ROW_NS, WALL_NS = 10**8, 10**18
ARENA = Arena((2.0, 1.0), 1.0, ("A", "B"), ("AB",), ((0.5, 0.25, 0.75, 0.5),), ((1.5, 0.0, 2.0, 0.5),))
WHISKERS = (
    Whisker("front", "object", base_m=(0.1, 0.0), yaw_rad=0.5, length_m=0.2),
    Whisker("floor", "texture", tip_m=(0.05, 0.0)),
)
SCENE = Scene(ARENA, Robot(0.15, 0.05, 0.002, WHISKERS), Prior("uniform"))
# Published by ROS 2's own packages (rmw_zenoh's design document, and the type descriptions of the Jazzy release).
STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"


def odometry(stamp_ns: int, pose) -> Odometry:
    return Odometry(m.Header.at(stamp_ns, "odom"), pose=m.PoseWithCovariance(m.Pose.planar(*pose)))


def located(stamp_ns: int, pose) -> m.PoseWithCovarianceStamped:
    belief = m.PoseWithCovariance.planar(pose, np.eye(3) * 0.01)
    return m.PoseWithCovarianceStamped(m.Header.at(stamp_ns, "map"), belief)


def transforms(view: StandardView, topic: str, message) -> dict[tuple[str, str], np.ndarray]:
    """(parent, child): (x, y, theta), each through the bytes that are published."""
    found = {}
    for standard in view.take(topic, message):
        read = types.decode(KINDS[standard.topic], types.encode(standard.message))
        if standard.topic == "/tf":
            (one,) = read.transforms
            moved, turn = one.transform.translation, one.transform.rotation
            pose = np.array([moved.x, moved.y, 2 * math.atan2(turn.z, turn.w)])
            found[one.header.frame_id, one.child_frame_id] = pose
    return found


def test_hashes_are_those_that_ros_publishes():
    assert types.type_hash("std_msgs/String") == STRING_HASH


def test_map_to_odom_corrects_the_odometry():
    """Frames composed as a tool does it: map to odom to base_link is the pose that was localised."""
    view = StandardView(SCENE, WALL_NS)
    for stamp, pose in ((80, (0.4, 0.2, 3.1)), (180, (0.42, 0.2, -3.1))):  # ms; the heading wraps between
        (place,) = transforms(view, "odometry", odometry(stamp * 10**6, pose)).items()
        assert place[0] == ("odom", "base_link") and place[1] == pytest.approx(pose)
    middle = np.array([0.41, 0.2, math.pi])
    wanted = np.array([1.2, 0.7, 0.3])
    corrected = transforms(view, "pose", located(130 * 10**6, wanted))["map", "odom"]
    c, s = math.cos(corrected[2]), math.sin(corrected[2])
    x = corrected[0] + c * middle[0] - s * middle[1]
    y = corrected[1] + s * middle[0] + c * middle[1]
    turn = math.remainder(corrected[2] + middle[2] - wanted[2], math.tau)
    assert (x, y) == pytest.approx(wanted[:2], abs=1e-9) and turn == pytest.approx(0.0, abs=1e-9)
    assert transforms(view, "pose", located(10**9, wanted)) == {}  # no odometry of that time


def test_stamps_are_the_walls():
    view = StandardView(SCENE, WALL_NS)
    row = m.Observation(m.Header.at(5 * ROW_NS), 0, 0, np.zeros(3), np.zeros(3), [], np.zeros(0), np.zeros(0))
    (first,) = view.take("observation", row)
    (later,) = [one for one in view.take("odometry", odometry(6 * ROW_NS, (0, 0, 0))) if one.topic == "/odom"]
    assert (first.stamp_ns, later.stamp_ns) == (WALL_NS, WALL_NS + ROW_NS)
    stamp = types.decode(KINDS["/odom"], types.encode(later.message)).header.stamp
    assert stamp.sec * 10**9 + stamp.nanosec == WALL_NS + ROW_NS


def test_the_map_has_boxes_unknown_ground_and_walls():
    grid = shapes.occupancy(SCENE, types.make("std_msgs/Header", frame_id="map"))
    cells = np.array(grid.data).reshape(grid.info.height, grid.info.width)

    def at(x: float, y: float) -> int:
        origin = grid.info.origin.position
        return cells[int((y - origin.y) / grid.info.resolution), int((x - origin.x) / grid.info.resolution)]

    assert at(0.6, 0.3) == 100 and at(1.7, 0.3) == -1 and at(1.0, 0.8) == 0
    assert at(-0.01, 0.5) == at(2.01, 0.5) == at(1.0, -0.01) == at(1.0, 1.01) == 100
    assert at(0.49, 0.3) == at(0.77, 0.3) == 0


def test_the_belief_is_a_grid_of_its_mass():
    columns = [np.array(values) for values in ((0.11, 0.12, 1.91), (0.11, 0.12, 0.91), (0, 0, 0), (0.3, 0.3, 0.3))]
    belief = m.Belief(m.Header(), "adaptive", 1, 3, 0.9, *columns, np.zeros(3), np.zeros(3))
    grid = shapes.belief(belief, SCENE, types.make("std_msgs/Header"))
    cells = np.array(grid.data).reshape(grid.info.height, grid.info.width)
    assert cells[2, 2] == 100 and cells[18, 38] == 50 and cells.sum() == 150


def test_a_whisker_that_touches_ends_at_its_contact():
    header = types.make("std_msgs/Header")
    free, touching = (shapes.robot_markers(SCENE.robot, t, header).markers for t in ({}, {"front": 0.1}))
    line = {mark.ns: mark for mark in touching}["whiskers"]
    length = math.dist(*((point.x, point.y) for point in line.points))
    assert length == pytest.approx(0.1) and line.color.r != {mark.ns: mark for mark in free}["whiskers"].color.r


# --- a real server and a client of its protocol


class FoxgloveClient:
    """What Foxglove does, as far as a test needs it: subscribes to everything, publishes poses."""

    def __init__(self, socket):
        self._socket, self.channels, self.statuses = socket, {}, []

    async def next(self) -> tuple[str, str, bytes]:
        """Topic, schema and bytes of the next message."""
        while True:
            got = await asyncio.wait_for(self._socket.recv(), 30)
            if isinstance(got, bytes):
                _, subscription, _ = struct.unpack_from("<BIQ", got)
                channel = self.channels[subscription]
                return channel["topic"], channel["schemaName"], got[13:]
            got_json = json.loads(got)
            if got_json["op"] == "status" and got_json["message"].startswith("/initialpose: "):
                self.statuses.append(got_json["message"])
            if got_json["op"] == "advertise":
                wanted = {len(self.channels) + n: channel for n, channel in enumerate(got_json["channels"], 1)}
                self.channels |= wanted
                asked = [{"id": number, "channelId": channel["id"]} for number, channel in wanted.items()]
                await self._socket.send(json.dumps({"op": "subscribe", "subscriptions": asked}))

    async def advertise(self, number: int, encoding: str) -> None:
        channel = {"id": number, "topic": "/initialpose", "encoding": encoding}
        channel["schemaName"] = "geometry_msgs/PoseWithCovarianceStamped"
        await self._socket.send(json.dumps({"op": "advertise", "channels": [channel]}))

    async def publish(self, number: int, data: bytes) -> None:
        await self._socket.send(b"\x01" + struct.pack("<I", number) + data)


@contextlib.contextmanager
def server(folder, endpoint: str, *more: str, errors=None):
    words = [sys.executable, "-m", "crunchbot.cli", "foxglove", folder, "--port", "0", "--connect", endpoint, *more]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=errors, text=True) as process:
        try:
            yield int(process.stdout.readline().split(": ")[0].rpartition(":")[2])
        finally:
            process.terminate()
            assert process.wait(30) == 0


def test_foxglove_gets_every_topic_and_sets_the_pose(tmp_path):
    write(tmp_path / "scene", SCENE)
    endpoint = free_endpoint()
    cdr = types.encode(
        types.make(
            "geometry_msgs/PoseWithCovarianceStamped",
            header=types.make("std_msgs/Header", frame_id="map"),
            pose=types.make("geometry_msgs/PoseWithCovariance", pose=shapes.pose(1.25, 0.75, 0.5)),
        )
    )
    as_json = json.dumps(
        {
            "header": {"frame_id": "map"},
            "pose": {
                "pose": {"position": {"x": 1.5, "y": 0.5, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}},
                "covariance": [0.0] * 36,
            },
        }
    ).encode()

    lying = as_json.replace(b'"w": 1', b'"w": 0')
    walled = as_json.replace(b'"x": 1.5, "y": 0.5', b'"x": 0.6, "y": 0.3')
    assert as_json not in (lying, walled)

    async def watch(port: int, streams: dict) -> None:
        async with connect(f"ws://127.0.0.1:{port}", subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:
            client, seen, stamp = FoxgloveClient(socket), {}, ROW_NS
            wanted = {"/map", "/tf", "/odom", "/pose", "/path", "/robot", "/robot/odometry", "/robot/pose"}
            while not wanted <= seen.keys():
                streams["odometry"].send(odometry(stamp, (0.1, 0.0, 0.0)))
                row = m.Observation(m.Header.at(stamp), 0, 0, np.zeros(3), np.zeros(3), [], np.zeros(0), np.zeros(0))
                streams["observation"].send(row)
                streams["pose"].send(located(stamp, (1.0, 0.8, 0.1)))
                topic, schema, data = await client.next()
                seen[topic], stamp = (schema, data), stamp + ROW_NS
            for topic, kind in KINDS.items():
                if topic in seen:
                    assert seen[topic][0] == kind.replace("/", "/msg/") and types.decode(kind, seen[topic][1])
            for number, (encoding, data) in enumerate(
                (("cdr", cdr), ("json", as_json), ("json", b"{}"), ("cdr", b"?"), ("json", lying), ("json", walled)), 1
            ):
                await client.advertise(number, encoding)
                await client.publish(number, data)
            while len(client.statuses) < 4:
                await client.next()
            assert "/initialpose: orientation (0, 0, 0, 0) has no heading; give z = sin" in str(client.statuses[2])
            assert "/initialpose: (0.6, 0.3) is in an obstacle; give a place that is free" in str(client.statuses[3])

    with Link("pilot", listen=[endpoint]) as link, server(tmp_path / "scene", endpoint) as port:
        inbox = link.subscribe("initial_pose")
        link.announce()
        assert link.wait_for(["foxglove"], 30)
        asyncio.run(watch(port, {topic: link.publish(topic) for topic in ("odometry", "observation", "pose")}))
        poses = []
        while len(poses) < 2:  # pytest's end is the limit: the server has said that it sent them
            poses += [received.message for received in inbox.take(30.0) if not received.over]
        assert [pose.pose.pose.xytheta for pose in poses] == [
            pytest.approx((1.25, 0.75, 0.5)),
            pytest.approx((1.5, 0.5, 0.0)),
        ]


def test_a_port_that_is_taken_is_one_line(tmp_path):
    write(tmp_path / "scene", SCENE)
    words = [sys.executable, "-m", "crunchbot.cli", "foxglove", tmp_path / "scene", "--connect", "none", "--port"]
    with server(tmp_path / "scene", free_endpoint()) as port:
        done = subprocess.run([*words, str(port)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and done.stderr.count("\n") == 1 and "choose another --host or --port" in done.stderr


async def first_said(port: int, **headers: str) -> dict:
    """What the server says first to a client with these headers; InvalidStatus when it is refused."""
    options = {"subprotocols": ["foxglove.sdk.v1"], "max_size": None, "additional_headers": headers}
    async with connect(f"ws://127.0.0.1:{port}", **options) as socket:
        return json.loads(await socket.recv())


def asked(port: int, fields: str) -> str:
    """The answer to a request with these header fields."""
    with socket.create_connection(("127.0.0.1", port)) as plug:
        plug.sendall(f"GET / HTTP/1.1\r\n{fields}\r\n\r\n".encode())
        return plug.makefile().read()


def test_a_page_of_a_stranger_is_not_answered(tmp_path):
    """Any page that is open in the user's browser can connect here."""
    write(tmp_path / "scene", SCENE)
    own = "http://foxglove.example:8080"
    with (
        open(tmp_path / "err", "w") as errors,
        server(tmp_path / "scene", free_endpoint(), "--allow-origin", own, errors=errors) as port,
    ):
        for origin in ("http://evil.example", "null", "http://evil.example"):
            with pytest.raises(InvalidStatus) as refused:
                asyncio.run(first_said(port, Origin=origin))
            assert refused.value.response.status_code == 403
        assert "this Host is not served" in asked(port, "Host: evil.example\r\nUpgrade: websocket")
        assert "a WebSocket is here" in asked(port, "Host: 127.0.0.1")
        assert "Host or Origin is given twice" in asked(port, "Host: 127.0.0.1\r\nHost: evil.example")
        assert "not a request" in asked(port, "Host")
        for origin in ("https://app.foxglove.dev", own):
            assert "clientPublish" in asyncio.run(first_said(port, Origin=origin))["capabilities"]
        listening = {line.split()[1] for line in Path("/proc/net/tcp").read_text().splitlines()[1:]}
        assert f"0100007F:{port:04X}" in listening
    lines = (tmp_path / "err").read_text().splitlines()
    assert len(lines) == 5 and all("foxglove: a connection is refused: " in line for line in lines)


@pytest.mark.parametrize("more, may", [([], False), (["--allow-pose"], True)])
def test_a_door_that_is_open_says_so_and_takes_poses_with_consent_alone(tmp_path, more, may):
    write(tmp_path / "scene", SCENE)
    with (
        open(tmp_path / "err", "w") as errors,
        server(tmp_path / "scene", free_endpoint(), "--host", "0.0.0.0", *more, errors=errors) as port,
    ):
        assert ("clientPublish" in asyncio.run(first_said(port))["capabilities"]) == may
    what = "watch, and set the pose" if may else "watch"
    assert (tmp_path / "err").read_text() == f"whisker: 0.0.0.0: anyone who reaches this address can {what}\n"
