"""Mutated recordings: whatever a file holds, reading it ends well or in the one-line error, and costs little memory."""

import io
import tempfile
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer
from mutate import mutate
from rings import make_frames

from crunchbot.recording import RecordingError, read
from crunchbot.recording.messages import (
    MISSING,
    MessageError,
    decode_block,
    decode_event,
    definition,
    encode_block,
    encode_event,
)
from crunchbot.recording.reading import EVENTS_TOPIC, FRAMES_TOPIC, METADATA


def seed_file(compression: CompressionType, crcs: bool) -> bytes:
    """A small recording that holds every kind of record."""
    out = io.BytesIO()
    writer = Writer(out, chunk_size=4096, compression=compression, enable_crcs=crcs)
    writer.start(profile="ros2", library="fuzz")
    writer.add_metadata(METADATA, {"format": "1", "clock_hz": "60000000", "lanes": "left,right"})
    channels = {}
    for topic, kind in ((FRAMES_TOPIC, "whisker_msgs/msg/Block"), (EVENTS_TOPIC, "whisker_msgs/msg/Event")):
        schema = writer.register_schema(kind, "ros2msg", definition(kind)[:200].encode())
        channels[topic] = writer.register_channel(topic, "cdr", schema, {"offered_qos_profiles": ""})
    for k in range(4):
        frames = make_frames(3, first=3 * k)
        writer.add_message(channels[FRAMES_TOPIC], k, encode_block(frames).tobytes(), k)
        writer.add_message(channels[EVENTS_TOPIC], k, encode_event(k, MISSING, tick=k, frames=1), k)
    writer.finish()
    return out.getvalue()


def use(path: Path) -> int:
    """Read everything of a file; the number of frames. Only RecordingError comes out."""
    try:
        with read(path) as recording:
            frames = sum(len(block) for block in recording.blocks())
            sum(1 for _ in recording.events())
            assert len(recording.lane_names) == 28 and recording.clock_hz > 0
            assert all("\n" not in line for line in recording.damage)
            return frames
    except RecordingError as error:
        assert str(path) in str(error) and "\n" not in str(error)
        return 0


def use_message(data: bytes) -> None:
    """Only MessageError comes out."""
    for decode in (decode_block, decode_event):
        try:
            decode(memoryview(data))
        except MessageError:
            continue


def fuzz(inputs: int, seed: int) -> dict[str, int]:
    """Half of the inputs are files, half single messages."""
    rng = np.random.default_rng(seed)
    kinds = (
        (CompressionType.NONE, False),
        (CompressionType.NONE, True),
        (CompressionType.ZSTD, False),
        (CompressionType.LZ4, True),
    )
    files = [seed_file(*kind) for kind in kinds]
    parts = [encode_block(make_frames(2)).tobytes(), encode_event(5, MISSING, 1, 2, 3)]
    readable = frames = 0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mutated.mcap"
        for k in range(inputs):
            if k % 2:
                use_message(mutate(parts[k // 2 % len(parts)], rng))
                continue
            data = files[0] if rng.integers(2) else files[rng.integers(len(files))]
            path.write_bytes(mutate(data, rng))
            got = use(path)
            readable += got > 0
            frames += got
    return {"files still gave frames": readable, "frames": frames}
