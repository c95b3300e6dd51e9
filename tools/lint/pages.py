"""Lines of Markdown are at most 120 characters; tables, code blocks and pictures are excepted, and a link that has no space."""

from pathlib import Path

from .tree import ROOT, read, written

MOST = 120


def long_lines(text: str) -> list[tuple[int, int]]:
    """(line, length) of each line that is too long."""
    found = []
    in_code = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            in_code = not in_code
        if in_code or line.lstrip().startswith(("|", "![")) or line.startswith("    ") or len(line) <= MOST:
            continue
        if " " in line.strip():
            found.append((number, len(line)))
    return found


def complaints(root: Path = ROOT) -> list[str]:
    return [
        f"{path}:{line}: {length} characters, {MOST} at most; break the line"
        for path in written(root, {".md"})
        for line, length in long_lines(read(path, root))
    ]
