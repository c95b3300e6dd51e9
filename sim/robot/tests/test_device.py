"""The simulated device under a real libusb: what is recorded depends on the seed, never on who reads it, or how fast."""

import csv
import os
import re
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import whisker_protocol as protocol

SIMULATION = os.environ.get("WHISKER_BRIDGE_SIM", "")
CLIENT = os.environ.get("WHISKER_STREAM_CLIENT", "")
USB_PROBE = os.environ.get("WHISKER_USB_PROBE", "")
TICKS_PER_S = 2000
BLOCK = 40
TIMEOUT_S = 120
PATIENT_MS, HASTY_MS = 1000, 1  # that a client gives a transfer; a busy machine does not make the first one short
ASLEEP_S = 1.0  # more than the world waits before it looks after its host

pytestmark = pytest.mark.skipif(not SIMULATION, reason="run by CTest, which knows where the programs are")

SCENE = """\
size_m 2.5 2.5
tile_m 0.5
texture VINYL
texture SMOOTH
texture ROUGH
floor VSRVS
floor RVSSV
floor SSVRR
floor VRRSV
floor RSVVS
obstacle 1.0 1.0 1.5 1.5
body_radius_m 0.165
texture_whisker left -0.02 0.21
object_whisker front 0.077 0.140 -0.5 0.14
start 0.75 0.75 0.3
"""


def command(folder: Path, seconds: float, seed: int, client: list, *options) -> list:
    scene = folder / "scene.flat"
    scene.write_text(SCENE)
    outputs = ["--truth", folder / "truth.csv", "--faults", folder / "faults.csv", "--usb-faults", folder / "usb.csv"]
    arguments = ["--scene", scene, "--seconds", seconds, "--seed", seed, *outputs, *options, "--", *client]
    return ["umockdev-wrapper", SIMULATION, *map(str, arguments)]


def stream(folder: Path, seconds: float, seed: int, transfer: int, timeout_ms: int, *options) -> dict:
    """Runs the simulation with a client that reads so; returns what was recorded, by file name."""
    folder.mkdir()
    client = [CLIENT, folder / "stream.bin", transfer, timeout_ms]
    subprocess.run(command(folder, seconds, seed, client, *options), check=True, timeout=TIMEOUT_S)
    return {name: (folder / name).read_bytes() for name in ("stream.bin", "truth.csv", "faults.csv", "usb.csv")}


def test_reader_changes_nothing(tmp_path):
    patient = stream(tmp_path / "patient", 2, 5, 16384, PATIENT_MS)
    hasty = stream(tmp_path / "hasty", 2, 5, 512, HASTY_MS)
    other = stream(tmp_path / "other", 2, 6, 16384, PATIENT_MS)
    assert patient == hasty
    assert all(patient[name] != other[name] for name in ("stream.bin", "faults.csv", "usb.csv"))
    assert len(patient["stream.bin"]) == 2 * TICKS_PER_S * protocol.FRAME_BYTES


def test_level_changes_nothing(tmp_path):
    gateware = stream(tmp_path / "gateware", 2, 7, 4096, PATIENT_MS)
    model = stream(tmp_path / "model", 2, 7, 4096, PATIENT_MS, "--level", "bytes")
    assert gateware == model


@pytest.mark.parametrize("level", ["rtl", "bytes"])
def test_a_paced_world_waits_for_a_slow_host(tmp_path, level):
    """Its host sleeps, for it writes into a pipe that nobody reads: it lives, so nothing is lost."""
    patient = stream(tmp_path / "patient", 1, 5, 4096, PATIENT_MS)
    folder = tmp_path / "slow"
    folder.mkdir()
    os.mkfifo(folder / "stream.bin")
    client = [CLIENT, folder / "stream.bin", 4096, PATIENT_MS]
    words = command(folder, 1, 5, client, "--level", level, "--pace", 10)
    with subprocess.Popen(words) as simulation:
        with open(folder / "stream.bin", "rb", buffering=0) as pipe:
            received = pipe.read(1)
            time.sleep(ASLEEP_S)
            received += pipe.readall()
        assert simulation.wait(TIMEOUT_S) == 0
    assert received == patient["stream.bin"]


@pytest.mark.parametrize("level", ["rtl", "bytes"])
def test_a_bus_reset_by_libusb_reaches_the_device(tmp_path, level):
    """In the midst of a run, with frames under way: none of them comes after it, and the next run begins at tick 0."""
    said = tmp_path / "said"
    client = ["sh", "-c", f"{USB_PROBE} reset >{said} 2>&1"]
    subprocess.run(command(tmp_path, 60, 1, client, "--level", level), capture_output=True, timeout=TIMEOUT_S)
    assert re.fullmatch(r"\d+ frames\n", said.read_text())


def test_exit_code_is_the_commands(tmp_path):
    result = subprocess.run(
        command(tmp_path, 1, 1, ["sh", "-c", "exit 7"]), capture_output=True, text=True, timeout=TIMEOUT_S
    )
    assert result.returncode == 7


def test_command_that_ends_too_soon_is_an_error(tmp_path):
    result = subprocess.run(command(tmp_path, 1, 1, ["true"]), capture_output=True, text=True, timeout=TIMEOUT_S)
    assert result.returncode == 1
    assert result.stderr == "whisker-bridge-sim: the run ended after 0 of 2000 ticks\n"


def test_a_socket_at_which_somebody_listens_is_not_taken(tmp_path):
    path = tmp_path / "sock"
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as other:
        other.bind(str(path))
        other.listen()
        (tmp_path / "first").mkdir()
        words = command(tmp_path / "first", 1, 1, ["true"], "--socket", path)
        result = subprocess.run(words, capture_output=True, text=True, timeout=TIMEOUT_S)
        assert result.returncode == 1 and f"cannot listen at '{path}': Address already in use" in result.stderr
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as client:
            client.connect(str(path))
    client = ["sh", "-c", f"rm {path} && echo mine > {path}"]
    subprocess.run(command(tmp_path, 1, 1, client, "--socket", path), capture_output=True, timeout=TIMEOUT_S)
    assert path.read_text() == "mine\n", "the socket of one that has ended is taken over, what came since stays"


def test_command_is_killed_with_the_simulation(tmp_path):
    mark = tmp_path / "pid"
    client = ["sh", "-c", f"echo $$ > {mark}.tmp && mv {mark}.tmp {mark} && exec sleep 1000"]
    simulation = subprocess.Popen(command(tmp_path, 1, 1, client, "--socket", tmp_path / "sock"))
    while not mark.exists():
        assert simulation.poll() is None
        os.sched_yield()
    simulation.terminate()
    assert simulation.wait(TIMEOUT_S) != 0
    assert not Path("/proc", mark.read_text().strip()).exists()
    assert not (tmp_path / "sock").exists()


class Pilot(threading.Thread):
    """Drives straight ahead; answers each block when it feels like it, for the simulation has to wait anyway."""

    def __init__(self, path: Path, ticks: int, speed_m_s: float):
        super().__init__()
        self.path, self.ticks, self.speed = path, ticks, speed_m_s
        self.odometry = []
        self.over = threading.Event()  # there is no simulation to connect to any more

    def run(self):
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as link:
            while link.connect_ex(str(self.path)) != 0:
                if self.over.is_set():
                    return
                os.sched_yield()
            link.send(b"pilot")
            for tick in range(BLOCK - 1, self.ticks, BLOCK):
                link.send(f"drive {tick} {self.speed} 0".encode())
            while (message := link.recv(256).decode().split())[0] != "end":
                self.odometry.append(message)
            self.end = message


def drive(folder: Path, speed_m_s: float):
    folder.mkdir()
    pilot = Pilot(folder / "sock", TICKS_PER_S, speed_m_s)
    pilot.start()
    client = [CLIENT, folder / "stream.bin", 4096, PATIENT_MS]
    options = ["--socket", folder / "sock", "--followers", 1]
    try:
        subprocess.run(command(folder, 1, 3, client, *options), check=True, timeout=TIMEOUT_S)
    finally:
        pilot.over.set()
        pilot.join()
    with open(folder / "truth.csv") as file:
        return pilot, [float(row["x_m"]) for row in csv.DictReader(file)]


def test_pilot_moves_the_robot_and_hears_of_it(tmp_path):
    pilot, x_m = drive(tmp_path / "drive", 0.2)
    assert [int(message[1]) for message in pilot.odometry] == list(range(199, TICKS_PER_S, 200))
    assert pilot.end == ["end", str(TICKS_PER_S)]
    # 0.2 m/s along 0.3 rad from tick 80 to 2000, less what it takes to get up to speed.
    assert x_m[-1] - 0.75 == pytest.approx(0.2 * 0.96 * 0.955, rel=0.1)
    reported_m = sum(float(message[2]) for message in pilot.odometry)
    assert reported_m == pytest.approx(0.2 * 0.96, rel=0.15)


def test_a_message_out_of_turn_ends_the_run_with_one_line(tmp_path):
    folder = tmp_path / "turn"
    folder.mkdir()
    client = [CLIENT, folder / "stream.bin", 4096, PATIENT_MS]
    simulation = subprocess.Popen(
        command(folder, 1, 1, client, "--socket", folder / "sock", "--followers", 1), stderr=subprocess.PIPE, text=True
    )
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as link:
        while link.connect_ex(str(folder / "sock")) != 0:
            assert simulation.poll() is None
            os.sched_yield()
        link.send(b"pilot")
        link.send(b"drive 79 0 0")
        _, error = simulation.communicate(timeout=TIMEOUT_S)
    assert simulation.returncode == 1
    assert error.splitlines()[-1].endswith("'drive 79 0 0', but the pilot's answer due is drive 39 V OMEGA")


def doctor(folder: Path, *options) -> subprocess.CompletedProcess:
    """`whisker doctor --pattern` with the simulated bridge plugged in, nobody else using it."""
    words = [sys.executable, "-m", "crunchbot.cli", "doctor", "--pattern"]
    return subprocess.run(command(folder, 3, 1, words, *options), capture_output=True, text=True, timeout=TIMEOUT_S)


def test_doctor_proves_a_bridge_without_a_node(tmp_path):
    """Also where nodes send something else."""
    done = doctor(tmp_path, "--level", "bytes", "--lanes-populated", "3")
    assert "\nok    pattern: 1000 frames of 28 lanes are right" in done.stdout, done.stdout + done.stderr


def test_doctor_notices_a_bridge_that_damages_its_pattern(tmp_path):
    done = doctor(tmp_path, "--level", "bytes", "--defect", "frame")
    assert "\nFAIL  pattern:" in done.stdout, done.stdout + done.stderr
