"""Well-formed messages that cannot be: made of a good one by the schema and the table of ranges, one field changed."""

import copy
import math
from collections.abc import Iterator

import numpy as np

from crunchbot.recording.types import DTYPES
from crunchbot.robot.network import messages as m
from crunchbot.robot.network.judge import MANY, ONE, TEXT, Field, fields_of
from crunchbot.robot.network.ranges import RANGES

FLOATS = (math.nan, math.inf, -math.inf, 1e308, -1e308, 3e38, -3e38)


def places(schema: str, path: tuple[str, ...] = ()) -> Iterator[tuple[str, tuple[str, ...], Field]]:
    """(schema that holds it, path, field) of each number, text and sequence, those of messages within messages too."""
    for field in fields_of(m.store(), schema):
        here = (*path, field.name)
        if field.kind in DTYPES or field.kind == TEXT or field.count == MANY:
            yield schema, here, field
        else:
            yield from places(field.kind, here)


def beyond(schema: str, field: Field) -> list:
    """Values of the field's type that the table of ranges forbids."""
    limits = RANGES[f"{schema}:{field.name}"]
    if field.kind == TEXT:
        return ["x" * (int(limits.high) + 1)]
    if field.kind not in DTYPES or field.kind == "bool":  # an encoder makes a truth value of any number
        return []
    kind = np.dtype(DTYPES[field.kind])
    if kind.kind == "f":
        low, high = float(np.min(limits.low)), float(np.max(limits.high))
        close = [v for v in (low - 0.01 - 1e-3 * abs(low), 1.001 * high) if math.isfinite(v)]
        held = [v for v in FLOATS if kind.itemsize == 8 or not math.isfinite(v) or abs(v) < float(np.finfo(kind).max)]
        return [v for v in (*held, *close) if _is_beyond(v, limits)]
    edges = np.iinfo(kind)
    low, high = int(limits.low), int(limits.high)
    return [
        v for v in (edges.min, edges.max, low - 1, high + 1) if edges.min <= v <= edges.max and not low <= v <= high
    ]


def _is_beyond(value: float, limits) -> bool:
    """For every element of a fixed array."""
    if not math.isfinite(value):
        return limits.finite
    return value < np.min(limits.low) or value > np.max(limits.high)


def variants(message) -> Iterator[tuple[object, str]]:
    """(message, path of the field that cannot be) for each field and each value beyond its range, and each length."""
    for schema, path, field in places(m.SCHEMAS[type(message)]):
        limits = RANGES[f"{schema}:{field.name}"]
        for value in beyond(schema, field):
            old = _at(message, path)
            count = 1 if field.count == ONE else len(old)
            for n in range(count):
                yield (
                    _changed(message, path, value if field.count == ONE else [*old[:n], value, *old[n + 1 :]]),
                    _name(path),
                )
        if field.count == MANY:
            old = _at(message, path)
            element = old[0] if len(old) else 0.0
            yield _changed(message, path, [element] * (limits.count + 1)), _name(path)


def _name(path: tuple[str, ...]) -> str:
    return ".".join(path)


def _at(message, path: tuple[str, ...]):
    for name in path:
        message = getattr(message, name)
    return message


def _changed(message, path: tuple[str, ...], value):
    made = copy.deepcopy(message)
    setattr(_at(made, path[:-1]), path[-1], value)
    return made
