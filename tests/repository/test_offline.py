"""Every remedy that names a package, against exactly the files of a release, without an index: `make release-offline`.

What third parties publish is fetched before, into build/wheelhouse; an index has nothing of this project yet.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from chainrun import ROOT
from remedies import PIP, messages

from crunchbot.cli import EXTRAS, LAB_COMMANDS, PACKAGE_EXTRAS

DIST = Path(os.environ.get("WHISKER_DIST", ROOT / "dist")).resolve()
HOUSE = ROOT / "build/wheelhouse"
pytestmark = pytest.mark.skipif("WHISKER_DIST" not in os.environ, reason="WHISKER_DIST names no folder: make wheels")
INSTALL_S = 900


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


@pytest.mark.parametrize("remedy", REMEDIES)
def test_a_remedy_installs_what_its_command_needs(bin_, house, remedy):
    extra = remedy.partition("[")[2].rstrip("]")
    needing = [command for command, one in EXTRAS.items() if one == extra and command not in LAB_COMMANDS]
    if needing:
        said = run(bin_ / "whisker", needing[0], "--help").stderr
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
