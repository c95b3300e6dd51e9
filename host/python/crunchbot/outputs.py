"""Everything that is written and kept: whole or not there, over nothing that somebody may want.

    with made(path, overwrite) as place:      # beside its place, on the same file system
        place.write_text(...)                 # or a folder, filled
    # to the disk, then renamed: until here what stood there is whole, from here on the new one is

`claim` refuses a place before the work is begun; the command line calls it for every argument of `arguments.add_output`.
"""

import ctypes
import errno
import os
import stat
import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from fnmatch import fnmatch
from itertools import chain, count
from pathlib import Path
from typing import IO

from .errors import UserError

AT_FDCWD, RENAME_EXCHANGE = -100, 2  # of renameat2(2)


class OutputError(UserError, OSError):
    """A place that is not written to; one line. `strerror`: what of it is wrong."""

    def __init__(self, path: str | Path, text: str, remedy: str):
        super().__init__(f"{path}: {text}; {remedy}")
        self.strerror = text

    def __str__(self) -> str:
        return self.args[0]


def unwritable(path: str | Path, error: OSError) -> OutputError:
    """What to say of a place that the system refuses."""
    return OutputError(path, f"cannot be written ({error.strerror or error})", "choose another place")


def next_free(path: Path) -> Path:
    """This path, or the first of it with -2, -3, ... that does not exist."""
    numbered = (path.with_name(f"{path.stem}-{number}{path.suffix}") for number in count(2))
    return next(candidate for candidate in chain([path], numbered) if not os.path.lexists(candidate))


def claim(path: str | Path, overwrite: bool, own: tuple[str, ...] = (), inputs: Collection[str | Path] = ()) -> None:
    """OutputError when this place may not be written to.

    own: what stands in a folder of this kind, as patterns, of which the first is always there; (): it is a file. inputs:
    what the same command reads.
    """
    for given in inputs:
        if _overlap(path, given):
            raise OutputError(path, f"is in {given}, which this command reads", "choose another place")
    kind = _kind(path)
    if kind is None or _is_stream(path):
        return
    if kind != (stat.S_IFDIR if own else stat.S_IFREG):
        raise OutputError(path, f"is there already, and no {'folder' if own else 'file'}", "choose another name")
    held = os.listdir(path) if own else []
    if own and not held:
        return
    if not overwrite:
        raise OutputError(path, "is there already", "give --overwrite, or another name")
    foreign = [name for name in held if not any(fnmatch(name, pattern) for pattern in own)]
    if foreign or (own and not any(fnmatch(name, own[0]) for name in held)):
        text = f"holds {foreign[0]}" if foreign else f"holds no {own[0]}"
        raise OutputError(path, f"{text}: it is no folder that this command writes", "choose another name")


@contextmanager
def made(
    path: str | Path, overwrite: bool = True, own: tuple[str, ...] = (), grows: bool = False, sync: bool = True
) -> Iterator[Path]:
    """Gives the place to write to, a file's or, with `own`, that of a folder; at the end it takes the place of `path`.

    grows: every beginning of it is of use, as of a recording: it has its name at once where nothing stands there, and what
    there is of it when the block fails is kept. sync: it is to outlive the machine's end, not only the process's.
    OutputError as `claim` gives it, and when it cannot be written.
    """
    claim(path, overwrite, own)
    try:
        if _is_stream(path) or (grows and _kind(path) is None):
            yield Path(path)
        else:
            yield from _beside(Path(os.path.realpath(path)), overwrite, own, grows, sync)
    except UserError:
        raise
    except OSError as error:
        raise unwritable(path, error) from error


def _beside(path: Path, overwrite: bool, own: tuple[str, ...], grows: bool, sync: bool) -> Iterator[Path]:
    if own:
        path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{path.name}-", dir=path.parent, ignore_cleanup_errors=True) as folder:
        part = Path(folder, path.name)
        try:
            yield part
        except BaseException:
            if grows and part.exists() and part.stat().st_size:
                part.rename(next_free(path))
            raise
        if sync:
            _to_disk(part)
        claim(path, overwrite, own)  # it may have come meanwhile
        _put(part, path)
        if sync:
            sync_folder(path.parent)


@contextmanager
def opened(path: str | Path, overwrite: bool = False, binary: bool = False) -> Iterator[IO]:
    """A file that grows, opened, as `made` makes it; binary: without a buffer, else text with line ends as they are given."""
    with made(path, overwrite, grows=True) as place:
        mode = ("w" if _is_stream(place) else "x") + ("b" if binary else "")
        with open(place, mode, 0 if binary else -1, newline=None if binary else "") as file:
            yield file


def put(path: str | Path, content: str | bytes, overwrite: bool = True, sync: bool = True) -> None:
    """A file of this content; OutputError as `made` gives it."""
    with made(path, overwrite, sync=sync) as place:
        place.write_bytes(content.encode() if isinstance(content, str) else content)


def put_aside(path: Path) -> Path:
    """A file that nobody here can read makes way for a new one; where it is now. OSError: it is none, or cannot be moved."""
    if not path.is_file():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    aside = next_free(path)
    path.rename(aside)
    return aside


def sync_folder(folder: Path) -> None:
    """Bring a directory to the disk, where one may open it and its file system can."""
    try:
        _sync(folder, os.O_DIRECTORY)
    except PermissionError:
        return
    except OSError as error:
        if error.errno != errno.EINVAL:
            raise


def _kind(path: str | Path) -> int | None:
    """Type bits of what a path leads to; None: there is nothing."""
    try:
        return stat.S_IFMT(os.stat(path).st_mode)
    except OSError:
        return None


def _is_stream(path: str | Path) -> bool:
    """Whether it takes what is written and keeps nothing, as /dev/null."""
    return _kind(path) in (stat.S_IFCHR, stat.S_IFIFO)


def _overlap(path: str | Path, given: str | Path) -> bool:
    """Whether writing `path` changes what stands at `given`: one is the other, or holds it, by whatever name."""
    if _kind(given) not in (stat.S_IFREG, stat.S_IFDIR) or _kind(path) is None:
        return False
    if os.path.samefile(path, given):
        return True
    place, read = Path(os.path.realpath(path)), Path(os.path.realpath(given))
    return read in place.parents or place in read.parents


def _to_disk(part: Path) -> None:
    for folder, _, files in os.walk(part):
        for name in files:
            _sync(Path(folder, name))
        sync_folder(Path(folder))
    if part.is_file():
        _sync(part)


def _sync(path: Path, flags: int = 0) -> None:
    number = os.open(path, os.O_RDONLY | flags)
    try:
        os.fsync(number)
    finally:
        os.close(number)


def _put(part: Path, path: Path) -> None:
    """In one step; a folder changes places with the one that stands there."""
    if not path.is_dir() or not os.listdir(path):
        part.rename(path)
        return
    exchange = ctypes.CDLL(None, use_errno=True).renameat2
    if exchange(AT_FDCWD, os.fsencode(part), AT_FDCWD, os.fsencode(path), RENAME_EXCHANGE):
        if ctypes.get_errno() not in (errno.EINVAL, errno.ENOSYS):
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
        path.rename(next_free(path))  # a file system that cannot exchange: the old one is kept
        part.rename(path)
