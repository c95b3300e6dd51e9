"""Remedies name what exists: every command, option, make target and package that a message tells a person to use."""

import re
import sys
import tomllib

import pytest
from remedies import PYTHON, ROOT, C, commands, messages, wrong_in

from crunchbot import programs

OF_PYTHON = re.compile(r'add_argument\(\s*"--([a-z-]+)"')
OF_C = re.compile(r'(?:\{|own\(|OWN\()\s*"([a-z][a-z-]*)",')  # an option in a program's table (host/command_line)


@pytest.fixture(scope="module")
def there():
    """What there is: commands, options of any program, targets of the Makefile, packages with their extras."""
    known = commands(sys.executable)
    options = set()

    def add(parser):
        options.update(parser["options"])
        for inner in parser["inner"].values():
            add(inner)

    for parser in known.values():
        add(parser)
    for folder in (*C, *PYTHON):
        for path in (ROOT / folder).rglob("*.[chp]*"):
            found = (OF_PYTHON if path.suffix == ".py" else OF_C).findall(path.read_text(errors="replace"))
            options.update(f"--{name}" for name in found)
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.M))
    packages = {}
    for folder in (".", "lab", "sim/wheel"):
        project = tomllib.loads((ROOT / folder / "pyproject.toml").read_text())["project"]
        packages[project["name"]] = set(project.get("optional-dependencies", {}))
    return known, options, targets, packages


def test_what_messages_name_exists(there):
    wrong = {f"{path.relative_to(ROOT)}: {one}" for path, text in messages() for one in wrong_in(text, *there)}
    assert wrong == set()


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("it fell; see whisker doctr", ["whisker doctr"]),
        ("make one with 'whisker texture learn'", ["whisker texture learn"]),
        ("write it with: whisker info --knots > {}", ["whisker info --knots", "--knots"]),
        ("choose another --rink", ["--rink"]),
        ("make it again: make bitstreem BOARD=...", ["make bitstreem"]),
        ("run: pip install 'crunchbot[records]'", ["pip install crunchbot[records]"]),
        ("pip install crunchbot-lab", ["pip install crunchbot-lab[]"]),
        ("the whisker does not reach; see whisker info --nodes; sudo cmake --install build", []),
        ("make wheels, then: pip install --find-links dist 'crunchbot[lab]'; start again with --pace 0.3", []),
    ],
)
def test_what_does_not_exist_is_noticed(there, text, wrong):
    assert wrong_in(text, *there) == wrong


def test_programs_that_a_remedy_installs_are_in_the_debian_package():
    installed = (ROOT / "debian/whiskerd.install").read_text().split()
    assert [name for name in programs.INSTALLED if f"usr/bin/{name}" not in installed] == []
    assert [
        name for name in programs.INSTALLED if f'"{name}"' not in (ROOT / "tools/wheels/__main__.py").read_text()
    ] == []
