"""Signals as the wish to end: an event that they set. No handler takes a lock, and none interrupts the ending.

A handler of Python's runs in the main thread between any two instructions, also inside `Event.set` or `Event.wait`. One
that sets an event then waits for ever for a lock which its own thread holds. So the handlers here do nothing. The
interpreter writes each signal's number into a pipe, and a thread that reads the pipe sets the event.
"""

import atexit
import os
import signal
import threading
from collections.abc import Callable

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def stop_on_signals() -> threading.Event:
    """An event that SIGINT, SIGTERM and SIGHUP set. Later ones change nothing, up to the end of the process.

    To be called by the main thread. A blocking call in the main thread goes on after a signal: look at the event often.
    """
    stop = threading.Event()
    listen(stop.set)
    return stop


def listen(heard: Callable[[], None]) -> None:
    """Call `heard` from a thread, once, when one of SIGNALS has come."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    threading.Thread(target=_await_signal, args=(reading, heard), name="signals", daemon=True).start()
    _handle(_nothing)
    atexit.register(_handle, signal.SIG_IGN)  # else the interpreter's own end gives signals their default back


def interrupt_on_signals() -> None:
    """For a program that ends by KeyboardInterrupt: the first of SIGNALS raises it, later ones change nothing."""
    _handle(_interrupt)


def _await_signal(reading: int, heard: Callable[[], None]) -> None:
    while not set(os.read(reading, 64)).intersection(SIGNALS):
        continue
    heard()


def _handle(handler) -> None:
    for number in SIGNALS:
        signal.signal(number, handler)


def _nothing(*_) -> None:
    """That there is a handler lets the interpreter note the signal."""


def _interrupt(*_) -> None:
    _handle(_nothing)
    raise KeyboardInterrupt
