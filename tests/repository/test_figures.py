"""Measured figures that stand in pages which people write: they equal bench/results, and so each other.

A figure that a page takes from a measurement has an entry here. The tables that `tools/benches page` writes are compared
as a whole.
"""

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "bench/results"


def result(name: str):
    return json.loads((RESULTS / f"{name}.json").read_text())


def cm(metres: float) -> str:
    return f"{100 * metres:.0f}"


@dataclass(frozen=True)
class Figure:
    """What the groups of a pattern, found once in a page, must say."""

    page: str
    pattern: str
    result: str
    expected: Callable[[dict], tuple[str, ...]]


def damaged(reader: str) -> Callable[[dict], tuple[str, ...]]:
    def of(data: dict) -> tuple[str, ...]:
        rows = [row for key, row in data["readers"].items() if key.startswith(f"{reader}: ")]
        read, intact, unsaid = (sum(row[key] for row in rows) for key in ("read", "intact", "unsaid"))
        return f"{100 * read / intact:.0f}", str(unsaid)

    return of


def drill_errors(data: dict) -> tuple[str, ...]:
    (run,) = data["runs"]
    failed = sum(bool(event["failures"]) for event in run["events"])
    faults = str(len(run["events"])), str(failed)
    share = f"{100 * run['answers_off'] / run['answers']:.1f}"
    return *faults, f"{run['error_p50_m']:.3f}", f"{run['error_p90_m']:.3f}", share


def half_hours(data: dict) -> tuple[str, ...]:
    assert len(data) == 4
    medians, most, lost = (
        max(run["filters"]["adaptive"][key] for run in data.values()) for key in ("median_m", "max_m", "lost_share")
    )
    return f"{1e3 * medians:.0f}", cm(most), f"{100 * lost:.1f}"


FIGURES = (
    Figure(
        "README.md",
        r"filter\s+(\d+)\s+mm,\s+an\s+exact\s+grid\s+(\d+)\s+mm.*?foveal\s+grid\s+(\d+)\s+mm.*?alone\s+(\d+)\s+mm",
        "demo",
        lambda d: tuple(
            f"{1e3 * d[f'{name}_error_median_m']:.0f}" for name in ("adaptive", "pose", "foveal", "odometry")
        ),
    ),
    Figure(
        "README.md",
        r"four\s+runs.*?at\s+most\s+(\d+)\s+mm.*?worst\s+it\s+was\s+(\d+)\s+cm.*?for\s+([\d.]+)\s+%",
        "robot_long",
        half_hours,
    ),
    Figure(
        "docs/first_drive.md",
        r"the\s+demo's\s+median\s+error\s+is\s+(\d+)\s+cm",
        "demo",
        lambda d: (cm(d["adaptive_error_median_m"]),),
    ),
    Figure(
        "docs/record.md",
        r"`crunchbot.recording`\s+reads\s+(\d+)\s+%.*?word\s+in\s+(\d+)\s+",
        "damage",
        damaged("whisker"),
    ),
    Figure(
        "docs/record.md",
        r"reads\s+(\d+)\s+%\s+from\s+front.*?loses\s+so\s+in\s+(\d+);",
        "damage",
        damaged("mcap, stream"),
    ),
    Figure(
        "docs/record.md",
        r"by\s+the\s+index\s+it\s+reads\s+(\d+)\s+%.*?loses\s+in\s+(\d+)\.",
        "damage",
        damaged("mcap, indexed"),
    ),
    Figure(
        "docs/record.md", r"rosbags\s+[\d.]+\s+reads\s+(\d+)\s+%.*?loses\s+in\s+(\d+)\.", "damage", damaged("rosbags")
    ),
    Figure("docs/record.md", r"Of (\d+) damaged files", "damage", lambda d: (str(d["files"]),)),
    Figure(
        "docs/results/drills.md",
        r"(\d+)\s+faults, (\d+) with failures.*?median\s+([\d.]+) m, p90\s+([\d.]+) m,\s+([\d.]+) %",
        "drills",
        drill_errors,
    ),
    Figure(
        "docs/results/host.md",
        r"at most (\d+) us off",
        "host",
        lambda d: (f"{max(clock['error_us_max'] for clock in d['clock'].values()):.0f}",),
    ),
    Figure(
        "docs/results/host.md",
        r"([\d ]+) frames, no gap, copy or wrong byte",
        "usb_soak",
        lambda d: (
            "" if any(d[key] for key in ("gaps", "duplicates", "wrong")) else f" {d['frames']:,}".replace(",", " "),
        ),
    ),
)


@pytest.mark.parametrize("figure", FIGURES, ids=lambda f: f"{f.page}: {f.pattern[:30]}")
def test_a_figure_of_a_page_is_that_of_the_result(figure):
    found = re.findall(figure.pattern, (ROOT / figure.page).read_text(), re.DOTALL)
    assert len(found) == 1, (
        f"{figure.page}: {len(found)} places; adapt the pattern, or take the entry out with the text"
    )
    groups = found[0] if isinstance(found[0], tuple) else (found[0],)
    assert groups == figure.expected(result(figure.result))


def test_the_tables_of_pages_are_what_the_stored_results_give(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from benches import tables

    assert len(tables.pages()) > 5
    for path in tables.pages():
        text = path.read_text()
        assert tables.written(text) == text, f"{path}: run '.venv/bin/python tools/benches page'"


def test_the_tables_of_the_site_can_be_made(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from benches import tables

    pages = {path: path.read_text() for path in ROOT.glob("docs/**/*.md")}
    found = {path: text for path, text in pages.items() if "<!-- table of the site" in text}
    assert len(found) > 4
    for text in found.values():
        whole = tables.of_site(text)
        assert "table of the site" not in whole and whole.count("\n| ") > text.count("\n| ")


def test_no_page_says_how_fast_the_chain_runs_but_the_generated_ones():
    """It is a figure of the machine and of the day: one page has it, from the result."""
    for path in [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]:
        if path.name not in ("results.md", "decisions.md"):
            assert not re.search(r"\d\.\d+ (?:x|times) real time", path.read_text()), path


def test_an_entry_that_is_wrong_is_found(monkeypatch):
    """The check itself: a figure that is not the result's fails."""
    one = FIGURES[0]
    wrong = Figure(one.page, one.pattern, one.result, lambda d: tuple(f"{text}9" for text in one.expected(d)))
    with pytest.raises(AssertionError):
        test_a_figure_of_a_page_is_that_of_the_result(wrong)
