"""The draw of mutants: each changes one line that runs, tests are found for every file, and the result counts right."""

from itertools import islice
from pathlib import Path

import pytest
from mutants.__main__ import ROOT, draw
from mutants.nearest import steps_for
from mutants.operators import mutants_of
from mutants.report import summarise

from crunchbot_lab.report.share import wilson


def changed(file: str, text: str) -> set[str]:
    return {mutant.apply(text) for mutant in mutants_of(file, text)}


@pytest.mark.parametrize(
    ("file", "text", "expected"),
    [
        ("a.py", "x = a < b\n", {"x = a <= b\n"}),
        ("a.py", "def f(a: int | None = 1):\n    return a\n", {"def f(a: int | None = 0):\n    return a\n"}),
        (
            "a.py",
            "if é and not b:\n    f(2)\n",
            {
                "if é or not b:\n    f(2)\n",
                "if é and b:\n    f(2)\n",
                "if é and not b:\n    pass\n",
                "if é and not b:\n    f(3)\n",
            },
        ),
        ("a.py", '"""a < 1"""\ns.x = "1 + 1"\n', {'"""a < 1"""\npass\n'}),
        ("a.c", '{\n    if (a < b && !*p) {\n        f(*q, &r, "<"); /* 1 + 1 */\n    }\n}\n', None),
        ("a.v", "\n    a <= b & 4'd3;\n", {"\n    ;\n", "\n    a <= b | 4'd3;\n", "\n    a <= b & 4'd4;\n"}),
    ],
)
def test_each_mutant_changes_one_thing_that_runs(file, text, expected):
    found = changed(file, text)
    if expected is None:
        expected = {text.replace("a < b", "a <= b"), text.replace("&&", "||")}
    assert found == expected


def test_one_seed_gives_one_draw_of_all_languages():
    first, again = (list(islice(draw(ROOT, 7), 200)) for _ in range(2))
    assert first == again != list(islice(draw(ROOT, 8), 200))
    assert {Path(mutant.file).suffix for mutant in first} >= {".c", ".py", ".v"}
    assert len(set(first)) == 200


def test_every_file_drawn_has_tests_that_are_there():
    for file in sorted({mutant.file for mutant in islice(draw(ROOT, 3), 2000)}):
        for step in steps_for(ROOT, file):
            assert step.ctest or step.pytest, file
            assert all((ROOT / path.partition("::")[0]).exists() for path in (*step.ctest, *step.pytest)), file


def entry(outcome: str, **more) -> dict:
    return {"file": "a.c", "text": "x = 1;", "before": "1", "after": "0", "outcome": outcome, "step": 0} | more


def test_invalid_mutants_do_not_count_and_survivors_are_kept():
    found = summarise([entry("killed"), entry("killed", step=1), entry("survived"), entry("invalid")], 1, "c")
    assert (found["tried"], found["killed"], found["by_nearest_tests"], len(found["survivors"])) == (3, 2, 1, 1)


def test_the_interval_is_wilsons():
    assert wilson(90, 100) == pytest.approx((0.8256, 0.9448), abs=1e-4)
