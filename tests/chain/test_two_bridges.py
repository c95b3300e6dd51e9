"""whiskerd on two simulated bridges: one ring of 56 lanes, whatever becomes of either."""

import os
import signal
import subprocess

import numpy as np
import pytest
from chainrun import END_S, FAST_LINK, program, running

from crunchbot.bridge.ring import FRAME, Reader, Writer
from crunchbot.bridge.wide import SECOND, wide
from crunchbot.cli import main
from whisker_protocol import LANES

RING = f"whisker-two-{os.getpid()}"
MICROFRAMES = 1 << 14
GAP, PAIRS = 256, 500


def command(*events: str, second: str = "0002", words: tuple = ("--wait",)) -> list[str]:
    daemon = [program("whiskerd"), "--ring", RING, "--serial", "0001", "--second", second, *words]
    # umockdev shows a device as always ready, and an answer may take 2 ms: a transfer is to take longer
    link = [*FAST_LINK, "--batch", "16", "--lane-mask", "7", "--second-lane-mask", "3"]
    return ["umockdev-wrapper", program("two_bridges"), *events, "--", *daemon, *link]


def run(*events: str, gaps: int, until_tick: int = 0) -> tuple[np.ndarray, list[str]]:
    """All frames of the ring, up to the daemon's end, and what it logged. It is ended when so many bridges have come back,
    PAIRS ticks of both have come since then, and a tick is this far.
    """
    frames, came, pairs, ended = [], 0, 0, False
    with running(command(*events)) as process:
        with Reader(RING, wait_s=END_S) as reader:
            for view in reader.frames(END_S):
                frames.append(view.copy())
                for frame in frames[-1]["flags"]:
                    came += bool(frame & GAP)
                    pairs = 0 if frame & GAP else pairs + bool(frame & SECOND)
                if came == gaps and pairs >= PAIRS and view["tick"][-1] >= until_tick and not ended:
                    process.send_signal(signal.SIGTERM)
                    ended = True
        _, errors = process.communicate(timeout=END_S)
        assert process.returncode == 0, errors
    return np.concatenate(frames), [line for line in errors.splitlines() if line.startswith("whiskerd:")]


def of_second(frames: np.ndarray) -> np.ndarray:
    return frames["flags"] & SECOND != 0


def assert_same_moments(frames: np.ndarray, pairs: int) -> None:
    """Neighbours of one tick, of the first and of the second bridge: their SYNC was in one microframe, or in two successive ones."""
    second = of_second(frames)
    paired = np.flatnonzero(~second[:-1] & second[1:] & (frames["tick"][:-1] == frames["tick"][1:]))
    assert len(paired) >= pairs
    usb = frames["flags"].astype(np.int64) >> 16
    later = (usb[paired + 1] - usb[paired]) % MICROFRAMES
    assert np.all((later <= 1) | (later == MICROFRAMES - 1))
    assert np.array_equal(frames["time_cycles"][paired], frames["time_cycles"][paired + 1])


def test_two_bridges_are_one_ring():
    frames, lines = run(gaps=0)
    second = of_second(frames)
    begun = np.flatnonzero(second)[0] - 1
    ended = np.flatnonzero(second)[-1] + 1
    row = frames[begun:ended]
    assert_same_moments(frames, PAIRS)
    assert np.array_equal(row["sequence"], row["sequence"][0] + np.arange(len(row)))
    assert np.array_equal(row["tick"], row["sequence"] // 2)
    assert set(frames["lane_mask"][~second]) == {7} and set(frames["lane_mask"][second]) == {3}
    merged = wide(row)
    assert len(merged) == len(row) // 2 and merged.dtype["lane"].shape == (2 * LANES,)
    assert set(merged["lane_mask"].tolist()) == {7 | 3 << LANES}
    assert np.array_equal(merged["lane"][:, LANES:], row["lane"][1::2])
    assert "0 out of step, 0 times realigned" in lines[-1]


def test_nothing_is_lost_of_the_first_and_the_second_falls_into_step_again():
    frames, lines = run("600:pull:2", "900:put:2", "3200:miss:2", gaps=1, until_tick=3400)
    first = frames[~of_second(frames)]
    assert np.array_equal(first["tick"], np.arange(len(first)))
    assert_same_moments(frames, PAIRS)
    second = frames[of_second(frames)]
    assert np.all(np.diff(second["tick"].astype(np.int64)) >= 1)
    assert np.array_equal(
        np.flatnonzero(second["flags"] & GAP), np.flatnonzero(np.diff(second["tick"], prepend=0) > 300)
    )
    gone, back, *_ = (line for line in lines if "second bridge" in line)
    assert gone == "whiskerd: second bridge: the bridge was unplugged; plug it in again"
    assert back.startswith("whiskerd: second bridge: 0002 is back after")
    assert lines[-1].endswith(", 0 out of step, 2 times realigned")


def test_the_first_may_go_and_come_back():
    frames, lines = run("600:pull:1", "900:put:1", gaps=1)
    begins = np.flatnonzero(frames["flags"] & GAP)
    assert len(begins) == 1 and frames["tick"][begins[0]] == 0
    assert_same_moments(frames[: begins[0]], 300)
    assert_same_moments(frames[begins[0] :], PAIRS // 2)
    assert [line for line in lines if "unplugged" in line] == [
        "whiskerd: bridge: the bridge was unplugged; plug it in again"
    ]


def test_a_bridge_that_is_not_there_is_reported_in_one_line():
    done = subprocess.run(command(second="0003", words=()), capture_output=True, text=True, timeout=END_S)
    assert done.returncode == 1
    assert done.stderr == (
        "whiskerd: second bridge: no bridge of this serial number is connected; see whiskerd --list for those there are\n"
    )


@pytest.mark.parametrize("lost", [0, 1])
def test_a_frame_without_the_others_is_read_as_absent(lost):
    frames = np.zeros(4, FRAME)
    frames["tick"], frames["lane_mask"] = [5, 5, 6, 6], 3
    frames["flags"][1::2] = SECOND
    frames["lane"]["alpha"] = np.arange(4 * LANES).reshape(4, LANES)
    merged = wide(np.delete(frames, 2 + lost))
    assert merged["tick"].tolist() == [5, 6]
    missing, there = (merged["lane"][1, n * LANES : (n + 1) * LANES] for n in (lost, 1 - lost))
    assert np.all(missing["status"] != 0) and np.all(there["status"] == 0)
    assert np.array_equal(there["alpha"], frames["lane"]["alpha"][3 - lost])


def two_rows() -> np.ndarray:
    """Ticks 0 and 1 of both bridges; lane 2 of the first reads 100, of the second 200."""
    frames = np.zeros(4, FRAME)
    frames["sequence"], frames["tick"] = range(4), [0, 0, 1, 1]
    frames["time_cycles"], frames["lane_mask"] = frames["tick"] * 30000, 4
    frames["flags"][1::2] = SECOND
    frames["lane"]["alpha"][:, 2] = [100, 200] * 2
    return frames


def test_tools_show_the_lanes_of_both(capsys):
    with Writer(RING) as writer:
        writer.publish(two_rows())
        assert main(["stream", "--ring", RING, "--backlog", "--frames", "2"]) == 0
        header, *lines = capsys.readouterr().out.splitlines()
        assert header.split(",")[3::3] == ["lane2_alpha", "lane30_alpha"]
        assert [line.split(",")[3::3] for line in lines] == [["100", "200"]] * 2
        writer.publish(two_rows())
        assert main(["top", "--ring", RING, "--once", "--interval", "0.01"]) == 0
    lanes = [line.split()[:3] for line in capsys.readouterr().out.splitlines() if " lane" in line]
    assert lanes == [["2", "lane2", "100"], ["30", "lane30", "200"]]
