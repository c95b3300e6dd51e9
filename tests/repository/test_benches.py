"""The front of the benches: every topic is there, can be asked for alone, and what it takes is what its run knows."""

import ast
import contextlib
import importlib
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BENCHES = ROOT / "tools/benches"
FRONT = (BENCHES / "__main__.py").read_text()
TOPICS = dict(re.findall(r'^    "(\w+)": "([\w.]+)",$', FRONT, re.MULTILINE))


def functions(module: Path) -> dict[str, ast.FunctionDef]:
    return {node.name: node for node in ast.parse(module.read_text()).body if isinstance(node, ast.FunctionDef)}


def module_of(topic: str) -> Path:
    return BENCHES / (TOPICS[topic].replace(".", "/") + ".py")


@pytest.mark.parametrize("topic", TOPICS)
def test_run_takes_a_build_and_all_its_options(topic):
    found = functions(module_of(topic))
    run = found["run"].args
    assert run.args[0].arg.lstrip("_") == "build"
    assert len(run.args) - len(run.defaults) == 1  # the rest has standards
    options = ast.unparse(found["options"]) if "options" in found else ""
    wanted = set(re.findall(r"add_argument\('--(\w+)'", options))
    assert run.kwarg or wanted == {a.arg for a in run.args[1:]}


def test_every_module_with_a_run_is_a_topic():
    with_run = {p for p in [*BENCHES.glob("*.py"), *BENCHES.glob("*/*.py")] if "run" in functions(p)}
    assert with_run == {module_of(topic) for topic in TOPICS}


def front(*words: str) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, BENCHES, *words], capture_output=True, text=True, cwd=ROOT)


def test_the_front_reports_topics_and_a_topic_reports_its_options():
    assert ", ".join(TOPICS) in " ".join(front("--help").stdout.split())
    reported = front("node", "--help").stdout
    assert "usage: tools/benches node " in reported and "--batches" in reported and "--build-dir" in reported


def test_a_topic_that_is_not_there_is_named():
    done = front("--only", "nothing")
    assert done.returncode == 2 and "nothing" in done.stderr
    done = front("nothing")
    assert done.returncode == 2 and "nothing" in done.stderr


def test_a_part_of_the_robot_measured_alone_leaves_the_others_as_published(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from benches.markdown import wrap
    from benches.robot import bench, page

    monkeypatch.setattr(bench, "CACHE", tmp_path)
    before = bench.gather()
    assert wrap(page.page(before)) == (ROOT / "docs/results/robot.md").read_text()
    (tmp_path / "instructions.json").write_text(json.dumps(before["latency"]))
    after = bench.gather()
    assert after.pop("instructions") == before["latency"] and after.items() <= before.items()


def test_every_result_and_chart_has_its_command_and_every_result_its_origin():
    sys.path.insert(0, str(ROOT / "tools"))
    from benches import store

    stored = {path.stem for path in store.RESULTS.glob("*.json")} - {Path(store.ORIGINS).stem}
    assert stored <= store.COMMAND_OF_RESULT.keys()
    assert stored == json.loads((store.RESULTS / store.ORIGINS).read_text()).keys()
    assert {path.name for path in store.CHARTS.iterdir()} <= {f"{name}.svg" for name in store.COMMAND_OF_CHART}
    for command in store.MAKES:
        if topic := re.match(r"tools/benches (\w+)", command):
            assert topic[1] in TOPICS


def test_every_chart_stands_in_a_page_and_has_something_in_it():
    pages = [path.read_text() for path in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]]
    for chart in (ROOT / "docs/charts").iterdir():
        assert chart.read_text().rstrip().endswith("</svg>"), chart.name
        assert any(f"charts/{chart.name})" in page for page in pages), f"{chart.name}: no page shows it; delete it"


def test_a_result_is_stored_with_commit_and_machine(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from benches import store

    monkeypatch.setattr(store, "commit", lambda: "0123456789ab")
    monkeypatch.setattr(store, "machine", lambda: "a processor, 2 processors")
    store.write_result("one", {"figure": 1}, tmp_path)
    store.write_result("another", [2], tmp_path)
    origins = json.loads((tmp_path / store.ORIGINS).read_text())
    assert list(origins) == ["another", "one"]
    assert origins["one"] == {"commit": "0123456789ab", "machine": "a processor, 2 processors"}
    assert json.loads((tmp_path / "one.json").read_text()) == {"figure": 1}


def test_every_page_of_results_is_what_its_generator_makes_of_the_stored_results(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from benches import pages
    from benches.markdown import wrap

    stored = {f"docs/results/{path.name}" for path in (ROOT / "docs/results").iterdir()} | {"docs/results.md"}
    assert pages.PAGES.keys() == stored - {"docs/results/archive.md"}
    for path, make in pages.PAGES.items():
        assert wrap(make()) == (ROOT / path).read_text(), f"{path}: run '.venv/bin/python tools/benches page'"


def test_the_page_of_results_has_at_most_twenty_figures(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from benches import headlines

    assert len(headlines.HEADLINES) <= headlines.MOST


def test_a_page_follows_its_figures(monkeypatch):
    """No page holds a figure that its generator does not read from the results."""
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from benches import headlines, pages, store

    def moved(value):
        """The same data with every figure changed."""
        if isinstance(value, dict):
            return {key: moved(part) for key, part in value.items()}
        if isinstance(value, list):
            return [moved(part) for part in value]
        return value * 1.37 if isinstance(value, float) else value

    for one in headlines.HEADLINES:
        data = store.read_result(one.result)
        if any(isinstance(figure, float) for figure in leaves(data)) and "." in one.value(data):
            assert one.value(moved(data)) != one.value(data), one.title
    assert (
        pages.studies.demo(moved(store.read_result("demo")), store.read_result("localisation"))
        != (ROOT / "docs/results/demo.md").read_text()
    )


def leaves(value) -> list:
    if isinstance(value, dict):
        return [leaf for part in value.values() for leaf in leaves(part)]
    return [leaf for part in value for leaf in leaves(part)] if isinstance(value, list) else [value]


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("short\nlines\n", "short\nlines\n"),
        ("| " + "cell " * 40 + "|\n", "| " + "cell " * 40 + "|\n"),
        ("word " * 30 + "\n", "word " * 23 + "word\n" + "word " * 5 + "word\n"),
        ("- " + "word " * 30 + "\n- next\n", "- " + "word " * 22 + "word\n  " + "word " * 6 + "word\n- next\n"),
        ("word " * 23 + "word - more " + "word\n", "word " * 23 + "word\nmore"),
    ],
)
def test_lines_of_a_page_are_broken_where_markdown_allows_it(monkeypatch, before, after):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from benches.markdown import wrap

    done = wrap(before)
    assert all(len(line) <= 120 or line.startswith("|") for line in done.splitlines())
    assert done.split() == before.split()
    if " - " in before:
        assert not any(line.startswith("- ") for line in done.splitlines())
    else:
        assert done.replace(" \n", "\n") == after


@pytest.mark.parametrize("topic", TOPICS)
def test_a_topic_can_be_imported(topic, monkeypatch):
    """Its imports are those of the tree as it is: a bench is run too seldom to find that out by itself."""
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    assert callable(importlib.import_module(f"benches.{TOPICS[topic]}").run)


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


@pytest.fixture
def rounds(monkeypatch, tmp_path):
    """The module of rounds, whose topics are functions of the test, measured in this process."""
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from benches import rounds, store

    monkeypatch.setattr(store, "BENCH", tmp_path)
    monkeypatch.setattr(store, "commit", lambda: "0123456789ab")
    rounds.topics = {}

    def measure(topic: str, words: list[str]) -> dict:
        monkeypatch.setattr(store, "LEFT_OUT", {})
        monkeypatch.setattr(store, "WROTE", [])
        with contextlib.suppress(RuntimeError), rounds.reported(topic, words):
            rounds.topics[topic]()
        return json.loads(rounds.report_of(topic).read_text())

    monkeypatch.setattr(rounds, "measure", measure)
    return rounds


def test_a_round_goes_on_with_what_is_missing_and_a_topic_that_fails_is_no_hindrance(rounds, capsys):
    ran, is_broken = [], [True]

    def fails():
        ran.append("fails")
        if is_broken[0]:
            raise RuntimeError("no such\nprogram")

    def peerless():
        ran.append("peerless")
        rounds.store.leave_out("iceoryx2", "ld: cannot find -lbsd")

    rounds.topics = {"fails": fails, "peerless": peerless}
    chosen = {"fails": [], "peerless": ["--rounds", "1"]}
    assert rounds.measure_all(chosen, ROOT, fresh=False) == 1 and ran == ["fails", "peerless"]
    said = capsys.readouterr().out
    assert "FAILED" in said and "RuntimeError: no such program" in said
    assert "left out: iceoryx2 (ld: cannot find -lbsd)" in said
    is_broken[0] = False
    assert rounds.measure_all(chosen, ROOT, fresh=False) == 0 and ran[2:] == ["fails"]
    lines = [line for line in capsys.readouterr().out.splitlines() if " of 2  " in line]
    assert len(lines) == 2 and "kept" in lines[1] and "-lbsd" in lines[1]
    assert rounds.measure_all(chosen, ROOT, fresh=True) == 0 and ran[3:] == ["fails", "peerless"]
    assert rounds.measure_all(chosen | {"peerless": ["--rounds", "2"]}, ROOT, fresh=False) == 0
    assert ran[5:] == ["peerless"], "other options, other measurements"


def test_what_is_kept_is_of_the_state_of_the_tree(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from benches import store

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
    subprocess.run([*git, "commit", "-q", "-a", "-m", "two"], check=True)
    assert states() == changed, "it is what the files hold, not the commit"
    store.state.cache_clear()


def test_place_and_route_is_repeated_for_other_gateware_only(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from benches.bridge import bench

    run = {"lanes": 6, "seed": 2}
    stored = {"gateware": "0123456789ab", "boards": {"ulx3s": {"runs": [run, {"lanes": 28}]}}}
    monkeypatch.setattr(bench, "CACHE", tmp_path)
    monkeypatch.setattr(bench.store, "read_result", lambda name: stored)
    monkeypatch.setattr(bench.store, "state", lambda *parts: "0123456789ab")
    assert bench.default_build("ulx3s", 6, [0]) == run
    assert bench.default_build("ulx3s", 28, [0]) is None, "it was not placed"
    monkeypatch.setattr(bench.store, "state", lambda *parts: "ba9876543210")
    assert bench.default_build("ulx3s", 6, [0]) is None


def test_a_peers_own_error_is_found(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from benches import store

    (tmp_path / "a.c").write_text("int main(void) { return 0; }\n")
    (tmp_path / "b.c").write_text("int main(void) { return nothing; }\n")
    assert store.failure(["cc", tmp_path / "a.c", "-o", tmp_path / "a"]) == ""
    assert "-lbsd-not-there" in store.failure(["cc", tmp_path / "a.c", "-lbsd-not-there", "-o", tmp_path / "a"])
    assert "nothing" in store.failure(["true"], ["cc", tmp_path / "b.c", "-o", tmp_path / "b"])


def test_a_measurement_is_whole_or_not_there(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from benches import store

    with pytest.raises(ZeroDivisionError):
        store.once(tmp_path / "part/a.json", lambda: 1 / 0)
    assert store.once(tmp_path / "part/a.json", lambda: [1]) == [1] == store.once(tmp_path / "part/a.json", lambda: [2])
