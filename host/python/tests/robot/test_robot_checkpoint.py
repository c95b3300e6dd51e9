"""A navigator's memory: what is kept comes back, what cannot be right is refused in one line, and motion is never lost."""

import json
import zlib

import numpy as np
import pytest
from fuzz_checkpoint import fuzz, seed_file
from robotkit import to_rows

from crunchbot.nav import filters
from crunchbot.nav.filters import COMPONENT, Filter, SettingError
from crunchbot.observation import Row
from crunchbot.pilot.pilot import compose
from crunchbot.pilot.wheels import EXACT
from crunchbot.robot import checkpoint
from crunchbot.robot.checkpoint import Checkpoint, CheckpointError
from crunchbot.robot.memory import AGE_MOST_S, Memory, widen
from crunchbot.robot.network import belief
from crunchbot.robot.network.inbox import Received
from crunchbot.robot.network.rows import ROW_NS, Follower, Place, Step, to_message
from crunchbot.robot.network.streams import Envelope
from crunchbot.robot.processes import parts
from crunchbot_lab import scenes

ROWS = 60
NAMES = ("grid", "adaptive")


@pytest.fixture(scope="module")
def made():
    """A scene and its rows."""
    made = scenes.make("robot", 4, ROWS)
    return made.scene, to_rows(made.observations, made.scene)


def components_at(x: float, y: float, count: int = 3) -> np.ndarray:
    components = np.zeros(count, COMPONENT)
    components["pose"] = [x, y, 0.5]
    components["sigma_m"], components["sigma_rad"], components["mass"] = 0.02, 0.05, np.arange(1, count + 1)
    return components


def received(rows, stream: int = 7, sent_from_ns: int = 10**18) -> list[Received]:
    """As a pilot sends them, its sum of motion from zero."""
    pose, out = np.zeros(3), []
    for n, row in enumerate(rows):
        message = to_message(Row.of(row), n, pose)
        pose = message.pose
        out.append(Received("observation", message, Envelope(stream, n, sent_from_ns + n * ROW_NS)))
    return out


def step_of(row: Received) -> Step:
    return Step(row.message, row.message.motion, row.message.header.stamp.ns, 1, row.envelope)


def kept(tmp_path, scene, row: Received, names=NAMES):
    """The file of a navigator that was killed after this row."""
    path = tmp_path / "navigator.checkpoint"
    x, y = np.array(scene.arena.size_m) / 2.0
    Memory(path, scene, names).keep(step_of(row), {name: components_at(x, y) for name in names})
    return path


def test_what_is_kept_comes_back(made, tmp_path):
    scene, rows = made
    row = received(rows)[9]
    path = kept(tmp_path, scene, row)
    reported = checkpoint.load(path)
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]
    assert (reported.stream, reported.seq, reported.stamp_ns) == (7, 9, row.message.header.stamp.ns)
    assert (reported.sent_ns, reported.scene) == (row.envelope.sent_ns, checkpoint.identity(scene))
    assert list(reported.pose) == list(row.message.pose) and list(reported.beliefs) == list(NAMES)
    for components in reported.beliefs.values():
        assert components.dtype == COMPONENT and components["mass"].tolist() == [1.0, 2.0, 3.0]
    assert checkpoint.encode(reported) == path.read_bytes()


def test_what_no_filter_could_begin_from_is_not_kept(made, tmp_path):
    scene, rows = made
    path, components = tmp_path / "file", components_at(0.5, 0.5, 5)
    components["pose"][0, 0], components["pose"][1, 1], components["mass"][2] = -0.01, scene.arena.size_m[1] + 0.01, 0.0
    components["sigma_m"][3] = components["sigma_rad"][3] = 0.0
    memory, row = Memory(path, scene, ("grid",)), step_of(received(rows)[0])
    memory.keep(row, {"grid": components[:3]})
    assert not path.exists()
    memory.keep(row, {"grid": components})
    left = checkpoint.load(path).beliefs["grid"]
    assert left["mass"].tolist() == [4.0, 5.0] and not filters.prior_fault(scene, left)


def forged(change, components: bytes | None = None) -> bytes:
    """A checkpoint whose JSON `change` has had in hand, with the right CRC."""
    rest = seed_file().partition(b"\n")[2]
    line, _, body = rest.partition(b"\n")
    head = json.loads(line)
    line = change(head)
    rest = (json.dumps(head).encode() if line is None else line) + b"\n" + (body if components is None else components)
    return b"whisker-checkpoint 1 %08x\n" % zlib.crc32(rest) + rest


def setting(name, value):
    return lambda head: head.update({name: value})


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"", "no checkpoint"),
        (b"\x89PNG\r\n", "no checkpoint"),
        (seed_file().replace(b"checkpoint 1", b"checkpoint 2", 1), "version 2, this release has 1"),
        (seed_file()[:-1], "CRC"),
        (seed_file() + b"\0", "CRC"),
        (forged(lambda head: b"[]"), "second line"),
        (forged(lambda head: b"{" * 5000), "second line"),
        (forged(lambda head: b"[" * 4000), "second line"),
        (forged(lambda head: head.pop("seq") and None), "second line"),
        (forged(setting("more", 1)), "second line"),
        *((forged(setting("stream", v)), "field stream") for v in (-1, 2**32, 1.0, True, None, "7")),
        *((forged(setting("seq", v)), "field seq") for v in (-1, 2**63, 0.5)),
        *((forged(setting("stamp_ns", v)), "field stamp_ns") for v in (-1, 2**63, [])),
        *((forged(setting("sent_ns", v)), "field sent_ns") for v in (-1, 1e300)),
        (forged(setting("scene", 5)), "field scene"),
        *(
            (forged(setting("pose", v)), "field pose")
            for v in (None, [0.0, 0.0], [0.0, 0.0, float("nan")], [0.0, 0.0, float("inf")], [0.0, 0.0, "x"], [1, 2, 3])
        ),
        *(
            (forged(setting("filters", v)), "field filters")
            for v in ({}, [], {"grid": 0}, {"grid": -1}, {"grid": 4}, {"grid": 1.5}, {"grid": 10**9}, {"grid": "3"})
        ),
        (forged(lambda head: None, b""), "field filters"),
    ],
)
def test_what_is_no_checkpoint_is_refused_by_field(data, why):
    with pytest.raises(CheckpointError, match=why.replace("(", r"\(")) as error:
        checkpoint.decode(data)
    assert "\n" not in str(error.value)


def test_whatever_a_file_holds_is_read_or_refused():
    assert 1000 < fuzz(3000, seed=1)["refused in one line"] < 3000


def test_a_filter_begins_from_what_a_filter_listed(made):
    scene, rows = made
    for name in filters.filter_names():
        before = Filter(name, scene)
        for row in rows[:20]:
            reported = before.step(row)
        after = Filter(name, scene, components=belief.condense(before.components()))
        listed = after.components()
        weight = listed["mass"] / listed["mass"].sum()
        off = np.hypot(*(listed["pose"][:, :2] - reported.pose[:2]).T)
        assert float(weight @ (off < 0.3).astype(float)) > 0.6, name
    for field, value, why in (("mass", -1.0, "component 1: its mass"), ("sigma_m", 0.0, "component 1: its width")):
        bad = components_at(0.5, 0.5)
        bad[field][1] = value
        with pytest.raises(SettingError, match=why):
            Filter("grid", scene, components=bad)
    with pytest.raises(SettingError, match="no components"):
        Filter("grid", scene, components=components_at(0.5, 0.5)[:0])


def test_from_the_same_pilot_the_belief_is_taken_as_it_was(made, tmp_path):
    scene, rows = made
    sent = received(rows)
    memory_path = kept(tmp_path, scene, sent[9])
    memory = Memory(memory_path, scene, NAMES)
    place, beliefs = memory.recall(sent[30])
    assert (place.stream, place.seq, list(place.pose)) == (7, 9, list(sent[9].message.pose))
    assert beliefs["grid"]["sigma_m"].tolist() == [0.02] * 3 and memory.note == ""
    assert memory.recall(sent[31]) is None  # once
    slow = later(sent[9], 5.0)  # the pilot's next row, whose motion is known however long it took
    assert Memory(memory_path, scene, NAMES).recall(slow)[1]["grid"]["sigma_m"].tolist() == [0.02] * 3


def test_after_another_pilot_the_belief_is_wider_by_what_the_robot_could_do(made, tmp_path):
    """Row 9, then 2.1 s until row 0 of the other pilot: 2 s that nobody counted."""
    scene, rows = made
    sent = received(rows)
    memory = Memory(kept(tmp_path, scene, sent[9]), scene, NAMES)
    (first,) = received([rows[30]], stream=8, sent_from_ns=sent[30].envelope.sent_ns)
    place, beliefs = memory.recall(first)
    assert (place.stream, place.seq) == (7, 9)
    assert beliefs["grid"]["sigma_m"] == pytest.approx(np.hypot(0.02, 0.15 * 2.0 / 2.0))
    assert beliefs["grid"]["sigma_rad"] == pytest.approx(np.hypot(0.05, 0.71 * 2.0 / np.sqrt(3.0)))
    assert (
        widen(beliefs["grid"], 100.0, EXACT)["sigma_rad"].max() < 2.1
    )  # a heading that is anything is not more than that


def later(row: Received, seconds: float, stream: int | None = None, stamp_s: float | None = None) -> Received:
    """The row as it would be, so much later."""
    cells = {**_cells(row), "t_s": stamp_s or _stamp_s(row) + seconds}
    message = to_message(Row.of(cells), row.message.seq + 1, np.zeros(3))
    reported = row.envelope
    sent_ns = reported.sent_ns + round(seconds * 1e9)
    return Received("observation", message, Envelope(stream or reported.stream, reported.number, sent_ns))


def _stamp_s(row: Received) -> float:
    return row.message.header.stamp.ns / 1e9


def _cells(row: Received) -> dict:
    return {"odo_x_m": 0.0, "odo_y_m": 0.0, "odo_theta_rad": 0.0}


def test_what_cannot_be_gone_on_from_is_said_in_one_line(made, tmp_path):
    scene, rows = made
    sent = received(rows)
    path = kept(tmp_path, scene, sent[9])
    other = scenes.make("robot", 5, 5).scene
    cases = [
        (Memory(path, other, NAMES), sent[30], "field scene"),
        (Memory(path, scene, ("foveal",)), sent[30], "nothing of foveal"),
        (Memory(path, scene, NAMES), sent[9], "of a later row"),
        (Memory(path, scene, NAMES), later(sent[9], -5.0, stamp_s=30.0), "of a later row"),
        (Memory(path, scene, NAMES), later(sent[9], AGE_MOST_S + 1.0), "61 s old, 60 s are the most"),
        (Memory(path, scene, NAMES), later(sent[9], 5.0, stream=8, stamp_s=0.1), "of an earlier run"),
    ]
    data = path.read_bytes()
    for memory, first, why in cases:
        path.write_bytes(data)
        assert memory.recall(first) is None
        assert why in memory.note and memory.note.startswith(f"{path}: not used: ") and "\n" not in memory.note
    assert Memory(path, scene, NAMES).recall(later(sent[9], AGE_MOST_S - 1.0))
    aside = [path.with_name(f"{path.stem}-{number}{path.suffix}") for number in (2, 3)]
    assert [file.read_bytes() for file in aside] == [data, data], "what is another's is not written over"


def test_components_that_are_no_prior_are_not_gone_on_from(made, tmp_path):
    scene, rows = made
    sent = received(rows)
    path = kept(tmp_path, scene, sent[9], ("grid",))
    reported = checkpoint.load(path)
    bad = reported.beliefs["grid"].copy()
    bad["mass"][1] = np.nan
    checkpoint.save(path, Checkpoint(**{**vars(reported), "beliefs": {"grid": bad}}))
    memory = Memory(path, scene, ("grid",))
    assert memory.recall(sent[30]) is None and "grid: component 1: its mass" in memory.note


def test_no_file_is_no_fault_and_no_path_no_memory(made, tmp_path):
    scene, rows = made
    sent = received(rows)
    for path in (None, tmp_path / "none"):
        memory = Memory(path, scene, NAMES)
        assert memory.recall(sent[3]) is None and memory.note == ""
    memory = Memory(tmp_path, scene, NAMES)  # a folder
    assert memory.recall(sent[3]) is None and "cannot be read" in memory.note
    memory = Memory(tmp_path / "no" / "file", scene, ("grid",))
    memory.keep(step_of(sent[3]), {"grid": components_at(0.5, 0.5)})
    assert "cannot be written" in memory.note and "\n" not in memory.note


def test_all_motion_since_the_place_comes_with_the_first_row_and_nothing_counts_as_missed(made):
    _, rows = made
    sent = received(rows)
    follower = Follower()
    follower.resume(Place(7, 9, sent[9].message.pose))
    steps = follower.take(sent[30:33], 1) + follower.take(sent[40:41], 1)
    moved = sent[9].message.pose
    for step in steps:
        moved = compose(moved, step.motion)
    assert moved == pytest.approx(sent[40].message.pose, abs=1e-9)
    assert (follower.first_seq, follower.missed, follower.restarts) == (30, 7, 0)
    assert sum(step.rows for step in steps) == 31


def test_from_another_pilot_only_what_it_reported_is_motion(made):
    _, rows = made
    sent = received(rows, stream=8)
    follower = Follower()
    follower.resume(Place(7, 500, np.array([5.0, 6.0, 7.0])))
    steps = follower.take(sent[2:5])
    assert steps[0].motion == pytest.approx(sent[2].message.pose) and steps[0].rows == 3
    assert (follower.first_seq, follower.missed, follower.restarts) == (2, 0, 1)


@pytest.mark.parametrize("motion", [(2.3, -0.4, 0.2), (0.1, 0.0, 7.5), (-1.5, 1.2, -4.0), (0.9, 0.2, 3.0)])
def test_a_long_motion_reaches_a_filter_whole(made, motion):
    """Filters refuse rows of more than a metre or half a turn; a gap of many rows is longer than that."""
    scene, rows = made
    first = received(rows)[0]
    step = Step(first.message, np.array(motion), 10**9, 30, first.envelope)
    alone = Filter("odometry", scene)
    for row in step.lead():
        alone.step(row)
    pose = alone.step(step.last()).pose
    expected = compose(scene.prior.mean, motion)
    assert pose[:2] == pytest.approx(expected[:2], abs=1e-6)
    assert np.exp(1j * pose[2]) == pytest.approx(np.exp(1j * expected[2]), abs=1e-6)
    assert alone.bad_cells == 0


def test_the_table_gives_the_navigator_a_file_of_the_run(tmp_path):
    body = parts.Body(tmp_path / "scene", tmp_path / "models", 1, tmp_path / "port", 1)
    navigator = parts.desktop(body, parts.Meeting("ring", tmp_path), None, None)[0]
    words = list(map(str, navigator.command))
    assert words[words.index("--checkpoint") + 1] == str(tmp_path / "navigator.checkpoint")
