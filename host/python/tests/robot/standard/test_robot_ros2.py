"""A robot as a node of ROS 2: what is on the wire, beside what other implementations of rmw_zenoh's protocol put there.

TOKEN, POSE and HASHES were recorded from hiroz 0.2.1, which has its own types and encoder; its subscribers also read what is
published here. ID is of rmw_zenoh's own hash function for TEXT.
"""

import contextlib
import json
import queue
import struct
import subprocess
import sys
import time

import numpy as np
import pytest
import zenoh
from linkkit import free_endpoint
from test_robot_standard import ROW_NS, SCENE, located, odometry
from zenoh.ext import HistoryConfig, declare_advanced_subscriber

from crunchbot.recording.types import store as own_types
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.link import Link
from crunchbot.robot.ros2.names import ros_name
from crunchbot.robot.ros2.rmw_zenoh import PUBLISHER, SUBSCRIPTION, Graph, publisher_id
from crunchbot.robot.standard import shapes, types
from crunchbot.robot.standard.view import KINDS, POSE_KIND
from crunchbot.scene import write

ZID = "a30685a8f7b6542e0c0e81e309f742d3"
HASHES = {
    "geometry_msgs/PoseWithCovarianceStamped": "26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e",
    "nav_msgs/Odometry": "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    "nav_msgs/OccupancyGrid": "8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7",
    "tf2_msgs/TFMessage": "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    "sensor_msgs/JointState": "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
    "diagnostic_msgs/DiagnosticArray": "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
}
NODE_TOKEN = f"@ros2_lv/0/{ZID}/0/0/NN/%/%/hiroz_client"
POSE_KEY = (
    "0/initialpose/geometry_msgs::msg::dds_::PoseWithCovarianceStamped_/"
    "RIHS01_26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e"
)
POSE_TOKEN = (
    f"@ros2_lv/0/{ZID}/0/14/MP/%/%/hiroz_client/%initialpose/"
    f"geometry_msgs::msg::dds_::PoseWithCovarianceStamped_/RIHS01_{HASHES[POSE_KIND]}/::,10:,:,:,,"
)
MAP_TOKEN = (
    f"@ros2_lv/0/{ZID}/0/8/MS/%/%/hiroz_client/%map/"
    f"nav_msgs::msg::dds_::OccupancyGrid_/RIHS01_{HASHES['nav_msgs/OccupancyGrid']}/:1:,1:,:,:,,"
)
POSE = bytes.fromhex(  # frame map, (1.25, 0.75), heading 0, variances 0.01, 0.01, 0.04
    "000100000000000000000000040000006d617000000000000000f43f000000000000e83f" + 32 * "00" + "000000000000f03f"
    "7b14ae47e17a843f" + 48 * "00" + "7b14ae47e17a843f" + 216 * "00" + "7b14ae47e17aa43f"
)
TEXT = "".join(chr(97 + n % 26) for n in range(1, 301))
ID = "246428e2ad348dbb80368f37299fb153"


def test_hashes_tokens_keys_and_ids_are_those_of_other_implementations():
    for kind, hashed in HASHES.items():
        assert types.type_hash(kind) == f"RIHS01_{hashed}"
    graph, schema = Graph(0, ZID, "hiroz_client"), POSE_KIND.replace("/", "/msg/")
    assert graph.node_token() == NODE_TOKEN
    assert graph.token(14, PUBLISHER, "/initialpose", schema) == POSE_TOKEN
    assert graph.token(8, SUBSCRIPTION, "/map", "nav_msgs/msg/OccupancyGrid") == MAP_TOKEN
    assert graph.key("/initialpose", schema) == POSE_KEY
    assert publisher_id(TEXT).hex() == ID


def test_a_pose_is_encoded_as_others_encode_it():
    header = types.make("std_msgs/Header", frame_id="map")
    covariance = np.diag([0.01, 0.01, 0, 0, 0, 0.04]).ravel()
    belief = types.make("geometry_msgs/PoseWithCovariance", pose=shapes.pose(1.25, 0.75), covariance=covariance)
    assert types.encode(types.make(POSE_KIND, header=header, pose=belief)) == POSE


def test_own_types_that_ros_has_too_are_the_same():
    shared = {name for name in own_types().fielddefs if not name.startswith("whisker_msgs")}
    assert len(shared) > 10
    for name in shared:
        assert own_types().hash_rihs01(name) == types.type_hash(name), name


@pytest.mark.parametrize(
    ("given", "wanted"),
    (("/robot/health/pilot", "/robot/health/pilot"), ("/my-robot/pose", "/my_robot/pose"), ("/7/pose", "/_7/pose")),
)
def test_topics_have_names_that_ros_allows(given, wanted):
    assert ros_name(given) == wanted


# --- a real router and a session as rmw_zenoh configures it


def session(**settings) -> zenoh.Session:
    config = zenoh.Config()
    for key, value in {"scouting/multicast/enabled": False, **settings}.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


class Desk:
    """A program of ROS: its session, the tokens it sees, and what comes by topic."""

    def __init__(self, router: str):
        self.session = session(**{"mode": "peer", "connect/endpoints": [router]})
        self.tokens, self.inbox, self._kept = queue.Queue(), queue.Queue(), []
        watch = self.session.liveliness().declare_subscriber(
            "@ros2_lv/0/**", lambda sample: self.tokens.put(str(sample.key_expr)), history=True
        )
        self._kept.append(watch)

    def wait_for_token(self, part: str) -> str:
        while part not in (token := self.tokens.get(timeout=30)):
            continue
        return token

    def listen(self, keys: str) -> None:
        self._kept.append(self.session.declare_subscriber(keys, self.inbox.put))

    def listen_late(self, keys: str) -> None:
        """As to a topic that is kept for those who come late."""
        late = declare_advanced_subscriber(
            self.session, keys, self.inbox.put, history=HistoryConfig(detect_late_publishers=True)
        )
        self._kept.append(late)


@contextlib.contextmanager
def node(folder, pilot: str, router: str):
    words = [sys.executable, "-m", "crunchbot.cli", "ros2", folder, "--connect", pilot, "--router", router]
    with subprocess.Popen([*words, "--domain", "0"], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline() == f"node crunchbot_robot in domain 0, by {router}\n"
            yield
        finally:
            process.terminate()
            assert process.wait(30) == 0


@contextlib.contextmanager
def ros_desk(router: str):
    with session(**{"mode": "router", "listen/endpoints": [router]}):
        desk = Desk(router)
        with desk.session:
            yield desk


def test_a_program_of_ros_reads_the_robot_and_sets_its_pose(tmp_path):
    write(tmp_path / "scene", SCENE)
    pilot, router = free_endpoint(), free_endpoint()
    with Link("pilot", listen=[pilot]) as link, ros_desk(router) as desk, node(tmp_path / "scene", pilot, router):
        inbox = link.subscribe("initial_pose")
        link.announce()
        assert link.wait_for(["ros2"], 30)
        desk.wait_for_token("/NN/%/%/crunchbot_robot")
        desk.listen_late("0/map/**")
        grid = desk.inbox.get(timeout=30)  # published long before
        assert types.decode(KINDS["/map"], grid.payload.to_bytes()).header.frame_id == "map"
        for topic in ("tf", "odom", "pose", "joint_states", "diagnostics", "robot/odometry"):
            desk.listen(f"0/{topic}/*/*")
        got = collect(desk, {topic: link.publish(topic) for topic in ("odometry", "pose", "joints")})
        check_attachments(desk, got)
        for topic, samples in got.items():
            if f"/{topic}" in KINDS:
                kind = KINDS[f"/{topic}"]
                assert samples[0].key_expr == f"0/{topic}/{dds_name(kind)}/{types.type_hash(kind)}"
                assert types.decode(kind, samples[0].payload.to_bytes())
        desk.session.put(POSE_KEY, b"?")
        desk.session.put(
            POSE_KEY, POSE[:4] + struct.pack("<iI", int(time.time()), 5) + POSE[12:]
        )  # stamped, as RViz does
        while (received := inbox.take(30.0)) and received[0].over:
            continue
        assert received[0].message.pose.pose.xytheta == pytest.approx((1.25, 0.75, 0.0))


def collect(desk: Desk, streams: dict) -> dict[str, list]:
    """At least two messages of each topic that was listened to; the robot speaks again when nothing more comes."""
    got, stamp = {}, ROW_NS
    while len(got) < 6 or min(map(len, got.values())) < 2:
        streams["odometry"].send(odometry(stamp, (0.1, 0.0, 0.0)))
        streams["pose"].send(located(stamp, (1.0, 0.8, 0.1)))
        streams["joints"].send(m.JointState(m.Header.at(stamp, "base_link"), ["front/alpha"], np.array([0.25])))
        stamp += ROW_NS
        with contextlib.suppress(queue.Empty):
            while sample := desk.inbox.get(timeout=0.2):
                topic = str(sample.key_expr)[2:].rpartition("/")[0].rpartition("/")[0]
                got.setdefault(topic, []).append(sample)
    return got


def check_attachments(desk: Desk, got: dict[str, list]) -> None:
    """Number, time, length of the id, id: numbers rise by one, the id is the hash of the publisher's token."""
    tokens = []
    while not tokens or "/MS/" not in tokens[-1]:  # the subscription is announced last
        tokens.append(desk.tokens.get(timeout=30))
    for topic, samples in got.items():
        (token,) = {token for token in tokens if f"/MP/%/%/crunchbot_robot/%{topic.replace('/', '%')}/" in token}
        read = [struct.unpack("<qqB16s", sample.attachment.to_bytes()) for sample in samples]
        assert all(length == 16 and name == publisher_id(token) for _, _, length, name in read)
        numbers = [number for number, *_ in read]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers))) and numbers[0] > 0
        assert abs(time.time_ns() - read[-1][1]) < 60 * 10**9


def dds_name(kind: str) -> str:
    return f"{kind.replace('/', '::msg::dds_::')}_"


def test_without_a_router_one_line_names_the_remedy(tmp_path):
    write(tmp_path / "scene", SCENE)
    words = [sys.executable, "-m", "crunchbot.cli", "ros2", tmp_path / "scene", "--connect", "none", "--router"]
    with subprocess.Popen([*words, free_endpoint()], stderr=subprocess.PIPE, text=True) as process:
        line = process.stderr.readline()
        process.terminate()
        assert process.wait(30) == 0
    assert "no router answers yet; start one: ros2 run rmw_zenoh_cpp rmw_zenohd" in line
    refused = subprocess.run([*words, "udp/x"], capture_output=True, text=True, timeout=60)
    assert refused.returncode == 2 and refused.stderr.count("\n") == 1 and "not an endpoint" in refused.stderr
