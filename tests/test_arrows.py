"""The folder arrows hold, and the checker sees a forbidden one."""

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
spec = importlib.util.spec_from_file_location("check_arrows", ROOT / "tools/check_arrows.py")
check_arrows = importlib.util.module_from_spec(spec)
spec.loader.exec_module(check_arrows)


def test_no_forbidden_arrow():
    assert check_arrows.violations() == []
    assert check_arrows.room_violations() == []


def test_rooms_of_the_package_make_no_circle():
    listed = list(check_arrows.ROOMS)
    package = ROOT / check_arrows.PACKAGE
    assert {path.parent.name for path in package.glob("*/__init__.py")} == set(listed) - {""}
    for room, used in check_arrows.ROOMS.items():
        assert set(used) <= set(listed[: listed.index(room)]), room


def test_a_forbidden_arrow_is_seen(tmp_path, monkeypatch):
    for name, text in {
        "host/nav/a.c": '#include "whisker/ring.h"\n',
        "host/libwhisker/include/whisker/ring.h": "",
    }.items():
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(check_arrows, "ROOT", tmp_path)
    assert check_arrows.violations() == [
        "host/nav/a.c: host/nav must not use host/libwhisker; move the code or turn the arrow round"
    ]


@pytest.mark.parametrize(
    "line",
    [
        "from ..pilot.base import Base",
        "from .. import pilot",
        "from crunchbot.pilot import base",
        "import crunchbot.pilot.base",
    ],
)
def test_a_room_that_reaches_back_is_seen(tmp_path, monkeypatch, line):
    for name, text in {
        "touch/radial/model.py": line.replace("..", "..."),
        "touch/floor.py": line,
        "pilot/base.py": "",
    }.items():
        path = tmp_path / check_arrows.PACKAGE / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n")
    monkeypatch.setattr(check_arrows, "ROOT", tmp_path)
    assert check_arrows.room_violations() == [
        f"{check_arrows.PACKAGE}/{name}: touch must not use pilot; move the code or turn the arrow round"
        for name in ("touch/floor.py", "touch/radial/model.py")
    ]
