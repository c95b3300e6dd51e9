"""The robot's bag: what ROS 2 tools read of it, and the scene that comes of it again."""

import re
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from commandkit import command, run, signals_as_before  # noqa: F401 - a fixture
from linkkit import free_endpoint
from patience import PATIENCE_S
from PIL import Image
from robotkit import examples, flat, to_rows
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from crunchbot.commands.bag import next_free
from crunchbot.nav import localise
from crunchbot.nav.observations import observations_path
from crunchbot.observation import Row
from crunchbot.pilot.pilot import compose
from crunchbot.recording.mcapfile import McapFile
from crunchbot.recording.writing import TopicWriter
from crunchbot.robot.bags.log_clock import LogClock
from crunchbot.robot.bags.played import RECORD
from crunchbot.robot.bags.writing import Bag, metadata
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.inbox import Received
from crunchbot.robot.network.link import Link
from crunchbot.robot.network.rows import RowPublisher
from crunchbot.robot.network.streams import Envelope
from crunchbot.scene import load
from crunchbot.sensor_tables import SensorTable
from crunchbot_lab import scenes

ROWS = 30


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A scene folder and its rows with the truth."""
    folder = tmp_path_factory.mktemp("scene")
    made = scenes.make("robot", 7, ROWS)
    scenes.write_scene(folder, made.scene, scenes.files.rounded(made.observations))
    loaded = load(folder)
    return folder, loaded, localise.read_observations(observations_path(folder), loaded)


@pytest.fixture(scope="module")
def bag(scene, tmp_path_factory):
    """A bag that a process wrote: rows, truth, and one message of every other topic."""
    folder, loaded, observations = scene
    path, endpoint = tmp_path_factory.mktemp("bag") / "run.mcap", free_endpoint()
    with Link("pilot", listen=[endpoint], lock_step=True) as pilot:
        options = ["--scene", folder, "--connect", endpoint, "--lock-step"]
        child = subprocess.Popen(command("bag", path, *options), stdout=subprocess.PIPE, text=True)
        assert pilot.wait_for(["bag"], PATIENCE_S)
        rows, truth = RowPublisher(pilot), pilot.publish("truth")
        others = {topic: pilot.publish(topic) for topic in examples() if topic not in ("observation", "truth")}
        for n, row in enumerate(to_rows(observations, loaded)):
            sent = rows.send(Row.of(row))
            truth.send(m.PoseStamped(sent.header, m.Pose.planar(*observations.truth[n])))
        for topic, stream in others.items():
            stream.send(examples()[topic])
        for stream in (rows, *[s for topic, s in others.items() if not topic.startswith("health")], truth):
            stream.end("over") if stream is rows else stream.end(0, "over")
        out, _ = child.communicate(timeout=PATIENCE_S)
    assert child.returncode == 0 and out.startswith(f"{path}: messages ") and ", missed 0, refused 0" in out
    return path


def test_ros_tools_open_it(bag, scene):
    _, loaded, observations = scene
    rows, seen, times, placed = [], {}, [], {}
    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        kinds = {c.topic: c.msgtype for c in reader.connections}
        for connection, time_ns, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            if connection.topic == "/robot/observation":
                rows.append(message)
                times.append(time_ns)
            elif connection.topic in ("/tf", "/map"):
                placed.setdefault(connection.topic, []).append(message)
            elif connection.topic != "/robot/truth":
                seen[connection.topic.removeprefix("/robot/")] = message
    assert kinds.pop("/robot/health/bag", "whisker_msgs/msg/ProcessHealth") == "whisker_msgs/msg/ProcessHealth"
    assert kinds.pop("/tf") == "tf2_msgs/msg/TFMessage" and kinds.pop("/map") == "nav_msgs/msg/OccupancyGrid"
    frames = {(t.header.frame_id, t.child_frame_id) for one in placed["/tf"] for t in one.transforms}
    assert ("odom", "base_link") in frames
    of_scene, of_mapper = placed["/map"]
    assert of_scene.info.width * of_scene.info.height == len(of_scene.data) and of_mapper.data.tolist() == [
        -1,
        0,
        50,
        99,
        100,
        1,
    ]
    assert kinds == {f"/robot/{topic}": m.SCHEMAS[type(message)] for topic, message in examples().items()}
    assert [row.seq for row in rows] == list(range(ROWS)) and set(np.diff(times)) == {10**8}
    for topic, message in examples().items():
        if topic in seen:
            theirs = flat(seen[topic])
            assert all(theirs[place] == value or value != value for place, value in flat(message).items()), topic


def test_what_it_says_of_itself(bag, scene):
    with McapFile(bag) as file:
        reported = file.metadata[RECORD]
        assert file.complete and reported["robot"] == "robot" and reported["observation.received"] == str(ROWS + 1)
    assert reported["arena.toml"] == (scene[0] / "arena.toml").read_text() and reported["missed"] == "0"


def test_what_lies_beside_a_scenes_files_is_in_the_bag_too(scene, tmp_path):
    _, loaded, observations = scene
    sensor = SensorTable(
        "light", (0.0, 0.0), 0.0, 0.0, np.zeros((5, 5), np.uint8), 0.5, np.arange(3.0), np.ones((2, 2))
    )
    scenes.write_scene(tmp_path, replace(loaded, robot=replace(loaded.robot, sensors=(sensor,))), observations)
    arena = (tmp_path / "arena.toml").read_text()
    Image.fromarray((loaded.arena.floor_indices()[::-1] * 127).astype(np.uint8)).save(tmp_path / "floor.png")
    (tmp_path / "arena.toml").write_text(re.sub(r"floor = \[.*?\]", 'floor = "floor.png"', arena, flags=re.DOTALL))
    reported = metadata("robot", tmp_path)
    assert (
        reported["arena.toml"] == arena
        and "[[sensor]]" not in reported["robot.toml"]
        and "floor_left" in reported["robot.toml"]
    )


def test_a_scene_comes_of_it_again(bag, scene, tmp_path, capsys):
    folder, loaded, observations = scene
    code, out, _ = run(capsys, "scene", "from", bag, "--out", tmp_path / "again")
    assert code == 0 and out.endswith(f"{ROWS} rows\n")
    again = load(tmp_path / "again")
    rows = localise.read_observations(observations_path(tmp_path / "again"), again)
    assert again.arena == loaded.arena and again.robot == loaded.robot and again.prior == loaded.prior
    for name in ("t_s", "odometry", "texture", "radial_m", "truth"):
        ours, theirs = getattr(rows, name), getattr(observations, name)
        assert np.allclose(ours, theirs, rtol=1e-5, atol=1e-6, equal_nan=True), name


class Kept(list):
    """A link that keeps what is sent on it."""

    def publish(self, topic):
        return self

    send = list.append


def scene_of(messages, scene, folder, capsys):
    """Rows of the scene that is made of a bag with these observations."""
    toml = {file.name: file.read_text() for file in scene[0].glob("*.toml")}
    writer = TopicWriter(folder / "a.mcap", RECORD, {"robot": "r2"} | toml)
    Bag(writer, "r2").take([Received("observation", row, Envelope(1, n, 0)) for n, row in enumerate(messages)])
    writer.finish()
    assert run(capsys, "scene", "from", folder / "a.mcap", "--out", folder / "b")[0] == 0
    return localise.read_observations(observations_path(folder / "b"), scene[1])


def summed(motions) -> np.ndarray:
    total = np.zeros(3)
    for motion in motions:
        total = compose(total, motion)
    return total


def sent(scene, first: int = 0, last: int = ROWS):
    """Observations of a pilot that lived for these rows."""
    kept = Kept()
    publisher = RowPublisher(kept)
    for row in to_rows(scene[2], scene[1])[first:last]:
        publisher.send(Row.of(row))
    return kept, publisher.pose


def test_rows_that_are_not_in_the_bag_are_there_with_their_motion_and_nothing_read(scene, tmp_path, capsys):
    messages, pose = sent(scene)
    lost = [1, 2, 3]
    assert all(messages[n].motion.any() for n in lost)
    rows = scene_of([row for row in messages if row.seq not in lost], scene, tmp_path, capsys)
    assert rows.t_s == pytest.approx(scene[2].t_s) and rows.truth is None
    assert np.isnan(rows.texture[lost]).all() and np.isnan(rows.radial_m[lost]).all()
    assert rows.odometry == pytest.approx(scene[2].odometry, abs=1e-5), "the robot went on as it did"
    assert summed(rows.odometry) == pytest.approx(pose, abs=1e-5)


def test_a_pilot_that_began_anew_goes_on_in_the_scene(scene, tmp_path, capsys):
    (first, pose), (then, more) = sent(scene, 0, 12), sent(scene, 12)
    rows = scene_of([*first, *then[2:]], scene, tmp_path, capsys)
    assert len(rows) == ROWS - 2 and np.all(np.diff(rows.t_s) > 0.0)
    assert summed(rows.odometry) == pytest.approx(compose(pose, more), abs=1e-5)


def test_bags_that_no_scene_can_be_made_from(scene, tmp_path, capsys):
    TopicWriter(tmp_path / "empty.mcap", RECORD, {"robot": "robot"}).finish()
    code, _, err = run(capsys, "scene", "from", tmp_path / "empty.mcap", "--out", tmp_path / "x")
    assert code == 2 and err.startswith(
        f"whisker: {tmp_path}/empty.mcap: nothing that the robot said can be read; give another"
    )
    (tmp_path / "no.mcap").write_text("nothing")
    code, _, err = run(capsys, "scene", "from", tmp_path / "no.mcap", "--out", tmp_path / "x")
    assert code == 2 and "no recording with observation rows" in err


def test_a_damaged_bag_gives_a_scene_and_a_warning(bag, scene, tmp_path, capsys):
    """A page of zeros at the beginning, where the magic, the metadata and the first rows are."""
    damaged = tmp_path / "a.mcap"
    messages, _ = sent(scene)
    with TopicWriter(
        damaged, RECORD, {"robot": "r2"} | {file.name: file.read_text() for file in scene[0].glob("*.toml")}
    ) as writer:
        take = Bag(writer, "r2")
        for n, row in enumerate(messages):
            take.take([Received("observation", row, Envelope(1, n, 0))])
            writer.flush()
        writer.finish()
    damaged.write_bytes(bytes(4096) + damaged.read_bytes()[4096:])
    code, out, err = run(capsys, "scene", "from", damaged, "--out", tmp_path / "b")
    lines = err.splitlines()
    rows = int(out.split()[-2])
    assert code == 0 and 0 < rows < ROWS and all(line.startswith("whisker: warning: ") for line in lines)
    assert any(f"/r2/observation: {ROWS - rows} of {ROWS} messages are lost" in line for line in lines)


def test_log_times_follow_the_bridge_and_outlive_it():
    clock, began, second = LogClock(10**18), 10**18, 10**9
    assert clock.other(3 * second) == began
    assert [clock.row(s * second) - began for s in (500, 501)] == [0, second]
    assert [clock.other(s * second) - began for s in (499, 501, 502)] == [-second, second, 2 * second]
    assert clock.other(0) == began + second  # a process that does not know the bridge's clock
    assert clock.row(0) == began + second + 10**8  # the bridge began anew
    assert clock.row(second) == clock.other(second) == began + 2 * second + 10**8
    assert clock.other(501 * second) == clock.latest  # an answer to a row of the bridge before


def test_log_times_stay_what_a_file_can_hold_whatever_rows_are_stamped():
    clock, began = LogClock(10**18), 10**18
    for n in range(200):
        clock.row(n % 2 * (10**9 - 1) * 10**9)
    assert began < clock.latest <= began + 200 * 10**8


def test_an_existing_bag_is_kept(tmp_path, capsys):
    (tmp_path / "a.mcap").write_text("dear")
    code, _, err = run(capsys, "bag", tmp_path / "a.mcap", "--connect", "none")
    assert code == 2 and "is there already; give --overwrite" in err
    assert (tmp_path / "a.mcap").read_text() == "dear"


def test_a_recorder_that_is_started_again_leaves_what_was_recorded(tmp_path):
    wanted = [tmp_path / name for name in ("a.mcap", "a-2.mcap", "a-3.mcap")]
    for path in wanted:
        assert next_free(wanted[0]) == path
        path.write_text("dear")
