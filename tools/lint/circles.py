"""No circle between files: of what a C file includes (a source and its header are one module), and of what a Python module
imports."""

import ast
import re
from pathlib import Path

from .tree import ROOT, read, written

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
    ]
