"""Records 28 lanes for an hour, accelerated: bytes per sample, frames lost, time; and counts instructions per frame.

    .venv/bin/python tools/benches record        bench/results/record.json

The frames are those of simulated robots that drive (level 1: world, whiskers, sensors), five of them to fill 28 lanes,
two minutes long and repeated: a chunk of a recording holds two seconds and is packed on its own, so that repeating
saves nothing. One process publishes a tenth of a second of frames and records it, in turn; then the file is read again
and compared. Instructions are counted by valgrind, as the difference between a short and a long recording; they are
those of the recorder alone.
"""

import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from tqdm import tqdm

from crunchbot.bridge.ring import FRAME, Reader, Writer
from crunchbot.recording import read
from crunchbot.recording.recorder import Recorder
from crunchbot.recording.writing import RecordingWriter
from crunchbot_lab.signals import World
from crunchbot_lab.simulation.scenes import make_scene
from whisker_protocol import LANES, LIMITS

from .. import store

ROOT = Path(__file__).resolve().parents[3]
HZ = LIMITS["clock_hz"] // LIMITS["tick_period"]
HOUR_S = 3600
PERIOD_S = 120  # of the frames that are repeated
BLOCK = HZ // 10
ATOM_HZ = 0.8e9  # instructions per second of the paper's netbook
COUNTED = (2_000, 22_000)  # frames of the two counted recordings
DRIVE = ((0.1, 0.0, 1500), (0.1, 0.5, 500), (0.0, -0.13, 1000), (-0.1, 0.0, 500))  # m/s, rad/s, ticks


def simulated_frames(seconds: int, moving: bool) -> np.ndarray:
    """Frames of robots that drive, or stand, each filling its lanes until all 28 are full."""
    frames = np.zeros(seconds * HZ, FRAME)
    frames["lane_mask"] = (1 << LANES) - 1
    lane, seed = 0, 0
    while lane < LANES:
        seed += 1
        counts = _robot(seed, len(frames), moving)
        width = min(counts.shape[1], LANES - lane)
        frames["lane"]["alpha"][:, lane : lane + width] = counts[:, :width, 0]
        frames["lane"]["beta"][:, lane : lane + width] = counts[:, :width, 1]
        lane += width
    return frames


def _robot(seed: int, ticks: int, moving: bool) -> np.ndarray:
    scene, start = make_scene(seed)
    world, parts, done = World(scene.flat(start), seed), [], 0
    while done < ticks:
        for speed, turn, length in DRIVE:
            world.drive(speed if moving else 0.0, turn if moving else 0.0)
            parts.append(world.run(min(length, ticks - done)))
            done += len(parts[-1])
    return np.concatenate(parts)


def number(frames: np.ndarray, first: int) -> np.ndarray:
    """These frames as those of ticks `first` on, in place."""
    frames["tick"] = np.arange(first, first + len(frames))
    frames["time_cycles"] = frames["tick"] * LIMITS["tick_period"]
    frames["sequence"] = frames["tick"]
    return frames


def record_and_read(path: Path, period: np.ndarray, seconds: int, label: str) -> dict:
    """Record `seconds` of these frames, over and over, and read them again."""
    name = f"whisker-bench-{os.getpid()}"
    count, recording_s = seconds * HZ, 0.0
    with Writer(name) as ring, Reader(name) as reader:
        recorder = Recorder(reader, RecordingWriter(path, {"ring": name}, overwrite=True))
        for first in tqdm(range(0, count, BLOCK), desc=label, unit="block"):
            at = first % len(period)
            ring.publish(number(period[at : at + BLOCK], first))
            began = time.process_time()
            recorder.step(False)
            recording_s += time.process_time() - began
        began = time.process_time()
        recorder.finish()
        recording_s += time.process_time() - began
    size = path.stat().st_size
    reading_s, wrong = _compare(path, period, count)
    return {
        "frames": recorder.tally.frames,
        "lost": count - recorder.tally.frames + recorder.tally.missing + recorder.tally.overrun + wrong,
        "bytes": size,
        "bytes_per_frame": size / count,
        "bytes_per_sample": size / count / LANES,
        "recording_cpu_s": recording_s,
        "reading_cpu_s": reading_s,
        "frames_per_cpu_s": count / recording_s,
    }


def _compare(path: Path, period: np.ndarray, count: int) -> tuple[float, int]:
    """Seconds to read the file, and frames that are not as they were published."""
    seen = wrong = 0
    reading_s, began = 0.0, time.process_time()
    with read(path) as recording:
        for frames in recording.blocks():
            reading_s += time.process_time() - began
            at = seen % len(period)
            wrong += int((frames != number(period[at : at + len(frames)], seen)).sum())
            seen += len(frames)
            began = time.process_time()
        assert recording.complete and not recording.damage
    return reading_s, wrong + count - seen


def instructions_per_frame(period: np.ndarray) -> float:
    """Of a recorder in a process of its own."""
    totals = []
    with tempfile.TemporaryDirectory() as folder:
        for count in COUNTED:
            name = f"whisker-bench-{os.getpid()}"
            with Writer(name, 1 << 15) as ring:
                ring.publish(number(period[:count], 0))
                out, log = Path(folder) / "callgrind", Path(folder) / "log"
                command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", f"--log-file={log}"]
                command += [sys.executable, "-m", "crunchbot.cli", "record", f"{folder}/{count}.mcap", "--ring", name]
                environment = os.environ | {"PYTHONMALLOC": "pymalloc", "OPENBLAS_NUM_THREADS": "1"}
                subprocess.run(
                    [*command, "--frames", str(count)], check=True, stdout=subprocess.DEVNULL, env=environment
                )
                totals.append(int(re.search(r"Collected\s*:\s*(\d+)", log.read_text()).group(1)))
    return (totals[1] - totals[0]) / (COUNTED[1] - COUNTED[0])


def run(build: Path) -> None:
    """Measure what is not measured yet. `build` is not used: the Python module is what counts."""
    cache = store.kept("record")
    cache.mkdir(parents=True, exist_ok=True)
    file = cache / "bench.mcap"
    driving = simulated_frames(PERIOD_S, True)
    still = simulated_frames(PERIOD_S, False)
    results = {
        "lanes": LANES,
        "rate_hz": HZ,
        "still": store.once(cache / "still.json", lambda: record_and_read(file, still, PERIOD_S, "standing robot")),
        "hour": store.once(cache / "hour.json", lambda: record_and_read(file, driving, HOUR_S, "an hour")),
        "instructions_per_frame": store.once(cache / "instructions.json", lambda: instructions_per_frame(driving)),
    }
    file.unlink(missing_ok=True)
    results["atom_share"] = results["instructions_per_frame"] * HZ / ATOM_HZ
    store.write_result("record", results)
