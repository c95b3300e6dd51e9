"""The benches: each can be imported and starts programs that are built, results have their origin."""

import importlib
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BENCHES = ROOT / "tools/benches"
sys.path.insert(0, str(ROOT / "tools"))
from benches import __main__ as front  # noqa: E402
from benches import store, tables  # noqa: E402


@pytest.mark.parametrize("topic", front.TOPICS)
def test_a_topic_can_be_imported(topic):
    """Its imports are those of the tree as it is: a bench is run too seldom to find that out by itself."""
    assert callable(importlib.import_module(f"benches.{front.TOPICS[topic]}").run)


def test_a_topic_reports_its_options_and_one_that_is_not_there_is_named():
    def run(*words: str) -> subprocess.CompletedProcess:
        return subprocess.run([sys.executable, BENCHES, *words], capture_output=True, text=True, cwd=ROOT)

    reported = run("node", "--help").stdout
    assert "usage: tools/benches node " in reported and "--batches" in reported and "--build-dir" in reported
    done = run("--only", "nothing")
    assert done.returncode == 2 and "nothing" in done.stderr


def test_every_result_and_chart_has_its_command_and_every_result_its_origin():
    stored = {path.stem for path in store.RESULTS.glob("*.json")} - {Path(store.ORIGINS).stem}
    assert stored <= store.COMMAND_OF_RESULT.keys()
    assert stored == json.loads((store.RESULTS / store.ORIGINS).read_text()).keys()
    assert {path.name for path in store.CHARTS.iterdir()} <= {f"{name}.svg" for name in store.COMMAND_OF_CHART}
    assert {t[1] for command in store.MAKES if (t := re.match(r"tools/benches (\w+)", command))} <= front.TOPICS.keys()


def test_every_chart_stands_in_a_page_and_has_something_in_it():
    pages = [path.read_text() for path in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]]
    for chart in (ROOT / "docs/charts").iterdir():
        assert chart.read_text().rstrip().endswith("</svg>"), chart.name
        assert any(f"charts/{chart.name})" in page for page in pages), f"{chart.name}: no page shows it; delete it"


def test_a_result_is_stored_with_commit_and_machine(monkeypatch, tmp_path):
    monkeypatch.setattr(store, "commit", lambda: "0123456789ab")
    monkeypatch.setattr(store, "machine", lambda: "a processor, 2 processors")
    store.write_result("one", {"figure": 1, "many": [{"a": "x" * 300}, [2.5] * 100]}, tmp_path)
    store.write_result("another", [2], tmp_path)
    origins = json.loads((tmp_path / store.ORIGINS).read_text())
    assert list(origins) == ["another", "one"]
    assert origins["one"] == {"commit": "0123456789ab", "machine": "a processor, 2 processors"}
    assert json.loads((tmp_path / "one.json").read_text()) == {"figure": 1, "many": [{"a": "x" * 300}, [2.5] * 100]}


@pytest.mark.parametrize(
    ("text", "record", "shown"),
    [
        ("{a:1e3*.1f} ({b})", {"a": 0.01234, "b": "x"}, "12.3 (x)"),
        ("{a:.3g}", {"a": 12345.6}, "12346"),
        ("{a:.3g}", {"a": 12.3456}, "12.3"),
        ("{a[b]:.2f} m", {"a": {"b": 1.0}}, "1.00 m"),
        ("{a:.1f}", {"a": None}, "-"),
        (lambda row: row["a"] + 1, {"a": 1}, "2"),
    ],
)
def test_a_cell_is_a_pattern_of_a_records_fields(text, record, shown):
    assert tables.cell(text, record) == shown
    assert tables.lined([record], {"head": text}) == f"| head |\n| --- |\n| {shown} |\n"


def test_records_of_nested_results_are_named_by_the_keys_on_the_way():
    assert tables.named({"f": {"g": {"n": 1}}}, "family", "filter") == [{"family": "f", "filter": "g", "n": 1}]


def test_the_programs_that_benches_start_are_built():
    named = {
        name
        for path in BENCHES.rglob("*.py")
        for name in re.findall(r'\bbuild(?:_dir)? / "((?:host|sim|tests)/[\w/-]+)"', path.read_text())
    }
    for name in named:
        folder, _, program = name.rpartition("/")
        lists = [
            path for part in (ROOT / folder, *(ROOT / folder).parents) if (path := part / "CMakeLists.txt").exists()
        ]
        assert any(re.search(rf"\b{program}\b", path.read_text()) for path in lists), (
            f"{name}: no CMakeLists.txt names it"
        )


def test_what_is_kept_is_of_the_state_of_the_tree(monkeypatch, tmp_path):
    monkeypatch.setattr(store, "ROOT", tmp_path)
    git = ["git", "-C", tmp_path, "-c", "user.name=a", "-c", "user.email=a@b"]
    for name in ("host.c", "fpga.v", "docs/page.md", "bench/results/ring.json"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("one\n")
    for words in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", "one"]):
        subprocess.run([*git, *words], check=True)

    def states() -> tuple[str, str]:
        store.state.cache_clear()
        return store.state(), store.state("fpga.v")

    first = states()
    for name in ("docs/page.md", "bench/results/ring.json"):
        (tmp_path / name).write_text("two\n")
    assert states() == first, "what benches write is no part of it"
    (tmp_path / "host.c").write_text("two\n")
    changed = states()
    assert changed[0] != first[0] and changed[1] == first[1]
    store.state.cache_clear()


def test_place_and_route_is_repeated_for_other_gateware_only(monkeypatch, tmp_path):
    from benches.bridge import bench

    run = {"lanes": 6, "seed": 2}
    stored = {"gateware": "0123456789ab", "boards": {"ulx3s": {"runs": [run, {"lanes": 28}]}}}
    monkeypatch.setattr(bench, "CACHE", tmp_path)
    monkeypatch.setattr(bench.store, "read_result", lambda name: stored)
    monkeypatch.setattr(bench, "GATEWARE", "0123456789ab")
    assert bench.default_build("ulx3s", 6, [0]) == run
    assert bench.default_build("ulx3s", 28, [0]) is None, "it was not placed"
    monkeypatch.setattr(bench, "GATEWARE", "ba9876543210")
    assert bench.default_build("ulx3s", 6, [0]) is None


def test_a_peers_own_error_is_found(tmp_path):
    (tmp_path / "a.c").write_text("int main(void) { return 0; }\n")
    (tmp_path / "b.c").write_text("int main(void) { return nothing; }\n")
    assert store.failure(["cc", tmp_path / "a.c", "-o", tmp_path / "a"]) == ""
    assert "-lbsd-not-there" in store.failure(["cc", tmp_path / "a.c", "-lbsd-not-there", "-o", tmp_path / "a"])
    assert "nothing" in store.failure(["true"], ["cc", tmp_path / "b.c", "-o", tmp_path / "b"])
    rust = "error: linking with `cc` failed\\n  = note: rust-lld: error: unable to find library -lbsd\\n"
    assert "-lbsd" in store.failure(["python3", "-c", f"print('{rust}'); exit(1)"])


def test_a_measurement_is_whole_or_not_there(tmp_path):
    with pytest.raises(ZeroDivisionError):
        store.once(tmp_path / "part/a.json", lambda: 1 / 0)
    assert store.once(tmp_path / "part/a.json", lambda: [1]) == [1] == store.once(tmp_path / "part/a.json", lambda: [2])
