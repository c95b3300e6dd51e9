"""The front of the benches: every topic is there, can be asked for alone, and what it takes is what its run knows."""

import ast
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
def test_run_takes_a_build_and_fresh_and_all_its_options(topic):
    found = functions(module_of(topic))
    run = found["run"].args
    assert [a.arg.lstrip("_") for a in run.args[:2]] == ["build", "fresh"]
    assert len(run.args) - len(run.defaults) == 2  # the rest has standards: `make bench` gives none of it
    options = ast.unparse(found["options"]) if "options" in found else ""
    wanted = set(re.findall(r"add_argument\('--(\w+)'", options))
    assert run.kwarg or wanted == {a.arg for a in run.args[2:]}


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
    assert pages.PAGES.keys() == stored
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
