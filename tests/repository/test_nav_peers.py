"""The peers of the navigation bench: what is native builds with this tree's headers, and a build that fails is no package
that is missing."""

import os
import re
import sys
from pathlib import Path

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
