"""Runs of the open tools are copied where the same tool ran on the same files, and nowhere else."""

import sys
from pathlib import Path

import pytest

sys.path[:0] = [str(Path(__file__).resolve().parents[1])]

import kept_runs  # noqa: E402
import toolchain  # noqa: E402

pytestmark = pytest.mark.skipif(bool(toolchain.missing("yosys")), reason=toolchain.missing("yosys"))
DESIGN = "module top(input clk, input d, output reg q); always @(posedge clk) q <= d; endmodule\n"
SCRIPT = "read_verilog top.v\nprep -top top\nwrite_json out.json\n"


@pytest.fixture
def started(monkeypatch, tmp_path):
    """Tools that were really started; the cache is this test's own."""
    monkeypatch.setattr(kept_runs, "cache_folder", lambda: tmp_path / "cache/runs")  # the tools' own cache stays
    names, run = [], toolchain.subprocess.run
    monkeypatch.setattr(toolchain.subprocess, "run", lambda words, **more: names.append(words) or run(words, **more))
    return names


def synthesised(folder: Path, design: str = DESIGN, *options: str) -> tuple[str, str]:
    """What yosys says and what it writes."""
    folder.mkdir()
    (folder / "top.v").write_text(design)
    (folder / "run.ys").write_text(SCRIPT)
    said = toolchain.must("yosys", *options, "-s", "run.ys", log=folder / "run.log")
    assert (folder / "run.log").read_text() == said
    return said, (folder / "out.json").read_text()


def test_the_same_run_is_copied(started, tmp_path):
    first, again = (synthesised(tmp_path / name) for name in ("a", "b"))
    assert first == again and len(started) == 1 and '"top"' in first[1]


def test_other_files_options_and_versions_run_anew(started, tmp_path, monkeypatch):
    first = synthesised(tmp_path / "a")
    assert synthesised(tmp_path / "b", DESIGN.replace("q <= d", "q <= !d"))[1] != first[1]
    synthesised(tmp_path / "c", DESIGN, "-q")
    monkeypatch.setattr(kept_runs.metadata, "version", lambda package: "another")
    synthesised(tmp_path / "d")
    assert len(started) == 4


def test_a_run_that_fails_is_not_kept(started, tmp_path):
    for name in ("a", "b"):
        with pytest.raises(toolchain.ToolError):
            synthesised(tmp_path / name, "module top(")
    assert len(started) == 2


def test_the_cache_holds_the_runs_that_were_used_last(started, tmp_path, monkeypatch):
    monkeypatch.setattr(kept_runs, "MOST", 2)
    for name, design in (("a", DESIGN), ("b", DESIGN + "// b\n"), ("a2", DESIGN), ("c", DESIGN + "// c\n")):
        synthesised(tmp_path / name, design)
    assert len(started) == 3 and len(list(kept_runs.cache_folder().iterdir())) == 2
    synthesised(tmp_path / "a3")
    assert len(started) == 3
    synthesised(tmp_path / "b2", DESIGN + "// b\n")
    assert len(started) == 4


def test_a_cache_that_cannot_be_written_costs_nothing(started, tmp_path):
    (tmp_path / "cache").write_text("a file")
    assert synthesised(tmp_path / "a")[1] == synthesised(tmp_path / "b")[1] and len(started) == 2
