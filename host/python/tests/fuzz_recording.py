"""Mutated recordings: whatever a file holds, reading it ends well or in the one-line error, and costs little memory.

python host/python/tests/fuzz_recording.py --inputs 100000 --seed 1
"""

import argparse
import io
import resource
import struct
import sys
import tempfile
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer
from rings import make_frames

from whisker.recording import RecordingError, read
from whisker.recording.messages import (
    MISSING,
    MessageError,
    decode_block,
    decode_event,
    definition,
    encode_block,
    encode_event,
)
from whisker.recording.reading import EVENTS_TOPIC, FRAMES_TOPIC, METADATA

EDGES = (0, 1, 0x7F, 0x80, 0xFF, 0xFFFF, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**63, 2**64 - 1)
MEMORY_MOST = 2 << 30  # address space a run may take: what a length in a file asks for is not believed


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


def mutate(data: bytes, rng: np.random.Generator) -> bytes:
    """One to four changes: bits, bytes, numbers at their edges, pieces cut, doubled or moved."""
    out = bytearray(data)
    for _ in range(rng.integers(1, 5)):
        if len(out) < 2:
            break
        place, length = int(rng.integers(len(out))), int(rng.integers(1, 64))
        match rng.integers(7):
            case 0:
                out[place] ^= 1 << int(rng.integers(8))
            case 1:
                out[place] = int(rng.integers(256))
            case 2:
                edge, code = EDGES[rng.integers(len(EDGES))], "<Q" if rng.integers(2) else "<I"
                out[place : place + struct.calcsize(code)] = struct.pack(
                    code, edge & (2 ** (8 * struct.calcsize(code)) - 1)
                )
            case 3:
                del out[place:]
            case 4:
                del out[place : place + length]
            case 5:
                out[place:place] = out[place : place + length]
            case 6:
                out[place : place + length] = rng.bytes(length)
    return bytes(out)


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


def fuzz(inputs: int, seed: int) -> tuple[int, int]:
    """(files from which frames were read, frames) of so many inputs; half of them files, half single messages."""
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
    return readable, frames


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_MOST, MEMORY_MOST))
    readable, frames = fuzz(options.inputs, options.seed)
    print(f"{options.inputs} inputs: {readable} files still gave frames ({frames}); no other error than the one line")
    return 0


if __name__ == "__main__":
    sys.exit(main())
