"""TOML read strictly: what a scene's files must hold, and the one line that says where one does not."""

import re
from pathlib import Path
from typing import Any

from .errors import UserError
from .files import UnreadableError, read_toml

LARGEST_M = 1000.0
SHOWN_MOST = 60  # characters of a wrong value


class SceneError(UserError, ValueError):
    """A scene that is not as docs/formats.md has it. Its text is one line: file, line or key, what and the remedy."""


class Table:
    """One TOML table with strict accessors: what is taken is checked, what is left over is an error."""

    def __init__(self, path: Path, source: str, content: dict, header: str | None = None, nth: int = 0):
        self.path, self.source, self.content, self.header, self.nth = path, source, dict(content), header, nth

    @classmethod
    def read(cls, path: Path) -> "Table":
        try:
            return cls(path, *read_toml(path))
        except UnreadableError as error:
            raise SceneError(f"{path}: {error}; a scene folder needs it, mend that place") from error

    def fail(self, key: str, text: str) -> SceneError:
        line = self._line_of(key)
        place = f"{self.path}, line {line}" if line else f"{self.path}"
        return SceneError(" ".join(f"{place}: '{key}' {text}".splitlines()))

    def take(self, key: str) -> Any:
        if key not in self.content:
            raise self.fail(
                key, f"is missing{f' in [[{self.header}]] number {self.nth + 1}' if self.header else ''}; add it"
            )
        return self.content.pop(key)

    def number(self, key: str, low: float, high: float) -> float:
        return self._checked(key, self.take(key), low, high)

    def numbers(self, key: str, count: int, low: float, high: float) -> tuple[float, ...]:
        value = self.take(key)
        if not isinstance(value, list) or len(value) != count:
            raise self.fail(key, f"must be a list of {count} numbers")
        return tuple(self._checked(key, item, low, high) for item in value)

    def strings(self, key: str) -> tuple[str, ...]:
        value = self.take(key)
        if not isinstance(value, list) or not value or not all(isinstance(item, str) and item for item in value):
            raise self.fail(key, 'must be a list of strings, as in ["A", "B"]')
        return tuple(value)

    def string(self, key: str, allowed: tuple[str, ...] | None = None) -> str:
        value = self.take(key)
        if not isinstance(value, str) or not value or (allowed and value not in allowed):
            raise self.fail(key, f"must be {' or '.join(map(repr, allowed)) if allowed else 'a string'}")
        return value

    def name(self) -> str:
        """The key `name`: letters, digits and underscores."""
        name = self.string("name")
        if not re.fullmatch(r"\w+", name):
            raise self.fail("name", f"is '{name}'; use letters, digits and underscores")
        return name

    def tables(self, key: str, most: int) -> list["Table"]:
        """Returns at most so many tables; none if the key is missing."""
        value = self.content.pop(key, [])
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            raise self.fail(key, f"must be tables; write each as [[{key}]]")
        if len(value) > most:
            raise self.fail(key, f"has {len(value)} tables; {most} are the most")
        return [Table(self.path, self.source, item, key, nth) for nth, item in enumerate(value)]

    def done(self) -> None:
        for key in self.content:
            raise self.fail(key, "is unknown; remove it")

    def _checked(self, key: str, value, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise self.fail(key, f"must be numbers from {low:g} to {high:g}, not {_shown(value)}")
        return float(value)

    def _line_of(self, key: str) -> int | None:
        """Line of `key` in this table: after the nth header, if it has one."""
        lines = list(enumerate(self.source.splitlines(), start=1))
        if self.header:
            heads = [n for n, text in lines if re.match(rf"\s*\[\[\s*{self.header}\s*\]\]", text)]
            if self.nth >= len(heads):
                return None
            end = heads[self.nth + 1] if self.nth + 1 < len(heads) else len(lines) + 1
            lines = lines[heads[self.nth] - 1 : end - 1]
        wanted = re.compile(rf"\s*(\[+\s*)?[\"']?{re.escape(key)}[\"']?\s*[=\].]")
        return next((n for n, text in lines if wanted.match(text)), lines[0][0] if self.header else None)


def _shown(value) -> str:
    """A wrong value, shortened; an integer of thousands of digits cannot be printed."""
    text = repr(value) if not isinstance(value, int) or abs(value) < 1 << 64 else "a number of many digits"
    return text if len(text) <= SHOWN_MOST else f"{text[:SHOWN_MOST]}..."
