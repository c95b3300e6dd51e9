"""The peers of the navigation bench: what is native builds with this tree's headers, and a build that fails is no package
that is missing."""

import importlib
import os
import re
import sys
from pathlib import Path

import numpy as np

from crunchbot_lab import scenes

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("WHISKER_BUILD", ROOT / "build/release"))
sys.path.insert(0, str(ROOT / "tools"))
from benches import store  # noqa: E402
from benches.nav import peer_runs  # noqa: E402


def configure(source: Path, build: Path) -> tuple:
    library = next(BUILD.rglob("libwhisker-nav.a"))
    return ("cmake", "-S", source, "-B", build, f"-DNAV_LIBRARY={library}", "-DCMAKE_BUILD_TYPE=Debug")


def test_what_all_native_peers_share_builds_with_the_headers_of_this_tree(tmp_path):
    build = ("cmake", "--build", tmp_path, "--target", "peer")
    assert store.failure(configure(peer_runs.PEERS, tmp_path), build) == ""


def test_weights_for_packages_in_python_are_the_librarys(tmp_path, monkeypatch):
    """The true pose weighs more than others, none has a weight where the robot cannot stand; a row again says nothing."""
    build = ("cmake", "--build", tmp_path, "--target", "weigh")
    assert store.failure(configure(peer_runs.PEERS, tmp_path), build) == ""
    monkeypatch.setenv("NAV_WEIGH", str(tmp_path / "libweigh.so"))
    monkeypatch.syspath_prepend(peer_runs.PEERS)
    made, rng, ahead = scenes.make("anchor", 4, rows=100), np.random.default_rng(1), []
    weigher = importlib.import_module("weigher").Weigher(made.scene)
    for k in range(100):
        motion, news = weigher.take(made.observations, k)
        assert np.array_equal(motion.step, made.observations.odometry[k])
        anywhere = rng.uniform((0, 0, -np.pi), (2.5, 2.5, np.pi), (50, 3))
        loglik = weigher.weigh(np.vstack([made.observations.truth[k], anywhere]))
        blocked = [not made.scene.arena.is_free(x, y, made.scene.robot.body_radius_m) for x, y, _ in anywhere]
        assert np.isfinite(loglik[0]) and np.array_equal(np.isneginf(loglik[1:]), blocked)
        ahead += [np.mean(loglik[1:] <= loglik[0])] if news else []
    assert len(ahead) > 50 and np.mean(ahead) > 0.85
    motion, news = weigher.take(made.observations, 99)
    assert not news and not motion.step.any()


def test_a_build_that_fails_is_reported_with_its_error_and_not_as_a_missing_package(tmp_path, monkeypatch, capsys):
    source = tmp_path / "peers"
    source.mkdir()
    lines = ["cmake_minimum_required(VERSION 3.25)", "project(broken C)", "add_executable(mrpt_peer broken.c)"]
    (source / "CMakeLists.txt").write_text("\n".join(lines))
    (source / "broken.c").write_text("int main(void) { return nothing_of_this_name; }")
    monkeypatch.setattr(peer_runs, "ROOT", tmp_path)
    monkeypatch.setattr(peer_runs, "PEERS", source)
    monkeypatch.setattr(peer_runs, "NATIVE", tmp_path / "build")
    assert peer_runs.mrpt_entries(BUILD, 1) == []
    assert re.search(r"does not build: .*nothing_of_this_name", capsys.readouterr().out)
    (source / "broken.c").unlink()
    (source / "CMakeLists.txt").write_text("\n".join(lines[:2]))
    monkeypatch.setattr(peer_runs, "NATIVE", tmp_path / "another")
    assert peer_runs.mrpt_entries(BUILD, 1) == []
    assert "left out: MRPT: not installed" in capsys.readouterr().out
