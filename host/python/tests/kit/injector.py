"""A disk that fails: injector.c before the C library, in processes that are started with `environment`."""

import ctypes
import os
import subprocess
from pathlib import Path

KILLED = 137
SOURCE = Path(__file__).with_name("injector.c")


def build(folder: Path) -> Path:
    library = folder / "injector.so"
    subprocess.run(["cc", "-O1", "-shared", "-fPIC", "-o", library, SOURCE, "-ldl"], check=True)
    return library


def environment(library: Path) -> dict[str, str]:
    return os.environ | {"LD_PRELOAD": str(library)}


def arm(folder: Path, at: int = 0, error: int = 0, lasts: bool = False) -> None:
    """From here on the file operations of this process below `folder` count; the one numbered `at` fails, or ends it."""
    ctypes.CDLL(None).injector_arm(os.fsencode(folder), ctypes.c_long(at), error, int(lasts))


def counted() -> int:
    call = ctypes.CDLL(None).injector_count
    call.restype = ctypes.c_long
    return call()
