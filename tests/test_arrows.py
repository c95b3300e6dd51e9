"""The folder arrows hold, and the checker sees a forbidden one."""

import importlib.util
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
spec = importlib.util.spec_from_file_location("check_arrows", ROOT / "tools/check_arrows.py")
check_arrows = importlib.util.module_from_spec(spec)
spec.loader.exec_module(check_arrows)


def test_no_forbidden_arrow():
    assert check_arrows.violations() == []


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
