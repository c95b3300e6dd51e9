"""The ring from Python: views without copies, read-only, confirmed after use."""

import getpass
import multiprocessing
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from patience import PATIENCE_S
from rings import make_frames, ring_name

from crunchbot.bridge.ring import FRAME, Clock, Reader, RingError, Writer, found_rings, signal_writer
from whisker_protocol import LIMITS

CAPACITY = 256
STRANGER = 4242  # a user id that no machine gives away


@pytest.fixture
def ring():
    with Writer(ring_name(), CAPACITY) as writer:
        yield writer


def test_frames_are_views_into_the_ring(ring):
    frames = make_frames(100)
    with Reader(ring.name) as reader:
        ring.publish(frames[:64])
        ring.publish(frames[64:])
        view = reader.peek()
        assert np.array_equal(view, frames) and not view.flags.owndata and not view.flags.writeable
        with pytest.raises(ValueError, match="read-only"):
            view["tick"][0] = 1
        reader.advance(60)
        assert np.array_equal(reader.peek(), frames[60:])


def test_a_window_is_one_array_wherever_it_lies(ring):
    frames = make_frames(3 * CAPACITY)
    ring.publish(frames[:300])
    with Reader(ring.name) as reader:
        position = reader.info.position
        with reader.window(CAPACITY) as window:
            assert np.array_equal(window, frames[300 - CAPACITY : 300]) and not window.flags.writeable
        assert reader.info.position == position
        with pytest.raises(RingError, match="overtook") as reported, reader.window(100):
            ring.publish(frames[300:])
        assert reported.value.name == "OVERRUN"
        with pytest.raises(RingError), reader.window(CAPACITY + 1):
            pass


def test_a_window_of_a_young_ring_is_short(ring):
    with Reader(ring.name) as reader:
        with reader.window(10) as window:
            assert window.shape == (0,) and window.dtype == FRAME
        ring.publish(make_frames(3))
        with reader.window(10) as window:
            assert len(window) == 3


def test_views_used_too_long_are_reported(ring):
    frames = make_frames(3 * CAPACITY)
    with Reader(ring.name) as reader:
        ring.publish(frames[:10])
        view = reader.peek()
        ring.publish(frames[10:])
        with pytest.raises(RingError) as reported:
            reader.advance(len(view))
        assert reported.value.name == "OVERRUN" and reader.info.overruns == 1
        assert reader.info.frames_overrun + len(reader.peek()) == len(frames)


def test_take_copies_waits_and_ends(ring):
    frames = make_frames(20)
    with Reader(ring.name) as reader:
        assert len(reader.take(0.0)) == 0
        ring.publish(frames)
        taken = reader.take(0.0)
        assert taken.flags.owndata and np.array_equal(taken, frames)
        ring.close()
        assert reader.take(0.0) is None


def test_the_clock_maps_both_ways_of_now(ring):
    hz = LIMITS["clock_hz"]
    with Reader(ring.name) as reader:
        assert reader.clock is None and reader.stats is None
        ring.set_clock(Clock(60 * hz, 5 * 10**9, 7 * 10**9, 1e9 / hz, 250.0))
        clock = reader.clock
        assert clock.uncertainty_ns == 250.0
        assert clock.monotonic([59 * hz, 61 * hz]).tolist() == [4 * 10**9, 6 * 10**9]
        assert int(clock.realtime(60 * hz)) == 7 * 10**9


def test_what_the_daemon_reports_arrives_as_text_and_numbers(ring):
    ring.set_stats(started_ns=5, frames=7, serial=b"B\xff1", firmware=b"x" * 31, error=-40)
    with Reader(ring.name) as reader:
        stats = reader.stats
    assert (stats.frames, stats.serial, stats.firmware, stats.error) == (7, "B\ufffd1", "x" * 31, -40)


def test_a_second_writer_and_a_missing_ring_are_one_line(ring):
    held = f"another writer holds this ring \\(/dev/shm/{ring.name}, user {getpass.getuser()}'s\\); stop"
    with pytest.raises(RingError, match=f"ring {ring.name}: {held}"):
        Writer(ring.name, CAPACITY)
    with pytest.raises(RingError) as reported:
        Reader("whisker-none")
    assert reported.value.name == "RING_MISSING" and reported.value.exit_code == 1 and "\n" not in str(reported.value)
    with pytest.raises(RingError, match="range"):
        Writer(ring_name(), 100)


def test_readers_say_whose_ring_it_is(ring):
    with Reader(ring.name) as reader:
        assert reader.owner == reader.info.owner == getpass.getuser()
    found = [entry for entry in found_rings() if entry.name == ring.name]
    assert [(entry.path, entry.owner, entry.error) for entry in found] == [
        (f"/dev/shm/{ring.name}", getpass.getuser(), "OK")
    ]


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file to another user")
def test_a_ring_of_another_user_is_refused_unless_that_user_is_named(ring):
    path = f"/dev/shm/{ring.name}"
    os.chown(path, STRANGER, STRANGER)
    with pytest.raises(
        RingError, match=f"the ring {path} is user {STRANGER}'s, .* --ring-owner {STRANGER}"
    ) as reported:
        Reader(ring.name)
    assert reported.value.name == "RING_OWNER" and "\n" not in str(reported.value)
    with pytest.raises(RingError):
        Reader(ring.name, owner=STRANGER + 1)
    with pytest.raises(RingError) as reported:
        signal_writer(ring.name, signal.SIGTERM)  # this process: it would end here
    assert reported.value.name == "RING_OWNER"
    with Reader(ring.name, owner=STRANGER) as reader:
        assert reader.owner == str(STRANGER)
    assert [entry.error for entry in found_rings() if entry.name == ring.name] == ["RING_OWNER"]


def _read_all(name, out):
    with Reader(name) as reader:
        out.send("attached")
        out.send(np.concatenate([view.copy() for view in reader.frames()]).tobytes())


def test_another_process_reads_the_same_bytes():
    frames, name = make_frames(200), ring_name()
    ours, theirs = multiprocessing.Pipe()
    with Writer(name, 1024) as writer:
        process = multiprocessing.get_context("spawn").Process(target=_read_all, args=(name, theirs))
        process.start()
        writer.publish(frames[:150])
        assert ours.recv() == "attached"
        writer.publish(frames[150:])
    assert ours.recv() == frames.tobytes()
    process.join()


def test_shared_memory_that_cannot_be_written_is_named():
    space = ["unshare", "--mount", *([] if os.geteuid() == 0 else ["--map-root-user"])]
    if subprocess.run([*space, "mount", "-t", "tmpfs", "none", "/dev/shm"], capture_output=True).returncode != 0:
        pytest.skip("this user may not have a mount namespace")
    program = f"from crunchbot.bridge.ring import Writer; Writer('{ring_name()}')"
    shell = f'mount -t tmpfs -o ro none /dev/shm && exec "{sys.executable}" -c "{program}"'
    done = subprocess.run([*space, "sh", "-c", shell], capture_output=True, text=True, timeout=PATIENCE_S)
    assert "the shared memory for rings is missing or cannot be written; mount a tmpfs at /dev/shm" in done.stderr
