"""Bags as `ros2 bag record` leaves them, made by rosbags in both storages: a robot's own topics, and ordinary ones by a table."""

import json
import math

import numpy as np
import pytest
from commandkit import run, signals_as_before  # noqa: F401 - a fixture
from robotkit import to_rows
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from crunchbot.nav import localise
from crunchbot.nav.observations import observations_path
from crunchbot.observation import Row
from crunchbot.recording.messages import definition
from crunchbot.recording.types import make_store
from crunchbot.robot.bags.played import BagError, read_bag
from crunchbot.robot.bags.topic_rows import read_by_table
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.rows import ROW_NS, to_message
from crunchbot.scene import Arena, Prior, Robot, Scene, Whisker, load, write
from crunchbot.sensor_tables import SensorTable
from crunchbot.view import command
from crunchbot.view.__main__ import main as whisker_view
from crunchbot.view.playback import Playback
from crunchbot_lab import scenes

ROWS, START_NS = 30, 1_764_313_200 * 10**9
STORAGES = {"mcap": StoragePlugin.MCAP, "sqlite": StoragePlugin.SQLITE3}
HASH = make_store().hash_rihs01(m.SCHEMAS[m.Observation])
FILLED = b"\0\x01\0\x02"  # the head of CDR that says so of two bytes at the end


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A scene folder, its scene, its rows, and the messages of a robot's own topics: topic, bytes, type, time."""
    folder = tmp_path_factory.mktemp("scene")
    made = scenes.make("robot", 7, ROWS)
    scenes.write_scene(folder, made.scene, scenes.files.rounded(made.observations))
    loaded = load(folder)
    observed = localise.read_observations(observations_path(folder), loaded)
    said, summed = [], np.zeros(3)
    for n, row in enumerate(to_rows(observed, loaded)):
        message = to_message(Row.of(row), n, summed)
        summed, at_ns = message.pose, START_NS + n * ROW_NS
        truth = m.PoseStamped(message.header, m.Pose.planar(*observed.truth[n]))
        said += [("/r2/observation", message, at_ns), ("/r2/truth", truth, at_ns + 1000)]
    return folder, loaded, observed, said


def recorded(folder, storage, said):
    """What `ros2 bag record` leaves of the messages."""
    with Writer(folder, version=9, storage_plugin=STORAGES[storage]) as writer:
        known = {}
        for topic, message, at_ns in said:
            kind = m.SCHEMAS[type(message)]
            if topic not in known:
                known[topic] = writer.add_connection(
                    topic, kind, msgdef=definition(kind), rihs01=make_store().hash_rihs01(kind)
                )
            writer.write(known[topic], at_ns, m.encode(message))
    return folder


def rows_of(path):
    return localise.read_observations(observations_path(path), load(path))


def agree(rows, wanted) -> None:
    for name in ("t_s", "odometry", "texture", "radial_m", "truth"):
        ours, theirs = getattr(rows, name), getattr(wanted, name)
        assert np.allclose(ours, theirs, rtol=1e-5, atol=1e-6, equal_nan=True), name


@pytest.mark.parametrize("storage", STORAGES)
def test_a_robots_rows_are_read_from_any_bag_that_holds_them(scene, tmp_path, capsys, storage):
    folder, loaded, observed, said = scene
    bag = recorded(tmp_path / "bag", storage, said)
    (file,) = [path for path in bag.iterdir() if path.suffix in (".mcap", ".db3")]
    for n, path in enumerate((bag, file)):
        code, _, err = run(capsys, "scene", "from", path, "--out", tmp_path / "x")
        assert code == 2 and err == f"whisker: {path}: holds no arena.toml; give the robot's scene with --scene\n"
        code, out, err = run(capsys, "scene", "from", path, "--scene", folder, "--out", tmp_path / f"{n}")
        assert code == 0 and out.endswith(f"{ROWS} rows\n") and err == ""
        agree(rows_of(tmp_path / f"{n}"), observed)
        made = load(tmp_path / f"{n}")
        assert (made.arena, made.robot, made.prior) == (loaded.arena, loaded.robot, loaded.prior)
        played = read_bag(path, ["observation", "truth"])
        assert played.robot == "r2" and played.scene is None and len(played.said) == 2 * ROWS
        assert Playback(played).length_s == pytest.approx((ROWS - 1) * 0.1 + 1e-6)


def test_rows_that_were_lost_on_the_way_are_counted(scene, tmp_path, capsys):
    kept = [said for said in scene[3] if not 4 * ROW_NS < said[2] - START_NS < 8 * ROW_NS]
    bag = recorded(tmp_path / "bag", "mcap", kept)
    code, _, err = run(capsys, "scene", "from", bag, "--scene", scene[0], "--out", tmp_path / "x")
    assert code == 0 and len(rows_of(tmp_path / "x")) == ROWS
    assert err.startswith(f"whisker: warning: {bag}: 3 rows are missing; they are there") and err.count("\n") == 1


def test_a_scene_of_another_robot_is_refused(scene, tmp_path, table, capsys):
    bag = recorded(tmp_path / "rows", "sqlite", scene[3])
    code, _, err = run(capsys, "scene", "from", bag, "--scene", tmp_path / "own", "--out", tmp_path / "x")
    assert (
        code == 2 and err.count("\n") == 1 and err.startswith(f"whisker: {bag}: no column 'front_mm' in its rows; give")
    )


def test_a_bag_whose_recorder_was_killed_is_read_without_its_index(scene, tmp_path, capsys):
    bag = recorded(tmp_path / "bag", "mcap", scene[3])
    (bag / "metadata.yaml").unlink()
    assert run(capsys, "scene", "from", bag, "--scene", scene[0], "--out", tmp_path / "a")[0] == 0
    agree(rows_of(tmp_path / "a"), scene[2])
    bag = recorded(tmp_path / "lite", "sqlite", scene[3])
    (bag / "metadata.yaml").unlink()
    code, _, err = run(capsys, "scene", "from", bag, "--scene", scene[0], "--out", tmp_path / "b")
    assert code == 2 and "no bag (" in err and "by 'ros2 bag reindex'" in err and err.count("\n") == 1


def test_a_compressed_bag_and_messages_filled_up_by_dds_are_read(scene, tmp_path):
    kind = m.SCHEMAS[m.Observation]
    for mode in (CompressionMode.FILE, CompressionMode.MESSAGE):
        writer = Writer(tmp_path / mode.name, version=9, storage_plugin=StoragePlugin.MCAP)
        writer.set_compression(mode, CompressionFormat.ZSTD)
        with writer:
            topic = writer.add_connection("/a/observation", kind, msgdef=definition(kind), rihs01=HASH)
            for n, (_, message, at_ns) in enumerate(scene[3][::2]):
                data = m.encode(message)
                head = FILLED if n % 2 else data[:4]
                writer.write(topic, at_ns, head + data[4:] + bytes(2))
        played = read_bag(tmp_path / mode.name, ["observation"])
        assert [said.message.seq for said in played.said] == list(range(ROWS)) and played.damage == []


def test_a_bag_of_two_robots_is_refused_with_the_remedy(scene, tmp_path):
    other = [("/b/observation", message, at_ns) for topic, message, at_ns in scene[3] if topic == "/r2/observation"]
    bag = recorded(tmp_path / "bag", "sqlite", [*scene[3], *other])
    with pytest.raises(
        BagError, match=r"rows \(/NAME/observation\) of /b and /r2; give a bag of one: 'rosbags-convert --include"
    ):
        read_bag(bag, ["observation"])


def test_a_damaged_bag_of_others_gives_what_is_before(scene, tmp_path, capsys):
    bag = recorded(tmp_path / "bag", "sqlite", scene[3])
    (file,) = bag.glob("*.db3")
    file.write_bytes(b"no database" * 100)
    code, _, err = run(capsys, "scene", "from", bag, "--scene", scene[0], "--out", tmp_path / "a")
    assert code == 2 and err.count("\n") == 1 and "bag" in err


# --- ordinary topics

LENGTH_M, SPEED, TURN = 0.3, 0.2, 0.1
ARENA = Arena((4.0, 4.0), 4.0, ("NONE",), ("N",), ())
WHISKERS = tuple(
    Whisker(name, "object", base_m=(0.1, 0.0), yaw_rad=0.0, length_m=LENGTH_M) for name in ("front", "left", "right")
)
LIGHT = SensorTable("light", (0.0, 0.0), 0.0, 0.0, np.zeros((4, 4), np.uint8), 1.0, np.arange(3.0), np.ones((2, 2)))
OWN = Scene(ARENA, Robot(0.1, 0.05, 0.01, WHISKERS, (LIGHT,)), Prior("uniform"), origin=(-10.0, -3.0, 1.0))
TABLE = """
motion = "/odom"
front_mm = "/range"
light = {topic = "/joint_states", joint = "lamp", scale = 2.0, offset = 0.5}
left_mm = {topic = "/bumper", contact = 250.0}

[right_mm]
topic = "/contacts"
contact = 100
"""
GZ = {
    "ros_gz_interfaces/msg/Contact": "string collision1\nstring collision2",
    "ros_gz_interfaces/msg/Contacts": "std_msgs/Header header\nros_gz_interfaces/Contact[] contacts",
}


def place(t: float) -> tuple[float, float, float]:
    """On an arc, through the heading at which angles wrap."""
    theta = 3.0 + TURN * t
    return SPEED / TURN * math.sin(theta), -SPEED / TURN * math.cos(theta), theta


def joints(n: int, lamp: float) -> tuple[list[str], np.ndarray]:
    """Names and positions of message n: of each four one is of another joint alone, and one gives no positions."""
    if n % 4 == 1:
        return ["arm"], np.array([9.0])
    return ["arm", "lamp"], np.array([9.0, lamp] if n % 4 != 3 else [])


def ordinary(folder, storage, seconds=3.0, gap=(9.0, 9.0), headless=(), start_ns=START_NS):
    """20 Hz of odometry, 15 Hz of ranges, 40 Hz of joints, 30 Hz of contacts. Stamps are of another clock: zero."""
    types = get_typestore(Stores.ROS2_JAZZY)
    for name, text in GZ.items():
        types.register(get_types_from_msg(text, name))
    new = {name.rpartition("/")[2]: kind for name, kind in types.types.items()}
    header = new["Header"](new["Time"](0, 0), "odom")
    touch = new["Contact"]

    def pose(t):
        x, y, theta = place(t)
        turn = (0.0, 0.0, 0.0, 0.0) if t in headless else (0.0, 0.0, math.sin(theta / 2), math.cos(theta / 2))
        return new["Pose"](new["Point"](x, y, 0.0), new["Quaternion"](*turn))

    twist = new["TwistWithCovariance"](
        new["Twist"](new["Vector3"](0.0, 0.0, 0.0), new["Vector3"](0.0, 0.0, 0.0)), np.zeros(36)
    )
    makes = {
        "/odom": (
            20,
            lambda t: new["Odometry"](header, "base", new["PoseWithCovariance"](pose(t), np.zeros(36)), twist),
        ),
        "/range": (
            15,
            lambda t: new["Range"](header, 0, 0.1, 0.02, 0.25, 0.1 * t if t < 2 else (np.inf, 0.25)[t > 2.5], 0.0),
        ),
        "/joint_states": (
            40,
            lambda t: new["JointState"](header, *joints(round(40 * t), 0.1 * t), np.zeros(0), np.zeros(0)),
        ),
        "/bumper": (30, lambda t: new["Bool"](1.0 < t < 1.2)),
        "/contacts": (30, lambda t: new["Contacts"](header, [touch("a", "b")] if t > 2 else [])),
        "/slow": (2, lambda t: new["Bool"](True)),
        "/text": (5, lambda t: new["String"]("x")),
    }
    times = sorted((n / rate, topic) for topic, (rate, _) in makes.items() for n in range(round(seconds * rate) + 1))
    with Writer(folder, version=9, storage_plugin=STORAGES[storage]) as writer:
        known = {}
        for t, topic in times:
            if topic == "/odom" and gap[0] < t < gap[1]:
                continue
            message = makes[topic][1](t)
            kind = message.__msgtype__
            if topic not in known:
                known[topic] = writer.add_connection(topic, kind, typestore=types)
            at_ns = START_NS if t else start_ns
            writer.write(known[topic], at_ns + round(t * 1e9), types.serialize_cdr(message, kind))
    return folder


@pytest.fixture
def table(tmp_path):
    (tmp_path / "topics.toml").write_text(TABLE)
    write(tmp_path / "own", OWN)
    return tmp_path / "topics.toml"


@pytest.mark.parametrize("storage", STORAGES)
def test_rows_come_of_ordinary_topics_by_a_table(tmp_path, table, capsys, storage):
    bag = ordinary(tmp_path / "bag", storage)
    options = ("--scene", tmp_path / "own", "--topics", table)
    code, out, err = run(capsys, "scene", "from", bag, *options, "--out", tmp_path / "a")
    assert code == 0 and err == "" and out.endswith("30 rows\n")
    rows, made = rows_of(tmp_path / "a"), load(tmp_path / "a")
    assert made.origin == OWN.origin and made.robot.sensors[0].name == "light"
    assert rows.t_s == pytest.approx(0.1 * np.arange(1, 31), abs=1e-6)
    steps = np.array([(SPEED * 0.1, 0.5 * SPEED * TURN * 0.01, TURN * 0.1)] * 30)
    assert np.allclose(rows.odometry, steps, atol=1e-5)
    front = rows.radial_m[:, 0]
    assert front[1:20] == pytest.approx(0.01 * np.arange(2, 21), abs=0.007) and np.isinf(front[20:]).all()
    assert np.isnan(front[0]), "nearer than it can measure: not read"
    touching = [10, 11]
    assert (
        rows.radial_m[touching, 1] == pytest.approx(0.25) and np.isinf(np.delete(rows.radial_m[:, 1], touching)).all()
    )
    assert np.isinf(rows.radial_m[:20, 2]).all() and rows.radial_m[20:, 2] == pytest.approx(0.1)
    assert rows.own[:, 0] == pytest.approx(0.5 + 0.02 * np.arange(1, 31), abs=1e-6)
    assert run(capsys, "localise", tmp_path / "a", "--json")[0] == 0
    played = read_by_table(bag, table, load(tmp_path / "own"))
    assert json.loads(json.dumps(Playback(played).refused()))["count"] == 0
    assert [said.topic for said in played.said] == ["observation"] * 30


def test_gaps_and_what_says_nothing_are_reported(tmp_path, table, capsys):
    bag = ordinary(tmp_path / "bag", "mcap", gap=(0.5, 2.0), headless=(2.5, 2.55))
    options = ("--scene", tmp_path / "own", "--topics", table)
    code, _, err = run(capsys, "scene", "from", bag, *options, "--out", tmp_path / "a")
    assert code == 0, err
    lines = [line.removeprefix(f"whisker: warning: {bag}: ") for line in err.splitlines()]
    assert lines == [
        "motion: 2 poses without a heading are left out",
        "motion: none came from 0.5 s to 2.0 s; taken as even",
    ]
    rows = rows_of(tmp_path / "a")
    assert rows.odometry[:, 2].sum() == pytest.approx(TURN * 3.0, abs=1e-5)


@pytest.mark.parametrize("storage", STORAGES)
def test_damaged_messages_are_left_out_and_many_are_reported(tmp_path, table, capsys, storage):
    types, options = get_typestore(Stores.ROS2_JAZZY), ("--scene", tmp_path / "own", "--topics", table)
    with Reader(ordinary(tmp_path / "whole", storage)) as reader:
        said = [(one.topic, one.msgtype, at_ns, bytes(data)) for one, at_ns, data in reader.messages()]
    for text in GZ.items():
        types.register(get_types_from_msg(text[1], text[0]))
    for name, topic, each in (("one", "/odom", 31), ("many", "/range", 5), ("all", "/odom", 1)):
        with Writer(tmp_path / name, version=9, storage_plugin=STORAGES[storage]) as writer:
            known, count = {}, 0
            for at, kind, at_ns, data in said:
                if at not in known:
                    known[at] = writer.add_connection(at, kind, typestore=types)
                count += at == topic
                writer.write(known[at], at_ns, data[:9] if at == topic and count % each == 0 else data)
        code, _, err = run(capsys, "scene", "from", tmp_path / name, *options, "--out", tmp_path / f"of_{name}")
        if name == "all":
            assert code == 2 and "/odom: no message of 61 can be read; give another bag" in err
            continue
        assert code == 0 and len(rows_of(tmp_path / f"of_{name}")) == 30
        wanted = "/range: 9 of 46 messages are damaged and left out; look what wrote them"
        assert (wanted in err) == (name == "many") and (name == "many" or err == "")


def test_rows_without_a_message_are_not_read_and_counted(tmp_path, table, capsys):
    bag, words = ordinary(tmp_path / "bag", "sqlite"), ("--scene", tmp_path / "own", "--out", tmp_path / "a")
    code, _, err = run(capsys, "scene", "from", bag, *words, "--topics", minimal(tmp_path, "/slower", "light"))
    assert code == 2 and f"{bag}: no topic /slower; it has /bumper, /contacts, /joint_states, /odom" in err
    code, _, err = run(
        capsys, "scene", "from", bag, *words, "--topics", minimal(tmp_path, "/slow", "light", "contact = 1")
    )
    text = "light: not read in 24 of 30 rows, in which no message came"
    assert code == 0 and err == f"whisker: warning: {bag}: {text}\n"
    rows = rows_of(tmp_path / "a")
    assert np.flatnonzero(np.isfinite(rows.own[:, 0])).tolist() == [4, 9, 14, 19, 24, 29]
    assert np.isnan(rows.radial_m).all(), "of what no topic says nothing is known"


def minimal(folder, topic: str, column: str, more: str = ""):
    path = folder / "minimal.toml"
    path.write_text(f'motion = "/odom"\n[{column}]\ntopic = "{topic}"\n{more}\n')
    return path


@pytest.mark.parametrize(
    ("topic", "column", "more", "said"),
    [
        (
            "/bumper",
            "left_mm",
            "",
            "/bumper: std_msgs/msg/Bool is no JointState or Range, and no contact for which the table",
        ),
        ("/joint_states", "light", 'joint = "arms"', "/joint_states: no joint 'arms'; it has arm, lamp"),
        ("/text", "front_mm", "", "/text: std_msgs/msg/String is no JointState or Range"),
        ("/bumper", "back_mm", "", "line 2: 'back_mm' is no column; give motion, front_mm, left_mm, right_mm, light"),
        ("/bumper", "left_mm", "colour = 1", "line 4: 'colour' is unknown; remove it"),
        ("/bumper", "left_mm", 'contact = "yes"', "line 4: 'contact' must be a number"),
    ],
)
def test_what_a_table_cannot_mean_is_one_line(tmp_path, table, capsys, topic, column, more, said):
    bag = ordinary(tmp_path / "bag", "mcap", seconds=1.0)
    words = ("scene", "from", bag, "--topics", minimal(tmp_path, topic, column, more), "--out", tmp_path / "a")
    code, _, err = run(capsys, *words, "--scene", tmp_path / "own")
    assert code == 2 and said in err and err.count("\n") == 1
    code, _, err = run(capsys, *words)
    assert code == 2 and "a table of topics fills the columns of a scene; give the scene with --scene" in err


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('motion = "/bumper"', "/bumper: std_msgs/msg/Bool is no Odometry; name the odometry's topic"),
        ('front_mm = "/range"', "'motion' is missing; add it"),
        ("motion = 3", "'topic' must be a string, not 3"),
        ("motion", "give a table of topics (docs/formats.md)"),
    ],
)
def test_a_table_names_the_odometry(tmp_path, table, capsys, text, said):
    bag = ordinary(tmp_path / "bag", "sqlite", seconds=1.0)
    table.write_text(text)
    options = ("--scene", tmp_path / "own", "--topics", table, "--out", tmp_path / "a")
    code, _, err = run(capsys, "scene", "from", bag, *options)
    assert code == 2 and said in err and err.count("\n") == 1


def test_a_clock_that_leaps_is_refused(tmp_path, table, capsys):
    """As of a simulation whose clock was not there at first: 18 billion rows."""
    bag = ordinary(tmp_path / "bag", "mcap", start_ns=10**9)
    options = ("--scene", tmp_path / "own", "--topics", table, "--out", tmp_path / "a")
    code, _, err = run(capsys, "scene", "from", bag, *options)
    assert code == 2 and "its clock leaps by more than a day; give the part of the bag before" in err


def test_a_drive_shorter_than_a_row_is_refused(tmp_path, table, capsys):
    for seconds, headless in ((0.05, ()), (0.0, ()), (0.0, (0.0,))):
        bag = ordinary(tmp_path / f"{seconds}{len(headless)}", "mcap", seconds=seconds, headless=headless)
        options = ("--scene", tmp_path / "own", "--topics", table, "--out", tmp_path / "a")
        code, _, err = run(capsys, "scene", "from", bag, *options)
        assert code == 2 and "less than a row of odometry; give a bag of a longer drive" in err


def test_the_page_plays_bags_of_others(scene, tmp_path, table, capsys, monkeypatch):
    own = recorded(tmp_path / "own_topics", "sqlite", scene[3])
    other = ordinary(tmp_path / "bag", "mcap")
    shown = []

    async def serve(arguments, hub, part):
        shown.append((hub.source.length_s, len(hub.robot.scene.robot.whiskers)))
        return 0

    monkeypatch.setattr(command, "_serve", serve)
    assert whisker_view([str(own), "--scene", str(scene[0])]) == 0
    assert whisker_view([str(other), "--scene", str(tmp_path / "own"), "--topics", str(table)]) == 0
    assert shown == [(pytest.approx(2.9, abs=1e-3), len(scene[1].robot.whiskers)), (pytest.approx(2.9), 3)]
    assert whisker_view([str(other), "--topics", str(table)]) == whisker_view(["--topics", str(table)]) == 2
    err = capsys.readouterr().err.splitlines()
    assert "give the scene with --scene" in err[0] and "--topics: no bag to read by it; name one" in err[1]


def test_a_robot_without_object_whiskers_has_rows_too(scene, tmp_path, table, capsys):
    blind = Scene(ARENA, Robot(0.1, 0.05, 0.01, (Whisker("foot", "texture", tip_m=(0.1, 0.0)),), (LIGHT,)), None)
    write(tmp_path / "blind", blind)
    bag, words = ordinary(tmp_path / "bag", "mcap"), ("--topics", minimal(tmp_path, "/slow", "light", "contact = 1"))
    code, _, _ = run(capsys, "scene", "from", bag, "--scene", tmp_path / "blind", *words, "--out", tmp_path / "a")
    rows = rows_of(tmp_path / "a")
    assert code == 0 and np.isnan(rows.texture).all() and rows.radial_m.shape == (30, 0) and rows.normal is None
