"""What is recorded is on the disk once a second, and a disk that is slow, full or broken costs no sample unsaid."""

import errno
import os
import threading
import time

import numpy as np
import pytest
from linkkit import free_endpoint
from patience import PATIENCE_S
from rings import make_frames, ring_name

from crunchbot.bridge.ring import Reader, Writer
from crunchbot.recording import read
from crunchbot.recording import writing as writing_module
from crunchbot.recording.recorder import Recorder
from crunchbot.recording.writing import RecordingWriter, TopicWriter, WriteError
from crunchbot.robot.bags.played import RECORD
from crunchbot.robot.bags.writing import Bag
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.link import Link


def eventually(condition) -> None:
    until = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < until, "it never came about"
        time.sleep(0.005)


class Disk:
    """os.fdatasync and os.fsync as a disk would have them: what is synced is known; it may be slow or fail."""

    def __init__(self, monkeypatch):
        self.error: OSError | None = None
        self.calls, self.safe, self.folders = 0, {}, []
        self.is_free = threading.Event()
        self.is_free.set()
        monkeypatch.setattr(os, "fdatasync", self._fdatasync)
        monkeypatch.setattr(os, "fsync", lambda number: self.folders.append(os.readlink(f"/proc/self/fd/{number}")))

    def _fdatasync(self, number: int) -> None:
        self.calls += 1
        size = os.fstat(number).st_size
        assert self.is_free.wait(PATIENCE_S)
        if self.error:
            raise self.error
        self.safe[os.readlink(f"/proc/self/fd/{number}")] = size

    def has_all(self, path) -> bool:
        return self.safe.get(str(path)) == path.stat().st_size


@pytest.fixture
def disk(monkeypatch):
    disk = Disk(monkeypatch)
    yield disk
    disk.is_free.set()


@pytest.fixture
def recorder(tmp_path):
    """(ring, recorder, path)."""
    name, path = ring_name(), tmp_path / "a.mcap"
    with Writer(name, 4096) as ring, Reader(name) as reader, RecordingWriter(path, {}) as writer:
        yield ring, Recorder(reader, writer), path


class Seconds:
    """time of the module `writing`, which passes when it is asked to."""

    def __init__(self):
        self.now = 1000.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def seconds(monkeypatch):
    seconds = Seconds()
    monkeypatch.setattr(writing_module, "time", seconds)
    return seconds


def take(ring, recorder, second: int) -> None:
    ring.publish(make_frames(400, first=400 * second))
    recorder.step(True)


def test_each_second_is_on_the_disk(disk, seconds, recorder):
    ring, recorder, path = recorder
    for second in range(5):
        take(ring, recorder, second)
        grown = path.stat().st_size
        seconds.now += 1.0
        recorder.step(True)
        assert path.stat().st_size > grown
        eventually(lambda: disk.has_all(path))
    calls = disk.calls
    for _ in range(3):  # nothing new: nothing to sync
        seconds.now += 1.0
        recorder.step(True)
    recorder.finish()
    assert disk.has_all(path) and disk.calls <= calls + 2
    assert disk.folders == [str(path.parent)]


def test_a_slow_disk_neither_loses_nor_delays_frames(disk, seconds, recorder):
    ring, recorder, path = recorder
    eventually(lambda: disk.has_all(path))
    before = disk.calls
    disk.is_free.clear()
    for second in range(20):  # twice what the ring holds: a recorder that waited would be overrun, or stand
        take(ring, recorder, second)
        seconds.now += 1.0
        recorder.step(True)
    assert recorder.tally.frames == 8000 and disk.calls == before + 1 and not disk.has_all(path)
    with read(path) as recording:  # other processes have it already, up to the last second
        assert sum(map(len, recording.blocks())) == 8000
    disk.is_free.set()
    recorder.finish()
    assert disk.has_all(path) and disk.calls <= before + 3
    with read(path) as recording:
        frames = np.concatenate(list(recording.blocks()))
    assert np.array_equal(frames["tick"], np.arange(8000)) and recorder.tally.overrun == 0


@pytest.mark.parametrize("number", [errno.EIO, errno.ENOSPC])
def test_a_sync_that_fails_is_one_line(disk, seconds, recorder, number):
    ring, recorder, path = recorder
    take(ring, recorder, 0)
    disk.error = OSError(number, os.strerror(number))
    with pytest.raises(WriteError) as reported:
        for second in range(1, 1000):
            seconds.now += 1.0
            take(ring, recorder, second)
            time.sleep(0.001)
    text = str(reported.value)
    assert f"{path}: cannot be written on ({os.strerror(number)}); what was recorded before is kept; " in text
    assert (
        ("free some space" in text) == (number == errno.ENOSPC) and reported.value.exit_code == 1 and "\n" not in text
    )


def test_a_sync_that_fails_at_the_end_is_reported(disk, recorder):
    ring, recorder, path = recorder
    take(ring, recorder, 0)
    disk.error = OSError(errno.EIO, "broken")
    with pytest.raises(WriteError, match="broken"):
        recorder.finish()


def test_a_crash_leaves_what_was_written_on_the_disk(disk, recorder):
    ring, recorder, path = recorder
    take(ring, recorder, 0)
    recorder._writer.flush()
    recorder._writer.close()
    assert disk.has_all(path)


def test_a_bag_is_on_the_disk_each_second(disk, tmp_path):
    path, endpoint, stop = tmp_path / "a.mcap", free_endpoint(), threading.Event()
    with Link("pilot", listen=[endpoint]) as pilot, Link("bag", connect=[endpoint]) as link:
        with TopicWriter(path, RECORD, {"robot": "robot"}) as writer:
            thread = threading.Thread(target=Bag(writer, "robot").run, args=(link, stop, True))
            thread.start()
            assert pilot.wait_for(["bag"], PATIENCE_S)
            begun, stream = path.stat().st_size, pilot.publish("truth")

            def one_more() -> bool:
                stream.send(m.PoseStamped(m.Header(m.Time(0), "map"), m.Pose.planar(1.0, 2.0, 0.5)))
                return disk.safe.get(str(path), 0) > begun

            eventually(one_more)
            stop.set()
            thread.join()
        assert disk.has_all(path)
