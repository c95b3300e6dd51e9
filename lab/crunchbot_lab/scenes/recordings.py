"""Scenes from recordings of runs. A reader knows one kind of recording; a new kind is one more entry of READERS."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from crunchbot.errors import UserError
from crunchbot.nav.observations import Observations, observations_path, read_observations
from crunchbot.robot.bags.rows import is_bag, read_bag
from crunchbot.scene import Prior, Scene, load

from .files import rounded
from .thymio import is_thymio, read_thymio

RUN_SCENE = "scene"  # where a run of `make demo` keeps arena, robot, prior and observation rows


class RecordingKindError(UserError):
    """What is no recording that a scene can be made from; one line."""


Warn = Callable[[str], None]


def read_recording(
    path: str | Path,
    warn: Warn = lambda line: None,
    kind: str = "",
    scene: str | None = None,
    topics: Path | None = None,
) -> tuple[Scene, Observations]:
    """The scene a recording was made in and its rows; a start that the recording does not hold is uniform.

    `kind`: the one of READERS that it must be; empty: any. `scene`, `topics`: of a bag, as read_bag has them. `warn` takes a line for each damage that cost rows or may have. RecordingKindError for what no reader knows;
    SceneError and TableError for a recording whose files are broken.
    """
    path = Path(path)
    if scene or topics:
        return _with_prior(*read_bag(path, warn, scene, topics))
    for knows, read in [READERS[kind]] if kind else READERS.values():
        if knows(path):
            return read(path, warn)
    if kind:
        raise RecordingKindError(f"{path}: no recording of kind {kind}; give one, or leave the kind out")
    raise RecordingKindError(
        f"{path}: no recording with observation rows; give the folder of a run (it holds {RUN_SCENE}/), its bag, a scene, "
        "or a Thymio's recording"
    )


def _read_folder(folder: Path, warn: Warn) -> tuple[Scene, Observations]:
    scene = load(folder)
    return _with_prior(scene, read_observations(observations_path(folder), scene))


def _read_bag(path: Path, warn: Warn) -> tuple[Scene, Observations]:
    return _with_prior(*read_bag(path, warn, None, None))


def _with_prior(scene: Scene, rows: Observations) -> tuple[Scene, Observations]:
    return replace(scene, prior=scene.prior or Prior("uniform")), rounded(rows)


def _is_folder_of_rows(path: Path) -> bool:
    return observations_path(path).is_file()


def _is_run(path: Path) -> bool:
    return _is_folder_of_rows(path / RUN_SCENE)


def _read_run(path: Path, warn: Warn) -> tuple[Scene, Observations]:
    return _read_folder(path / RUN_SCENE, warn)


Reader = tuple[Callable[[Path], bool], Callable[[Path, Warn], tuple[Scene, Observations]]]
READERS: dict[str, Reader] = {
    "run": (_is_run, _read_run),
    "scene": (_is_folder_of_rows, _read_folder),
    "bag": (is_bag, _read_bag),
    "thymio": (is_thymio, read_thymio),
}
