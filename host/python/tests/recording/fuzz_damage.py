"""Recordings and bags that a card or a cable damaged: no more is lost than the chunks that were hit, and none of it unsaid.

Of six inputs four have a bit flipped, one has a page of 4 KiB zeroed, one is cut: its end is missing, or a chunk, or any
piece out of its middle. They are recordings of a ring, bags, and files without chunks as other programs write them,
finished ones and such that end within a chunk. In a file without chunks each message stands for a chunk. No checksum is
its own, so one that was hit may be given changed, and that must be said.
"""

import re
import tempfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import mcap.reader
import mcap.writer
import numpy as np
from mcap.opcode import Opcode
from rings import make_frames

from crunchbot.recording import RecordingError, read
from crunchbot.recording.mcapfile import MAGIC, McapFile
from crunchbot.recording.messages import encode_block
from crunchbot.recording.writing import RecordingWriter, TopicWriter
from crunchbot.robot.bags.played import RECORD
from crunchbot.robot.network.messages import SCHEMAS, Header, Pose, PoseStamped, Time, encode

PAGE = 4096
SECOND_NS = 10**9
END_DAMAGED = ("at its end", "its closing record", "ends within", "does not end as")  # then nothing counts the losses
CHANGED = ("the checksum of the whole is wrong", "bytes left out")
LOST = re.compile(r"(\d+) of \d+ messages are lost$")


@dataclass(frozen=True)
class Original:
    """A file as it was written: its bytes, the chunks' places, and each message with the chunk that it is in.

    described: where the descriptions of the channels stand that all messages need; empty where there are others.
    """

    kind: str
    data: bytes
    chunks: list[tuple[int, int]]
    messages: dict[tuple, tuple[int, int]]  # (topic, time, bytes) -> (its number, its chunk)
    is_indexed: bool
    has_chunks: bool = True
    described: tuple[int, int] = (0, 0)

    def touched(self, first: int, last: int) -> set[int]:
        """Chunks that have any of the bytes from `first` up to `last`."""
        if first < self.described[1] and self.described[0] < last:
            return set(range(len(self.chunks)))
        return {n for n, (start, end) in enumerate(self.chunks) if start < last and first < end}


def ring_recording(path: Path, seconds: int) -> None:
    with RecordingWriter(path, {"ring": "ring", "frames": str(2000 * seconds)}, ["left", "right"]) as writer:
        for k in range(10 * seconds):
            time_ns = SECOND_NS * k // 10
            writer.block(time_ns, encode_block(make_frames(200, seed=k, first=200 * k)))
            if k % 10 == 9:
                writer.health(time_ns, 2000, 0, 0, np.zeros(28, int), None)
                writer.flush()
        writer.finish({"frames": str(2000 * seconds)})


def bag(path: Path, seconds: int) -> None:
    rng = np.random.default_rng(1)
    with TopicWriter(path, RECORD, {"robot": "robot", "arena.toml": "size_m = [1.0, 1.0]\n" * 100}) as writer:
        topics = [f"/robot/{name}" for name in ("truth", "pose/grid", "pose/particle")]
        for topic in topics:
            writer.topic(topic, SCHEMAS[PoseStamped])
        for k in range(10 * seconds):
            for topic in topics:
                at = SECOND_NS * k // 10
                pose = PoseStamped(Header(Time(*divmod(at, SECOND_NS)), "map"), Pose.planar(*rng.random(3)))
                writer.add(topic, at, encode(pose))
            if k % 10 == 9:
                writer.flush()
        writer.finish({"messages": str(30 * seconds)})


def loose(path: Path, seconds: int) -> None:
    rng = np.random.default_rng(2)
    with path.open("wb") as file:
        writer = mcap.writer.Writer(file, use_chunking=False, enable_data_crcs=True)
        writer.start("ros2", "another program")
        schema = writer.register_schema(SCHEMAS[PoseStamped], "ros2msg", b"")
        channels = [writer.register_channel(f"/robot/pose/{name}", "cdr", schema) for name in ("grid", "particle")]
        for k in range(10 * seconds):
            for channel in channels:
                at = SECOND_NS * k // 10
                pose = PoseStamped(Header(Time(*divmod(at, SECOND_NS)), "map"), Pose.planar(*rng.random(3)))
                writer.add_message(channel, at, encode(pose), at, k)
        writer.finish()


def contents(path: Path) -> list[tuple]:
    with McapFile(path) as file:
        return [(message.topic, message.log_time, bytes(message.data)) for message in file.messages()]


def original(kind: str, path: Path) -> Original:
    with path.open("rb") as file:
        indexes = mcap.reader.make_reader(file, validate_crcs=True).get_summary().chunk_indexes
    chunks = sorted((index.chunk_start_offset, index.chunk_start_offset + index.chunk_length) for index in indexes)
    times = sorted((index.chunk_start_offset, index.message_end_time) for index in indexes)
    messages = {}
    for number, message in enumerate(contents(path)):
        messages[message] = number, next(n for n, (_, last) in enumerate(times) if message[1] <= last)
    return Original(kind, path.read_bytes(), chunks, messages, True)


def loose_original(path: Path) -> Original:
    data, at, places, chunks = path.read_bytes(), len(MAGIC), {}, []
    while (opcode := data[at]) != Opcode.DATA_END:
        begin, at = at, at + 9 + int.from_bytes(data[at + 1 : at + 9], "little")
        places[opcode] = places.get(opcode, (begin, at))[0], at
        if opcode == Opcode.MESSAGE:
            chunks.append((begin, at))
    messages = {message: (number, number) for number, message in enumerate(contents(path))}
    assert len(messages) == len(chunks)
    described = places[Opcode.CHANNEL]
    return Original("loose", data, chunks, messages, True, False, described)


def cut_off(whole: Original, share: float) -> Original:
    """The same, as a crash within a chunk leaves it."""
    chunk = int(share * len(whole.chunks))
    start, end = whole.chunks[chunk]
    messages = {message: place for message, place in whole.messages.items() if place[1] < chunk}
    data = whole.data[: (start + end) // 2]
    kind = f"{whole.kind}, cut off"
    return Original(kind, data, whole.chunks[:chunk], messages, False, whole.has_chunks, whole.described)


def originals(folder: Path) -> list[Original]:
    made = []
    for kind, make, seconds in (("recording", ring_recording, 8), ("bag", bag, 40)):
        make(folder / f"{kind}.mcap", seconds)
        made.append(original(kind, folder / f"{kind}.mcap"))
        assert len(made[-1].chunks) >= seconds
    loose(folder / "loose.mcap", 40)
    made.append(loose_original(folder / "loose.mcap"))
    return [*made, *(cut_off(whole, 0.8) for whole in made)]


def flipped(of: Original, rng: np.random.Generator) -> tuple[bytes, set[int]]:
    data, place = bytearray(of.data), int(rng.integers(len(of.data)))
    data[place] ^= 1 << int(rng.integers(8))
    return bytes(data), of.touched(place, place + 1)


def zeroed(of: Original, rng: np.random.Generator) -> tuple[bytes, set[int]]:
    place = PAGE * int(rng.integers(-(-len(of.data) // PAGE)))
    page = of.data[place : place + PAGE]
    return of.data[:place] + bytes(len(page)) + of.data[place + PAGE :], of.touched(place, place + PAGE)


def cut(of: Original, rng: np.random.Generator) -> tuple[bytes, set[int]]:
    size = len(of.data)
    match rng.integers(4):
        case 0 | 1:
            first, last = int(rng.integers(8, size)), size
        case 2:
            first, last = of.chunks[rng.integers(len(of.chunks))]
        case _:
            first = int(rng.integers(8, size))
            last = min(size, first + int(rng.integers(1, 3 * size // len(of.chunks))))
    return of.data[:first] + of.data[last:], of.touched(first, last)


DAMAGES = {"flipped": flipped, "zeroed": zeroed, "cut": cut}
TURNS = ("flipped", "flipped", "zeroed", "flipped", "flipped", "cut")


def outcome(of: Original, path: Path, touched: set[int]) -> str:
    """What became of a damaged file; AssertionError when too much is lost, or something is not said."""
    numbers, changed, damage, is_complete = [], 0, [], False
    try:
        with McapFile(path) as file:
            for message in file.messages():
                key = message.topic, message.log_time, bytes(message.data)
                if key in of.messages:
                    numbers.append(of.messages[key][0])
                else:
                    changed += 1
                    assert not of.has_chunks, f"a message that was not written: {key[:2]}"
            damage, is_complete = file.damage, file.complete
    except RecordingError as error:
        damage = [str(error)]
    assert numbers == sorted(set(numbers)), "messages out of order, or twice"
    read_on = set(numbers)
    lost = {key: place for key, place in of.messages.items() if place[0] not in read_on}
    assert {chunk for _, chunk in lost.values()} <= touched, f"lost more than the chunks {touched}: {damage}"
    assert changed <= len(touched), f"{changed} changed messages of {len(touched)} that were hit: {damage}"
    assert all("\n" not in line for line in damage)
    if not lost:
        return "nothing lost, and said so" if damage else "nothing lost, nothing said"
    assert damage and not is_complete, "lost without a word"
    reported = sum(int(found[1]) for line in damage if (found := LOST.search(line)))
    assert not reported or len(lost) - changed <= reported <= len(lost), f"{len(lost)} lost, {reported} said: {damage}"
    said = (*END_DAMAGED, *CHANGED) if changed else END_DAMAGED
    assert reported or not of.is_indexed or any(text in line for line in damage for text in said), damage
    return "lost and counted" if reported else "lost and said"


def recording_agrees(path: Path) -> None:
    """What `read` says of the same file: frames, or the one-line error."""
    try:
        with read(path) as recording:
            frames = sum(len(block) for block in recording.blocks())
            assert frames and (recording.complete or recording.damage)
    except RecordingError as error:
        assert "\n" not in str(error)


def fuzz(inputs: int, seed: int) -> dict[str, int]:
    """Each input is a file with one damage."""
    rng = np.random.default_rng(seed)
    counts = Counter()
    with tempfile.TemporaryDirectory() as folder:
        files = originals(Path(folder))
        path = Path(folder) / "damaged.mcap"
        for k in range(inputs):
            of, how = files[k // len(TURNS) % len(files)], TURNS[k % len(TURNS)]
            data, touched = DAMAGES[how](of, rng)
            path.write_bytes(data)
            try:
                counts[f"{how} {of.kind}: {outcome(of, path, touched)}"] += 1
                if of.kind.startswith("recording") and k % 10 == 0:
                    recording_agrees(path)
            except AssertionError as error:
                raise AssertionError(f"input {k} of seed {seed}, {how} {of.kind}: {error}") from error
    return {f"are {what}": counts[what] for what in sorted(counts)}
