"""CSV files with strict structure and forgiven values; every complaint is one line with file, line and remedy."""

import csv
import math
from collections import Counter
from collections.abc import Callable, Container, Iterable
from pathlib import Path

import numpy as np

from .errors import UserError
from .files import UnreadableError, read_text

Warn = Callable[[str], object]


def ignore(line: str) -> None:
    """A fault that nobody asked for."""


class TableError(UserError, ValueError):
    """A file whose structure is wrong. Its text is one line: file, line where known, what and the remedy."""

    def __init__(self, path: str | Path, line: int | None, text: str):
        place = f"{path}, line {line}" if line else f"{path}"
        super().__init__(f"{place}: {text}")


def number(cell: str) -> float:
    """A cell as a number; whatever is none, an empty cell too, is nan."""
    try:
        return float(cell)
    except ValueError:
        return math.nan


def read_rows(path: str | Path) -> tuple[list[str], list[list[str]]]:
    """Header and rows of a CSV file: header first, no duplicate column, no ragged row. Empty lines do not count, nor do those
    before the header that begin with "#"; one of these is the header where numbers follow, as NumPy writes it."""
    try:
        lines = [(n, row) for n, row in enumerate(csv.reader(read_text(path).splitlines()), 1) if row]
    except (UnreadableError, csv.Error) as error:
        raise TableError(path, None, f"{error}; give a readable CSV file") from error
    first = next((n for n, (_, row) in enumerate(lines) if not row[0].startswith("#")), len(lines))
    if first and first < len(lines) and math.isfinite(number(lines[first][1][0])):
        first -= 1
    if first == len(lines) or all(math.isfinite(number(cell or "0")) for cell in lines[first][1]):
        raise TableError(path, 1, "no header line; name the columns in the first line")
    at, names = lines[first]
    header = [_name(cell) for cell in (names[0].lstrip("#"), *names[1:])]
    for name, count in Counter(header).items():
        if count > 1:
            raise TableError(path, at, f"column '{name}' appears twice; keep one")
    if len(header) == 1 and (other := next((mark for mark in ";\t|" if mark in header[0]), "")):
        raise TableError(path, at, f"cells are separated by {other!r}; separate them by commas, with decimal points")
    for line, row in lines[first + 1 :]:
        if len(row) != len(header):
            raise TableError(path, line, f"{len(row)} cells but {len(header)} columns; give every row all its cells")
    return header, [row for _, row in lines[first + 1 :]]


def _name(cell: str) -> str:
    return cell.strip()


def read_columns(path: str | Path, required: list[str], optional: Iterable[str] = ()) -> dict[str, list[str]]:
    """Columns as text by name; TableError when one of `required` is missing. A name in other letter case than one of
    those asked for is taken for it where none is written as asked."""
    header, rows = read_rows(path)
    written = set(header)
    asked = {name.lower(): name for name in (*optional, *required) if name not in written}
    header = [asked.get(name.lower(), name) for name in header]
    require_columns(path, set(header), required)
    return {name: [row[i].strip() for row in rows] for i, name in enumerate(header)}


def require_columns(path: str | Path, known: Container[str], required: list[str]) -> None:
    """TableError when one of `required` is not among the known columns."""
    for name in required:
        if name not in known:
            raise TableError(path, 1, f"column '{name}' is missing; add it to the header and every row")


def numbers(cells: list[str]) -> np.ndarray:
    """Cells as float64; whatever is no number is nan."""
    return np.array([number(cell) for cell in cells], dtype=np.float64)
