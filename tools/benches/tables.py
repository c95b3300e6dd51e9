"""The one writer of tables in pages. A page is prose by hand; between the marks

    <!-- table: nav.matrix -->
    <!-- end -->

stands what the function `matrix` of benches/nav/tables.py makes of bench/results. Words after the name are arguments.
A page's lesser tables are in the site alone (`make docs`), at `<!-- table of the site: nav.matrix -->`.

    .venv/bin/python tools/benches page        writes all tables again, without measuring
"""

import importlib
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from string import Formatter

from .store import ROOT

MARKS = re.compile(r"(<!-- table: (\w+)\.(\w+)([^>]*?) -->\n).*?(<!-- end -->)", re.DOTALL)
OF_SITE = re.compile(r"<!-- table of the site: (\w+)\.(\w+)([^>]*?) -->\n")
NONE = "-"
Cell = str | Callable[[dict], object]


class Cells(Formatter):
    """Fields `{error_m:1e3*.1f}`, a scale before a format: 12.3 of 0.0123. Of a field that is None the cell is NONE."""

    def get_field(self, field_name: str, args, kwargs):
        """As str.format's, but a number in brackets may be a key that is text."""
        name, *keys = field_name.replace("]", "").split("[")
        value = kwargs[name]
        for key in keys:
            value = value[int(key)] if isinstance(value, list) else value[key]
        return value, name

    def format_field(self, value, spec: str) -> str:
        if value is None:
            raise TypeError("no value")
        scale, _, digits = spec.rpartition("*")
        value = value * float(scale) if scale else value
        return format(value, ".0f" if digits.endswith("g") and abs(value) >= 1000 else digits)


def table(head: list[str], rows: list[list[str]]) -> str:
    lines = [" | ".join(head), " | ".join("---" for _ in head), *(" | ".join(row) for row in rows)]
    return "".join(f"| {line} |\n".replace("|  |", "| |") for line in lines)


def lined(records: Iterable[dict], columns: dict[str, Cell]) -> str:
    """A row for each record; a column's text is formatted with the record's fields, or is what its function returns."""
    return table(list(columns), [[cell(text, record) for text in columns.values()] for record in records])


def cell(text: Cell, record: dict) -> str:
    if callable(text):
        value = text(record)
        return NONE if value is None else str(value)
    try:
        return Cells().vformat(text, (), record)
    except TypeError:
        return NONE


def named(found: dict, *keys: str) -> list[dict]:
    """Records of nested dictionaries; the keys on the way to each become its fields `keys`."""
    if not keys:
        return [found]
    return [{keys[0]: name} | record for name, part in found.items() for record in named(part, *keys[1:])]


def pages() -> list[Path]:
    """Those with marks."""
    every = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "tests").rglob("*.md")]
    return [path for path in every if MARKS.search(path.read_text())]


def made(room: str, name: str, words: str) -> str:
    """What a mark stands for."""
    return getattr(importlib.import_module(f"benches.{room}.tables"), name)(*words.split())


def written(text: str) -> str:
    """A page's text with its tables made of what is stored now."""
    return MARKS.sub(lambda found: f"{found[1]}{made(*found.groups()[1:4])}{found[5]}", text)


def of_site(text: str) -> str:
    """A page's text with the tables that the site alone has."""
    return OF_SITE.sub(lambda found: made(*found.groups()), text)


def run(_build: Path | None = None) -> None:
    for path in pages():
        path.write_text(written(path.read_text()))
