"""Peers of the mapper: what they are given and answer."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))
from benches.nav import map_peers

WHEELS = "import sys\nfrom math import cos, sin\nx = y = t = 0.0\n" + (
    "lines = [line.split() for line in sys.stdin]\n"
    "for line in lines[1 + int(lines[0][1]):]:\n"
    "    dx, dy, turn = map(float, line[:3])\n"
    "    x, y, t = x + cos(t) * dx - sin(t) * dy, y + sin(t) * dx + cos(t) * dy, t + turn\n"
    "    print(x, y, t, 1.0)\n"
)


def program(folder: Path, text: str) -> str:
    path = folder / "peer"
    path.write_text(f"#!{sys.executable}\n{text}")
    path.chmod(0o755)
    return str(path)


def test_a_peer_gets_all_rows_and_is_judged_as_others(tmp_path):
    world = ("anchor", 3)
    peer, wheels = (map_peers.one(name, program(tmp_path, WHEELS), world, 0) for name in ("peer", "odometry"))
    assert peer["step_us_mean"] == 1.0
    assert peer["error_median_m"] == pytest.approx(wheels["error_median_m"], rel=1e-6)


def test_a_peer_that_fails_is_left_out_with_its_error(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(map_peers.peer_runs, "built", lambda *_: None)
    monkeypatch.setenv("MAP_PEER_BROKEN", program(tmp_path, "import sys\nsys.exit('no such thing')\n"))
    assert map_peers.programs(tmp_path) == {}
    said = capsys.readouterr().out
    assert "no such thing" in said and "MAP_PEER_GMAPPING" in said
