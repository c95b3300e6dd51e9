"""Every public function of the Python packages states the types of its parameters and of its result."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("host/python/crunchbot", "lab/crunchbot_lab", "protocol/whisker_protocol")
# Functions of one signature, (b: Behaviour, tick: int), in tables of the module that holds Behaviour and imports them.
ALIKE = {"pilot/conditions.py", "pilot/effects.py"}


def untyped(body: list[ast.stmt], inside: str = "", method: bool = False) -> list[str]:
    """Public functions that lack a type, and which it is."""
    found = []
    for node in body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            found += untyped(node.body, f"{inside}{node.name}.", True)
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        made = node.name == "__init__"
        if node.name.startswith("_") and not made:
            continue
        static = any(getattr(mark, "id", "") == "staticmethod" for mark in node.decorator_list)
        taken = node.args.posonlyargs + node.args.args
        taken = taken[method and not static :] + node.args.kwonlyargs
        taken += [more for more in (node.args.vararg, node.args.kwarg) if more]
        lacking = [each.arg for each in taken if each.annotation is None]
        lacking += ["its result"] if node.returns is None and not made else []
        found += [f"{inside}{node.name}: {name}" for name in lacking]
    return found


@pytest.mark.parametrize("package", PACKAGES)
def test_public_functions_have_types(package):
    files = [path for path in (ROOT / package).rglob("*.py") if "tests" not in path.parts]
    assert files
    lacking = [
        f"{path.relative_to(ROOT)}: {text}"
        for path in files
        if "/".join(path.parts[-2:]) not in ALIKE
        for text in untyped(ast.parse(path.read_text()).body)
    ]
    assert not lacking


def test_a_missing_type_is_seen():
    text = "class A:\n    def f(self, x: int, y) -> int: ...\n    def _g(self, z): ...\ndef h(): ..."
    assert untyped(ast.parse(text).body) == ["A.f: y", "h: its result"]
