"""Fields of a parsed model file, each with its type and range: what is taken is as it should be, or a ValueError says
which field is not."""

import math
from typing import Any

import numpy as np

HUGE = 1e12  # of numbers that have no bound of their own: far beyond any, and no sum of squares of them is infinite
TEXT_MOST = 40  # characters of a wrong value that are shown


class Fields:
    """The fields of one JSON object; `place` says where it lies in the file."""

    def __init__(self, content: Any, place: str = ""):
        if not isinstance(content, dict):
            raise ValueError(f"{place or 'the file'}: no object with fields")
        self._content, self._place = content, place

    def has(self, name: str) -> bool:
        """Whether the field is there and not null."""
        return self._content.get(name) is not None

    def take(self, name: str) -> Any:
        if name not in self._content:
            raise ValueError(f"field '{self._path(name)}' is missing")
        return self._content[name]

    def number(self, name: str, low: float = -HUGE, high: float = HUGE) -> float:
        value = self.take(name)
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise self._wrong(name, f"a number from {low:g} to {high:g}")
        return float(value)

    def whole(self, name: str, low: int, high: int) -> int:
        value = self.take(name)
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise self._wrong(name, f"a whole number from {low} to {high}")
        return value

    def flag(self, name: str) -> bool:
        if not isinstance(self.take(name), bool):
            raise self._wrong(name, "true or false")
        return self.take(name)

    def text(self, name: str, *allowed: str) -> str:
        if self.take(name) not in allowed:
            raise self._wrong(name, " or ".join(f"'{text}'" for text in allowed))
        return self.take(name)

    def names(self, name: str, most: int) -> list[str]:
        """One to `most` different texts."""
        value = self.take(name)
        texts = isinstance(value, list) and all(isinstance(item, str) and item for item in value)
        if not texts or not 1 <= len(set(value)) == len(value) <= most:
            raise self._wrong(name, f"1 to {most} different names")
        return value

    def array(self, name: str, dimensions: int, low: float = -HUGE, high: float = HUGE) -> np.ndarray:
        """Nested lists of numbers, all in the range; an empty list has whatever dimensions are wanted."""
        try:
            array = np.array(self.take(name))
        except (ValueError, RecursionError):  # ragged
            array = np.array(None)
        numbers = array.dtype.kind in "iuf" and array.ndim == (dimensions if array.size else 1)
        if not numbers or not ((low <= array) & (array <= high)).all():
            raise self._wrong(name, f"numbers from {low:g} to {high:g} in lists of depth {dimensions}")
        return array.astype(np.float64)

    def part(self, name: str) -> "Fields":
        return Fields(self.take(name), self._path(name))

    def parts(self, name: str, most: int) -> "list[Fields]":
        value = self.take(name)
        if not isinstance(value, list) or not 1 <= len(value) <= most:
            raise self._wrong(name, f"a list of 1 to {most}")
        return [Fields(item, f"{self._path(name)}[{n}]") for n, item in enumerate(value)]

    def _wrong(self, name: str, wanted: str) -> ValueError:
        value = self.take(name)
        shown = repr(value) if isinstance(value, str | float | bool | None) or _short(value) else type(value).__name__
        return ValueError(f"field '{self._path(name)}' is {shown[:TEXT_MOST]}; it must be {wanted}")

    def _path(self, name: str) -> str:
        return f"{self._place}.{name}" if self._place else name


def _short(value) -> bool:
    """Whether it may be printed: an integer of thousands of digits may not."""
    return isinstance(value, int) and math.log2(abs(value) + 1) < 64
