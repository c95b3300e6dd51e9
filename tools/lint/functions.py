"""Every C function outside the tests carries its module's name, so that a search, a profile or a back trace says whose it is.
The module is the file (or a word of its name), a folder above it, or the library. In C++ the namespace or class says it."""

import re
from pathlib import Path

from .tree import ROOT, read, written

# A definition as clang-format leaves it: it begins in column 0 (or in a namespace) and its brace follows.
DEFINITION = re.compile(
    r"^(?!(?:#|//|/\*| |\t|\}|return|else|typedef|template|namespace|extern \"C\" \{))"
    r"[A-Za-z_][^;{}()=#]*?[\s*&](?P<name>[A-Za-z_]\w*)\([^;{}]*\)(?:\s*(?:const|noexcept))*\s*\{",
    re.MULTILINE,
)
# "board" and "cpu" are the interfaces that the firmware's ports implement.
LIBRARIES = ("whisker", "nav", "oi", "sim", "create", "board", "cpu")
# Names that a compiler, a linker or another library prescribes.
PRESCRIBED = re.compile(r"^(?:main|_\w+|LLVMFuzzer\w*|mem(?:cpy|set|cmp))$")


def prefixes(path: str) -> set[str]:
    """Words a function of this file may begin with."""
    parts = Path(path)
    words = {*parts.stem.split("_"), *(word for folder in parts.parts[:-1] for word in folder.split("_")), *LIBRARIES}
    return {form for word in words for form in (word, word.rstrip("s"), word + "s")}


def bare(path: str, text: str) -> list[tuple[int, str]]:
    """(line, name) of each function whose first word names no module."""
    allowed = prefixes(path)
    found = []
    for match in DEFINITION.finditer(text):
        name = match["name"]
        first, _, rest = name.partition("_")
        if not PRESCRIBED.match(name) and (not rest or first not in allowed) and name.lower() == name:
            found.append((text.count("\n", 0, match.start()) + 1, name))
    return found


def complaints(root: Path = ROOT) -> list[str]:
    found = []
    for path in written(root, {".c", ".h"}):
        text = read(path, root)
        if "test" in path or "/fuzz/" in path or "/bench" in path or "namespace " in text:
            continue
        found += [
            f"{path}:{line}: {name}() does not carry its module's name; write: {Path(path).stem}_{name}"
            for line, name in bare(path, text)
        ]
    return found
