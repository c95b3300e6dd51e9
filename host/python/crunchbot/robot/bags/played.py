"""A robot's bag, read whole, by whomever it was recorded: who it was, its scene, and everything it said, by time."""

import tempfile
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...errors import UserError
from ...outputs import put
from ...progress import bar
from ...recording.mcapfile import McapFile, Message
from ...recording.rosbag import RosBag, open_bag
from ...scene import ARENA, PRIOR, ROBOT, Scene, load
from ..network.messages import MessageError, decode, type_of

RECORD, FORMAT = "whisker_robot", "1"  # name of a bag's metadata record, and of what it promises
SCENE_FILES = (ARENA, ROBOT, PRIOR)
ROWS = "/observation"  # end of the topic
WORD = 4  # bytes of the head of CDR, and of what DDS fills up to
SLOW_S = 2.0  # a reading that takes longer shows how far it is


class BagError(UserError):
    """A file that is no bag of a robot; one line."""

    exit_code = 2


@dataclass(frozen=True)
class Said:
    """A message. at_s: by the bag's log time, from its first message on."""

    at_s: float
    topic: str
    message: Any


@dataclass(frozen=True)
class Played:
    """`said` is in the order of time; scene: None where the bag has none. damage: a line each."""

    robot: str
    scene: Scene | None
    said: list[Said]
    damage: list[str]


def read_bag(path: Path, topics: Collection[str]) -> Played:
    """What was said on these topics; "health" is that of all processes. BagError or RecordingError: it is no robot's."""
    with open_bag(path) as bag:
        reported = bag.metadata.get(RECORD, {})
        prefix = f"/{reported['robot']}/" if "robot" in reported else _prefix(bag)
        found = []
        for message in bar(bag.messages(), desc="reading", unit=" messages", delay=SLOW_S, leave=False):
            topic = message.topic.removeprefix(prefix)
            if topic != message.topic and topic.partition("/")[0] in topics:
                found += _decoded(bag, topic, message)
        damage = list(bag.damage)
    if not found:
        raise BagError(f"{path}: nothing that the robot said can be read; give another bag")
    found.sort(key=lambda said: said.at_s)
    first = found[0].at_s
    said = [Said((one.at_s - first) * 1e-9, one.topic, one.message) for one in found]
    return Played(prefix.strip("/"), _scene(reported), said, damage)


def _prefix(bag: McapFile | RosBag) -> str:
    """What the topics of the one robot whose rows a bag holds begin with."""
    found = {message.topic.removesuffix(ROWS) for message in bag.messages() if message.topic.endswith(ROWS)}
    if len(found) != 1:
        what = f"rows (/NAME/observation) of {' and '.join(sorted(found)) or 'no robot'}; give a bag of one"
        more = "'rosbags-convert --include-topic' makes it; for ordinary topics give --topics"
        raise BagError(f"{bag.path}: {what}: {more} (frames of a ring: whisker replay)")
    return f"{found.pop()}/"


def _decoded(bag: McapFile | RosBag, topic: str, message: Message) -> list[Said]:
    """The message, stamped in ns; none where it cannot be read, or is of no topic of a robot."""
    faults = []
    for data in _plain(bytes(message.data)):
        try:
            return [Said(message.log_time, topic, decode(type_of(topic), data, message.topic))]
        except KeyError:
            return []
        except MessageError as error:
            faults.append(error)
    bag.note(f"{faults[0]}; left out")
    return []


def _plain(data: bytes) -> Iterator[bytes]:
    """CDR as it was encoded: DDS fills it up to four bytes, and may say so in the last byte of its head."""
    for filled in range(WORD):
        if not any(data[len(data) - filled :]):
            yield data[: WORD - 1] + b"\0" + data[WORD : len(data) - filled]


def _scene(reported: dict[str, str]) -> Scene | None:
    files = {name: reported[name] for name in SCENE_FILES if name in reported}
    if not {ARENA, ROBOT} <= files.keys():
        return None
    with tempfile.TemporaryDirectory(prefix="whisker-") as place:
        for name, text in files.items():
            put(Path(place) / name, text, sync=False)
        return load(place)
