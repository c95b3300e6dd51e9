"""The file behind a recording: whole up to its last flush, and from there to the disk by a thread of its own.

A write ends when the kernel has the data, fdatasync when the disk has them. A slow card needs seconds for that; the
thread waits for it, so that the process that records does not.
"""

import os
import stat
import threading
from contextlib import ExitStack
from pathlib import Path
from typing import BinaryIO

from ..errors import UserError
from ..outputs import opened, sync_folder


class Syncer:
    """Brings a file to the disk, by a thread: at most one fdatasync at a time, however many are asked for meanwhile.

    The first one syncs the file's directory too: without it a power cut may take the name. `error`: what fdatasync
    failed with. It ends the syncing, because the kernel reports lost data only once.
    """

    def __init__(self, file: BinaryIO):
        """`file`: an open regular file; stays the caller's to close, after `stop`."""
        self._file, self._wanted, self._stopping = file, threading.Event(), False
        self.error: OSError | None = None
        self._thread = threading.Thread(target=self._run, name="sync", daemon=True)
        self._thread.start()

    def request(self) -> None:
        """All that is written by now is to be on the disk soon."""
        self._wanted.set()

    def stop(self) -> None:
        """Return when all that is written is on the disk, or `error` says why not."""
        self._stopping = True
        self._wanted.set()
        self._thread.join()

    def _run(self) -> None:
        try:
            sync_folder(Path(self._file.name).resolve().parent)
            last = False
            while not last:
                self._wanted.wait()
                self._wanted.clear()
                last = self._stopping  # asked before the sync: what was written until then is in it
                os.fdatasync(self._file.fileno())
        except OSError as error:
            self.error = error


class Sink:
    """A file that remembers up to where it is whole, and goes back there when the disk is full."""

    def __init__(self, path: str | Path, overwrite: bool):
        """OutputError when there is no such place, or something is there that must not be replaced. What is replaced stays there until all is settled."""
        self._opened, self._settled = ExitStack(), False
        self._file = self._opened.enter_context(opened(path, overwrite, binary=True))
        self._place = self._whole = 0
        is_file = stat.S_ISREG(os.fstat(self._file.fileno()).st_mode)  # pipes and devices know no fdatasync
        self._syncer = Syncer(self._file) if is_file else None

    def write(self, data: bytes | memoryview) -> int:
        """All of data; OSError when there is no room."""
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) :]
        self._place += len(data)
        return len(data)

    def tell(self) -> int:
        return self._place

    def flush(self) -> None:
        """Called between records: all up to here is whole, and on its way to the disk. OSError when a sync failed."""
        if self._syncer and self._whole != self._place:
            self._syncer.request()
        self._whole = self._place
        self._raise()

    def settle(self) -> None:
        """Wait until all is on the disk; OSError when that failed."""
        if self._syncer:
            self._syncer.stop()
        self._raise()
        self._settled = True

    def cut(self) -> None:
        """Give up what came after the last flush."""
        if self._syncer:
            self._file.truncate(self._whole)

    def close(self) -> None:
        """Close, with what was written on the disk if that is to be had."""
        if self._syncer:
            self._syncer.stop()
        failed = None if self._settled else UserError()
        self._opened.__exit__(failed and type(failed), failed, None)

    def _raise(self) -> None:
        if self._syncer and self._syncer.error:
            raise self._syncer.error
