"""No circle between files: of what a C file includes (a source and its header are one module), of what it calls, and of what
a Python module imports.

A call is a name before a bracket that another file defines. Pointers to functions do not count, nor does an interface that a
file implements for its callers (INTERFACES).
"""

import ast
import re
from pathlib import Path

from .functions import DEFINITION, PRESCRIBED
from .tree import ROOT, read, written

# Headers of functions that a file below the caller implements: the firmware's port those of board/ for its core.
INTERFACES = ("firmware/dspic/board/",)
# Circles of calls that stay: files, and why.
WAIVED = {
    frozenset(
        f"firmware/dspic/port_dspic/{name}.c" for name in ("port", "chip/main")
    ): "the chip's vectors call the port, which jumps by it to the application; a simulated node has another jump",
    frozenset(
        f"sim/dspic/{name}.c" for name in ("dma", "dspic", "events", "interrupts", "pins", "spi", "system", "timer")
    ): "the blocks of a chip act on one another as its wires do: an event of SPI asks DMA for a word, which SPI gives",
}
OUTSIDE = re.compile(r"(^|/)tests?/|/test_|/tb/|fuzz|bench")  # test programs: what several define is not one function
NOISE = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'', re.DOTALL)
CALL = re.compile(r"\b([A-Za-z_]\w*)\(")
INCLUDE = re.compile(r'^\s*#\s*include\s+["<]([^">]+)[">]', re.MULTILINE)
PACKAGES = {"crunchbot": "host/python", "crunchbot_lab": "lab"}


def includes(root: Path) -> dict[str, set[str]]:
    """C and C++ module (path without suffix) -> modules it includes. A name held by several folders is the nearest one.

    A source, its header and an internal header (`spi_state.h` of `spi.c`, without a source of its own) are one module.
    """
    paths = written(root, {".c", ".h", ".cpp", ".hpp"})
    headers: dict[str, list[str]] = {}
    for path in paths:
        if path.endswith((".h", ".hpp")):
            headers.setdefault(Path(path).name, []).append(path)
    sources = {path.rsplit(".", 1)[0] for path in paths if not path.endswith((".h", ".hpp"))}

    def module_of(path: str) -> str:
        stem = path.rsplit(".", 1)[0]
        outer = [source for source in sources if stem.startswith(source + "_")]
        return max(outer, key=len) if stem not in sources and outer else stem

    graph: dict[str, set[str]] = {}
    for path in paths:
        module = module_of(path)
        used = graph.setdefault(module, set())
        for name in INCLUDE.findall(read(path, root)):
            candidates = [p for p in headers.get(Path(name).name, []) if p == name or p.endswith("/" + name)]
            if candidates:
                used.add(module_of(max(candidates, key=lambda p: _common(p, path))))
        used.discard(module)
    return graph


def _common(one: str, other: str) -> int:
    """How many leading folders two paths share."""
    n = 0
    for a, b in zip(Path(one).parts, Path(other).parts, strict=False):
        if a != b:
            break
        n += 1
    return n


def imports(root: Path) -> dict[str, set[str]]:
    """Python module of the packages (dotted) -> modules of the packages it imports, inside functions too."""
    files = {}
    for package, place in PACKAGES.items():
        base = root / place
        for path in sorted((base / package).rglob("*.py")):
            parts = path.relative_to(base).with_suffix("").parts
            files[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    graph = {}
    for module, path in files.items():
        inside = module if path.name == "__init__.py" else module.rpartition(".")[0]
        used = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                used |= {name.name for name in node.names}
            elif isinstance(node, ast.ImportFrom):
                start = inside.split(".")[: len(inside.split(".")) - node.level + 1] if node.level else []
                base_name = ".".join([*start, *filter(None, [node.module])])
                # `from package import module` uses the module; of anything else, the package's own file.
                used |= {f"{base_name}.{n.name}" if f"{base_name}.{n.name}" in files else base_name for n in node.names}
        graph[module] = (used & files.keys()) - {module}
    return graph


def _nearest(candidates: set[str], path: str) -> str | None:
    """The one that shares most folders with the path; None where none does more than others."""
    best = max((_common(one, path) for one in candidates), default=0)
    near = [one for one in candidates if _common(one, path) == best]
    return near[0] if len(near) == 1 else None


def calls(root: Path) -> dict[str, dict[str, str]]:
    """C file -> file that it calls a function of -> the first such function by name."""
    text = {path: NOISE.sub(" ", read(path, root)) for path in written(root, {".c", ".h"}) if not OUTSIDE.search(path)}
    implemented = {name for path in text if path.startswith(INTERFACES) for name in CALL.findall(text[path])}
    defined: dict[str, set[str]] = {}  # function that others may call -> files
    called: dict[str, set[str]] = {}
    for path in (path for path in text if path.endswith(".c")):
        found = list(DEFINITION.finditer(text[path]))
        called[path] = set(CALL.findall(text[path])) - {match["name"] for match in found}
        for name in (match["name"] for match in found if not re.search(r"\bstatic\b", match[0])):
            if name not in implemented and not PRESCRIBED.match(name):
                defined.setdefault(name, set()).add(path)
    graph: dict[str, dict[str, str]] = {path: {} for path in called}
    for path, names in called.items():
        for name in sorted(names & defined.keys()):
            if place := _nearest(defined[name], path):
                graph[path].setdefault(place, name)
    return graph


def circles_of_calls(root: Path) -> list[str]:
    graph = calls(root)
    groups = circles({path: set(used) for path, used in graph.items()})
    found = [
        f"circle of calls: {', '.join(sorted(group))}: waived in {__name__}, and there is none; take the waiver out"
        for group in WAIVED.keys() - set(map(frozenset, groups))
        if group & graph.keys()
    ]
    for group in groups:
        if frozenset(group) not in WAIVED:
            each = [(path, next(other for other in group if other in graph[path])) for path in group]
            named = ", ".join(f"{path} calls {graph[path][other]}() of {other}" for path, other in each)
            found.append(f"circle of calls: {named}; move what both need to a third file")
    return found


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Groups of modules that reach one another (Tarjan's strongly connected components), without recursion."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    on_stack: set[str] = set()
    found = []
    for start in graph:
        if start in index:
            continue
        work = [(start, iter(sorted(graph[start])))]
        index[start] = low[start] = len(index)
        stack.append(start)
        on_stack.add(start)
        while work:
            node, following = work[-1]
            for other in following:
                if other not in graph:
                    continue
                if other not in index:
                    index[other] = low[other] = len(index)
                    stack.append(other)
                    on_stack.add(other)
                    work.append((other, iter(sorted(graph[other]))))
                    break
                if other in on_stack:
                    low[node] = min(low[node], index[other])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    group = []
                    while True:
                        group.append(stack.pop())
                        on_stack.discard(group[-1])
                        if group[-1] == node:
                            break
                    if len(group) > 1:
                        found.append(sorted(group))
    return found


def complaints(root: Path = ROOT) -> list[str]:
    return [
        f"circle: {' <-> '.join(group)}; move what both need to a third file"
        for graph in (includes(root), imports(root))
        for group in circles(graph)
    ] + circles_of_calls(root)
