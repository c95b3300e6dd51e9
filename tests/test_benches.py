"""The front of the benches: every topic is there, can be asked for alone, and what it takes is what its run knows."""

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
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
    with_run = {p for p in BENCHES.glob("*/*.py") if "run" in functions(p)}
    assert with_run == {module_of(topic) for topic in TOPICS}


def front(*words: str) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, BENCHES, *words], capture_output=True, text=True, cwd=ROOT)


def test_the_front_tells_topics_and_a_topic_tells_its_options():
    assert ", ".join(TOPICS) in " ".join(front("--help").stdout.split())
    told = front("node", "--help").stdout
    assert "usage: tools/benches node " in told and "--batches" in told and "--build-dir" in told


def test_a_topic_that_is_not_there_is_named():
    done = front("--only", "nothing")
    assert done.returncode == 2 and "nothing" in done.stderr
    done = front("nothing")
    assert done.returncode == 2 and "nothing" in done.stderr


def test_a_part_of_the_robot_measured_alone_leaves_the_others_as_published(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from benches.robot import bench, page

    monkeypatch.setattr(bench, "CACHE", tmp_path)
    before = bench.gather()
    assert page.page(before) == (ROOT / "docs/results_robot.md").read_text()
    (tmp_path / "instructions.json").write_text(json.dumps(before["latency"]))
    after = bench.gather()
    assert after.pop("instructions") == before["latency"] and after.items() <= before.items()
