"""The bench that nobody can tune a filter to: its judge, its draws, its journal."""

import json
import math
import re
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from crunchbot.nav.scoring import heading_errors, lock_row, position_errors
from crunchbot_lab.scenes import make

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
from benches.nav import families, filters, judge, states, worlds, worth  # noqa: E402
from benches.nav.states import Answers  # noqa: E402

ROWS = 300
MADE = replace(make("anchor+kidnap", 3, rows=2 * ROWS), kidnaps=(ROWS,))
AT = len(judge.localise.judged_rows(MADE.observations, judge.REGIONS))


def answers(off_m: float, confidence: float, level: float, turned: float = 0.0) -> Answers:
    """Of a filter that is always off by so much and says so much of itself."""
    poses = MADE.observations.truth + (off_m, 0.0, turned)
    return Answers(poses, np.full(len(poses), confidence), np.full(AT, level), np.full(len(poses), 100.0))


def test_a_filter_that_is_always_sure_and_wrong_comes_out_so():
    found = judge.judged(MADE, answers(1.0, 1.0, 1.0))
    assert not found["locked"] and found["rows"] == [None, None] and found["error_mm"] is None
    assert found["sure"] == found["sure_wrong"] == 1.0
    assert found["log_score"] == pytest.approx(math.log(judge.LEAST))
    assert found["held"][0] == 0 < found["held"][1] and found["near"] == 0.0
    shown = judge.figures([found, found])
    assert (shown["locked"], shown["coverage"], shown["right_when_sure"]) == (0, 0.0, 0.0)


def test_a_heading_that_is_wrong_is_wrong_too():
    found = judge.judged(MADE, answers(0.0, 1.0, 0.5, turned=math.pi))
    assert found["locked"] and found["sure_wrong"] == 1.0


def test_one_that_is_always_right_and_one_that_knows_that_it_does_not_know():
    found = judge.judged(MADE, answers(0.01, 1.0, 0.5))
    assert found["locked"] and found["rows"] == [0, 0] and found["error_mm"] == pytest.approx(10.0)
    assert found["sure_wrong"] == 0.0 and found["log_score"] == pytest.approx(0.0, abs=2e-3)
    assert found["held"] == found["held_locked"] and found["held"][0] == found["held"][1] > AT // 2
    doubting = judge.judged(MADE, answers(1.0, 0.5, 0.5))
    assert doubting["sure"] == 0.0 and doubting["log_score"] == pytest.approx(math.log(0.5))


def test_a_kidnap_that_is_not_found_is_no_lock_and_its_first_rows_are_nobodys_fault():
    poses = MADE.observations.truth.copy()
    poses[ROWS:] = poses[ROWS - 1]
    off = position_errors(poses, MADE.observations.truth)
    wrong = (off > judge.FAR_M) | (heading_errors(poses, MADE.observations.truth) > judge.FAR_RAD)
    assert lock_row(off[ROWS:]) is None and wrong[ROWS : ROWS + judge.SETTLING_ROWS].all()
    found = judge.judged(MADE, replace(answers(0.0, 1.0, 0.5), poses=poses))
    assert not found["locked"] and found["rows"] == [0, None]
    late = wrong[ROWS + judge.SETTLING_ROWS :].sum()
    assert found["sure_wrong"] == pytest.approx(late / (len(off) - judge.SETTLING_ROWS))


def test_the_image_of_the_truth_is_locked_to_but_a_filter_that_is_sure_of_it_is_wrong():
    image = np.array([*MADE.scene.arena.size_m, math.pi]) - MADE.observations.truth * (1, 1, -1)
    found = judge.judged(MADE, replace(answers(0.0, 1.0, 0.5), poses=image), folds=2)
    assert found["locked"] and found["sure_wrong"] > 0.9
    assert not judge.judged(MADE, replace(answers(0.0, 1.0, 0.5), poses=image))["locked"]


def test_differences_are_of_pairs_and_have_their_standard_error():
    base = [{"locked": n % 2 == 0, "log_score": -n, "sure_wrong": 0.0, "held": [1, 2], "error_mm": 10.0, "us": 1.0 + n}
            for n in range(16)]  # fmt: skip
    ours = [draw | {"log_score": draw["log_score"] + 1.0 + 0.5 * (-1) ** n, "us": 2.0 * draw["us"], "error_mm": None if n else 20.0}
            for n, draw in enumerate(base)]  # fmt: skip
    found = judge.differences(ours, base)
    assert found["log_score"] == pytest.approx([1.0, 0.5 * math.sqrt(16 / 15) / 4.0, 16])
    assert found["time"] == pytest.approx([math.log(2.0), 0.0, 16], abs=1e-9)
    assert found["error"][0] == pytest.approx(math.log(2.0)) and found["error"][2] == 1
    assert found["locked"] == found["coverage"] == [0.0, 0.0, 16]
    parts = {"all": {"against": found}}
    assert "+1 +- 0.26 *" in families.against(parts) and "2.00 (2.00-2.00) *" in families.against(parts)


def test_seeds_follow_from_the_commit_the_family_and_the_draw():
    seeds = [families.seed_of(commit, name, n) for commit in "ab" for name in "xy" for n in range(3)]
    assert len(set(seeds)) == len(seeds) and seeds[0] == families.seed_of("a", "x", 0)


@pytest.mark.parametrize("seed", range(3))
def test_every_family_is_drawn_and_stays_on_free_ground(seed):
    for name, family in worlds.all_families(None).items():
        made = family.make(seed)
        assert len(made.observations) >= 250, name
        inside = [made.scene.fault_at(tuple(pose)) == "" for pose in made.observations.truth[::20]]
        assert family.group == "wrong map" or all(inside), name


def test_a_grey_room_has_the_rows_of_its_clean_one_and_ground_that_nobody_mapped():
    known = worlds.all_families(None)
    for name in worlds.GREY:
        grey = name.replace("clean", "grey")
        assert known[grey].seed_of == name
        clean, padded = known[name].make(5), known[grey].make(5)
        assert np.array_equal(clean.observations.odometry, padded.observations.odometry)
        assert np.array_equal(clean.observations.radial_m, padded.observations.radial_m)
        assert not clean.scene.arena.unknown and len(padded.scene.arena.unknown) >= 4
        assert all(b > a for a, b in zip(clean.scene.arena.size_m, padded.scene.arena.size_m, strict=True))


@dataclass
class Fixed:
    """A state that answers with the truth, off by so much, and counts how often it is asked."""

    words: str
    off_m: float
    asked: int = 0

    def identity(self) -> str:
        return self.words

    def answer(self, folder: Path, seed: int, regions: int) -> Answers:
        self.asked += 1
        assert (folder / "observations.csv").exists()
        return answers(self.off_m, 1.0, 0.5)


def test_a_journal_that_was_cut_goes_on_and_every_state_has_every_draw(tmp_path, monkeypatch):
    monkeypatch.setattr(families.store, "BENCH", tmp_path)
    known = {name: worlds.Family("some", lambda seed: MADE) for name in ("one", "other")}
    pair = [Fixed("right", 0.0), Fixed("wrong", 1.0)]
    whole = families.measure(known, 6, "c", pair)
    assert [state.asked for state in pair] == [6, 6]
    path = next(tmp_path.rglob("*.jsonl"))
    lines = path.read_text().splitlines()
    assert [json.loads(line)["seed"] for line in lines[:2]] == [families.seed_of("c", n, 0) for n in ("one", "other")]
    path.write_text("\n".join(lines[:4]) + "\n" + lines[4][:50])
    assert families.measure(known, 6, "c", pair) == whole
    assert [state.asked for state in pair] == [8, 8] and path.read_text().splitlines() == lines
    summary = families.summed_up(known, whole, pair)
    assert summary["right"]["all"]["locked"] == 6 and summary["wrong"]["all of 'some'"]["sure_wrong"] == 1.0
    assert summary["wrong"]["one"]["against"]["locked"] == [-1.0, 0.0, 3]
    assert "sure and wrong" in families.report(summary)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("nowhere", "no compiled module"),
        (f"{ROOT}:nothing", "no filter or setting 'nothing'"),
        (f"{ROOT}:grid:grid.cells=3", "no filter or setting 'grid.cells'"),
        (f"{ROOT}:grid:3", "KEY=VALUE"),
    ],
)
def test_a_state_that_cannot_be_is_named_with_its_remedy(words, text):
    with pytest.raises(SystemExit, match=text):
        states.stated(words)


def test_this_trees_state_answers():
    state = states.stated(f"{ROOT}:odometry")
    found = families.drawn(worlds.Family("some", lambda seed: MADE), 1, [state])
    assert len(found) == 1 and found[0]["rows"][1] is None  # odometry does not know that it was carried


def test_the_switches_of_a_mechanism_fit_the_filters_as_they_are():
    done = subprocess.run(
        ["git", "apply", "--check", worth.PATCH], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{worth.PATCH}: write it anew for what was changed: {done.stderr}"
    given = set(re.findall(r"^\+ +ENTRY\(worth, (\w+)", worth.PATCH.read_text(), re.MULTILINE))
    assert {switch.removeprefix("worth.").removesuffix("=0") for switch in worth.SWITCHES} <= given


def test_the_chart_has_a_point_a_filter_and_the_netbooks_line():
    one = {"locked": 30, "draws": 40, "error_mm": 9.0, "sure_wrong": 0.02, "instructions": 2e6}
    states = {"adaptive": one, "grid": one | {"error_mm": None}, "ekf": one | {"instructions": None}}
    left, middle, right = filters.draw(states).axes
    assert [line.get_label() for line in left.lines[:-1]] == ["adaptive", "grid"]
    assert [line.get_label() for line in middle.lines[:-1]] == ["adaptive"] and len(right.lines) == 3
    assert (left.lines[0].get_xdata()[0], left.lines[0].get_ydata()[0]) == (2e6, 25.0)
    assert left.lines[-1].get_xdata()[0] == 0.8e9 * 0.1


def test_instructions_are_a_rows_and_none_where_nothing_counts_them(tmp_path, monkeypatch, capsys):
    counter = tmp_path / "valgrind"
    counter.write_text(
        '#!/bin/sh\nfor word; do case $word in *out-file=*) echo "summary: 1200" >"${word#*=}";; esac; done\n'
    )
    counter.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    assert filters.instructions(f"{ROOT}:odometry", 3) == 1200 / filters.COUNTED_ROWS
    monkeypatch.setenv("PATH", "")
    assert filters.instructions(f"{ROOT}:odometry", 3) is None
    assert "left out: instructions: valgrind" in capsys.readouterr().out
