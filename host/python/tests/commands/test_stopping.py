"""What signals do to a process that ends in good order."""

import signal
import subprocess
import sys
import threading

import level0
import numpy as np
import pytest
from patience import PATIENCE_S
from rings import ring_name

from crunchbot.bridge.ring import Reader, RingError, Writer, await_reader
from crunchbot.native import lib
from crunchbot.nav import filters
from crunchbot.nav.filters import Filter

TWICE = """
import signal
from crunchbot.stopping import {use}
{before}
try:
    signal.raise_signal(signal.{first})
    {waits}
finally:
    signal.raise_signal(signal.{second})
    print("ended in order")
"""


def run(**parts) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-c", TWICE.format(**parts)], capture_output=True, text=True, timeout=PATIENCE_S
    )


@pytest.mark.parametrize("first", ["SIGINT", "SIGTERM", "SIGHUP"])
@pytest.mark.parametrize("second", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_second_signal_breaks_no_ending(first, second):
    reported = run(
        use="stop_on_signals", before="stop = stop_on_signals()", waits="stop.wait()", first=first, second=second
    )
    assert (reported.stdout, reported.stderr, reported.returncode) == ("ended in order\n", "", 0)


CLOSE = """
import os, random, signal, threading, time
from crunchbot.stopping import stop_on_signals
rng = random.Random(3)
for _ in range(300):
    stop, woken = stop_on_signals(), threading.Event()
    threading.Thread(target=lambda s=stop, w=woken: (s.wait(), w.set()), daemon=True).start()
    if os.fork() == 0:
        for number in rng.sample([signal.SIGTERM, signal.SIGHUP, signal.SIGINT], 2):
            until = time.perf_counter() + rng.uniform(0.0, 200e-6)
            while time.perf_counter() < until:
                continue
            os.kill(os.getppid(), number)
        os._exit(0)
    assert woken.wait(60)
    os.wait()
print("ended in order")
"""


def test_two_signals_close_together_hang_nobody():
    """As a dropped ssh, GNU timeout or a script sends them."""
    done = subprocess.run([sys.executable, "-c", CLOSE], capture_output=True, text=True, timeout=PATIENCE_S)
    assert (done.stdout, done.returncode) == ("ended in order\n", 0), done.stderr


def test_who_ends_by_an_interrupt_gets_one():
    reported = run(
        use="interrupt_on_signals", before="interrupt_on_signals()", waits="pass", first="SIGTERM", second="SIGINT"
    )
    assert reported.stdout == "ended in order\n" and reported.stderr.count("Traceback") == 1
    assert reported.returncode == -signal.SIGINT


def test_a_ring_is_not_waited_for_when_it_is_to_stop():
    stop = threading.Event()
    stop.set()
    with pytest.raises(KeyboardInterrupt):
        await_reader("whisker-test-no-such-ring", 1e6, stop)
    with pytest.raises(RingError):
        await_reader("whisker-test-no-such-ring", 0.0, threading.Event())


def test_a_wait_for_a_ring_without_an_end_hears_signals_and_the_wish_to_stop():
    """The library waits in C: in one piece it would hear neither."""
    stop = threading.Event()
    threading.Timer(0.3, stop.set).start()
    with pytest.raises(RingError, match="there is no ring"):
        Reader("whisker-test-nosuch", None, stop=stop)
    name = ring_name()
    with Writer(name) as ring, Reader(name) as reader:
        for call in (lambda: Reader("whisker-test-nosuch", None), lambda: reader.wait(None)):
            before = signal.signal(signal.SIGALRM, signal.default_int_handler)
            signal.setitimer(signal.ITIMER_REAL, 0.3)
            with pytest.raises(KeyboardInterrupt):
                call()
            signal.signal(signal.SIGALRM, before)
        ring.close()
        threading.Timer(0.3, stop.set).start()
        stop.clear()
        with pytest.raises(RingError):
            reader.reattach(None, stop)


def test_a_filter_hears_signals_between_rows(monkeypatch):
    """A call of the library hears none: it is given few rows, and all of them in their order."""
    scene, observations = level0.record(3, rows=47)
    calls = []

    class Library:
        def __getattr__(self, name):
            return getattr(lib, name)

        def nav_replay(self, made, rows, first, count, *out):
            calls.append((first, count))
            lib.nav_replay(made, rows, first, count, *out)

    monkeypatch.setattr(filters, "lib", Library())
    table, step_us = Filter("grid", scene).replay(observations, 3, 44)
    assert calls == [(first, min(10, 47 - first)) for first in range(3, 47, 10)]
    monkeypatch.setattr(filters, "HEARD", 100)
    whole, _ = Filter("grid", scene).replay(observations, 3, 44)
    assert np.array_equal(table, whole) and (step_us > 0).all()
