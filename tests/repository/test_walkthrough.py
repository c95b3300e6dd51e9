"""docs/walkthrough.md and the programs: every command, option, make target and file that it names is there."""

import re
import subprocess
import sys

import pytest
from chainrun import BUILD, ROOT, program

TEXT = (ROOT / "docs/walkthrough.md").read_text()
WHISKER = (sys.executable, "-m", "crunchbot.cli")
PROGRAMS = ("whiskerd", "whisker-base")
VIEW = (sys.executable, "-m", "crunchbot.view")
ACTIONS = ("scene", "radial", "texture")  # commands whose second word is an action
VARIABLES = ("BOARD", "SERIAL", "SEED", "TOOL", "BASE", "MODEL", "WHEELS_UP", "INTERACTIVE")


def commands() -> list[list[str]]:
    """The words of each command of the page, without prompt, comment and what a pipe or & brings."""
    lines = [
        re.sub(r"^(netbook|desktop): +", "", line.strip()) for line in TEXT.splitlines() if line.startswith("    ")
    ]
    inline = re.findall(r"`((?:whisker|whiskerd|make|whisker-view|whisker-base) [^`]*)`", TEXT)
    return [re.split(r"\s+(?:#|&|>)", line)[0].split() for line in [*lines, *inline]]


def help_of(words: list[str]) -> str:
    """What the program of these words says of itself."""
    if words[0] == "whisker":
        command = [*WHISKER, *words[1 : 3 if words[1] in ACTIONS else 2]]
    else:
        command = VIEW if words[0] == "whisker-view" else [program(words[0])]
    done = subprocess.run([*command, "--help"], capture_output=True, text=True)
    assert done.returncode == 0, f"{' '.join(words)}: {done.stderr}"
    return done.stdout


def options(words: list[str]) -> set[str]:
    return {word.split("=")[0] for word in words if word.startswith("--")}


def test_every_command_and_its_options_are_known(monkeypatch):
    monkeypatch.setenv("WHISKER_BUILD", str(BUILD))
    asked: dict[str, str] = {}
    found = [words for words in commands() if len(words) > 1 and words[0] in ("whisker", "whisker-view", *PROGRAMS)]
    assert len(found) > 25
    for words in found:
        key = " ".join(words[: 3 if words[1] in ACTIONS else 2] if words[0] == "whisker" else words[:1])
        asked[key] = asked.get(key) or help_of(words)
        unknown = {option for option in options(words) if not re.search(rf"{option}\b", asked[key])}
        assert not unknown, f"{' '.join(words)}: {unknown}"


def test_every_make_target_and_variable_is_in_the_makefile():
    makefile = (ROOT / "Makefile").read_text()
    found = [words for words in commands() if len(words) > 1 and words[0] == "make"]
    assert len(found) > 8
    for words in found:
        assert re.search(rf"^{re.escape(words[1])}:", makefile, re.MULTILINE), words
        named = {word.split("=")[0] for word in words[2:] if "=" in word}
        assert named <= set(VARIABLES) and all(f"$({name}" in makefile or f'"{name}' in makefile for name in named), (
            words
        )


def test_every_page_and_picture_it_points_at_is_there():
    missing = [
        target
        for target in re.findall(r"\]\(([^)#]+)", TEXT)
        if not target.startswith("http") and not (ROOT / "docs" / target).exists()
    ]
    assert not missing


def headings(page: str) -> set[str]:
    """The anchors of a page's headings."""
    found = re.findall(r"^#+ (.*)$", (ROOT / "docs" / page).read_text(), re.MULTILINE)
    return {re.sub(r"[^a-z0-9 -]", "", heading.lower()).replace(" ", "-") for heading in found}


@pytest.mark.parametrize("page, anchor", sorted(set(re.findall(r"\]\(([^)#]+)#([^)]+)\)", TEXT))))
def test_every_place_it_points_at_is_there(page, anchor):
    assert anchor in headings(page)


def test_the_page_s_program_is_a_program():
    compile(re.search(r"```python\n(.*?)```", TEXT, re.DOTALL)[1], "drive.py", "exec")
