"""Named checks of parts that may be there or not: one line each, skipped by name with the reason, counted at the end."""

import time
from collections.abc import Callable
from typing import NoReturn

LOOK_S = 0.01  # between two looks at something that is waited for


class CheckError(Exception):
    """Something is not as it should be: what, and the remedy."""


class SkipError(Exception):
    """The check cannot be made: which part or permission is not there."""


def require(ok: bool, text: str) -> None:
    """CheckError with this text unless it is so."""
    if not ok:
        raise CheckError(text)


def until(condition: Callable[[], bool], patience_s: float, progress: Callable[[], object], text: str) -> None:
    """Looks until it is so; CheckError with this text when `progress()` has not changed for `patience_s`."""
    seen, since = progress(), time.monotonic()
    while not condition():
        if (now := progress()) != seen:
            seen, since = now, time.monotonic()
        require(time.monotonic() - since < patience_s, text)
        time.sleep(LOOK_S)


class Checks:
    """Runs checks one by one and counts; a failed one does not keep the next from running."""

    def __init__(self, wanted: list[str]):
        """wanted: beginnings of the names of those that are run; empty: all."""
        self._wanted = wanted
        self.passed = self.failed = self.skipped = 0

    def run(self, name: str, check: Callable[[], str]) -> None:
        """Run one; what it returns, or what it raises, is reported beside its name."""
        if self._wanted and not name.startswith(tuple(self._wanted)):
            return
        try:
            reported = check()
        except SkipError as reason:
            self.skipped += 1
            print(f"skip {name}: {reason}: skipped", flush=True)
        except (CheckError, OSError) as error:
            self.failed += 1
            print(f"FAILED {name}: {error}", flush=True)
        else:
            self.passed += 1
            print(f"ok {name}: {reported}", flush=True)

    def end(self) -> int:
        """The last line, and the exit code: 1 if anything failed."""
        if self.passed + self.failed == 0:
            print(f"all {self.skipped} skipped: no hardware was tested", flush=True)
        else:
            print(f"{self.passed} passed, {self.failed} failed, {self.skipped} skipped", flush=True)
        return 1 if self.failed else 0


def skip(reason: str) -> NoReturn:
    """SkipError, where an expression is wanted."""
    raise SkipError(reason)
