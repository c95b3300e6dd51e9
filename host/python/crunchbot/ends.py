"""How a program ends: its exit code, and one line for whatever a person can mend, a full disk behind its output too."""

import contextlib
import io
import signal
import sys
import threading
from collections.abc import Callable, Iterator

from .errors import UserError

INTERRUPTED = 130  # the shell's exit code for Ctrl-C
AGAIN_S = 0.05  # a destructor is over by then; if not, the interrupt comes once more


class OutputError(UserError):
    """Standard output takes no more."""

    exit_code = 1


class _Output(io.FileIO):
    """A file descriptor that fails once, with an error of ours, and then takes everything: what is still in buffers when
    the program ends makes no second complaint."""

    failed = False

    def write(self, data) -> int | None:
        if self.failed:
            return len(data)
        try:
            return super().write(data)
        except BrokenPipeError:
            self.failed = True
            raise
        except OSError as error:
            self.failed = True
            raise OutputError(
                f"standard output: {error.strerror}; make room there, or send it to another place"
            ) from error


def exit_code(program: str, work: Callable[[], int]) -> int:
    """Do the work of a program and give its exit code."""
    try:
        with _checked_output(), _kept_interrupts():
            return _code_of(work)
    except BrokenPipeError:  # the reader of our output has gone: not our trouble
        return 0
    except KeyboardInterrupt:
        return INTERRUPTED
    except (UserError, ExceptionGroup) as raised:
        error = _innermost(raised)
        if not isinstance(error, UserError):
            raise
        print(f"{program}: {error}", file=sys.stderr)
        return error.exit_code


def _code_of(work: Callable[[], int]) -> int:
    """The work's exit code, once all that it has printed is written."""
    try:
        code = work()
    except SystemExit as leaving:  # help, or wrong arguments
        code = leaving.code or 0
    sys.stdout.flush()
    return code


@contextlib.contextmanager
def _kept_interrupts() -> Iterator[None]:
    """Python drops an exception that is raised in a destructor. An interrupt that came there comes again, behind it."""
    before = sys.unraisablehook

    def hook(dropped) -> None:
        if not issubclass(dropped.exc_type, KeyboardInterrupt):
            before(dropped)
            return
        signal.signal(signal.SIGINT, signal.default_int_handler)
        main = threading.main_thread().ident
        threading.Timer(AGAIN_S, signal.pthread_kill, (main, signal.SIGINT)).start()

    sys.unraisablehook = hook
    try:
        yield
    finally:
        sys.unraisablehook = before


def _innermost(error: Exception) -> Exception:
    """The only error of a group, as tasks raise it."""
    while isinstance(error, ExceptionGroup) and len(error.exceptions) == 1:
        error = error.exceptions[0]
    return error


@contextlib.contextmanager
def _checked_output() -> Iterator[None]:
    """Standard output by way of _Output, where it is a file."""
    before = sys.stdout
    try:
        raw = _Output(before.fileno(), "wb", closefd=False)
    except (OSError, ValueError, AttributeError):
        yield
        return
    before.flush()
    sys.stdout = io.TextIOWrapper(
        io.BufferedWriter(raw), before.encoding, before.errors, line_buffering=before.line_buffering
    )
    try:
        yield
    finally:
        try:
            sys.stdout.flush()
        finally:
            sys.stdout = before
