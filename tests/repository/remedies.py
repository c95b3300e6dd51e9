"""What the programs' messages name: commands of `whisker` with their options, options, make targets, packages."""

import ast
import json
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PYTHON = ("host/python/crunchbot", "lab/crunchbot_lab", "sim/wheel/crunchbot_sim")
C = ("host/libwhisker", "host/apps", "host/create", "host/command_line", "sim/robot", "sim/bridge", "sim/create")
STRING = r'"(?:[^"\\\n]|\\.)*"'
# A command stands in quotes, or behind a word or sign that leads to it; "the whisker does not ..." is no command.
COMMAND = re.compile(
    r"(?:[`'(]|\b(?:see|run|try|next|by|of|with|start|and|then|sudo|anew):? |[;:] )whisker ((?:[a-z]|\{)[^`';,.()]*)"
)
MAKE = re.compile(r"(?:[`';:] ?|\brun |\bit: )make ([a-z-]+)(?=[`';,)]| [A-Z_]+=|$)")
PIP = re.compile(r"pip install ((?:--?\S+ \S+ )*)'?([a-z-]+)(?:\[([a-z,{}]+)\])?")
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
# What these name is theirs; a word alone is no message, but one of a command line.
FOREIGN = re.compile(
    r"\b(cmake|udevadm|usbip|pip|systemctl|rosbags-convert)\b[^;,)']*|var\([^)]*\)|^'?--[\w-]+(=\w+)?'?$"
)
DUMP = """
import argparse, json, re
from crunchbot.cli import COMMANDS, parser_of
def actions(parser):
    inner = next((a.choices for a in parser._actions if isinstance(a, argparse._SubParsersAction)), {})
    options = [option for a in parser._actions for option in a.option_strings]
    return {"options": options, "inner": {name: actions(one) for name, one in inner.items()}}
print(json.dumps({name: actions(parser_of(name))["inner"][name] for name in COMMANDS}))
"""


def commands(python: str | Path, **options) -> dict:
    """{command: {"options": [...], "inner": {action: the same}}} as the `whisker` of this Python understands them."""
    done = subprocess.run([str(python), "-c", DUMP], capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def messages() -> Iterator[tuple[Path, str]]:
    """(file, text) of every string that a program may print; what a format fills in is {}."""
    for folder in PYTHON:
        for path in sorted((ROOT / folder).rglob("*.py")):
            yield from ((path, text) for text in _of_python(path))
    for folder in C:
        for path in sorted((ROOT / folder).rglob("*.[ch]*")):
            if "test" not in path.as_posix():
                yield from ((path, text) for text in _of_c(path.read_text()))
    for path in (ROOT / "host/python/crunchbot/view/page").glob("*.js"):
        yield from ((path, text) for text in re.findall(r"'[^'\n]+'|`[^`\n]+`", path.read_text()))
    yield from ((ROOT / "protocol/whisker.toml", text) for text in _of_c((ROOT / "protocol/whisker.toml").read_text()))


def _of_python(path: Path) -> Iterator[str]:
    tree = ast.parse(path.read_text())
    inside = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in ast.walk(node)}
    bare = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}  # docstrings
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inside | bare:
            yield node.value


def _of_c(source: str) -> Iterator[str]:
    code = re.sub(r"/\*.*?\*/|^\s*//[^\n]*", "", source, flags=re.S | re.M).replace("\\\n", "\n")
    for found in re.finditer(rf"{STRING}(?:\s*{STRING})*", code):
        yield "".join(part[1:-1] for part in re.findall(STRING, found[0]))


def wrong_in(text: str, known: dict, options: set[str], targets: set[str], packages: dict[str, set[str]]) -> list[str]:
    """What the text names and is not there."""
    wrong = []
    for found in COMMAND.findall(text):
        words = found.split()
        if not words or words[0].startswith("{"):
            continue
        parser, said = known.get(words[0]), words[0]
        if parser and parser["inner"] and len(words) > 1 and not words[1].startswith(("-", "{")):
            parser, said = parser["inner"].get(words[1]), " ".join(words[:2])
        wrong += [] if parser else [f"whisker {said}"]
        wrong += [f"whisker {said} {o}" for o in OPTION.findall(found) if parser and o not in parser["options"]]
    ours = FOREIGN.sub("", text)
    wrong += [option for option in OPTION.findall(ours) if option not in options]
    wrong += [f"make {target}" for target in MAKE.findall(text) if target not in targets]
    for given, package, extras in PIP.findall(text):
        missing = [e for e in extras.split(",") if e and not e.startswith("{") and e not in packages.get(package, ())]
        beside = package != "crunchbot" or "lab" in extras  # no index has these before a release
        if package not in packages or missing or (beside and "--find-links dist" not in given):
            wrong.append(f"pip install {given}{package}[{extras}]")
    return wrong
