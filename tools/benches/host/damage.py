"""What is left of damaged recordings: this project's reader beside MCAP's own and rosbags, on the same files.

    .venv/bin/python tools/benches damage        bench/results/damage.json

The files are those of the fuzzer `damage`: of six, four have a bit flipped, one a page zeroed, one is cut. Counted are
the messages in chunks that were not hit, and how many of them a reader gives; and files of which messages are missing
or different without an error or a line of damage.
"""

import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import mcap.reader
import mcap.records
import mcap.stream_reader
import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from tqdm import tqdm

from crunchbot.recording.mcapfile import McapFile

from .. import store

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "host/python/tests" / room) for room in ("kit", "recording")]
import fuzz_damage  # noqa: E402

FILES, SEED = 600, 1


class Incomplete(Exception):
    """What a reader says of a file that it did not read in full."""


def whisker(path: Path) -> Iterator[tuple]:
    with McapFile(path) as file:
        for message in file.messages():
            yield message.topic, message.log_time, bytes(message.data)
        if file.damage:
            raise Incomplete(file.damage[0])


def mcap_stream(path: Path) -> Iterator[tuple]:
    """From front to back, as a recovery does."""
    topics = {}
    with path.open("rb") as file:
        for record in mcap.stream_reader.StreamReader(file, validate_crcs=True).records:
            if isinstance(record, mcap.records.Channel):
                topics[record.id] = record.topic
            elif isinstance(record, mcap.records.Message):
                yield topics[record.channel_id], record.log_time, record.data


def mcap_indexed(path: Path) -> Iterator[tuple]:
    """By the index at the end."""
    with path.open("rb") as file:
        for _, channel, message in mcap.reader.make_reader(file, validate_crcs=True).iter_messages():
            yield channel.topic, message.log_time, message.data


def rosbags(path: Path) -> Iterator[tuple]:
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as bag:
        for connection, time_ns, data in bag.messages():
            yield connection.topic, time_ns, bytes(data)


READERS = {"whisker": whisker, "mcap, stream": mcap_stream, "mcap, indexed": mcap_indexed, "rosbags": rosbags}


def judged(of: fuzz_damage.Original, touched: set[int], read: Callable, path: Path) -> tuple[int, int, bool, bool]:
    """(messages not hit, those of them that were read, whether something is missing or different, whether that is
    said)."""
    seen, is_said = [], False
    try:
        for message in read(path):
            seen.append(message)
    except Exception:  # noqa: BLE001 - whatever a reader raises, it has said something
        is_said = True
    intact = {key for key, (_, chunk) in of.messages.items() if chunk not in touched}
    known = set(seen)
    is_wrong = known != set(of.messages) or len(seen) != len(known)
    return len(intact), len(intact & known), is_wrong, is_said


def measure() -> dict:
    rng = np.random.default_rng(SEED)
    rows = {}
    with tempfile.TemporaryDirectory() as folder:
        files, path = fuzz_damage.originals(Path(folder)), Path(folder) / "damaged.mcap"
        for k in tqdm(range(FILES), desc="damaged files"):
            turn = fuzz_damage.TURNS[k % len(fuzz_damage.TURNS)]
            of = files[k // len(fuzz_damage.TURNS) % len(files)]
            data, touched = fuzz_damage.DAMAGES[turn](of, rng)
            path.write_bytes(data)
            kind = "cut off before" if not of.is_indexed else "finished"
            for name, read in READERS.items():
                row = rows.setdefault(
                    f"{name}: {kind}, {turn}", {"files": 0, "intact": 0, "read": 0, "wrong": 0, "unsaid": 0}
                )
                intact, got, is_wrong, is_said = judged(of, touched, read, path)
                row["files"] += 1
                row["intact"] += intact
                row["read"] += got
                row["wrong"] += is_wrong
                row["unsaid"] += is_wrong and not is_said
    return rows


def run(build: Path) -> None:
    """Measure and write. `build` is not used, and nothing is kept from run to run."""
    rows = measure()
    store.write_result("damage", {"seed": SEED, "files": FILES, "readers": rows})
    for name in READERS:
        parts = [row for key, row in rows.items() if key.startswith(f"{name}: ")]
        intact, read, unsaid = (sum(row[column] for row in parts) for column in ("intact", "read", "unsaid"))
        print(
            f"{name}: {100 * read / intact:.1f} % of what was not hit; {unsaid} of {FILES} files lost something unsaid"
        )
