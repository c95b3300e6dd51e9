"""What `whisker robot` says while it runs: the page's address, and what share of the samples is lost."""

import threading

import pytest
from rings import make_frames, ring_name

from crunchbot.bridge.ring import Writer
from crunchbot.robot import terminal
from crunchbot.robot.terminal import Terminal

STATS = {"started_ns": 1, "connected": 1}


@pytest.fixture
def watched(monkeypatch, tmp_path):
    """(terminal on a ring that is not there yet, what it said, a call that lets time pass, the page's log)."""
    said, clock = [], [0.0]
    monkeypatch.setattr(terminal.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(terminal, "Flow", lambda: terminal_flow(lambda: clock[0]))
    made = Terminal(ring_name(), tmp_path / "view.log", 1.0, threading.Event(), said.append)
    return made, said, lambda s: clock.__setitem__(0, clock[0] + s), tmp_path / "view.log"


terminal_flow = terminal.Flow


def test_the_pages_address_is_said_once_it_is_up(watched):
    made, said, _, log = watched
    made.look()
    log.write_text("2026-11-28 started as process 7\n")
    made.look()
    assert said == []
    log.write_text("started as process 7\n12:00:01 http://127.0.0.1:8028/\n")
    made.look()
    made.look()
    assert said == ["the robot's page: http://127.0.0.1:8028/"]


def test_a_loss_is_said_within_two_seconds_and_not_at_every_look(watched):
    made, said, passes, _ = watched
    with Writer(made._ring) as writer:
        writer.set_stats(**STATS)
        for step in range(8):
            writer.publish(make_frames(1000, first=1000 * step))
            writer.set_stats(**STATS, frames_missing=250 * step, frames_dropped=250 * step)
            made.look()
            passes(0.5)
    (line,) = said
    assert line.startswith("warning: 20 % of the samples are lost: the bridge dropped them") and "--pace 0.3" in line


def test_a_robot_that_is_slower_than_asked_is_said(watched):
    made, said, passes, _ = watched
    with Writer(made._ring) as writer:
        writer.set_stats(**STATS)
        for step in range(8):
            writer.publish(make_frames(300, first=300 * step))
            made.look()
            passes(0.5)
    (line,) = said
    assert line.startswith("warning: the robot runs at 0.30 of real time, not 1; ")


def test_a_ring_that_went_and_came_is_looked_at_anew(watched):
    made, said, passes, _ = watched
    for _ in range(2):
        with Writer(made._ring) as writer:
            writer.set_stats(**STATS)
            for step in range(3):
                writer.publish(make_frames(1000, first=1000 * step))
                made.look()
                passes(0.5)
        made.look()
    assert said == []
