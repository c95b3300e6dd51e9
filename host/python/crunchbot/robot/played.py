"""A robot's bag, read whole: who it was, its scene, and everything it said, by time."""

import tempfile
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import UserError
from ..progress import bar
from ..recording.mcapfile import McapFile
from ..scene import ARENA, PRIOR, ROBOT, Scene, load
from .network.messages import MessageError, decode, type_of

RECORD, FORMAT = "whisker_robot", "1"  # name of a bag's metadata record, and of what it promises
SCENE_FILES = (ARENA, ROBOT, PRIOR)
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
    with McapFile(path) as bag:
        reported = bag.metadata.get(RECORD)
        if reported is None:
            text = "holds no robot; give a bag of 'whisker bag' or 'whisker robot'"
            raise BagError(f"{path}: {text} (frames of a ring: whisker replay {path})")
        prefix = f"/{reported.get('robot', '')}/"
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


def _decoded(bag: McapFile, topic: str, message: Any) -> list[Said]:
    """The message, stamped in ns; none where it cannot be read, or is of no topic of a robot."""
    try:
        return [Said(message.log_time, topic, decode(type_of(topic), bytes(message.data), message.topic))]
    except KeyError:
        return []
    except MessageError as error:
        bag.note(f"{error}; left out")
        return []


def _scene(reported: dict[str, str]) -> Scene | None:
    files = {name: reported[name] for name in SCENE_FILES if name in reported}
    if not files:
        return None
    with tempfile.TemporaryDirectory(prefix="whisker-") as place:
        for name, text in files.items():
            (Path(place) / name).write_text(text)
        return load(place)
