"""Text, TOML and JSON that anybody may have written: read whole or refused with a reason, in bounded memory."""

import errno
import json
import os
import stat
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

BYTES_MOST = 1 << 28  # no table, scene or model is larger


class UnreadableError(ValueError):
    """Why a file cannot be read, in a few words without the file's name: who reads it adds that and the remedy."""


def open_file(path: str | Path) -> BinaryIO:
    """Opened to be read. OSError for a pipe or a device, too: opening a pipe waits until somebody writes into it."""
    if not stat.S_ISREG(os.stat(path).st_mode) and not os.path.isdir(path):
        raise OSError(errno.EINVAL, "no regular file")
    return open(path, "rb")


def read_text(path: str | Path) -> str:
    """UTF-8, with or without a byte-order mark."""
    try:
        with open_file(path) as file:
            data = file.read(BYTES_MOST + 1)
        if len(data) > BYTES_MOST:
            raise UnreadableError(f"more than {BYTES_MOST >> 20} MiB")
        return data.decode("utf-8-sig")
    except OSError as error:
        raise UnreadableError(f"cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise UnreadableError("not a text file") from error


def read_toml(path: str | Path) -> tuple[str, dict]:
    """(source, content)"""
    source = read_text(path).replace("\r\n", "\n")
    return source, _parsed(tomllib.loads, source, "TOML")


def read_json(path: str | Path) -> object:
    return _parsed(json.loads, read_text(path), "JSON")


def _parsed(parse: Callable[[str], object], source: str, name: str):
    try:
        return parse(source)
    except RecursionError as error:
        raise UnreadableError(f"not {name} (nested too deeply)") from error
    except ValueError as error:  # an integer of thousands of digits too
        raise UnreadableError(f"not {name} ({error})") from error
