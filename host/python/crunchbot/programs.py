"""The compiled programs (whiskerd, whisker-base, whisker-bridge-sim ...): where they are."""

import importlib
import os
import shutil
from pathlib import Path

from .errors import UserError

INSTALLED = ("whiskerd", "whisker-base", "whisker-flash", "whisker-log")  # of the Debian package whiskerd, too
SOURCE_TREE = Path(__file__).resolve().parents[3]


def program(name: str) -> str:
    """A program's path: from $WHISKER_BUILD, the source tree's build folder, $PATH, or the package crunchbot_sim.
    UserError where there is none."""
    places = [Path(os.environ[key]) for key in ("WHISKER_BUILD",) if key in os.environ] + [
        SOURCE_TREE / "build/release"
    ]
    for place in places:
        for path in sorted(place.rglob(name)) if place.is_dir() else []:
            if path.is_file() and os.access(path, os.X_OK):
                return str(path)
    if found := shutil.which(name):
        return found
    if found := _packaged(name):
        return found
    raise UserError(f"{name}: not found; {_remedy(name)}, or name the folder in $WHISKER_BUILD")


def _remedy(name: str) -> str:
    """Where a program comes from: no index has the wheels before a release."""
    if name.startswith("umockdev"):
        return "install umockdev"
    if name in INSTALLED:
        return "in the source tree: make build, then sudo cmake --install build/release"
    return "in the source tree: make wheels, then pip install --find-links dist crunchbot-sim"


def _packaged(name: str) -> str | None:
    """The program of the package crunchbot_sim. UserError: it is there, and libraries that it loads are not."""
    try:
        package = importlib.import_module("crunchbot_sim")
    except ModuleNotFoundError:
        return None
    if missing := package.missing_packages():
        raise UserError(f"{name}: needs Debian packages; run: apt-get install {' '.join(missing)}")
    path = package.PROGRAMS / name
    return str(path) if os.access(path, os.X_OK) else None
