"""Finds the rings of this machine by the mark they begin with (host/libwhisker/src/ring_layout.h)."""

import os
import stat
from pathlib import Path

from ..bridge.ring import Reader, RingError

SHARED_MEMORY = Path("/dev/shm")
MARK = b"WHSKRING"
NAMES_MAX = 64  # rings offered
FILES_MAX = 4096  # looked at
NAME_CHARACTERS_MAX = 250


def find_rings(folder: Path = SHARED_MEMORY) -> list[str]:
    """Names of the rings that have a writer and that we may read, in order; none if the folder cannot be read."""
    names = []
    try:
        with os.scandir(folder) as entries:
            for _, entry in zip(range(FILES_MAX), entries, strict=False):
                if (
                    is_name(entry.name)
                    and entry.is_file(follow_symlinks=False)
                    and _is_marked(entry.path)
                    and _lives(entry.name)
                ):
                    names.append(entry.name)
    except OSError:
        return []
    return sorted(names)[:NAMES_MAX]


def is_name(text: str) -> bool:
    """Whether a ring can have this name."""
    return 0 < len(text) <= NAME_CHARACTERS_MAX and text.isascii() and text.isprintable() and "/" not in text


def _is_marked(path: str) -> bool:
    try:
        file = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        return stat.S_ISREG(os.fstat(file).st_mode) and os.pread(file, len(MARK), 0) == MARK
    except OSError:
        return False
    finally:
        os.close(file)


def _lives(name: str) -> bool:
    try:
        Reader(name).close()
    except RingError:
        return False
    return True
