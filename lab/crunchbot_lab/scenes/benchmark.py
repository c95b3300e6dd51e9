"""The benchmark "by touch": a fixed list of scenes and logs on which any engine's estimates are scored alike.

Scenes are drawn by family and seed, nothing was developed on them. Logs are other people's: they are read from the
user's folder.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from crunchbot.errors import UserError
from crunchbot.files import UnreadableError, read_json
from crunchbot.nav import localise
from crunchbot.nav.estimates import Estimates
from crunchbot.nav.observations import Observations, observations_path, read_observations
from crunchbot.scene import Scene, load

from .making import make
from .recordings import read_recording
from .thymio import published

SEED = 7000
FAMILIES = (
    "anchor",
    "robot",
    "anchor+global",
    "free+global",
    "raw+global",
    "ring+global",
    "anchor+kidnap",
    "anchor+slip",
)
LOGS = ("thymio/random_1", "thymio/random_2")
NAMES = (*FAMILIES, *LOGS)
STORED = Path(__file__).resolve().parents[3] / "bench/results/touch.json"  # in a source tree


class BenchmarkError(UserError):
    """A scene that is not on the list, or whose log is not there; one line."""


@dataclass(frozen=True)
class Entry:
    """One scene of the list, or a user's own; beside: the answers of others for the same rows."""

    name: str
    scene: Scene
    observations: Observations
    beside: tuple[Estimates, ...] = ()


def entry(name: str, data: str | None = None) -> Entry:
    """A scene of NAMES, or of a scene folder. `data`: folder of the logs, with one folder per kind (data/thymio/...) or
    that kind's own folder. BenchmarkError, SceneError or TableError when it cannot be had."""
    if name in FAMILIES:
        made = make(name, SEED)
        return Entry(name, made.scene, made.observations)
    if name in LOGS:
        place = _log(name, data)
        scene, observations = read_recording(place, kind=name.split("/")[0])
        return Entry(name, scene, observations, published(place, observations))
    if not Path(name).is_dir():
        raise BenchmarkError(f"'{name}': neither on the list nor a scene folder; choose one of {', '.join(NAMES)}")
    scene = load(name)
    return Entry(name, scene, read_observations(observations_path(name), scene))


def _log(name: str, data: str | None) -> Path:
    kind, run = name.split("/")
    if data is None:
        raise BenchmarkError(f"{name}: a log that this project does not hold; give its folder by --data")
    places = [Path(data) / kind / run, Path(data) / run]
    found = next((place for place in places if place.is_dir()), None)
    if found is None:
        raise BenchmarkError(f"{places[0]}: no such folder; give the folder that holds {kind}/{run} or {run} by --data")
    return found


def run_filter(name: str, wanted: Entry, seed: int = 0) -> Estimates:
    """One of this project's filters with its defaults, its own 90 % regions judged."""
    done = localise.run(name, wanted.scene, wanted.observations, {}, seed, localise.REGION_ROWS)
    count = len(wanted.observations)
    judged = done.levels[np.isfinite(done.levels)]
    inside = judged <= 0.9 if len(judged) else None
    return Estimates(name, np.arange(count), done.poses, done.table["confidence"], inside, done.step_us)


def stored(path: Path = STORED) -> dict[str, list[dict]]:
    """Figures of other engines by scene, as `tools/benches touch` left them; none where there is no such file."""
    try:
        reported = read_json(path) if path.exists() else {}
    except UnreadableError as error:
        raise BenchmarkError(f"{path}: {error}; make it anew with tools/benches touch") from error
    return reported if isinstance(reported, dict) else {}


def store(path: Path, scores: dict[str, list[dict]]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(scores, indent=1) + "\n")
