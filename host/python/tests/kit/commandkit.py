"""What tests of commands share: running one in this process or its own, and a ring whose writer reports itself."""

import contextlib
import sys

import pytest
from rings import ring_name

from crunchbot.bridge.ring import Clock, Writer
from crunchbot.cli import main
from whisker_protocol import LIMITS, WIRE_VERSION

STATS = {
    "started_ns": 1,
    "connected": 1,
    "usb_mbit": 12,
    "wire_version": WIRE_VERSION,
    "serial": b"B0042",
    "lane_mask": 0b101,
}


@pytest.fixture(autouse=True)
def signals_as_before(monkeypatch):
    """Commands take over signals; in this process they must not."""
    monkeypatch.setattr("crunchbot.stopping.listen", lambda *_: None)


def run(capsys, *arguments):
    """Exit code, standard output, standard error."""
    return (main([str(a) for a in arguments]), *capsys.readouterr())


def command(*arguments):
    return [sys.executable, "-m", "crunchbot.cli", *map(str, arguments)]


@contextlib.contextmanager
def live_ring(frames, **stats):
    name = ring_name()
    with Writer(name, 4096) as writer:
        writer.set_stats(**(STATS | stats))
        writer.set_clock(Clock(0, 10**9, 10**18, 1e9 / LIMITS["clock_hz"], 5000.0))
        writer.publish(frames)
        yield name
