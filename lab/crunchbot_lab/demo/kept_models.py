"""Models of simulated robots, kept in the user's cache by scene and seed: the second run of a robot learns nothing.

The cache is $XDG_CACHE_HOME/crunchbot/models, or ~/.cache/crunchbot/models. A key is the digest of everything the models
follow from: the scene with its whiskers, the seed, and the programs that record and learn. To learn again, delete the folder.
"""

import hashlib
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path

import crunchbot
from crunchbot.outputs import made, put
from crunchbot.scene import Scene

from . import training

PROGRAMS = ("*.py", "*.so")


def learn_or_copy(folder: Path, scene: Scene, seed: int, progress: Callable[[], object]) -> str:
    """The models that `training.learn` gives, in `folder`; `progress()` after each. Returns what became of the cache."""
    place = cache_folder() / key_of(scene, seed)
    if place.is_dir():
        folder.mkdir(parents=True, exist_ok=True)
        for model in sorted(place.glob("*.json")):
            put(folder / model.name, model.read_bytes())
            progress()
        return f"copied from {place}"
    training.learn(folder, scene, seed, progress)
    try:
        _keep(folder, place)
    except OSError as error:  # a cache that cannot be written costs time, and nothing else
        return f"not kept for the next run: {place}: {error.strerror}"
    return f"kept in {place}"


def cache_folder() -> Path:
    """Where models are kept, by the XDG base directory specification."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".cache") / "crunchbot" / "models"


def key_of(scene: Scene, seed: int) -> str:
    """The name of a robot's models in the cache."""
    text = f"{seed}\n{training.flat(scene)}"
    return hashlib.sha256(_programs() + text.encode()).hexdigest()[:32]


@cache
def _programs() -> bytes:
    """Digest of both packages as they are installed: all that recording and learning use."""
    digest = hashlib.sha256()
    for package in (Path(crunchbot.__file__).parent, Path(__file__).parents[1]):
        for path in sorted(path for pattern in PROGRAMS for path in package.rglob(pattern)):
            digest.update(path.relative_to(package).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.digest()


def _keep(folder: Path, place: Path) -> None:
    """Copy a folder's models to their place in the cache, all or none: two runs may end at once."""
    with made(place, True, ("*.json",)) as whole:
        whole.mkdir()
        for model in folder.glob("*.json"):
            put(whole / model.name, model.read_bytes())
