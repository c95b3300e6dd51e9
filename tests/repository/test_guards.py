"""The guards of `make lint` hold for this tree, and each sees what it is for."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
from lint import arrows, budget, circles, folders, functions, pages, words  # noqa: E402

GUARDS = (arrows, budget, circles, folders, functions, pages, words)
PACKAGE = "host/python/crunchbot"


def repository(place, files: dict[str, str]):
    """A repository of its own with these tracked files."""
    subprocess.run(["git", "init", "-q", place], check=True)
    for name, text in files.items():
        path = place / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    subprocess.run(["git", "-C", place, "add", "-A"], check=True)
    return place


@pytest.mark.parametrize("guard", GUARDS, ids=lambda guard: guard.__name__)
def test_the_tree_passes(guard):
    assert guard.complaints() == []


@pytest.mark.parametrize("place", arrows.ROOMS)
def test_rooms_of_a_package_make_no_circle(place):
    rooms = arrows.ROOMS[place]
    assert {path.parent.name for path in (ROOT / place).glob("*/__init__.py")} == set(rooms) - {""}
    for room, used in rooms.items():
        assert set(used) <= set(list(rooms)[: list(rooms).index(room)]), room


def test_a_forbidden_arrow_is_found(tmp_path):
    files = {"host/nav/a.c": '#include "whisker/ring.h"\n', "host/libwhisker/include/whisker/ring.h": ""}
    assert arrows.complaints(repository(tmp_path, files)) == [
        "host/nav/a.c: host/nav must not use host/libwhisker; move the code or turn the arrow round"
    ]


@pytest.mark.parametrize(
    "line",
    [
        "from ..pilot.base import Base",
        "from .. import pilot",
        "from crunchbot.pilot import base",
        "import crunchbot.pilot.base",
    ],
)
def test_a_room_that_reaches_back_is_found(tmp_path, line):
    files = {
        "touch/radial/model.py": line.replace("..", "...") + "\n",
        "touch/floor.py": line + "\n",
        "pilot/base.py": "\n",
    }
    repository(tmp_path, {f"{PACKAGE}/{name}": text for name, text in files.items()})
    assert arrows.complaints(tmp_path) == [
        f"{PACKAGE}/{name}: touch must not use pilot; move the code or turn the arrow round"
        for name in ("touch/floor.py", "touch/radial/model.py")
    ]


def test_circles_of_includes_and_imports_are_found(tmp_path):
    files = {
        "host/a.h": "",
        "host/a.c": '#include "a.h"\n#include "b.h"\n',
        "host/b.h": '#include "a.h"\n',
        "host/b.c": '#include "b.h"\n',
        "host/python/crunchbot/__init__.py": "",
        "host/python/crunchbot/one.py": "from . import two\n",
        "host/python/crunchbot/two.py": "def late():\n    from .one import x\n",
        "host/python/crunchbot/three.py": "from .one import x\n",
    }
    assert circles.complaints(repository(tmp_path, files)) == [
        "circle: host/a <-> host/b; move what both need to a third file",
        "circle: crunchbot.one <-> crunchbot.two; move what both need to a third file",
    ]


def test_an_internal_header_is_part_of_its_module(tmp_path):
    files = {"a/spi.h": "", "a/spi.c": '#include "spi_state.h"\n', "a/spi_state.h": '#include "spi.h"\n'}
    assert circles.complaints(repository(tmp_path, files)) == []


BOARD = circles.INTERFACES[0]


@pytest.mark.parametrize(
    "back, found",
    [
        ("void a_one(void)\n{\n    b_two();\n}\n", True),
        ("void a_one(void)\n{\n    later = b_two; /* b_two() */\n}\n", False),
        ('void a_one(void)\n{\n    log("b_two()");\n}\n', False),
        ("static void b_two(void)\n{\n}\n\nvoid a_one(void)\n{\n    b_two();\n}\n", False),
    ],
    ids=["call", "pointer", "text", "own function of that name"],
)
def test_circles_of_calls_are_found(tmp_path, back, found):
    forth = "void b_two(void)\n{\n    a_one();\n}\n"
    files = {"host/both.h": "void a_one(void);\nvoid b_two(void);\n", "host/a.c": back, "host/b.c": forth}
    told = "circle of calls: host/a.c calls b_two() of host/b.c, host/b.c calls a_one() of host/a.c; "
    expected = [told + "move what both need to a third file"] if found else []
    assert circles.complaints(repository(tmp_path, files)) == expected


def test_an_interface_is_no_circle_of_calls(tmp_path):
    files = {
        f"{BOARD}link.h": "void board_send(void);\n",
        "firmware/core.c": "void core_tick(void)\n{\n    board_send();\n}\n",
        "firmware/port.c": "void board_send(void)\n{\n    core_tick();\n}\n",
    }
    assert circles.complaints(repository(tmp_path, files)) == []


def test_a_waiver_without_its_circle_is_found(tmp_path):
    waived = sorted(next(iter(circles.WAIVED)))
    (complaint,) = circles.complaints(repository(tmp_path, {waived[0]: "int x;\n"}))
    assert waived[0] in complaint and complaint.endswith("take the waiver out")


C_CONSTANTS = """static int variable = 7; /* #define NO 8 */
#define ONE 1
static const double TABLE[] = {0.5, 2, -3e-1};
enum { FIVE = 5, SIX };
"""
PYTHON_CONSTANTS = """RATE_HZ = 2000
PAIR: tuple = (1.5, "text", -2)
lower = 3

class Kind:
    LEAST = 4
    ON = True
"""


def budgeted(place, **rooms: tuple[int, int]):
    """A repository with a file of C and one of Python, and budgets (lines, numbers) of its rooms."""
    text = "".join(
        f'"{room}" = {{ lines = {lines}, numbers = {numbers} }}\n' for room, (lines, numbers) in rooms.items()
    )
    files = {"c/room/a.c": C_CONSTANTS, "c/tests/test_a.c": C_CONSTANTS, "python/a.py": PYTHON_CONSTANTS}
    return repository(place, {**files, budget.BUDGET: "# head\n\n" + text})


def test_lines_and_numbers_of_rooms_are_counted(tmp_path):
    place = budgeted(tmp_path, c=(4, 5), python=(7, 4))
    assert budget.measured(place, budget.budgets((place / budget.BUDGET).read_text())) == {
        "c": (4, 5),
        "python": (7, 4),
    }
    assert budget.complaints(place) == []


def test_a_room_above_its_budget_is_found(tmp_path):
    place = budgeted(tmp_path, c=(3, 5), python=(7, 3))
    remedy = f"at most ({budget.BUDGET}); take 1 out, or raise it and say why"
    assert budget.complaints(place) == [f"c: 4 lines, 3 {remedy}", f"python: 4 numbers, 3 {remedy}"]


def test_what_lies_in_no_room_is_found(tmp_path):
    assert [line.split(",")[0] for line in budget.complaints(budgeted(tmp_path, c=(4, 5)))] == [
        "what lies in no room: 7 lines",
        "what lies in no room: 4 numbers",
    ]


def test_a_budget_is_lowered_and_never_raised(tmp_path):
    place = budgeted(tmp_path, **{"c/room": (9, 4), "python": (7, 4), "gone": (5, 5)})
    assert budget.lower(place) == ["c/room", "gone"]
    text = (place / budget.BUDGET).read_text()
    assert text == '# head\n\n"c/room" = { lines = 4, numbers = 4 }\n"python" = { lines = 7, numbers = 4 }\n'


def test_a_commit_that_raises_a_budget_says_why(tmp_path):
    place = budgeted(tmp_path, c=(4, 5), python=(7, 4))

    def commit(*message: str) -> list[str]:
        who = ["-c", "user.name=x", "-c", "user.email=x@x.example"]
        words = [word for part in message for word in ("-m", part)]
        subprocess.run(["git", "-C", place, *who, "commit", "-qa", *words], check=True)
        return budget.complaints(place)

    assert commit("first") == []
    path = place / budget.BUDGET
    path.write_text(path.read_text().replace("lines = 4", "lines = 9"))
    (complaint,) = commit("more")
    assert "raises the budget of c;" in complaint
    path.write_text(path.read_text().replace("lines = 9", "lines = 10"))
    assert commit("more still", "budget: a filter more") == []


def test_a_crowded_folder_is_found(tmp_path):
    place = repository(tmp_path, {f"room/{n}.c": "" for n in range(folders.MOST + 1)})
    assert [line.split(":")[0] for line in folders.complaints(place)] == ["room"]
    (place / "room/0.c").unlink()
    assert folders.complaints(place) == []


def test_a_function_without_its_module_is_found(tmp_path):
    text = """
static int take(int x)
{
    return x;
}

struct ring *ring_take(void)
{
    if (take(1)) {
    }
}
"""
    place = repository(tmp_path, {"host/ring.c": text, "host/tests/test_ring.c": text})
    assert functions.complaints(place) == ["host/ring.c:2: take() does not carry its module's name; write: ring_take"]


def test_long_lines_are_found_outside_tables_and_code(tmp_path):
    long = "Word. " * 25
    text = f"{long}\n\n| {long} |\n\n```\n{long}\n```\n"
    assert pages.complaints(repository(tmp_path, {"page.md": text})) == [
        "page.md:1: 150 characters, 120 at most; break the line"
    ]


def test_what_a_reader_must_get_through_is_measured(tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "LINES", 7)
    monkeypatch.setattr(pages, "NOTES", 1)
    text = "# Head\n\n- One two three. Four `a b c`\n  five.\n- Six.\n"
    assert pages.sentences(text) == [3, 3, 1]
    assert pages.sentences("| a b c |\n\n```\na b\n```\n\nSee [the page](x.md). **Bold** is 3.5 m.") == [3, 4]
    place = repository(tmp_path, {"a/README.md": text, "b/README.md": f"{'w ' * 36}.\n"})
    assert pages.complaints(place) == ["pages: 2 notes of folders, 1 at most; only a folder with rules has one"] + [
        "pages: 25.0 % of the sentences have more than 35 words, 2 % at most"
    ]
    place = repository(tmp_path, {"c.md": f"{'w ' * 35}\n" * 4})
    assert [line.split(",")[0] for line in pages.complaints(place)][:3] == [
        "pages: 10 lines of Markdown",
        "pages: 2 notes of folders",
        "pages: 36.6 words a sentence",
    ]


def test_words_not_used_here_are_found(tmp_path):
    files = {
        "a.c": "/* Told apart. */\nint reported_apart;\n",
        "host/create/bumper.c": "/* A bump. */\n",
        "b.md": "A bump.\n",
    }
    assert words.complaints(repository(tmp_path, files)) == [
        "a.c:1: the word 'Told' is not used here; write: given, reported, published",
        "b.md:1: 'bump' is only for the Create's bumper; write: component, contact",
    ]


def test_each_complaint_is_a_line_and_the_exit_code_reports_it():
    done = subprocess.run(
        [sys.executable, "-m", "lint", "nonsense"], cwd=ROOT / "tools", capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 2 and done.stderr.count("\n") == 1
