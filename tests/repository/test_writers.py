"""Nobody writes a file but by `crunchbot.outputs`: whole or not there, over nothing that somebody may want."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("host/python/crunchbot", "lab/crunchbot_lab")
WRITE = {"write_text", "write_bytes", "to_csv", "savefig", "copy", "copy2", "copyfile", "copytree", "move", "savez"}
OF = {"copy": "shutil", "move": "shutil"}  # words that other things have, too
ALLOWED = {
    "host/python/crunchbot/outputs.py": "it is the one that does",
    "host/python/crunchbot/build_ffi.py": "makes the module, before there is one to import",
    "lab/crunchbot_lab/signals/build_ffi.py": "likewise",
    "host/python/crunchbot/recording/exporting.py": "fills the place that `made` gives",
    "host/python/crunchbot/touch/calibration.py": "likewise; each contact is on the disk before the next is asked for",
    "lab/crunchbot_lab/demo/mapping.py": "likewise",
    "host/python/crunchbot/robot/journal.py": "goes on behind what its process wrote before",
    "host/python/crunchbot/robot/track.py": "likewise",
    "lab/crunchbot_lab/commands/pico_world.py": "a pipe to the board that is simulated",
    "host/python/crunchbot/bridge/pico_drive.py": "the drive of a board, which takes the image as it comes",
}


def plain_writes(tree: ast.AST) -> Iterator[int]:
    """Lines in which something is written by a call of Python's own."""
    for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
        name, of = "", ""
        if isinstance(call.func, ast.Attribute):
            name, of = call.func.attr, getattr(call.func.value, "id", "")
        elif isinstance(call.func, ast.Name):
            name = call.func.id
        modes = [
            word.value for word in (*call.args, *(k.value for k in call.keywords)) if isinstance(word, ast.Constant)
        ]
        opens = name == "open" and any(
            isinstance(m, str) and set(m) <= set("rwaxbt+") and set(m) & set("wax+") for m in modes
        )
        if opens or (name in WRITE and OF.get(name, of) == of) or (name == "save" and of in ("np", "numpy")):
            yield call.lineno


def test_everything_that_is_written_goes_through_one_module():
    found = {
        path.relative_to(ROOT).as_posix(): lines
        for package in PACKAGES
        for path in sorted((ROOT / package).rglob("*.py"))
        if "/tests/" not in path.as_posix() and (lines := list(plain_writes(ast.parse(path.read_text()))))
    }
    assert found.keys() == ALLOWED.keys(), {name: found[name] for name in found.keys() - ALLOWED.keys()}


@pytest.mark.parametrize(
    "text",
    [
        "Path(a).write_text(b)",
        "open(a, 'w')",
        "path.open('ab')",
        "open(a, mode='x')",
        "shutil.copy(a, b)",
        "np.save(a, b)",
    ],
)
def test_a_plain_write_is_found(text):
    assert list(plain_writes(ast.parse(text))) == [1]
    assert not list(plain_writes(ast.parse("open(a); open(b, 'rb'); rows.copy(); part.save(buffer)")))
