"""whiskerd from outside: the cable pulled and put back, killed and started again, replaced; what readers learn of it."""

import itertools
import json
import os
import pwd
import re
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from chainrun import END_S, FAST_LINK, Cable, program, running, simulation, write_flat_scene

from crunchbot.bridge.ring import Reader, RingError
from whisker_protocol import LIMITS, WIRE_VERSION

LONG_S = 600
LOOK_S = 0.05
WATCHDOG_US = 400_000  # fed at a quarter of it
LAST, GAP = 1, 256  # WHISKER_FRAME_LAST, WHISKER_FRAME_GAP
RINGS = itertools.count()


@pytest.fixture
def ring() -> str:
    """A name of its own for each test: what one that fails leaves behind does not fail the next."""
    return f"whisker-daemon-{os.getpid()}-{next(RINGS)}"


def until(condition, process: subprocess.Popen, reader: Reader) -> None:
    """Looks whenever frames come into the reader's ring, which stays where it is; fails when the process ends or a generous
    time is over. What the daemon reports without a frame wakes no reader, so LOOK_S without one is enough too.
    """
    give_up = time.monotonic() + END_S
    with Reader(reader.name) as watcher:
        while not condition():
            assert process.poll() is None, process.stderr.read()
            assert time.monotonic() < give_up, "it does not happen"
            watcher.seek_latest(0)
            with suppress_timeout():
                watcher.wait(LOOK_S)


@contextmanager
def suppress_timeout():
    try:
        yield
    except RingError as error:
        if error.name != "TIMEOUT":
            raise


def connected(reader: Reader) -> bool:
    return reader.stats is not None and reader.stats.connected == 1


def read_to_end(reader: Reader) -> tuple[np.void, str]:
    """Reads until the ring has ended: its last frame, and how it ended."""
    last = None
    while True:
        try:
            reader.wait(END_S)
        except RingError as error:
            return last, error.name
        frames = reader.peek()
        last = frames[-1].copy()
        reader.advance(len(frames))


def finish(process: subprocess.Popen) -> list[str]:
    """Ends the simulation and its command; returns whiskerd's lines."""
    process.terminate()
    _, errors = process.communicate(timeout=END_S)
    return [line for line in errors.splitlines() if line.startswith("whiskerd:")]


@contextmanager
def bridge(folder: Path, ring: str, *options, words=(), **popen):
    """A simulated bridge with whiskerd, and the cable between them."""
    scene, _ = write_flat_scene(folder, 1)
    path = folder / "sim.sock"
    with running([*simulation(folder, scene, LONG_S, 1, ring, "--socket", path, *options), *words], **popen) as process:
        cable = Cable(path, process)
        yield process, cable
        cable.close()


def shell(folder: Path, ring: str, script: str) -> list[str]:
    """A simulated bridge with a shell script, in which $D starts whiskerd on the ring."""
    scene, _ = write_flat_scene(folder, 1)
    command = simulation(folder, scene, LONG_S, 1, ring)
    start = f"{program('whiskerd')} --ring {ring} {' '.join(FAST_LINK)}"
    return [*command[: command.index("--") + 1], "bash", "-c", script.replace("$D", start)]


# ---------------------------------------------------------------------------------------------------------------------
# the cable


def test_ring_lives_on_while_the_bridge_is_away(tmp_path, ring):
    with bridge(tmp_path, ring) as (process, cable), Reader(ring, wait_s=END_S) as reader:
        until(lambda: reader.info.published > 400, process, reader)
        generation = reader.info.generation
        for away in (1, 2):
            cable.pull()
            until(lambda: not connected(reader), process, reader)
            before = reader.info.published
            cable.put()
            until(lambda n=before: reader.info.published > n + 400, process, reader)
            assert reader.stats.reconnects == away
        frames = reader.peek().copy()
        assert reader.info.generation == generation
        lines = finish(process)
    assert begins_anew_after_each_gap(frames, 2)
    assert [line for line in lines if "unplugged" in line] == [
        "whiskerd: bridge: the bridge was unplugged; plug it in again"
    ] * 2
    assert sum("0001 is back after" in line for line in lines) == 2


def begins_anew_after_each_gap(frames: np.ndarray, gaps: int) -> bool:
    """The first frame after a gap, and only it, is flagged; ticks run without a hole in between."""
    flagged = np.flatnonzero(frames["flags"] & GAP)
    steps = np.diff(frames["tick"].astype(np.int64))
    return (
        len(flagged) == gaps
        and np.all(frames["tick"][flagged] == 0)
        and np.array_equal(np.flatnonzero(steps != 1) + 1, flagged)
    )


def test_loose_contact_is_survived(tmp_path, ring):
    with bridge(tmp_path, ring) as (process, cable), Reader(ring, wait_s=END_S) as reader:
        for blinks in range(1, 6):
            before = reader.info.published
            until(lambda n=before: reader.info.published > n + 100, process, reader)
            cable.pull()
            cable.put()
            until(lambda n=blinks: reader.stats.reconnects == n, process, reader)
        before = reader.info.published
        until(lambda: reader.info.published > before + 100, process, reader)
        assert begins_anew_after_each_gap(reader.peek(), 5)
        finish(process)


def test_waits_for_its_first_bridge(tmp_path, ring):
    with (
        bridge(tmp_path, ring, "--unplugged", words=["--wait"]) as (process, cable),
        Reader(ring, wait_s=END_S) as reader,
    ):
        until(lambda: reader.stats is not None, process, reader)
        assert reader.stats.connected == 0 and reader.info.published == 0
        cable.put()
        until(lambda: reader.info.published > 200, process, reader)
        assert not np.any(reader.peek()["flags"] & GAP), "nothing was missed"
        lines = finish(process)
    assert lines[0] == "whiskerd: bridge: no bridge is connected; plug it in; check its power and cable"
    assert len(lines) == 2, lines


def test_once_ends_when_the_bridge_goes(tmp_path, ring):
    with bridge(tmp_path, ring, words=["--once"]) as (process, cable), Reader(ring, wait_s=END_S) as reader:
        until(lambda: reader.info.published > 100, process, reader)
        cable.pull()
        _, errors = process.communicate(timeout=END_S)
    lines = [line for line in errors.splitlines() if line.startswith("whiskerd: bridge")]
    assert lines == ["whiskerd: bridge: the bridge was unplugged; plug it in again"]
    assert process.returncode == 1


def test_readers_know_bridge_and_clock(tmp_path, ring):
    with bridge(tmp_path, ring) as (process, _), Reader(ring, wait_s=END_S) as reader:
        until(lambda: connected(reader) and reader.clock is not None, process, reader)
        stats, clock = reader.stats, reader.clock
        finish(process)
    assert (stats.serial, stats.firmware) == ("0001", f"gateware {LIMITS['gateware_version']}, wire {WIRE_VERSION}")
    assert stats.lane_mask == 2**28 - 1 and stats.tick_period == 30000
    assert stats.started_ns <= stats.connected_ns <= time.time_ns()
    assert clock.ns_per_cycle == pytest.approx(1e9 / 60e6, rel=1e-3)
    assert abs(clock.monotonic_ns - time.monotonic_ns()) < END_S * 1e9


# ---------------------------------------------------------------------------------------------------------------------
# starts and ends


def test_killed_daemon_hinders_no_next_one(tmp_path, ring):
    # The next one waits: umockdev, unlike a kernel, notices the end of a process only a moment later.
    script = "trap : TERM; $D & a=$!; read go; kill -KILL $a; wait $a; $D --wait & b=$!; read go; kill $b; wait $b"
    with running(shell(tmp_path, ring, script), stdin=subprocess.PIPE) as process, Reader(ring, wait_s=END_S) as reader:
        until(lambda: reader.info.published > 100, process, reader)
        first = reader.info.generation
        process.stdin.write("go\n")
        process.stdin.flush()
        assert read_to_end(reader)[1] in ("WRITER_DEAD", "RESTARTED")
        reader.reattach(10.0)
        assert reader.info.generation != first
        until(lambda: reader.info.published > 100, process, reader)
        ticks = reader.peek()["tick"]
        assert ticks[0] == 0, "frames left over from the killed one's run are thrown away"
        process.communicate("go\n", timeout=END_S)
    assert not Path("/dev/shm", ring).exists()


def test_a_client_that_died_before_its_answer_holds_no_interface(tmp_path, ring):
    client = f"{sys.executable} {Path(__file__).with_name('dying_client.py')}"
    script = f"trap : TERM; {client} || exit 9; $D --wait & b=$!; read go; kill $b; wait $b"
    with running(shell(tmp_path, ring, script), stdin=subprocess.PIPE) as process, Reader(ring, wait_s=END_S) as reader:
        until(lambda: reader.info.published > 100, process, reader)
        process.communicate("go\n", timeout=END_S)


def test_replacement_takes_over_name_and_bridge(tmp_path, ring):
    script = "trap : TERM; $D & a=$!; read go; $D --replace & b=$!; wait $a; echo first $? >&2; read go; kill $b; wait $b; echo second $? >&2"
    with running(shell(tmp_path, ring, script), stdin=subprocess.PIPE) as process, Reader(ring, wait_s=END_S) as reader:
        until(lambda: reader.info.published > 100, process, reader)
        process.stdin.write("go\n")
        process.stdin.flush()
        last, how = read_to_end(reader)
        assert how in ("CLOSED", "RESTARTED")
        assert last["flags"] & LAST, "the first daemon drained its bridge"
        reader.reattach(10.0)
        until(lambda: reader.info.published > 100, process, reader)
        _, errors = process.communicate("go\n", timeout=END_S)
    assert "first 0" in errors and "second 0" in errors


# A stale ring of the name, as a killed whiskerd leaves it; a service with its RuntimeDirectory; another whiskerd beside it.
SERVICE = """
set -e
mount -t tmpfs none /run && mkdir /run/whiskerd
echo stale: $(basename $(ls /dev/shm/$RING))
RUNTIME_DIRECTORY=/run/whiskerd $D --wait 2>$LOG & service=$!
"$PYTHON" -m crunchbot.cli info --json --wait 60
echo files: $(ls /run/whiskerd)
$D --wait || echo refused: $?
RUNTIME_DIRECTORY=/run/other $D --wait || echo refused: $?
kill $service; wait $service
echo left: $(ls -A /run/whiskerd)
"""


def test_the_service_has_its_ring_in_its_runtime_directory(tmp_path, ring):
    space = ["unshare", "--mount", *([] if os.geteuid() == 0 else ["--map-root-user"])]
    if subprocess.run([*space, "mount", "-t", "tmpfs", "none", "/run"], capture_output=True).returncode != 0:
        pytest.skip("this user may not have a mount namespace")
    leave = f"import os; from crunchbot.bridge.ring import Writer; w = Writer('{ring}', 64); os._exit(0)"
    subprocess.run([sys.executable, "-c", leave], check=True, timeout=END_S)
    log = tmp_path / "service.log"
    names = {"D": f"{program('whiskerd')} --ring {ring}", "RING": ring, "LOG": str(log), "PYTHON": sys.executable}
    try:
        done = subprocess.run(
            [*space, "sh", "-c", SERVICE.replace("info", f"info --ring {ring}")],
            env=os.environ | names,
            capture_output=True,
            text=True,
            timeout=END_S,
        )
        assert Path("/dev/shm", ring).exists(), "the stale ring is not the service's business"
    finally:
        Path("/dev/shm", ring).unlink()
    lines = done.stdout.splitlines()
    assert lines[0] == f"stale: {ring}" and lines[2:] == [f"files: {ring}", "refused: 1", "refused: 1", "left:"], done
    assert json.loads(lines[1])["ring"]["owner"] == pwd.getpwuid(os.geteuid()).pw_name
    held = f"whiskerd: {ring}: another writer holds this ring (/run/whiskerd/{ring}, user "
    assert [line.startswith(held) for line in done.stderr.splitlines()] == [True, True], done.stderr
    assert "no bridge is connected" in log.read_text()


def test_statistics_on_request(tmp_path, ring):
    with bridge(tmp_path, ring) as (process, _), Reader(ring, wait_s=END_S) as reader:
        until(lambda: reader.info.published > 100, process, reader)
        os.kill(reader.info.writer_pid, signal.SIGUSR1)
        line = process.stderr.readline()
        finish(process)
    assert line.startswith("whiskerd: ") and "frames published, 0 missing, 0 dropped by the bridge" in line


@pytest.mark.parametrize("plugged", [True, False])
def test_systemd_is_reported_that_it_is_ready_lives_and_stops(tmp_path, ring, plugged):
    if "libsystemd" not in subprocess.run(["ldd", program("whiskerd")], capture_output=True, text=True).stdout:
        pytest.skip("whiskerd was built without libsystemd")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(tmp_path / "notify"))
        listener.settimeout(END_S)
        reported = {"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": str(WATCHDOG_US)}
        unplugged = [] if plugged else ["--unplugged"]
        with bridge(tmp_path, ring, *unplugged, words=["--wait"], env=os.environ | reported) as (process, _):
            heard = [listener.recv(1024).decode() for _ in range(4)]
            finish(process)
            while heard[-1] != "STOPPING=1":
                heard.append(listener.recv(1024).decode())
    status = f"bridge 0001 (.*) at 1-1 streams into ring {ring}" if plugged else "waiting for a bridge"
    assert re.fullmatch(f"READY=1\nSTATUS={status}", heard[0])
    assert set(heard[1:-1]) == {"WATCHDOG=1"}


def test_nodes_on_request_while_frames_go_on(tmp_path, ring):
    with bridge(tmp_path, ring) as (process, _), Reader(ring, wait_s=END_S) as reader:
        until(lambda: reader.info.published > 100, process, reader)
        asked = subprocess.run(
            [sys.executable, "-m", "crunchbot.cli", "info", "--nodes", "--ring", ring], capture_output=True, text=True
        )
        assert asked.returncode == 0, asked.stderr
        lines = [process.stderr.readline()]
        lines += [process.stderr.readline() for _ in range(int(lines[0].split()[1]))]
        published = reader.info.published
        until(lambda: reader.info.published > published + 100, process, reader)
        finish(process)
        missing = reader.info.frames_missing
    assert len(lines) > 1 and all("the application runs" in line for line in lines[1:])
    assert asked.stdout.splitlines() == [line.strip().partition(": ")[2] for line in lines]
    assert missing == 0


def test_bridges_are_listed(tmp_path, ring):
    command = shell(tmp_path, ring, f"{program('whiskerd')} --list; {program('whiskerd')} --ring {ring} --serial 0009")
    done = subprocess.run(command, capture_output=True, text=True, timeout=END_S)
    assert done.stdout == "0001 at 1-1: can be opened\n"
    assert "no bridge of this serial number is connected; see whiskerd --list" in done.stderr
