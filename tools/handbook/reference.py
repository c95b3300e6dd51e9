"""Writes the pages of the API: one for each library's headers, one for each room of the Python packages."""

import importlib
import pkgutil
from pathlib import Path
from types import ModuleType

LIBRARIES = {
    "whisker": "libwhisker: from the bridge to any number of readers",
    "whisker-nav": "libwhisker-nav: perception and localisation",
    "whisker-create": "libwhisker-create: iRobot Create 1 and 2",
}
PACKAGES = ("crunchbot", "crunchbot_lab", "whisker_protocol")
PRIVATE = ("_", "build_ffi")  # beginnings of the last word of a name


def write_reference(folder: Path, headers: list[str]) -> None:
    """api/c and api/python below the site's source."""
    pages = {f"c/{name}": c_page(name, title, headers) for name, title in LIBRARIES.items()}
    for package in PACKAGES:
        pages |= {f"python/{name}": text for name, text in python_pages(importlib.import_module(package)).items()}
    entries = "\n".join(f"   {name}" for name in pages)
    pages["index"] = f"{titled('API')}\n.. toctree::\n   :maxdepth: 1\n\n{entries}\n"
    for name, text in pages.items():
        path = folder / f"{name}.rst"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def titled(text: str, line: str = "=") -> str:
    return f"{text}\n{line * len(text)}\n"


def c_page(library: str, title: str, headers: list[str]) -> str:
    """All headers of a library."""
    mine = [header for header in headers if header.split("/")[0] == library]
    parts = [f"{titled(header.partition('/')[2], '-')}\n.. doxygenfile:: {Path(header).name}\n" for header in mine]
    return "\n".join([titled(title), *parts])


def python_pages(package: ModuleType) -> dict[str, str]:
    """A page for each room of a package: the modules right below it."""
    found = {package.__name__: [package.__name__]}
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if any(word.startswith(PRIVATE) for word in module.name.split(".")):
            continue
        room = module.name if module.ispkg else module.name.rpartition(".")[0]
        found.setdefault(room, []).append(module.name)
    return {room: "\n".join([titled(room), *map(_module, names)]) for room, names in found.items()}


def _module(name: str) -> str:
    return f"{titled(name, '-')}\n.. automodule:: {name}\n"
