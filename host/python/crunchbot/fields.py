"""Fields of a parsed file, each with its type and range: what is taken is as it should be, or an error says which field is
not. The one place that judges what a JSON, YAML or TOML file holds (TOML with its lines: scene_table)."""

import math
from typing import Any

import numpy as np

HUGE = 1e12  # of numbers that have no bound of their own: far beyond any, and no sum of squares of them is infinite
SHOWN_MOST = 60  # characters of a wrong value that are shown


class Fields:
    """The fields of one object; `place` says where it lies in the file."""

    def __init__(self, content: Any, place: str = ""):
        if not isinstance(content, dict):
            raise ValueError(f"{place or 'the file'}: no object with fields")
        self.content, self._place = content, place

    def fail(self, name: str, text: str) -> ValueError:
        """The error of a field, whose name `text` goes on behind."""
        return ValueError(f"field '{self._path(name)}' {text}")

    def has(self, name: str) -> bool:
        """Whether the field is there and not null."""
        return self.content.get(name) is not None

    def take(self, name: str) -> Any:
        if name not in self.content:
            raise self.fail(name, "is missing")
        return self.content[name]

    def number(self, name: str, low: float = -HUGE, high: float = HUGE) -> float:
        return self._within(name, self.take(name), low, high, "a number")

    def numbers(self, name: str, count: int, low: float, high: float) -> tuple[float, ...]:
        value = self.take(name)
        if not isinstance(value, list) or len(value) != count:
            raise self.fail(name, f"must be a list of {count} numbers")
        return tuple(self._within(name, item, low, high, "numbers") for item in value)

    def whole(self, name: str, low: int, high: int) -> int:
        value = self.take(name)
        if type(value) is not int or not low <= value <= high:
            raise self.fail(name, f"must be a whole number from {low} to {high}, not {_shown(value)}")
        return value

    def flag(self, name: str) -> bool:
        value = self.take(name)
        if not isinstance(value, bool):
            raise self.fail(name, f"must be true or false, not {_shown(value)}")
        return value

    def text(self, name: str, *allowed: str) -> str:
        """One of those that are allowed; if none is named, any that is not empty."""
        value = self.take(name)
        if not isinstance(value, str) or not value or (allowed and value not in allowed):
            raise self.fail(name, f"must be {' or '.join(map(repr, allowed)) or 'a string'}, not {_shown(value)}")
        return value

    def strings(self, name: str) -> tuple[str, ...]:
        value = self.take(name)
        if not isinstance(value, list) or not value or not all(isinstance(item, str) and item for item in value):
            raise self.fail(name, 'must be a list of strings, as in ["A", "B"]')
        return tuple(value)

    def names(self, name: str, most: int) -> list[str]:
        """One to `most` different texts."""
        value = self.strings(name)
        if not len(set(value)) == len(value) <= most:
            raise self.fail(name, f"must be 1 to {most} different names")
        return list(value)

    def array(self, name: str, dimensions: int, low: float = -HUGE, high: float = HUGE) -> np.ndarray:
        """Nested lists of numbers, all in the range; an empty list has whatever dimensions are wanted."""
        value = self.take(name)
        try:
            array = np.array(value)
        except (ValueError, RecursionError):  # ragged
            array = np.array(None)
        numbers = array.dtype.kind in "iuf" and array.ndim == (dimensions if array.size else 1)
        if not numbers or not ((low <= array) & (array <= high)).all():
            wanted = f"numbers from {low:g} to {high:g} in lists of depth {dimensions}"
            raise self.fail(name, f"must be {wanted}, not {_wrong_item(value, dimensions, low, high) or _shown(value)}")
        return array.astype(np.float64)

    def part(self, name: str) -> "Fields":
        return Fields(self.take(name), self._path(name))

    def parts(self, name: str, most: int) -> "list[Fields]":
        value = self.take(name)
        if not isinstance(value, list) or not 1 <= len(value) <= most:
            raise self.fail(name, f"must be a list of 1 to {most}")
        return [Fields(item, f"{self._path(name)}[{n}]") for n, item in enumerate(value)]

    def _within(self, name: str, value: Any, low: float, high: float, wanted: str) -> float:
        if not _is_number(value, low, high):
            raise self.fail(name, f"must be {wanted} from {low:g} to {high:g}, not {_shown(value)}")
        return float(value)

    def _path(self, name: str) -> str:
        return f"{self._place}.{name}" if self._place else name


def _is_number(value: Any, low: float, high: float) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high


def _wrong_item(value: Any, depth: int, low: float, high: float, place: tuple[int, ...] = ()) -> str:
    """The first item of nested lists that is no number in the range, and where it is, from 1; empty: there is none."""
    if depth == 0:
        at = ".".join(map(str, place))
        return "" if _is_number(value, low, high) else f"{_shown(value)} as number {at}"
    items = enumerate(value, 1) if isinstance(value, list) else ()
    return next(filter(None, (_wrong_item(item, depth - 1, low, high, (*place, n)) for n, item in items)), "")


def _shown(value: Any) -> str:
    """A wrong value, shortened; of lists and objects the kind. An integer of thousands of digits cannot be printed."""
    if isinstance(value, int) and math.log2(abs(value) + 1) >= 64:
        return "a number of many digits"
    text = type(value).__name__ if isinstance(value, list | dict) else repr(value)
    return text if len(text) <= SHOWN_MOST else f"{text[:SHOWN_MOST]}..."
