"""Damaged recordings: what is not hit is read, and what is lost is counted."""

import io
import struct

import mcap.reader
import mcap.stream_reader
import numpy as np
import pytest
from fuzz_damage import bag, fuzz, loose, loose_original, ring_recording
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk
from mcap.writer import Writer

from crunchbot.recording import RecordingError, read, salvage
from crunchbot.recording.mcapfile import McapFile

SECONDS = 4
BLOCKS = 10 * SECONDS
PER_CHUNK = 10


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """(bytes, places of the chunks) of a recording with a chunk each second."""
    path = tmp_path_factory.mktemp("whole") / "a.mcap"
    ring_recording(path, SECONDS)
    return path.read_bytes(), chunks_of(path)


def chunks_of(path) -> list[tuple[int, int]]:
    with path.open("rb") as file:
        indexes = mcap.reader.make_reader(file).get_summary().chunk_indexes
    return sorted((index.chunk_start_offset, index.chunk_start_offset + index.chunk_length) for index in indexes)


def look(path, data) -> tuple[list[int], list[str]]:
    """(numbers of the blocks that are read, damage) of a recording; it is complete just when nothing is damaged."""
    path.write_bytes(data)
    with read(path) as recording:
        blocks = [int(frames["tick"][0]) // 200 for frames in recording.blocks()]
        assert recording.complete == (not recording.damage)
        return blocks, [line.removeprefix(f"{path}: ") for line in recording.damage]


def flip(data: bytes, place: int, bit: int) -> bytes:
    out = bytearray(data)
    out[place] ^= 1 << bit
    return bytes(out)


def without(chunk: int) -> list[int]:
    return [n for n in range(BLOCKS) if n // PER_CHUNK != chunk]


def test_a_whole_recording_is_complete(tmp_path, whole):
    assert look(tmp_path / "a.mcap", whole[0]) == (list(range(BLOCKS)), [])


def test_each_chunk_describes_the_channels_that_it_uses(tmp_path, whole):
    chunks = [
        r
        for r in mcap.stream_reader.StreamReader(io.BytesIO(whole[0]), emit_chunks=True).records
        if isinstance(r, Chunk)
    ]
    for chunk in chunks:
        topics = {r.topic for r in mcap.stream_reader.breakup_chunk(chunk, True) if isinstance(r, Channel)}
        assert {"/whisker/frames", "/whisker/health"} <= topics
    start, end = whole[1][0]
    cut_off = flip(whole[0][: whole[1][-1][1]], (start + end) // 2, 3)
    blocks, damage = look(tmp_path / "a.mcap", cut_off)
    assert blocks == without(0) and any("/whisker/frames: at least 10 messages are lost" in line for line in damage)


def test_channels_are_read_from_the_index_too(tmp_path):
    """Files of others, and ours of before, describe a channel in the first chunk alone."""
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/a", "cdr", writer.register_schema("b/msg/C", "ros2msg", b""))
        for k in range(4):
            writer.add_message(channel, k, bytes(100), k)
            writer.flush()
        writer.finish()
    start, end = chunks_of(path)[0]
    path.write_bytes(flip(path.read_bytes(), end - 5, 0))
    with McapFile(path) as file:
        assert [message.log_time for message in file.messages()] == [1, 2, 3]
        assert any("/a: 1 of 4 messages are lost" in line for line in file.damage) and not file.complete


@pytest.mark.parametrize("bit", range(8))
def test_a_chunk_under_another_opcode_costs_itself_and_is_counted(tmp_path, whole, bit):
    blocks, damage = look(tmp_path / "a.mcap", flip(whole[0], whole[1][2][0], bit))
    assert blocks == without(2) and f"/whisker/frames: 10 of {BLOCKS} messages are lost" in damage


@pytest.mark.parametrize("offset", [1, 9 + 28 + 8])  # the record's length, the length of what is packed in it
@pytest.mark.parametrize("bit", [0, 4, 13, 25, 40, 63])
def test_a_damaged_length_loses_nothing(tmp_path, whole, offset, bit):
    blocks, damage = look(tmp_path / "a.mcap", flip(whole[0], whole[1][1][0] + offset + bit // 8, bit % 8))
    assert blocks == list(range(BLOCKS)) and "a chunk whose length is damaged" in damage[0] and len(damage) == 1


def test_zeros_over_the_end_of_one_chunk_and_the_head_of_the_next_cost_these_two(tmp_path, whole):
    data, chunks = whole
    place = chunks[1][1] - 2000
    assert chunks[2][0] < place + 4096 < chunks[2][1]
    blocks, damage = look(tmp_path / "a.mcap", data[:place] + bytes(4096) + data[place + 4096 :])
    assert blocks == [n for n in range(BLOCKS) if n // PER_CHUNK in (0, 3)]
    assert f"/whisker/frames: 20 of {BLOCKS} messages are lost" in damage
    assert damage[-1] == f"4000 of {2000 * SECONDS} frames are lost"


@pytest.mark.parametrize("is_cut_off", [False, True])
def test_a_chunk_that_is_not_there_is_reported(tmp_path, whole, is_cut_off):
    data, chunks = whole
    first, last = chunks[2][0], chunks[3][0]  # with the index records behind it
    data = data[:first] + data[last : chunks[3][1] if is_cut_off else None]
    blocks, damage = look(tmp_path / "a.mcap", data)
    assert blocks == without(2)
    reported = "at least 10 messages are lost" if is_cut_off else f"10 of {BLOCKS} messages are lost"
    assert f"/whisker/frames: {reported}" in damage
    if not is_cut_off:
        assert "the index at its end counts 4 chunks; 3 are whole" in damage


def test_a_chunk_twice_is_reported(tmp_path, whole):
    data, chunks = whole
    first, last = chunks[1][0], chunks[2][0]
    _, damage = look(tmp_path / "a.mcap", data[:last] + data[first:last] + data[last:])
    assert "/whisker/frames: 10 messages more than were written" in damage
    assert any("/whisker/frames: 1 messages out of order" in line for line in damage)


def test_a_page_of_zeros_at_the_beginning_costs_the_first_chunk(tmp_path, whole):
    data, path = bytes(4096) + whole[0][4096:], tmp_path / "a.mcap"
    for content in (data, data[: whole[1][-1][1]]):
        blocks, damage = look(path, content)
        assert blocks == without(0) and "does not begin as an MCAP file does" in damage[0]
        with read(path) as recording:
            assert recording.lane_names[:2] == ("left", "right")


def test_a_format_that_one_bit_made_new_is_no_newer_release(tmp_path, whole):
    place = whole[0].index(b"format\x01\x00\x00\x001") + 10
    blocks, damage = look(tmp_path / "a.mcap", flip(whole[0], place, 1))
    assert blocks == list(range(BLOCKS)) and "beside the messages" in damage[0]


def test_every_byte_of_head_and_end_is_accounted_for(tmp_path, whole):
    """All that is no chunk: a bit of it that is wrong loses no message, and is reported."""
    data, chunks = whole
    beside = [*range(chunks[0][0]), *range(chunks[-1][1], len(data))]
    for place in beside[:: len(beside) // 150]:
        blocks, damage = look(tmp_path / "a.mcap", flip(data, place, place % 8))
        assert blocks == list(range(BLOCKS)) and damage, place


def test_files_of_other_kinds_are_refused_at_once(tmp_path):
    path = tmp_path / "a.mp4"
    path.write_bytes(np.random.default_rng(1).bytes(1 << 20))
    with pytest.raises(RecordingError, match="not an MCAP file; give"):
        McapFile(path)
    path.write_text(f"version https://git-lfs.github.com/spec/v1\noid sha256:{64 * '0'}\nsize 12345\n")
    with pytest.raises(RecordingError, match="not an MCAP file but its Git LFS pointer; fetch it by 'git lfs pull'"):
        McapFile(path)


def test_a_file_made_to_cost_time_is_given_up(tmp_path, monkeypatch):
    """Heads of chunks within heads of chunks, each of which seems to hold all that is behind it."""
    monkeypatch.setattr(salvage, "VAIN_MOST", 1 << 20)
    body = b""
    for _ in range(300):
        inner = (
            struct.pack("<QQQI", 0, 0, 1 << 16, 1)
            + struct.pack("<I", 4)
            + b"zstd"
            + struct.pack("<Q", len(body))
            + body
        )
        body = struct.pack("<BQ", 6, len(inner)) + inner
    path = tmp_path / "a.mcap"
    path.write_bytes(salvage.MAGIC + bytes(9) + body)
    with McapFile(path) as file:
        assert list(file.messages()) == [] and any("looks like records and is none" in line for line in file.damage)


def test_damage_is_listed_up_to_a_bound(tmp_path):
    path = tmp_path / "a.mcap"
    bag(path, 150)
    data = bytearray(path.read_bytes())
    for start, end in chunks_of(path):
        data[(start + end) // 2] ^= 1
    path.write_bytes(data)
    with McapFile(path) as file:
        assert list(file.messages()) == [] and 100 < len(file.damage) < 110
        assert any("more is damaged than is listed" in line for line in file.damage)
        assert any("/robot/truth: 1500 of 1500 messages are lost" in line for line in file.damage)


@pytest.fixture
def without_chunks(tmp_path):
    """(path, bytes, places of the messages) of a file without chunks, half of whose messages are of each topic."""
    loose(tmp_path / "a.mcap", SECONDS)
    made = loose_original(tmp_path / "a.mcap")
    return tmp_path / "a.mcap", made.data, made.chunks


def times(path, data) -> tuple[list[int], list[str]]:
    path.write_bytes(data)
    with McapFile(path) as file:
        found = [message.log_time // 10**8 for message in file.messages()]
        return found, [line.removeprefix(f"{path}: ") for line in file.damage]


EACH = [n // 2 for n in range(2 * BLOCKS)]


def test_a_whole_file_without_chunks_is_complete(without_chunks):
    path, data, _ = without_chunks
    assert times(path, data) == (EACH, [])


@pytest.mark.parametrize("bit", [0, 3, 9, 25, 60])
def test_a_message_of_a_wrong_length_costs_itself_alone(without_chunks, bit):
    path, data, places = without_chunks
    found, damage = times(path, flip(data, places[20][0] + 1 + bit // 8, bit % 8))
    assert [n for n in found if n != 10] == [n for n in EACH if n != 10] and damage


def test_a_message_that_was_changed_is_not_called_whole(without_chunks):
    path, data, places = without_chunks
    found, damage = times(path, flip(data, places[20][1] - 4, 2))
    assert found == EACH and damage == [damage[0]] and "messages may be changed" in damage[0]


def test_a_page_of_zeros_over_messages_costs_these(without_chunks):
    path, data, places = without_chunks
    start, end = places[20][0], places[24][1]
    found, damage = times(path, data[:start] + bytes(end - start) + data[end:])
    assert found == EACH[:20] + EACH[25:]
    assert f"/robot/pose/grid: 3 of {BLOCKS} messages are lost" in damage


def test_a_file_without_chunks_is_read_to_where_it_is_cut_off(without_chunks):
    path, data, places = without_chunks
    found, damage = times(path, data[: places[30][1] - 1])
    assert found == EACH[:30] and "ends within a record" in damage[0]


def test_no_more_is_lost_than_was_hit_and_none_of_it_unsaid():
    counts = fuzz(240, seed=5)
    assert sum(counts.values()) == 240 and any("lost and counted" in what for what in counts)


def test_metadata_that_disagree_are_reported_of_a_file_that_was_cut_off(tmp_path, whole):
    data = whole[0][: whole[1][-1][1]]
    place = data.index(b"left,right")
    _, damage = look(tmp_path / "a.mcap", flip(data, place, 0))
    assert "its metadata records disagree; the later one counts" in damage
    _, damage = look(tmp_path / "a.mcap", data)
    assert not any("disagree" in line for line in damage)


def test_a_chunks_index_that_looks_like_a_message_is_none(tmp_path, whole):
    data, chunks = whole
    place = chunks[0][1]
    assert data[place] == Opcode.MESSAGE_INDEX == Opcode.MESSAGE ^ 2
    blocks, damage = look(tmp_path / "a.mcap", flip(data, place, 1))
    assert blocks == list(range(BLOCKS)) and "a message beside the chunks" in damage[0]
