"""Arrays on their way into C: every function that hands one over refuses the shapes that C would read past.

`CASES` holds each such function with arrays that it takes; the source says which functions there are. Each axis that C
assumes a length of is made one shorter and one longer, each array gets an axis more.
"""

import ast
import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import level0
import numpy as np
import pytest
from models import CHANNELS, FEATURES, LENGTH, LIMITS, classifier, model, novelty
from rings import ring_name

import crunchbot
from crunchbot.bridge.ring import FRAME, Writer
from crunchbot.native import as_doubles, doubles, ffi, lib, octets
from crunchbot.nav.filters import COMPONENT, Filter, Sensor, pack, prior_fault
from crunchbot.nav.fit import fitted
from crunchbot.nav.mapper import OneMap
from crunchbot.planning.coverage import CoveragePlanner, Field, Vehicle
from crunchbot.touch.contact import Contact
from crunchbot.touch.contact_filter import ContactFilter
from crunchbot.touch.radial.curve import peak
from crunchbot.touch.radial.model import RadialModel
from crunchbot.touch.texture.classifier import Classifier, Reducer, blocks_of, plain_features
from crunchbot.touch.texture.model import TextureModel
from crunchbot.touch.texture.novelty import Novelty
from crunchbot.touch.texture.spectral import forward
from crunchbot_lab import signals

PACKAGE = Path(crunchbot.__file__).parent
HELPERS = {"doubles", "floats", "octets", "pointer"}
AROUND = {"cast", "from_buffer", "ctypes"}  # ways around the helpers
# Functions that hand over only arrays of their own making.
OWN = {
    "nav.filters.problem_of",
    "nav.mapper.OneMap._grid",
    "nav.mapper.OneMap._listed",
    "signals.world.World.run",
    "signals.mechanics._counts",
    "signals.mechanics.touch",
    "signals.mechanics.drag",
}
ROWS, SHAPES = 12, lib.nav_texture_shape_count(LENGTH)


class Case(NamedTuple):
    """A function that takes `arrays` by name, and the axes of each whose lengths C assumes."""

    call: Callable
    arrays: dict[str, np.ndarray]
    fixed: dict[str, tuple[int, ...]]


def of_rows(call: Callable) -> Case:
    columns = {name: getattr(OBSERVATIONS, name) for name in ("t_s", "odometry", "texture", "radial_m")}
    fixed = {"t_s": (0,), "odometry": (0, 1), "texture": (0, 1, 2), "radial_m": (0, 1)}
    return Case(lambda **changed: call(dataclasses.replace(OBSERVATIONS, **changed)), columns, fixed)


def of_part(part, call: Callable, **fixed) -> Case:
    """A part of a texture model with its arrays."""
    arrays = {name: getattr(part, name) for name in fixed}
    return Case(lambda **changed: call(dataclasses.replace(part, **changed)), arrays, fixed)


def of_one(call: Callable, name: str, array: np.ndarray, *fixed: int) -> Case:
    return Case(lambda **changed: call(changed[name]), {name: array}, {name: fixed})


def published(frames) -> None:
    with Writer(ring_name(), 64) as writer:
        writer.publish(frames)


SCENE, OBSERVATIONS = level0.record(3, rows=ROWS)
ANSWERS, _ = Filter("odometry", SCENE).replay(OBSERVATIONS, 0, ROWS)
ROW = {name: getattr(OBSERVATIONS, name)[1] for name in ("odometry", "texture", "radial_m")}
NOISE = np.random.default_rng(1).normal(0.0, 5.0, (10 * LENGTH, CHANNELS))
COMPONENTS = np.zeros(2, COMPONENT)
COMPONENTS["pose"], COMPONENTS["sigma_m"], COMPONENTS["sigma_rad"], COMPONENTS["mass"] = (0.5, 0.5, 0.0), 0.1, 0.1, 0.5
PLAIN = TextureModel.train({"A": [NOISE], "B": [3.0 * NOISE]})
WHISK = {"t_s": np.arange(64.0), "samples": NOISE[:64], "whisk_rad_s": np.ones(64), "reported_rad_s": np.ones(64)}
PUSH = {"bases": np.zeros((8, 3)), "tilts": np.zeros((8, 2)), "good": np.ones(8, bool)}
VEHICLE = Vehicle(0.15, 0.71, 0.5, 0.25)
FIELD = Field(0.1, 0.0, 0.0, np.ones((5, 6), np.float32), np.ones((5, 6), np.uint8))
BLOCK = {"ticks": np.arange(8), "samples": NOISE[:8], "good": np.ones(8, bool)}

CASES = {
    "nav.filters.Filter.step_values": Case(
        lambda **row: Filter("odometry", SCENE).step_values(0.1, *row.values()),
        ROW,
        {"odometry": (0,), "texture": (0, 1), "radial_m": (0,)},
    ),
    "nav.filters.Filter.replay": of_rows(lambda rows: Filter("odometry", SCENE).replay(rows, 0, len(rows))),
    "nav.fit.fitted": of_one(lambda table: fitted(SCENE, OBSERVATIONS, table), "table", ANSWERS, 0),
    "nav.filters.pack": of_rows(
        lambda rows: pack(rows, OBSERVATIONS.texture.shape[1:], OBSERVATIONS.radial_m.shape[1], 0)
    ),
    "nav.mapper.OneMap.replay": of_rows(
        lambda rows: OneMap(SCENE.robot, SCENE.arena.textures).replay(rows, 0, len(rows))
    ),
    "nav.filters._sensors": Case(
        lambda **table: Filter("odometry", SCENE, sensors=[Sensor(cell_m=0.1, levels=2, **table)]),
        {"codes": np.zeros((3, 4), np.uint8), "edges": np.arange(4.0), "likelihood": np.ones((3, 2))},
        {"codes": (), "edges": (0,), "likelihood": (0, 1)},
    ),
    "nav.filters._components": of_one(lambda components: prior_fault(SCENE, components), "components", COMPONENTS),
    "planning.coverage.CoveragePlanner.plan": Case(
        lambda **cells: CoveragePlanner(VEHICLE, np.zeros(1)).plan(Field(0.1, 0.0, 0.0, **cells), np.ones(3)),
        {"open": np.ones((5, 6), np.float32), "fresh": np.ones((5, 6), np.uint8)},
        {"open": (), "fresh": (0, 1)},
    ),
    "planning.coverage.CoveragePlanner._make": Case(
        lambda **asides: CoveragePlanner(VEHICLE, **asides).plan(FIELD, np.ones(3)),
        {"asides_m": np.zeros(3)},
        {"asides_m": ()},
    ),
    "touch.contact.Contact.block": Case(
        lambda **block: Contact().block(*block.values()), BLOCK, {"ticks": (0,), "samples": (0, 1), "good": (0,)}
    ),
    "touch.contact_filter.ContactFilter.run": Case(
        lambda **push: ContactFilter().run(*push.values()), PUSH, {"bases": (0, 1), "tilts": (0, 1), "good": (0,)}
    ),
    "touch.radial.curve.peak": Case(
        lambda **given: peak(*given.values()), {"samples": NOISE, "rest": np.zeros(2)}, {"samples": (1,), "rest": (0,)}
    ),
    "touch.radial.model.RadialModel.fit": Case(
        lambda **given: RadialModel.fit(*given.values()),
        {"peak_counts": np.arange(5.0), "radius_mm": 90.0 + np.arange(5.0)},
        {"peak_counts": (0,), "radius_mm": (0,)},
    ),
    "touch.texture.novelty.Novelty.native": of_part(
        novelty(), Novelty.native, turn=(0, 1), mean=(1,), row=(0,), limit=(0,)
    ),
    "touch.texture.novelty.Novelty.distances": of_one(novelty().distances, "features", np.zeros((3, FEATURES)), 1),
    "touch.texture.spectral.forward": of_one(lambda loglik: forward(loglik, 1.0, 0.1), "loglik", np.zeros((4, 3))),
    "touch.texture.classifier.Classifier._make": of_part(
        classifier(), Classifier._make, floor=(0,), weight=(0, 1), bias=(0,)
    ),
    "touch.texture.classifier.plain_features": Case(
        lambda **given: plain_features(given["windows"], given["floor"], given["shape"]),
        {"windows": np.zeros((2, LENGTH, CHANNELS)), "floor": np.ones(CHANNELS), "shape": np.zeros(SHAPES)},
        {"windows": (2,), "floor": (0,), "shape": (0,)},
    ),
    "touch.texture.classifier.Reducer.features": of_one(
        Reducer(np.ones(CHANNELS), LENGTH).features, "window", np.zeros((LENGTH, CHANNELS)), 0, 1
    ),
    "touch.texture.classifier.blocks_of": of_one(
        lambda samples: blocks_of(samples, LENGTH, CHANNELS), "samples", NOISE, 1
    ),
    "touch.texture.spectral.Stream.__init__": Case(
        lambda **limits: model(**limits).stream(LENGTH), LIMITS, dict.fromkeys(LIMITS, (0,))
    ),
    "touch.texture.spectral.Stream.push": of_one(model().stream(LENGTH).push, "samples", NOISE, 1),
    "bridge.ring.Writer.publish": of_one(published, "frames", np.zeros(3, FRAME)),
}
CASES["touch.texture.classifier.pointers"] = CASES["touch.texture.classifier.Classifier._make"]
CASES["touch.texture.classifier.Reducer.__init__"] = CASES["touch.texture.classifier.plain_features"]


def sources() -> dict[str, Path]:
    """Python modules that may call into C, by name."""
    ours = {".".join(p.relative_to(PACKAGE).with_suffix("").parts): p for p in PACKAGE.rglob("*.py")}
    theirs = {f"signals.{p.stem}": p for p in Path(signals.__file__).parent.glob("*.py")}
    return {name: path for name, path in (ours | theirs).items() if name not in ("native", "signals.border")}


def functions(tree: ast.AST, inside: str):
    """(qualified name, node) of every function."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            name = f"{inside}.{node.name}"
            yield from [(name, node)] if isinstance(node, ast.FunctionDef) else functions(node, name)


def calls_helper(node: ast.AST) -> bool:
    called = {n.func.id for n in ast.walk(node) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)}
    return bool(called & HELPERS)


def test_no_array_goes_around_the_helpers():
    found = [
        f"{name}, line {node.lineno}: {node.attr}"
        for name, path in sources().items()
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Attribute) and node.attr in AROUND
    ]
    assert found == []


def test_every_function_that_hands_an_array_to_c_is_tried():
    found = {
        function
        for name, path in sources().items()
        for function, node in functions(ast.parse(path.read_text()), name)
        if calls_helper(node)
    }
    assert found - OWN <= CASES.keys() and found >= OWN


@pytest.mark.parametrize("function", CASES)
def test_arrays_of_the_right_shape_are_taken(function):
    CASES[function].call(**CASES[function].arrays)


def shorter(array: np.ndarray, axis: int) -> np.ndarray:
    return np.ascontiguousarray(np.delete(array, -1, axis))


def longer(array: np.ndarray, axis: int) -> np.ndarray:
    return np.concatenate([array, np.take(array, [-1], axis)], axis)


def wrong(case: Case):
    """(name, array of another shape)"""
    for name, array in case.arrays.items():
        yield name, array[None]
        for axis in case.fixed[name]:
            yield name, shorter(array, axis)
            yield name, longer(array, axis)


@pytest.mark.parametrize("function", CASES)
def test_another_shape_is_refused_in_one_line_that_names_the_argument(function):
    case = CASES[function]
    for name, array in wrong(case):
        with pytest.raises(ValueError) as refusal:
            case.call(**(case.arrays | {name: array}))
        text = str(refusal.value)
        assert "\n" not in text and any(argument in text for argument in case.arrays), text


def test_rows_outside_those_given_are_refused():
    made = Filter("odometry", SCENE)
    for first, count in ((-1, 1), (0, ROWS + 1), (ROWS, 1), (ROWS + 1, 0), (3, -1), (2**62, 2**62)):
        with pytest.raises(ValueError, match="rows given"):
            made.replay(OBSERVATIONS, first, count)
    assert len(made.replay(OBSERVATIONS, ROWS, 0)[0]) == 0


@pytest.mark.parametrize(
    ("array", "text"),
    [
        ([1.0, 2.0, 3.0], "x: list; give an array of float64 with shape (3,)"),
        (np.zeros(3, np.float32), "x: float32 with shape (3,); give float64"),
        (np.zeros(3, ">f8"), "x: >f8 with shape (3,); give float64"),
        (np.zeros(6)[::2], "x: shape (3,), but not contiguous; give np.ascontiguousarray of it"),
        (np.zeros((1, 3)), "x: shape (1, 3); give shape (3,)"),
    ],
)
def test_a_pointer_needs_type_shape_and_order(array, text):
    with pytest.raises(ValueError) as refusal:
        doubles(array, "x", (3,))
    assert str(refusal.value) == text


def test_a_pointer_keeps_its_array():
    held = octets(np.arange(100, dtype=np.uint8), "x", (None,))
    assert list(held) == list(range(100)) and ffi.sizeof(held) == 100


@pytest.mark.parametrize("values", ["abc", [[1.0], [1.0, 2.0]], [None, {}], {1.0}, [10**400, 1, 1]])
def test_what_is_no_numbers_is_named(values):
    with pytest.raises(ValueError, match=r"^x: no array of numbers; give shape \(n, 3\)$"):
        as_doubles(values, "x", (None, 3))


def test_a_robot_without_whiskers_takes_no_numbers():
    assert as_doubles([], "x", (0, 3)).shape == (0, 3)
