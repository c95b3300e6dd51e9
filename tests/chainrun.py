"""Starts the simulated bridge with whiskerd inside and reads its ring, for tests."""

import os
import shutil
import socket
import subprocess
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from crunchbot.bridge.ring import FRAME, Reader
from crunchbot_lab.simulation.scenes import make_scene
from whisker_protocol import FRAME_FLAGS

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / os.environ.get("WHISKER_BUILD", "build/release")
TICKS_PER_S = 2000
BLOCK_TICKS = 40
DECISION_TICKS = 40  # a decision on the block that ends with T takes effect at T + 1 + 40
END_S = 120
FAST_LINK = ("--sck-divider", "6", "--word-gap", "30", "--sample-point", "5")


def program(name: str) -> str:
    return str(next(path for path in BUILD.rglob(name) if path.is_file() and os.access(path, os.X_OK)))


def write_flat_scene(folder: Path, seed: int) -> tuple[Path, str]:
    """The demo's scene of this seed as the simulation reads it; its path and its text."""
    scene, start = make_scene(seed)
    text = scene.flat(start)
    path = folder / "scene.flat"
    path.write_text(text)
    return path, text


def simulation(folder: Path, scene: Path, seconds: float, seed: int, ring: str, *options, link=FAST_LINK) -> list[str]:
    """Command line of a run with whiskerd; `options` go to the simulation."""
    words = [shutil.which("umockdev-wrapper"), program("whisker-bridge-sim"), "--scene", scene, "--seed", seed]
    words += ["--seconds", seconds, *options, "--", program("whiskerd"), "--ring", ring, *link]
    return [str(word) for word in words]


@contextmanager
def running(command: list[str], **options):
    """A process that does not outlive the test."""
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, **options)
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        process.stderr.close()


class Cable:
    """Pulls and puts back the cable of a simulated bridge."""

    def __init__(self, path: Path, simulated: subprocess.Popen):
        self._link = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        while self._link.connect_ex(str(path)) != 0:
            assert simulated.poll() is None, simulated.stderr.read()
            os.sched_yield()

    def pull(self) -> None:
        self._link.send(b"unplug")

    def put(self) -> None:
        self._link.send(b"plug")

    def close(self) -> None:
        self._link.close()


class Driver:
    """The pilot's side of the socket, driving by a script: block number -> (m/s, rad/s)."""

    def __init__(self, path: Path, script, simulation: subprocess.Popen):
        self._link = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        while self._link.connect_ex(str(path)) != 0:
            assert simulation.poll() is None, simulation.stderr.read()
            os.sched_yield()
        self._link.send(b"pilot")
        self._script, self._answered = script, 0

    def answer(self, ticks: int) -> None:
        """Answer every block that ended within the first `ticks` ticks."""
        while (self._answered + 1) * BLOCK_TICKS <= ticks:
            speed, turn = self._script(self._answered)
            last = (self._answered + 1) * BLOCK_TICKS - 1
            self._link.send(f"drive {last} {speed} {turn}".encode())
            self._answered += 1

    def close(self) -> None:
        self._link.close()


def record(folder: Path, seconds: float, seed: int, script, *options, link=FAST_LINK) -> np.ndarray:
    """All frames of a run of the whole chain, with the robot driven by `script`."""
    folder.mkdir(exist_ok=True)
    ring = f"whisker-test-{os.getpid()}"
    scene, _ = write_flat_scene(folder, seed)
    path = folder / "sim.sock"
    command = simulation(folder, scene, seconds, seed, ring, "--socket", path, "--followers", 1, *options, link=link)
    with running(command) as process:
        driver = Driver(path, script, process)
        frames = []
        with Reader(ring, wait_s=END_S) as reader:
            for view in reader.frames():
                frames.append(view.copy())
                driver.answer(int(view["tick"][-1]) + 1)
        code = process.wait(END_S)
        driver.close()
        assert code == 0, process.stderr.read()
    return np.concatenate(frames) if frames else np.empty(0, FRAME)


def is_last(frame: np.void) -> bool:
    return bool(frame["flags"] & FRAME_FLAGS["last"])
