"""The Create in the simulated robot: what its driver writes takes effect at fixed ticks, whenever it arrives."""

import csv
import math
import os
import socket
import subprocess
import threading
import tty
from pathlib import Path

import pytest

SIMULATION = os.environ.get("WHISKER_BRIDGE_SIM", "")
CLIENT = os.environ.get("WHISKER_STREAM_CLIENT", "")
TICKS_PER_S = 2000
BLOCK = 40
FIRST_EFFECT = 80  # tick at which the answer to the first block takes effect
TIMEOUT_S = 120
START, SAFE, DRIVE_DIRECT, STREAM = 128, 131, 145, 148
DISTANCE, ANGLE, BUMPS = 19, 20, 7
X_M, Y_M = 0.75, 0.75
ROOM_M = 1.6
ODOMETRY_ERROR = 0.09  # at most, of the wheels (sim/world/base.h)

pytestmark = pytest.mark.skipif(not SIMULATION, reason="run by CTest, which knows where the programs are")

SCENE = f"""\
size_m {ROOM_M} {ROOM_M}
tile_m {ROOM_M}
texture SMOOTH
floor S
body_radius_m 0.165
texture_whisker left -0.02 0.21
start {X_M} {Y_M} 0
"""


def simulate(folder: Path, seconds: float, seed: int, client: list, *options) -> subprocess.Popen:
    scene = folder / "scene.flat"
    scene.write_text(SCENE)
    common = [
        "--scene",
        scene,
        "--seconds",
        seconds,
        "--seed",
        seed,
        "--truth",
        folder / "truth.csv",
        "--level",
        "bytes",
    ]
    create = ["--create", 1, "--create-link", folder / "create", *options]
    command = ["umockdev-wrapper", SIMULATION, *common, *create, "--", *client]
    return subprocess.Popen([str(word) for word in command], stderr=subprocess.PIPE, text=True)


def truth(folder: Path) -> list[dict]:
    with open(folder / "truth.csv") as file:
        return [{name: float(cell) for name, cell in row.items() if name[-1] in "md"} for row in csv.DictReader(file)]


def drive_direct(right: int, left: int) -> bytes:
    return bytes([DRIVE_DIRECT]) + right.to_bytes(2, "big", signed=True) + left.to_bytes(2, "big", signed=True)


class Driver(threading.Thread):
    """Pilot and driver in one: reads what the robot has sent up to each block, then drives. `hasty`: answers the block
    before its bytes are on their way, and sends them one by one."""

    def __init__(self, folder: Path, ticks: int, orders: dict, hasty: bool):
        super().__init__()
        self.folder, self.ticks, self.orders, self.hasty = folder, ticks, orders, hasty
        self.heard = b""
        self.written = 0
        self.over = threading.Event()

    def run(self):
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as link:
            while link.connect_ex(str(self.folder / "sock")) != 0:
                if self.over.is_set():
                    return
                os.sched_yield()
            link.send(b"pilot")
            port = os.open(self.folder / "create", os.O_RDWR | os.O_NOCTTY)
            tty.setraw(port)
            for tick in range(BLOCK - 1, self.ticks, BLOCK):
                self.answer(link, port, tick)
            while link.recv(256).split()[0] != b"end":
                pass
            os.close(port)

    def answer(self, link, port: int, tick: int):
        kind, at, count = link.recv(256).split()
        assert (kind, int(at)) == (b"base", tick)
        while len(self.heard) < int(count):
            self.heard += os.read(port, int(count) - len(self.heard))
        order = self.orders.get(tick, b"")
        self.written += len(order)
        reply = f"base {tick} {self.written}".encode()
        if self.hasty:
            link.send(reply)
        for byte in order:
            os.write(port, bytes([byte]))
        if not self.hasty:
            link.send(reply)


OPENING = bytes([START, SAFE, STREAM, 3, BUMPS, DISTANCE, ANGLE])
COURSE = {39: OPENING + drive_direct(200, 200), 999: drive_direct(50, -50), 1599: drive_direct(300, 100)}


def drive(folder: Path, seconds: float, seed: int, *options, orders: dict = COURSE, hasty: bool = False) -> dict:
    """What is recorded of a run: the robot's bytes, the truth, the whiskers' frames."""
    folder.mkdir()
    driver = Driver(folder, round(seconds * TICKS_PER_S), orders, hasty)
    driver.start()
    client = [CLIENT, folder / "stream.bin", 4096, 200]
    simulation = simulate(folder, seconds, seed, client, "--socket", folder / "sock", "--followers", 1, *options)
    _, error = simulation.communicate(timeout=TIMEOUT_S)
    driver.over.set()
    driver.join()
    assert simulation.returncode == 0, error
    assert not (folder / "create").is_symlink()
    return {"bytes": driver.heard, **{name: (folder / name).read_bytes() for name in ("truth.csv", "stream.bin")}}


def frames(heard: bytes) -> list[bytes]:
    """Frames with a right sum, of the length that the opening asks for."""
    length = 3 + 2 + 3 + 3
    whole = [heard[at : at + length] for at in range(0, len(heard) - length + 1, length)]
    assert all(frame[0] == 19 and frame[1] == length - 3 and sum(frame) % 256 == 0 for frame in whole)
    return whole


def signed(two: bytes) -> int:
    return int.from_bytes(two, "big", signed=True)


def test_same_seed_same_bytes_same_truth(tmp_path):
    one = drive(tmp_path / "one", 1.2, 5)
    again = drive(tmp_path / "again", 1.2, 5, hasty=True)
    other = drive(tmp_path / "other", 1.2, 6)
    assert one == again
    assert one["bytes"] != other["bytes"]


def test_orders_take_effect_at_their_tick(tmp_path):
    robot = drive(tmp_path / "run", 1.2, 7)
    rows = truth(tmp_path / "run")
    assert rows[0]["x_m"] - X_M == pytest.approx(0.2 * (200 - FIRST_EFFECT) / TICKS_PER_S, abs=2e-6)
    assert rows[4]["theta_rad"] == 0
    turned = 0.1 / 0.258 * (1200 - 1040) / TICKS_PER_S
    assert rows[5]["theta_rad"] == pytest.approx(turned, abs=2e-6)
    reported = frames(robot["bytes"])
    millimetres = 200 * ((1040 - FIRST_EFFECT) + (2400 - 1640)) / TICKS_PER_S
    assert sum(signed(frame[5:7]) for frame in reported) == pytest.approx(millimetres, rel=ODOMETRY_ERROR, abs=8)
    degrees = math.degrees((0.1 * (1640 - 1040) + 0.2 * (2400 - 1640)) / 0.258 / TICKS_PER_S)
    assert sum(signed(frame[8:10]) for frame in reported) == pytest.approx(degrees, rel=ODOMETRY_ERROR, abs=2)


def test_a_wall_is_reported(tmp_path):
    orders = {39: OPENING + drive_direct(500, 500)}
    robot = drive(tmp_path / "run", 1.8, 8, orders=orders)
    reported = frames(robot["bytes"])
    assert reported[10][3] == 0
    assert reported[-1][3] == 3  # both sides of the bumper
    assert truth(tmp_path / "run")[-1]["x_m"] == pytest.approx(ROOM_M - 0.165, abs=1e-3)


def test_faults_of_the_line_are_the_seeds(tmp_path):
    options = ("--create-lose-bytes", 0.01, "--create-drop-remainder", "--create-event", "silent@0.4s+0.2s")
    one = drive(tmp_path / "one", 1, 5, *options)
    again = drive(tmp_path / "again", 1, 5, *options, hasty=True)
    assert one == again
    assert len(one["bytes"]) < len(drive(tmp_path / "sound", 1, 5)["bytes"]) * 0.85


def test_without_a_pilot_bytes_act_as_they_come(tmp_path):
    octal = "".join(f"\\{byte:03o}" for byte in bytes([START, SAFE]) + drive_direct(200, 200))
    script = f"printf '{octal}' > {tmp_path}/create && exec {CLIENT} {tmp_path}/stream.bin 4096 200"
    simulation = simulate(tmp_path, 1, 1, ["sh", "-c", script])
    _, error = simulation.communicate(timeout=TIMEOUT_S)
    assert simulation.returncode == 0, error
    assert truth(tmp_path)[-1]["x_m"] - X_M == pytest.approx(0.2, abs=2e-6)


def test_a_paced_base_sends_frames_whole(tmp_path):
    heard = []

    def listen():
        while not (tmp_path / "create").is_symlink():
            os.sched_yield()
        port = os.open(tmp_path / "create", os.O_RDWR | os.O_NOCTTY)
        tty.setraw(port)
        os.write(port, OPENING)
        while len(heard) < 20:
            heard.append(os.read(port, 512))
        os.close(port)

    listener = threading.Thread(target=listen)
    listener.start()
    simulation = simulate(tmp_path, 2, 1, [CLIENT, tmp_path / "stream.bin", 4096, 200], "--pace", 1)
    _, error = simulation.communicate(timeout=TIMEOUT_S)
    listener.join()
    assert simulation.returncode == 0, error
    assert all(heard) and all(frames(read) and len(read) % len(frames(read)[0]) == 0 for read in heard)


def refused(folder: Path, *options) -> str:
    command = [SIMULATION, "--scene", folder / "x", "--seconds", "1", *map(str, options), "--", "true"]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=TIMEOUT_S)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    return done.stderr


def test_wrong_use_is_refused(tmp_path):
    assert "--create 3: give 1 or 2" in refused(tmp_path, "--create", 3, "--create-link", tmp_path / "c")
    assert "--create-link" in refused(tmp_path, "--create", 1)
    assert "needs --create" in refused(tmp_path, "--create-link", tmp_path / "c")
    assert "--create-lose-bytes" in refused(tmp_path, "--create", 1, "--create-lose-bytes", 7)


def ended_by(folder: Path, *messages: bytes) -> str:
    """The line with which a run ends whose pilot says this, and drives nothing."""
    client = [CLIENT, folder / "stream.bin", 4096, 200]
    simulation = simulate(folder, 1, 1, client, "--socket", folder / "sock", "--followers", 1)
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as link:
        while link.connect_ex(str(folder / "sock")) != 0:
            assert simulation.poll() is None
            os.sched_yield()
        for message in (b"pilot", *messages):
            link.send(message)
        try:
            _, error = simulation.communicate(timeout=TIMEOUT_S)
        finally:
            simulation.kill()
    assert simulation.returncode == 1
    return error.splitlines()[-1]


def test_a_drive_message_is_out_of_turn(tmp_path):
    reported = ended_by(tmp_path, b"drive 39 0 0")
    assert reported.endswith("'drive 39 0 0', but the pilot's answer due is base 39 N")


def test_bytes_that_never_come_are_not_waited_for_without_end(tmp_path):
    reported = ended_by(tmp_path, b"base 39 7")
    assert "7 bytes written to the base's port, but only 0 have come" in reported
