"""Remedies name what exists: every command, option, make target and package that a message tells a person to use.

`make release-offline` runs those that name a package against exactly the files of a release, without an index. What third
parties publish is fetched before, into build/wheelhouse.
"""

import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from remedies import PIP, PYTHON, ROOT, C, commands, messages, wrong_in

from crunchbot import programs
from crunchbot.cli import EXTRAS, LAB_COMMANDS, PACKAGE_EXTRAS

OF_PYTHON = re.compile(r'add_argument\(\s*"--([a-z-]+)"')
OF_C = re.compile(r'(?:\{|own\(|OWN\()\s*"([a-z][a-z-]*)",')  # an option in a program's table (host/command_line)

DIST = Path(os.environ.get("WHISKER_DIST", ROOT / "dist")).resolve()
HOUSE = ROOT / "build/wheelhouse"
INSTALL_S = 900


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


def remedies() -> set[str]:
    """What the programs' messages have pip install, each extra that fills a message in."""
    extras = {*EXTRAS.values(), *PACKAGE_EXTRAS.values()}
    found = {(package, extra) for _, text in messages() for _, package, extra in PIP.findall(text)}
    assert ("crunchbot", "{}") in found
    wanted = {(package, one) for package, extra in found for one in (extras if extra == "{}" else {extra})}
    return {f"{package}[{extra}]" if extra else package for package, extra in wanted}


REMEDIES = sorted(remedies())


def run(*words: object, **options) -> subprocess.CompletedProcess:
    """Outside of the tree: nothing of it may help."""
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "WHISKER_BUILD")}
    options = {
        "cwd": HOUSE,
        "env": environment | {"PIP_DISABLE_PIP_VERSION_CHECK": "1"},
        "timeout": INSTALL_S,
    } | options
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, **options)


def pip(python: Path | str, *words: object) -> None:
    done = run(python, "-m", "pip", *words)
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-2000:]


@pytest.fixture(scope="module")
def house() -> Path:
    HOUSE.mkdir(parents=True, exist_ok=True)
    wanted = ["-q", "--only-binary", ":all:", "--find-links", DIST, "--dest", HOUSE]
    pip(sys.executable, "download", *wanted, *REMEDIES)
    for own in HOUSE.glob("crunchbot*"):
        own.unlink()  # these come from the release alone
    return HOUSE


@pytest.fixture
def bin_(house, tmp_path) -> Path:
    """An environment as a user has it before a remedy: the package alone, of the release."""
    assert run(sys.executable, "-m", "venv", tmp_path / "venv").returncode == 0
    pip(
        tmp_path / "venv/bin/python",
        "install",
        "-q",
        "--no-index",
        "--find-links",
        DIST,
        "--find-links",
        house,
        "crunchbot",
    )
    return tmp_path / "venv/bin"


# What needs an extra, where the command's help does without it: {1} is a scene with a base of ROS 2, {2} a file to be.
USES = {"cyclonedds": "base {1} --trial", "scenes": "map {1} --out {2}"}


def scene_of_ros2(folder: Path) -> Path:
    with zipfile.ZipFile(ROOT / "host/python/crunchbot/data/examples.zip") as examples:
        examples.extractall(folder)
    table = "[base]\nwheel_base_m = 0.16\nwheel_most_m_s = 0.22\nwheel_step_m_s = 0.01\nacceleration_m_s2 = 1.5\n"
    with (folder / "scene/robot.toml").open("a") as robot:
        robot.write(f'\n{table}[base.ros2]\nodometry = "/odom"\n')
    return folder / "scene"


@pytest.mark.skipif("WHISKER_DIST" not in os.environ, reason="WHISKER_DIST names no folder: make release-offline")
@pytest.mark.parametrize("remedy", REMEDIES)
def test_a_remedy_installs_what_its_command_needs(bin_, house, remedy, tmp_path):
    extra = remedy.partition("[")[2].rstrip("]")
    needing = [command for command, one in EXTRAS.items() if one == extra and command not in LAB_COMMANDS]
    if needing:
        words = USES.get(extra, "{0} --help").format(needing[0], scene_of_ros2(tmp_path), tmp_path / "out").split()
        said = run(bin_ / "whisker", *words).stderr
        assert f"pip install 'crunchbot[{extra}]'" in said, "it was needed"
    own = ["--find-links", DIST] if remedy.startswith("crunchbot-") or extra == "lab" else []
    pip(bin_ / "python", "install", "-q", "--no-index", *own, "--find-links", house, remedy)
    for command in needing:
        done = run(bin_ / "whisker", command, "--help")
        assert done.returncode == 0, done.stderr
    if own:
        assert (
            run(
                bin_ / "python", "-c", "from crunchbot.programs import program; print(program('whisker-bridge-sim'))"
            ).returncode
            == 0
        )
    if extra == "lab":
        assert run(bin_ / "whisker", "scene", "make", "--help").returncode == 0
