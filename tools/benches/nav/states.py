"""States of the filters that are compared: a source tree with its compiled module, a filter and its settings. All of them
answer in one process, so that times of one draw can be compared."""

import hashlib
import importlib
import json
import sys
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

import numpy as np

import crunchbot

MODULES = ("nav.localise", "nav.observations", "scene")
REMEDY = "`tools/build.sh build/release demo`, in that tree, makes it"


@dataclass(frozen=True)
class Answers:
    """Of one state, row by row; levels and areas at the rows that are judged."""

    poses: np.ndarray
    confidence: np.ndarray
    levels: np.ndarray
    us: np.ndarray


@dataclass(frozen=True)
class State:
    """As `stated` reads it; `compiled` is a digest of the module."""

    words: str
    filter: str
    settings: dict[str, float]
    compiled: str
    modules: dict[str, ModuleType] = field(compare=False, repr=False)

    def answer(self, folder: Path, seed: int, regions: int) -> Answers:
        """To the scene and the rows of a folder."""
        scene = self.modules["scene"].load(folder)
        rows = self.modules["nav.observations"].read_observations(folder / "observations.csv", scene)
        run = self.modules["nav.localise"].run(self.filter, scene, rows, self.settings, seed, regions)
        return Answers(run.poses, run.table["confidence"], run.levels, run.step_us)

    def identity(self) -> str:
        return json.dumps([self.filter, self.settings, self.compiled])


def stated(words: str) -> State:
    """TREE[:FILTER[:KEY=VALUE[,KEY=VALUE]...]]; without a filter the tree's default one."""
    tree, filter, settings = ([*words.split(":", 2), "", ""])[:3]
    package = Path(tree).resolve() / "host/python"
    compiled = sorted((package / "crunchbot").glob("_native*.so"))
    if not compiled:
        raise SystemExit(f"--state {words}: {package}/crunchbot has no compiled module; {REMEDY}")
    try:
        chosen = {key: float(value) for key, value in (pair.split("=") for pair in settings.split(",") if pair)}
    except ValueError as error:
        raise SystemExit(f"--state {words}: {settings}: give settings as KEY=VALUE,KEY=VALUE") from error
    try:
        modules = _modules(package)
    except (ImportError, AttributeError) as error:
        raise SystemExit(f"--state {words}: {error}; {REMEDY} anew") from error
    localise = modules["nav.localise"]
    name = filter or localise.default_filter()
    for word in {name, *chosen} - {*localise.filter_names(), *(one[0] for one in localise.settings_list())}:
        raise SystemExit(f"--state {words}: that tree has no filter or setting '{word}'; `whisker localise` lists them")
    return State(words, name, chosen, hashlib.sha256(compiled[0].read_bytes()).hexdigest(), modules)


def _modules(package: Path) -> dict[str, ModuleType]:
    """The modules of the package `crunchbot` in this folder, beside those of the same names that are imported already."""

    def imported() -> dict[str, ModuleType]:
        return {name: importlib.import_module(f"crunchbot.{name}") for name in MODULES}

    if Path(crunchbot.__file__).resolve().parents[1] == package:
        return imported()
    ours = {name: module for name, module in sys.modules.items() if name.split(".")[0] == "crunchbot"}
    sys.path.insert(0, str(package))
    try:
        for name in ours:
            del sys.modules[name]
        return imported()
    finally:
        sys.path.remove(str(package))
        for name in [name for name in sys.modules if name.split(".")[0] == "crunchbot"]:
            del sys.modules[name]
        sys.modules.update(ours)
