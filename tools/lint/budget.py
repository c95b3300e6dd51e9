"""No room grows by itself: source lines and numbers set by hand of each room, at most as budget.toml says.

A room is a folder that budget.toml names, with all below it that is not in a room of its own. Lines are those of source:
neither tests, benches, what a tool wrote, nor pages. Numbers set by hand stand in C in `static const`, `#define` and
enumerations, in Python in what is named in capitals, in a module or class.

`python -m lint --lower` lowers what has become less. Nothing raises it but an edit; the commit says why, in a line that
begins with `budget:`.
"""

import ast
import re
import subprocess
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from .tree import ROOT, read, tracked

BUDGET = "tools/lint/budget.toml"
CODE = (".c", ".h", ".cc", ".cpp", ".hpp", ".v", ".py", ".sh", ".js", ".mjs", ".html", ".css", ".S", ".s")
IN_C = (".c", ".h", ".cc", ".cpp", ".hpp")
TESTS = re.compile(r"(^|/)tests?/|/test_|/tb/|fuzz")
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
CONSTANTS = re.compile(r"(?:static const|#define)[^;{}]*?(?:;|\n(?=[^ ]))|static const[^;]*;|enum\s*\{[^}]*\}")
NUMBER = re.compile(r"[=\s,{]-?\d+\.?\d*(?:e-?\d+)?f?(?=[,;}\s])")
NAMED = re.compile(r"_?[A-Z][A-Z0-9_]*")
ENTRY = re.compile(r'^"(?P<room>[^"]+)" = \{ lines = (?P<lines>\d+), numbers = (?P<numbers>\d+) \}\n', re.MULTILINE)


class Size(NamedTuple):
    lines: int
    numbers: int


def kind(path: str) -> str:
    """ "source", "tests" or "benches"; "" for what is no code or is generated."""
    if not path.endswith(CODE) or "/gen/" in path:
        return ""
    if "bench" in path:
        return "benches"
    return "tests" if TESTS.search(path) else "source"


def numbers_in_c(text: str) -> int:
    return sum(len(NUMBER.findall(part)) for part in CONSTANTS.findall(COMMENT.sub("", text)))


def numbers_in_python(text: str) -> int:
    bodies = [ast.parse(text).body]
    bodies += [node.body for node in bodies[0] if isinstance(node, ast.ClassDef)]
    return sum(_numbers_of(value) for body in bodies for value in _named_in_capitals(body))


def _named_in_capitals(body: list[ast.stmt]) -> Iterator[ast.expr]:
    for node in body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        names = [one.id for target in targets if target for one in ast.walk(target) if isinstance(one, ast.Name)]
        if names and all(map(NAMED.fullmatch, names)) and getattr(node, "value", None):
            yield node.value


def _numbers_of(value: ast.expr) -> int:
    found = (node.value for node in ast.walk(value) if isinstance(node, ast.Constant))
    return sum(isinstance(one, int | float) and not isinstance(one, bool) for one in found)


def room_of(path: str, rooms: dict[str, Size]) -> str:
    """The innermost room that holds a file; "." holds every file that no other does."""
    return next((str(folder) for folder in Path(path).parents if str(folder) in rooms), ".")


def measured(root: Path, rooms: dict[str, Size]) -> dict[str, Size]:
    lines, numbers = Counter(), Counter()
    for path in tracked(root):
        if kind(path) != "source":
            continue
        text, room = read(path, root), room_of(path, rooms)
        lines[room] += text.count("\n")
        if path.endswith(IN_C):
            numbers[room] += numbers_in_c(text)
        elif path.endswith(".py"):
            numbers[room] += numbers_in_python(text)
    return {room: Size(lines[room], numbers[room]) for room in {*rooms, *lines}}


def budgets(text: str) -> dict[str, Size]:
    return {room: Size(**size) for room, size in tomllib.loads(text).items()}


def complaints(root: Path = ROOT) -> list[str]:
    rooms = budgets(read(BUDGET, root))
    found = []
    for room, size in sorted(measured(root, rooms).items()):
        for what, has, may in zip(Size._fields, size, rooms.get(room, Size(0, 0)), strict=True):
            if has > may:
                named = "what lies in no room" if room == "." else room
                found.append(
                    f"{named}: {has} {what}, {may} at most ({BUDGET}); take {has - may} out, or raise it and say why"
                )
    return found + _unexplained(root)


def _unexplained(root: Path) -> list[str]:
    """What the last commit of the budget raised, if it does not say why."""

    def git(*words: str) -> str:
        return subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=False).stdout

    commit, _, message = git("log", "-1", "--format=%h%n%b", "--", BUDGET).partition("\n")
    if not commit or re.search(r"^budget:", message, re.MULTILINE):
        return []
    before, after = (git("show", f"{at}:{BUDGET}") for at in (f"{commit}~", commit))
    earlier = budgets(before)
    raised = [
        room
        for room, size in budgets(after).items()
        if any(a > b for a, b in zip(size, earlier.get(room, (0, 0)), strict=True))
    ]
    return [
        f"commit {commit} raises the budget of {room}; give its message a line that begins with 'budget:' and says why"
        for room in (raised if earlier else [])
    ]


def lower(root: Path = ROOT) -> list[str]:
    """Writes what has become less; the rooms changed. A room that is empty goes."""
    text = read(BUDGET, root)
    sizes = measured(root, budgets(text))
    changed = []

    def entry(match: re.Match) -> str:
        room, may = match["room"], Size(int(match["lines"]), int(match["numbers"]))
        now = Size(*map(min, sizes[room], may))
        if now != may:
            changed.append(room)
        return f'"{room}" = {{ lines = {now.lines}, numbers = {now.numbers} }}\n' if now.lines else ""

    (root / BUDGET).write_text(ENTRY.sub(entry, text))
    return changed
