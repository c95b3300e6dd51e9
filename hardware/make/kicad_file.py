"""KiCad's files as nested lists: reading, writing, and names that stay the same from run to run."""

import re
import uuid
from pathlib import Path

TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[()]|[^\s()]+')


class Word(str):
    """A bare word of the file: written without quotes."""


def read(path: Path) -> list:
    """The file's outermost list: elements are str (quoted in the file), Word (bare) and lists of these."""
    stack: list[list] = [[]]
    for token in TOKEN.findall(path.read_text(encoding="utf-8")):
        if token == "(":
            stack.append([])
        elif token == ")":
            done = stack.pop()
            stack[-1].append(done)
        else:
            quoted = token.startswith('"')
            stack[-1].append(re.sub(r"\\(.)", r"\1", token[1:-1]) if quoted else Word(token))
    return stack[0][0]


def write(node, depth: int = 0) -> str:
    """Text of a list as `read` gives it; numbers are written as they are in KiCad's files."""
    if isinstance(node, (list, tuple)):
        nested = any(isinstance(part, (list, tuple)) for part in node)
        parts = [write(part, depth + 1) for part in node]
        if not nested or node[0] == "pts":  # thousands of corners: on one line
            return "(" + " ".join(parts) + ")"
        head = [part for part, item in zip(parts, node, strict=True) if not isinstance(item, (list, tuple))]
        rest = [part for part, item in zip(parts, node, strict=True) if isinstance(item, (list, tuple))]
        indent = "\n" + "\t" * (depth + 1)
        return "(" + " ".join(head) + indent + indent.join(rest) + "\n" + "\t" * depth + ")"
    if isinstance(node, Word):
        return str(node)
    if isinstance(node, (int, float)):
        return f"{node:.4f}".rstrip("0").rstrip(".") if isinstance(node, float) else str(node)
    return '"' + node.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'


def child(node: list, name: str) -> list | None:
    """The first list within a list that begins with the name."""
    return next((part for part in node if isinstance(part, list) and part and part[0] == name), None)


def children(node: list, name: str) -> list[list]:
    """All lists within a list that begin with the name."""
    return [part for part in node if isinstance(part, list) and part and part[0] == name]


def identity(*names: object) -> str:
    """A UUID that depends on the names only, so that the files come out alike in every run."""
    return str(uuid.uuid5(uuid.NAMESPACE_URL, "crunchbot/" + "/".join(map(str, names))))
