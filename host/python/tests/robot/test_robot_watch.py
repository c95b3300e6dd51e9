"""Heartbeat, watchdog and logs: what a process and who started it know of each other."""

import os
import socket

import pytest

from crunchbot.errors import UserError
from crunchbot.robot.processes.lifeline import SILENT_S, VARIABLE, Heartbeat, Pulse
from crunchbot.robot.processes.logs import last_line, run_folder
from crunchbot.robot.processes.watchdog import LOOK_MOST_S, TIMEOUT_S, Watchdog

SPARSE_BYTES = 1 << 36


class Clock:
    now = 10.0

    def __call__(self) -> float:
        return self.now


def test_a_heartbeat_beats_falls_silent_comes_back_and_ends():
    clock, pulse = Clock(), Pulse()
    heart = Heartbeat(os.dup(pulse.reading), clock)
    clock.now += SILENT_S
    assert not heart.beats
    pulse.beat()
    assert heart.beats and not heart.ended
    clock.now += 0.9 * SILENT_S
    assert heart.beats
    clock.now += 0.2 * SILENT_S
    assert not heart.beats
    pulse.close()
    assert heart.ended and not heart.beats


def test_a_heartbeat_is_never_waited_for_whatever_pipe_it_comes_by():
    reading, writing = os.pipe()
    clock = Clock()
    heart = Heartbeat(reading, clock)
    assert not os.get_blocking(reading)
    clock.now += SILENT_S
    assert not heart.beats and not heart.ended
    os.close(writing)
    assert heart.ended
    os.close(reading)


def test_a_child_that_reads_nothing_holds_nobody_up():
    pulse = Pulse()
    for _ in range(1 << 17):
        pulse.beat()
    os.close(pulse.reading)
    pulse.reading = -1
    pulse.beat()
    pulse.close()


def test_without_a_supervisor_the_heart_always_beats(monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)
    heart = Heartbeat.of_environment()
    assert heart.beats and not heart.ended


@pytest.mark.parametrize("text", ["", "none", "-1", "987654"])
def test_a_heartbeat_that_is_none_is_reported(monkeypatch, text):
    monkeypatch.setenv(VARIABLE, text)
    with pytest.raises(UserError, match=VARIABLE):
        Heartbeat.of_environment()


def say(watchdog: Watchdog, text: bytes) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
        sender.sendto(text, "\0" + watchdog.variables["NOTIFY_SOCKET"][1:])


def looks(watchdog: Watchdog, clock: Clock, seconds: float) -> bool:
    """Whether it bites within so many seconds of looks."""
    until = clock.now + seconds
    while clock.now < until:
        clock.now += LOOK_MOST_S / 2
        if watchdog.bites(clock.now):
            return True
    return False


def test_a_watchdog_bites_who_was_ready_and_then_silent():
    clock, watchdog = Clock(), Watchdog()
    assert not looks(watchdog, clock, 100 * TIMEOUT_S), "not yet ready"
    say(watchdog, b"READY=1\nSTATUS=drives the base")
    assert not looks(watchdog, clock, 0.8 * TIMEOUT_S)
    say(watchdog, b"WATCHDOG=1")
    assert not looks(watchdog, clock, 0.8 * TIMEOUT_S)
    assert looks(watchdog, clock, TIMEOUT_S)
    say(watchdog, b"STOPPING=1")
    assert not looks(watchdog, clock, 10 * TIMEOUT_S)
    watchdog.close()


def test_time_in_which_nobody_looked_is_not_the_programs():
    """As when both were stopped, or the machine was."""
    clock, watchdog = Clock(), Watchdog()
    say(watchdog, b"READY=1")
    assert not looks(watchdog, clock, 0.5 * TIMEOUT_S)
    clock.now += 1000.0
    assert not watchdog.bites(clock.now)
    say(watchdog, b"WATCHDOG=1")
    assert not looks(watchdog, clock, 0.8 * TIMEOUT_S)
    watchdog.close()


def test_the_last_line_of_any_log_is_found(tmp_path):
    log = tmp_path / "log"
    assert last_line(log) == ""
    log.write_bytes(b"one\n2026-11-22 18:00:49.153 port \xe9: gone\nprogress 1 2\n")
    assert last_line(log) == "port \ufffd: gone"
    with log.open("r+b") as file:
        file.truncate(SPARSE_BYTES)
        file.seek(0, os.SEEK_END)
        file.write(b"\nthe end\n")
    assert last_line(log) == "the end"


def test_every_run_has_a_folder_of_its_own(tmp_path):
    folders = {run_folder(tmp_path / "logs") for _ in range(5)}
    assert len(folders) == 5 and all(folder.is_dir() for folder in folders)
