"""Records while a page wants it, by a command of `whisker` that runs beside the view and ends with it."""

import time
from collections.abc import Callable
from pathlib import Path

from ..errors import UserError
from ..outputs import next_free
from ..robot.processes.children import Child, Program
from ..robot.processes.logs import last_line


class Recorder:
    """One recording at a time, each a new file of `folder`. `command`: the words that record a ring, or, without one, the
    robot, into a file; UserError where there is no robot. Never waits, but in `close`."""

    def __init__(self, folder: Path, command: Callable[[str | None, Path], list[str]]):
        self._folder, self._command = folder, command
        self._child: Child | None = None
        self._file, self._is_ending = folder, False
        self.said = ""  # of the recording that ended last, one line

    def start(self, ring: str | None) -> None:
        """UserError: one is under way, or it cannot begin."""
        if self._child:
            raise UserError(f"{self._file} is being recorded; stop that first")
        name = f"{ring or 'robot'}-{time.strftime('%Y%m%d-%H%M%S')}"
        self._file = next_free(self._folder / f"{name}.mcap")
        words = self._command(ring, self._file)
        try:
            self._child = Child(Program.of("recorder", words), self._file.with_suffix(".log"))
        except (OSError, RuntimeError) as error:
            raise UserError(f"{self._file}: no recorder could be started ({error}); try again") from error
        self._is_ending, self.said = False, ""

    def stop(self) -> None:
        """What was recorded is being written; `state` is None once it is."""
        if self._child and not self._is_ending:
            self._is_ending = True
            self._child.ask_to_end()

    def state(self) -> dict | None:
        """The recording under way: its file, and for how many whole seconds; None: there is none."""
        if self._child and not self._child.running:
            self.close()
        if self._child is None:
            return None
        return {"file": str(self._file), "for_s": int(time.monotonic() - self._child.started_s)}

    def close(self) -> None:
        """The recording under way is ended, and whole."""
        if self._child:
            child, self._child = self._child, None
            child.close()
            self.said = child.failure() if child.failed else last_line(child.log)
