"""Bags of others gone wrong: damaged files, messages of any content, and tables of topics. Each is refused in one line, or gives
rows that a filter takes."""

import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from mutate import mutate
from rosbags.rosbag2 import Reader, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from test_robot_rosbags import GZ, OWN, STORAGES, TABLE, ordinary

from crunchbot.errors import UserError
from crunchbot.nav.faults import row_faults
from crunchbot.robot.bags.rows import read_bag
from crunchbot.scene import write

SECONDS = 0.2
NUMBERS = (np.nan, np.inf, -np.inf, 0.0, -1.0, 1e-38, 1e38, 1e6)
TYPES = get_typestore(Stores.ROS2_JAZZY)
for name, text in GZ.items():
    TYPES.register(get_types_from_msg(text, name))


def messages(bag: Path) -> list[tuple[str, str, int, bytes]]:
    """(topic, type, time, bytes) of each."""
    with Reader(bag) as reader:
        return [(at.topic, at.msgtype, at_ns, bytes(data)) for at, at_ns, data in reader.messages()]


def written(folder: Path, storage: str, said: list[tuple[str, str, int, bytes]]) -> Path:
    with Writer(folder, version=9, storage_plugin=STORAGES[storage]) as writer:
        known = {}
        for topic, kind, at_ns, data in said:
            if topic not in known:
                known[topic] = writer.add_connection(topic, kind, typestore=TYPES)
            writer.write(known[topic], at_ns, data)
    return folder


def odd(said: object, rng: np.random.Generator) -> object:
    """A message, or a field, well-formed, with a field that hardly anybody sends."""
    if isinstance(said, float):
        return float(rng.choice(NUMBERS))
    if isinstance(said, np.ndarray):
        fixed = len(said) == 36  # a covariance
        return np.full(len(said) if fixed else rng.integers(4), rng.choice(NUMBERS))
    if isinstance(said, list):
        return said[: rng.integers(len(said) + 1)] * int(rng.integers(3))
    if not hasattr(said, "__msgtype__"):
        return said
    fields = [name for name in vars(said) if name != "__msgtype__"]
    chosen = fields[rng.integers(len(fields))] if fields else None
    return replace(said, **{chosen: odd(getattr(said, chosen), rng)}) if chosen else said


def changed(said: list[tuple[str, str, int, bytes]], rng: np.random.Generator) -> list[tuple[str, str, int, bytes]]:
    """With one message of each ten odd, one in a thousand damaged, and one time in two the bag's times wrong, too."""
    out, clock = [], rng.integers(2)
    for topic, kind, at_ns, data in said:
        if rng.integers(1000) == 0:
            data = data[:4] + mutate(data[4:], rng)
        elif rng.integers(10) == 0:
            data = TYPES.serialize_cdr(odd(TYPES.deserialize_cdr(data, kind), rng), kind)
            at_ns += int(rng.choice([0, -(10**9), 10**9])) if clock else 0
        out.append((topic, kind, at_ns, data))
    return out


def spoiled(folder: Path, whole: Path, rng: np.random.Generator) -> Path:
    """A copy with one of its files damaged."""
    bag = shutil.copytree(whole, folder)
    file = sorted(bag.iterdir())[rng.integers(2)]
    file.write_bytes(mutate(file.read_bytes(), rng))
    return bag


def fuzz(inputs: int, seed: int) -> dict[str, int]:
    rng, refused = np.random.default_rng(seed), 0
    with tempfile.TemporaryDirectory() as name:
        folder, table = Path(name), Path(name, "topics.toml")
        write(folder / "own", OWN)
        bags = [ordinary(folder / storage, storage, SECONDS) for storage in STORAGES]
        said = messages(bags[0])
        for k in range(inputs):
            bag, way, lines = bags[k % 2], k // 2 % 3, []
            table.write_bytes(mutate(TABLE.encode(), rng) if way == 0 else TABLE.encode())
            if way == 1:
                bag = written(folder / f"{k}", list(STORAGES)[k % 2], changed(said, rng))
            elif way == 2:
                bag = spoiled(folder / f"{k}", bag, rng)
            try:
                scene, rows = read_bag(bag, lines.append, folder / "own", table)
                assert len(row_faults(rows, scene.robot)) < 20
            except UserError as error:
                lines.append(str(error))
                refused += 1
            except Exception as error:
                raise AssertionError(f"input {k} of seed {seed}, way {way}") from error
            assert not any("\n" in line for line in lines), lines
            if way:
                shutil.rmtree(bag)
    return {"refused in one line": refused}
