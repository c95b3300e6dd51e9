"""Peers of the mapper: what they are given and answer, and laser logs with beams cut short."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))
from benches import store
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


def test_a_peer_that_fails_is_left_out_with_its_error(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "LEFT_OUT", {})
    monkeypatch.setattr(map_peers.peer_runs, "built", lambda *_: None)
    monkeypatch.setenv("MAP_PEER_BROKEN", program(tmp_path, "import sys\nsys.exit('no such thing')\n"))
    assert map_peers.programs(tmp_path) == {}
    assert "no such thing" in store.LEFT_OUT["broken"] and "MAP_PEER_GMAPPING" in store.LEFT_OUT["gmapping"]


def test_beams_of_a_log_are_cut_and_its_wheels_are_its_odometry(tmp_path):
    lines = []
    for k in range(80):
        lines.append(f"ODOM {0.1 * k} 0 0 0 0 0 {k} host {k}")
        ranges = " ".join(["0.25" if beam == 90 else "5.0" for beam in range(181)])
        lines.append(f"FLASER 181 {ranges} {0.09 * k} 0 0 {0.09 * k} 0 0 {k} host {k}")
    (tmp_path / "hall.log").write_text("\n".join(lines))
    robot, _, rows = map_peers.clipped(tmp_path / "hall.log", 0.3, 0)
    whiskers = robot.of_role("object")
    touched = np.isfinite(rows.radial_m)
    assert len(rows) == 80 and len(whiskers) == map_peers.BEAMS
    assert touched.sum() == 80 and (rows.radial_m[touched] == 0.25).all()
    assert abs(whiskers[int(np.flatnonzero(touched[0])[0])].yaw_rad) < 1e-9
    assert rows.odometry[1:] == pytest.approx(np.array([[0.1, 0.0, 0.0]] * 79))
    assert rows.truth[-1, 0] == pytest.approx(79 * 0.09)
    poses, _ = map_peers.by_program(program(tmp_path, WHEELS), (robot, ("NONE",), rows), 0)
    assert poses[-1] == pytest.approx([7.9, 0.0, 0.0])


SCAN = "FLASER 2 1 1 0 0 0 0 0 0 0 host 0\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("nothing\n", "hall.log: no lines of ODOM and FLASER"),
        ("ODOM 0 0\n", "hall.log:1: ODOM: "),
        ("FLASER many\n", "hall.log:1: FLASER: "),
        ("FLASER 9 1 1\n", "hall.log:1: FLASER: "),
        (SCAN + SCAN.replace("2 1 1", "3 1 1 1"), "hall.log:2: FLASER: 3 beams, 2 before"),
    ],
)
def test_a_file_that_is_no_log_is_one_line(text, said, tmp_path):
    (tmp_path / "hall.log").write_text(text)
    with pytest.raises(SystemExit, match=said):
        map_peers.scans(tmp_path / "hall.log")


def test_a_log_that_is_not_there_is_one_line(tmp_path):
    with pytest.raises(SystemExit, match="hall.log: .*; give --log a log"):
        map_peers.scans(tmp_path / "hall.log")
