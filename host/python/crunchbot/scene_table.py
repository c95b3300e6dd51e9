"""TOML read strictly: what a scene's files must hold, and the one line that says where one does not."""

import re
from pathlib import Path
from typing import Any

from .errors import UserError
from .fields import Fields
from .files import UnreadableError, read_toml

LARGEST_M = 1000.0
FARTHEST_M = 3 * LARGEST_M  # of a place on a map: as far as its arena's origin, and across the arena
ANGLE_MOST = 10.0  # rad: more than a turn and a half is in degrees


class SceneError(UserError, ValueError):
    """A scene that is not as docs/formats.md has it. Its text is one line: file, line or key, what and the remedy."""


class Table(Fields):
    """One TOML table: what is taken is checked, what is left over is an error."""

    def __init__(self, path: Path, source: str, content: dict, header: str | None = None, nth: int = 0):
        super().__init__(dict(content))
        self.path, self.source, self.header, self.nth = path, source, header, nth

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

    def name(self) -> str:
        """The key `name`: letters, digits and underscores."""
        name = self.text("name")
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

    def within(self, key: str) -> "Table":
        """The table of this key, written as [key]."""
        value = self.take(key)
        if not isinstance(value, dict):
            raise self.fail(key, f"must be a table; write it as [{key}]")
        return Table(self.path, self.source, value)

    def done(self) -> None:
        for key in self.content:
            raise self.fail(key, "is unknown; remove it")

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
