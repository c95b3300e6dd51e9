"""Recordings: lossless, honest about losses, open to other tools, readable after any accident, bit for bit replayed."""

import contextlib
import resource
import struct
import threading
import time

import mcap.reader
import mcap.records
import mcap.stream_reader
import numpy as np
import pytest
from fuzz_recording import fuzz
from rings import make_frames, ring_name
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from crunchbot.bridge.ring import Clock, Reader, RingError, Writer
from crunchbot.native import lib
from crunchbot.outputs import OutputError
from crunchbot.recording import RecordingError, read
from crunchbot.recording.mcapfile import McapFile
from crunchbot.recording.messages import MessageError, decode_block, encode_block
from crunchbot.recording.recorder import Recorder, record
from crunchbot.recording.replay import Replay
from crunchbot.recording.timeline import Timeline
from crunchbot.recording.writing import RecordingWriter
from whisker_protocol import LANES, LIMITS

CAPACITY = 4096


def write(path, frames, **options):
    """A finished recording of these frames, by way of a ring."""
    name = ring_name()
    with Writer(name, CAPACITY) as ring, Reader(name) as reader:
        recorder = Recorder(reader, RecordingWriter(path, {"ring": name}, **options))
        for start in range(0, len(frames), 500):
            ring.publish(frames[start : start + 500])
            recorder.step(False)
        recorder.step(True)
        recorder.finish()
    return recorder.tally


def all_frames(path):
    with read(path) as recording:
        return np.concatenate(list(recording.blocks()))


def events(path):
    with read(path) as recording:
        return [(event.kind, event.tick, event.frames) for event in recording.events()]


def test_what_goes_in_comes_out(tmp_path):
    frames = make_frames(3001)
    frames["lane"]["reserved"] = 5
    tally = write(tmp_path / "a.mcap", frames, lane_names=["left", "right"])
    assert (tally.frames, tally.missing, tally.overrun, tally.restarts) == (3001, 0, 0, 0)
    assert np.array_equal(tally.records_bad, np.count_nonzero(frames["lane"]["status"], axis=0))
    with read(tmp_path / "a.mcap") as recording:
        assert np.array_equal(np.concatenate(list(recording.blocks())), frames)
        assert recording.complete and not recording.damage
        assert recording.lane_names[:3] == ("left", "right", "lane2") and len(recording.lane_names) == LANES
        assert recording.clock_hz == LIMITS["clock_hz"]
        stamps = [stamp for stamp, _ in recording.stamped_blocks()]
        assert np.diff(stamps)[:-1] == pytest.approx(200 * 500_000)
    assert events(tmp_path / "a.mcap") == []


def test_other_tools_open_it(tmp_path):
    frames = make_frames(2500)
    path = tmp_path / "a.mcap"
    write(path, np.delete(frames, slice(1000, 1010)))
    with open(path, "rb") as file:
        summary = mcap.reader.make_reader(file, validate_crcs=True).get_summary()
        topics = {channel.topic: summary.schemas[channel.schema_id].name for channel in summary.channels.values()}
        assert sum(1 for _ in mcap.reader.make_reader(file).iter_messages("/whisker/frames")) == 13
    assert topics["/whisker/frames"] == "whisker_msgs/msg/Block" and topics["/diagnostics"].endswith("DiagnosticArray")
    alpha, kinds, bad = [], [], 0
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as bag:
        for connection, _, data in bag.messages():
            message = bag.deserialize(data, connection.msgtype)
            if connection.topic == "/whisker/frames":
                alpha.append(message.lanes[3].alpha)
            elif connection.topic == "/whisker/events":
                kinds.append((message.kind, message.tick, message.frames))
            elif connection.topic == "/whisker/health":
                bad += message.records_bad.sum()
            else:
                assert message.status[0].name == "whisker: stream"
    kept = np.delete(frames, slice(1000, 1010))
    assert np.array_equal(np.concatenate(alpha), kept["lane"]["alpha"][:, 3])
    assert kinds == [(1, 1010, 10)] and bad == np.count_nonzero(kept["lane"]["status"])


def test_losses_before_the_ring_and_restarts_are_reported(tmp_path):
    frames = make_frames(1000)
    again = make_frames(300)
    again["sequence"] = frames["sequence"][-1] + 3 + np.arange(300)
    again["flags"][150] = lib.WHISKER_FRAME_GAP
    tally = write(tmp_path / "a.mcap", np.concatenate([frames[:100], frames[150:], again]))
    assert (tally.missing, tally.restarts) == (52, 2)
    reported = [("missing", 150, 50), ("restarted", 0, 0), ("missing", 0, 2), ("restarted", 150, 0)]
    assert events(tmp_path / "a.mcap") == reported


def test_ticks_that_go_back_by_less_than_a_block_are_a_restart(tmp_path):
    frames = make_frames(1000)
    frames["tick"][400:] -= 150
    tally = write(tmp_path / "a.mcap", frames)
    assert (tally.missing, tally.restarts) == (0, 1) and events(tmp_path / "a.mcap") == [("restarted", 250, 0)]


def test_a_recorder_overtaken_says_so(tmp_path):
    frames, name = make_frames(CAPACITY + 3000), ring_name()
    with Writer(name, CAPACITY) as ring, Reader(name) as reader:
        recorder = Recorder(reader, RecordingWriter(tmp_path / "a.mcap", {}))
        ring.publish(frames[:200])
        recorder.step(True)
        for start in range(200, len(frames), 1000):
            ring.publish(frames[start : start + 1000])
        recorder.step(True)
        recorder.finish()
    kept = all_frames(tmp_path / "a.mcap")
    assert recorder.tally.overrun > 0 and recorder.tally.missing == 0
    assert recorder.tally.overrun + len(kept) == len(frames)
    assert events(tmp_path / "a.mcap") == [("overrun", kept["tick"][200], recorder.tally.overrun)]


def test_a_recorder_outlives_its_ring(tmp_path):
    name, stop, tallies = ring_name(), threading.Event(), []
    frames = make_frames(900)
    first = Writer(name, CAPACITY)
    with Reader(name) as reader:
        writer = RecordingWriter(tmp_path / "a.mcap", {})
        thread = threading.Thread(target=lambda: tallies.append(record(reader, writer, stop)))
        thread.start()
        first.publish(frames[:333])
        first.close()
        thread.join()
    assert tallies[0].frames == 333 and np.array_equal(all_frames(tmp_path / "a.mcap"), frames[:333])


def test_limit_in_frames(tmp_path):
    name = ring_name()
    with Writer(name, CAPACITY) as ring, Reader(name) as reader:
        ring.publish(make_frames(1000))
        tally = record(reader, RecordingWriter(tmp_path / "a.mcap", {}), threading.Event(), frames=777)
    assert tally.frames == 777 and len(all_frames(tmp_path / "a.mcap")) == 777


def test_replay_is_bit_for_bit(tmp_path):
    frames = make_frames(5003)
    frames = np.concatenate([frames[:1000], frames[1200:], make_frames(400, seed=9)])
    write(tmp_path / "a.mcap", frames)
    name = ring_name()
    with read(tmp_path / "a.mcap") as recording, Writer(name, 8192) as ring, Reader(name) as reader:
        recorder = Recorder(reader, RecordingWriter(tmp_path / "b.mcap", {}))
        Replay(recording, ring, None).run(threading.Event())
        recorder.step(True)
        recorder.finish()
    assert np.array_equal(all_frames(tmp_path / "b.mcap"), frames)
    assert events(tmp_path / "a.mcap") == events(tmp_path / "b.mcap")


def test_replay_keeps_time_and_reports_the_clock(tmp_path):
    write(tmp_path / "a.mcap", make_frames(2000))
    name = ring_name()
    with read(tmp_path / "a.mcap") as recording, Writer(name) as ring, Reader(name) as reader:
        began = time.monotonic_ns()
        replay = Replay(recording, ring, 4.0)
        replay.run(threading.Event())
        took_s = (time.monotonic_ns() - began) / 1e9
        assert replay.frames == 2000 and took_s > 0.24  # 1 s of frames at four times the speed; not the last 10 ms
        due = reader.clock.monotonic(reader.peek()["time_cycles"])
    assert (due[-1] - due[0]) / 1e9 == pytest.approx(1999 * 500e-6 / 4)


def blocks_others_see(path):
    """How many blocks mcap's own reader finds before it stumbles: what `mcap recover` would keep."""
    seen, channels = 0, {}
    with open(path, "rb") as file, contextlib.suppress(mcap.exceptions.McapError, struct.error):
        for record in mcap.stream_reader.StreamReader(file).records:
            if isinstance(record, mcap.records.Channel):
                channels[record.id] = record.topic
            seen += isinstance(record, mcap.records.Message) and channels[record.channel_id] == "/whisker/frames"
    return seen


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9, 0.9999])
def test_a_file_cut_off_is_read_to_its_last_whole_chunk(tmp_path, share):
    frames = make_frames(20000)
    path = tmp_path / "a.mcap"
    write(path, frames)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    with read(path) as recording:
        kept = np.concatenate(list(recording.blocks()))
        assert not recording.complete and "ends within a record" in recording.damage[0]
    assert np.array_equal(kept, frames[: len(kept)])
    assert len(kept) > share * len(frames) - 2 * 4200  # a chunk is 1 MiB, two seconds
    assert blocks_others_see(path) == -(-len(kept) // 200)


def test_a_damaged_chunk_costs_only_itself(tmp_path):
    frames = make_frames(20000)
    path = tmp_path / "a.mcap"
    write(path, frames)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0x40
    path.write_bytes(data)
    with read(path) as recording:
        kept = np.concatenate(list(recording.blocks()))
        lost = len(frames) - len(kept)
        assert not recording.complete and "its checksum is wrong" in recording.damage[0]
        assert any(
            line.endswith(f"/whisker/frames: {-(-lost // 200)} of 100 messages are lost") for line in recording.damage
        )
        assert recording.damage[-1].endswith(f"{lost} of 20000 frames are lost")
    assert 10000 < len(kept) < 20000 and np.isin(kept["tick"], frames["tick"]).all()


@contextlib.contextmanager
def files_at_most(count):
    """No file grows beyond `count` bytes: a disk that fills up, as this process sees it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (count, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_full_disk_keeps_what_was_written(tmp_path):
    name, path = ring_name(), tmp_path / "a.mcap"
    with Writer(name, CAPACITY) as ring, Reader(name) as reader:
        recorder = Recorder(reader, writer := RecordingWriter(path, {}))
        with files_at_most(1_000_000), pytest.raises(RecordingError) as reported:
            for start in range(0, 10 * CAPACITY, 1000):
                ring.publish(make_frames(1000, first=start))
                recorder.step(False)
                writer.flush()
        writer.close()
    text = str(reported.value)
    assert (
        reported.value.exit_code == 1
        and str(path) in text
        and "kept" in text
        and "free some space" in text
        and "\n" not in text
    )
    with read(path) as recording:
        kept = np.concatenate(list(recording.blocks()))
        assert len(recording.damage) == 1 and "without its closing record" in recording.damage[0]  # no half record
    assert len(kept) >= 2000 and np.array_equal(kept["tick"], np.arange(len(kept)))
    assert np.array_equal(kept[:1000], make_frames(1000))


def test_no_room_at_all_is_one_line():
    with pytest.raises(RecordingError, match="/dev/full: cannot be written on"):
        RecordingWriter("/dev/full", {}, overwrite=True)


def test_an_existing_file_is_not_replaced_unasked(tmp_path):
    path = tmp_path / "a.mcap"
    write(path, make_frames(10))
    with pytest.raises(OutputError, match="is there already; give --overwrite"):
        RecordingWriter(path, {})
    write(path, make_frames(20), overwrite=True)
    assert len(all_frames(path)) == 20


def test_wrong_files_are_one_line(tmp_path):
    wrong = {"none.mcap": None, "text.mcap": b"hello", "empty.mcap": b"", "header.mcap": b"\x89MCAP0\r\n"}
    for name, content in wrong.items():
        if content is not None:
            (tmp_path / name).write_bytes(content)
        with pytest.raises(RecordingError) as reported:
            read(tmp_path / name)
        assert (
            name in str(reported.value) and "whisker record" in str(reported.value) and "\n" not in str(reported.value)
        )


class Clocks:
    """A host whose clocks stand where they are put."""

    def __init__(self):
        self.monotonic, self.wall = 100 * 10**9, 1_700_000_000 * 10**9

    def timeline(self):
        return Timeline(lambda: self.monotonic, lambda: self.wall)

    def pass_by(self, ns):
        self.monotonic += ns
        self.wall += ns


def test_times_do_not_go_back_when_the_wall_clock_does():
    host = Clocks()
    line = host.timeline()
    times = [line.of(0, None)]
    host.pass_by(10**9)
    host.wall -= 3600 * 10**9
    times += [line.of(LIMITS["clock_hz"], None), line.now()]
    assert times == [host.wall + 3599 * 10**9, host.wall + 3600 * 10**9, host.wall + 3600 * 10**9]
    assert line.wall_step_ns() == -3600 * 10**9 and line.wall_step_ns() == 0


def test_times_follow_the_bridge_or_its_mapping():
    host = Clocks()
    line, hz = host.timeline(), LIMITS["clock_hz"]
    begun = line.of(5 * hz, None)
    assert line.of(65 * hz, None) - begun == 60 * 10**9  # a replay at speed: the bridge's seconds count
    assert line.of(3 * hz, None) - begun == 60 * 10**9  # begun anew: not back
    assert line.of(4 * hz, None) - begun == 61 * 10**9
    mapped = Clock(4 * hz, host.monotonic + 62 * 10**9, 0, 1e9 / hz, 1e3)
    assert line.of(5 * hz, mapped) - begun == 62 * 10**9  # a stale mapping is not followed
    host.pass_by(62 * 10**9)
    assert line.of(5 * hz, mapped) - begun == 63 * 10**9
    assert line.of(2**64 - 1, None) - begun < 100 * 10**9  # nonsense in a frame is no time


def test_the_wall_clock_set_is_an_event(tmp_path):
    host, name = Clocks(), ring_name()
    with Writer(name, CAPACITY) as ring, Reader(name) as reader:
        recorder = Recorder(reader, RecordingWriter(tmp_path / "a.mcap", {}), host.timeline())
        ring.publish(make_frames(200))
        host.wall -= 5 * 10**9
        recorder.step(True)
        recorder.finish()
    with read(tmp_path / "a.mcap") as recording:
        assert [(event.kind, event.step_ns) for event in recording.events()] == [("clock set", -5 * 10**9)]


def test_a_missing_ring_is_reported_while_recording(tmp_path):
    name = ring_name()
    with pytest.raises(RingError, match="start whiskerd"):
        Reader(name)


def test_blocks_say_what_ros_expects():
    block = encode_block(make_frames(3))
    assert block["cdr_header"] == b"\x00\x01" and block.tobytes()[:4] == b"\x00\x01\x00\x00"


def test_blocks_whose_columns_differ_in_length_are_none():
    block = encode_block(make_frames(3))
    assert len(decode_block(block.tobytes())[1]) == 3
    for field in ("tick_count", "flags_count", "lanes_count"):
        wrong = block.copy()
        wrong[field] += 1
        with pytest.raises(MessageError):
            decode_block(wrong.tobytes())
    wrong = block.copy()
    wrong["lanes"]["status_count"][27] = 2
    with pytest.raises(MessageError, match="differ in length"):
        decode_block(wrong.tobytes())


def test_hostile_lengths_cost_no_memory(tmp_path):
    path = tmp_path / "a.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + b"\x06" + (2**62).to_bytes(8, "little") + b"x" * 100)
    with McapFile(path) as file:
        assert list(file.messages()) == [] and "within a record" in file.damage[0]


def test_mutated_files_end_in_frames_or_one_line():
    readable, frames = fuzz(4000, seed=7).values()
    assert 200 < readable < 2000 and frames > 1000  # the mutations reach behind the header, and hurt
