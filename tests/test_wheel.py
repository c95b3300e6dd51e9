"""`pip install .` without the build folder: a C compiler makes the wheel, and what it installs works on its own."""

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from chainrun import ROOT

NEEDED = (
    "host/python",
    "host/libwhisker",
    "host/nav",
    "protocol",
    "pyproject.toml",
    "setup.py",
    "README.md",
    "LICENSE",
)
BUILT = shutil.ignore_patterns("*.so", "*.egg-info", "__pycache__", "tests")
ROUND_TRIP = """
import sys, numpy as np, crunchbot
from crunchbot.bridge.ring import FRAME, Reader, Writer
from crunchbot.nav.localise import filter_names
from crunchbot.recording.messages import definition
assert sys.argv[1] in crunchbot.__file__, crunchbot.__file__
frames = np.zeros(100, FRAME)
frames["sequence"] = np.arange(100)
with Writer("whisker-test-wheel", 256) as writer, Reader("whisker-test-wheel") as reader:
    writer.publish(frames)
    assert np.array_equal(reader.take(), frames)
assert "foveal" in filter_names() and "MSG: whisker_msgs/Lane" in definition("whisker_msgs/msg/Block")
"""


def run(*words, **options) -> subprocess.CompletedProcess:
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=300, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done


@pytest.fixture(scope="module")
def venv(tmp_path_factory) -> Path:
    """A fresh virtual environment with the wheel; what the package depends on is lent by this one."""
    place = tmp_path_factory.mktemp("wheel")
    for name in NEEDED:
        source, copy = ROOT / name, place / "source" / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(source, copy, ignore=BUILT) if source.is_dir() else shutil.copy(source, copy)
    options = ["--quiet", "--no-deps", "--no-build-isolation", "--disable-pip-version-check"]
    run(sys.executable, "-m", "pip", "wheel", *options, "--wheel-dir", place, place / "source")
    run(sys.executable, "-m", "venv", "--without-pip", place / "venv")
    site = Path(sysconfig.get_path("purelib", vars={"base": str(place / "venv")}))
    wheel = next(place.glob("crunchbot-*.whl"))
    run(sys.executable, "-m", "pip", "--python", place / "venv/bin/python", "install", *options, wheel)
    (site / "lent.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return place / "venv"


def test_the_command_line_works(venv):
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    said = run(venv / "bin/whisker", "--help", env=environment, cwd=venv).stdout
    assert "  record " in said and "  localise " in said
    assert "adaptive" in run(venv / "bin/whisker", "localise", "--list-filters", env=environment, cwd=venv).stdout


def test_ring_filters_and_messages_are_inside(venv):
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    run(venv / "bin/python", "-c", ROUND_TRIP, venv, env=environment, cwd=venv)
