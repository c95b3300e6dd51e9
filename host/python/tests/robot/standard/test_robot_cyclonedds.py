"""A robot as a node of ROS 2 by Cyclone DDS, read, and given its pose, by a program with types of its own (rosdesk)."""

import contextlib
import os
import subprocess
import sys
import time
import uuid

import numpy as np
import pytest
import rosdesk
from linkkit import free_endpoint
from rosdesk import DOMAIN, Desk, apart, wait_for
from test_robot_standard import ROW_NS, SCENE, located, odometry

from crunchbot.robot.network import messages as m
from crunchbot.robot.network.link import Link
from crunchbot.robot.standard import shapes, types
from crunchbot.scene import write

VARIABLE = "CYCLONEDDS_URI"


def command(*words: object) -> list[str]:
    return [sys.executable, "-m", "crunchbot.cli", "ros2", "--rmw", "cyclonedds", *map(str, words)]


@contextlib.contextmanager
def node(scene, pilot: str, tag: str):
    words = command(scene, "--connect", pilot, "--domain", DOMAIN)
    environment = os.environ | {VARIABLE: apart(tag)}
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment) as process:
        try:
            where = f"in domain {DOMAIN}, by Cyclone DDS, range localhost"
            assert process.stdout.readline() == f"node crunchbot_robot {where}\n"
            yield process
        finally:
            process.terminate()
            process.last_words = process.communicate(timeout=30)[0]
            assert process.returncode == 0


def test_a_program_of_ros_reads_the_robot_and_sets_its_pose(tmp_path):
    write(tmp_path / "scene", SCENE)
    pilot, tag = free_endpoint(), str(uuid.uuid4())
    desk = Desk(tag)
    with Link("pilot", listen=[pilot]) as link, node(tmp_path / "scene", pilot, tag) as process:
        inbox = link.subscribe("initial_pose")
        link.announce()
        assert link.wait_for(["ros2"], 30)
        check_map(desk)
        check_topics(desk, {topic: link.publish(topic) for topic in ("odometry", "pose", "joints")})
        check_graph(desk)
        poses = desk.writer("rt/initialpose", rosdesk.PoseWithCovarianceStamped)
        wait_for(poses.get_matched_subscriptions, "nobody takes a pose")
        poses.write(given_pose(-1.0))  # no variance
        poses.write(given_pose(0.01))
        while (received := inbox.take(30.0)) and received[0].over:
            continue
        assert received[0].message.pose.pose.xytheta == pytest.approx((1.25, 0.75, 0.0))
        assert received[0].message.pose.covariance[0] == 0.01
    assert process.last_words.endswith(" messages, 1 poses set, 1 refused\n")
    wait_for(lambda: not desk.others(), "the node has not said goodbye")


def check_map(desk: Desk) -> None:
    """It was published before the reader was there."""
    (grid,) = wait_for(desk.reader("rt/map", rosdesk.OccupancyGrid, rosdesk.KEPT).take, "no map")
    wanted = shapes.occupancy(SCENE, types.make("std_msgs/Header"))
    assert grid.header.frame_id == "map" and grid.info.resolution == pytest.approx(wanted.info.resolution)
    assert (grid.info.width, grid.info.height) == (wanted.info.width, wanted.info.height)
    assert np.array_equal(grid.data, wanted.data)


def check_topics(desk: Desk, streams: dict) -> None:
    """The robot speaks until each topic has come."""
    readers = {
        "frames": desk.reader("rt/tf", rosdesk.TFMessage),
        "pose": desk.reader("rt/pose", rosdesk.PoseWithCovarianceStamped),
        "joints": desk.reader("rt/joint_states", rosdesk.JointState),
    }
    got, stamp = {name: [] for name in readers}, ROW_NS

    def speak() -> bool:
        nonlocal stamp
        streams["odometry"].send(odometry(stamp, (0.1, 0.0, 0.0)))
        streams["pose"].send(located(stamp, (1.0, 0.8, 0.1)))
        streams["joints"].send(m.JointState(m.Header.at(stamp, "base_link"), ["front/alpha"], np.array([0.25])))
        stamp += ROW_NS
        for name, reader in readers.items():
            got[name] += reader.take(10)
        return len(got["frames"]) > 1 and all(got.values())

    wait_for(speak, "some topics do not come")
    frames = {(one.header.frame_id, one.child_frame_id): one for sent in got["frames"] for one in sent.transforms}
    assert set(frames) == {("map", "odom"), ("odom", "base_link")}
    assert frames["odom", "base_link"].transform.translation == rosdesk.Vector3(0.1, 0.0, 0.0)
    pose = got["pose"][0].pose
    assert (pose.pose.position, list(pose.covariance[:2])) == (rosdesk.Point(1.0, 0.8, 0.0), [0.01, 0.0])
    assert (list(got["joints"][0].name), list(got["joints"][0].position)) == (["front/alpha"], [0.25])


def check_graph(desk: Desk) -> None:
    """`ros2 node info` knows whose the endpoints are, and `ros2 topic info --verbose` their types' hashes."""
    (participant,) = desk.others()
    assert participant.qos[rosdesk.Policy.Userdata].data == b"enclave=/;"
    pose = desk.publications()["rt/pose"]
    assert pose.type_name == "geometry_msgs::msg::dds_::PoseWithCovarianceStamped_"
    hashed = types.type_hash("geometry_msgs/PoseWithCovarianceStamped")
    assert pose.qos[rosdesk.Policy.Userdata].data == f"typehash={hashed};".encode()
    graph = desk.reader("ros_discovery_info", rosdesk.ParticipantEntitiesInfo, rosdesk.KEPT)
    said = []

    def agrees() -> bool:  # topics of health come as they are published
        said.extend(graph.take(10))
        there = {one.key.bytes for name, one in desk.publications().items() if name != "ros_discovery_info"}
        return said and {bytes(gid.data) for gid in said[-1].node_entities_info_seq[0].writer_gid_seq} == there

    wait_for(agrees, "the node's publishers are not those that it names")
    (described,) = said[-1].node_entities_info_seq
    assert (described.node_namespace, described.node_name) == ("/", "crunchbot_robot")
    assert bytes(said[-1].gid.data) == participant.key.bytes and len(described.reader_gid_seq) == 1


def given_pose(variance: float) -> rosdesk.PoseWithCovarianceStamped:
    pose = rosdesk.Pose(rosdesk.Point(1.25, 0.75, 0.0), rosdesk.Quaternion(0.0, 0.0, 0.0, 1.0))
    covariance = np.zeros(36)
    covariance[[0, 7, 35]] = variance
    header = rosdesk.Header(rosdesk.Time(int(time.time()), 5), "map")  # as RViz stamps it
    return rosdesk.PoseWithCovarianceStamped(header, rosdesk.PoseWithCovariance(pose, covariance.tolist()))


@pytest.mark.parametrize(
    ("words", "variables", "line"),
    (
        (["--router", "tcp/localhost:7447"], {}, "--router: --rmw cyclonedds has none; leave it out"),
        ([], {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, "'off' is not served; give --range localhost or subnet"),
        (["--domain", "233"], {}, "argument --domain: '233' is not a whole number from 0 to 232"),
        ([], {VARIABLE: "file:///nowhere.xml"}, f"mend {VARIABLE}, or choose another --domain"),
    ),
)
def test_mistakes_are_one_line_with_the_remedy(tmp_path, words, variables, line):
    write(tmp_path / "scene", SCENE)
    ran = subprocess.run(
        command(tmp_path / "scene", "--connect", "none", *words),
        capture_output=True,
        text=True,
        timeout=120,
        env=os.environ | variables,
    )
    assert ran.returncode in (1, 2) and line in ran.stderr.splitlines()[-1], ran.stderr


def test_a_range_is_of_cyclonedds_alone(tmp_path):
    write(tmp_path / "scene", SCENE)
    words = [sys.executable, "-m", "crunchbot.cli", "ros2", str(tmp_path / "scene"), "--range", "subnet"]
    ran = subprocess.run(words, capture_output=True, text=True, timeout=120)
    assert (ran.returncode, ran.stderr.count("\n")) == (2, 1)
    assert "--range: --rmw zenoh has none" in ran.stderr


def test_without_the_extra_one_line_names_it(tmp_path):
    write(tmp_path / "scene", SCENE)
    block = "import sys; sys.modules['cyclonedds'] = None; from crunchbot.cli import main; sys.exit(main())"
    words = [sys.executable, "-c", block, *command(tmp_path / "scene", "--connect", "none")[3:]]
    ran = subprocess.run(words, capture_output=True, text=True, timeout=120)
    wanted = "whisker: ros2: needs the package cyclonedds; run: pip install 'crunchbot[cyclonedds]'\n"
    assert (ran.returncode, ran.stderr) == (2, wanted)
