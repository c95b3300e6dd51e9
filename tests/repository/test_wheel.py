"""`pip install .` and `pip install ./lab` without the build folder: a C compiler makes the wheels, and what they install works
on its own."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest
from chainrun import BUILD, ROOT
from remedies import commands

from crunchbot import __version__

PRODUCT = (
    "host/python",
    "host/libwhisker",
    "host/create",
    "host/nav",
    "protocol",
    "pyproject.toml",
    "setup.py",
    "README.md",
    "LICENSE",
)
LAB = ("lab", "sim/signals", "sim/world", "sim/mechanics", "sim/mlx90333", "sim/common", "firmware/dspic/core")
BUILD_S = 600  # for a wheel and an environment, on a machine at load 15
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
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=BUILD_S, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done


def wheel(place: Path, project: Path) -> Path:
    """The wheel of a project's folder."""
    options = ["--quiet", "--no-deps", "--no-build-isolation", "--disable-pip-version-check"]
    cached = (
        {"CC": "ccache cc", "CCACHE_BASEDIR": str(place), "CCACHE_NOHASHDIR": "1"} if shutil.which("ccache") else {}
    )
    words = [sys.executable, "-m", "pip", "wheel", *options, "--wheel-dir", place / project.name, project]
    run(*words, env=os.environ | cached)
    return next((place / project.name).glob("*.whl"))


@pytest.fixture(scope="module")
def wheels(tmp_path_factory) -> tuple[Path, Path]:
    """Those of the product and of the laboratory, from a copy of the sources alone."""
    place = tmp_path_factory.mktemp("wheel")
    for name in (*PRODUCT, *LAB):
        source, copy = ROOT / name, place / "source" / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(source, copy, ignore=BUILT) if source.is_dir() else shutil.copy(source, copy)
    return wheel(place, place / "source"), wheel(place, place / "source/lab")


def fresh_venv(place: Path, *packages: Path, lent: tuple[str, ...] = ()) -> Path:
    """A virtual environment with these wheels; what they depend on is lent by this one: all, or what is named."""
    run(sys.executable, "-m", "venv", "--without-pip", place)
    site = Path(sysconfig.get_path("purelib", vars={"base": str(place)}))
    options = ["--quiet", "--no-deps", "--disable-pip-version-check"]
    run(
        sys.executable,
        "-m",
        "pip",
        "--python",
        place / "bin/python",
        "install",
        *options,
        *packages,
        env=bare_environment(),
    )
    if lent:
        for name in (one for pattern in lent for one in Path(sysconfig.get_path("purelib")).glob(pattern)):
            (site / name.name).symlink_to(name)
    else:
        (site / "lent.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return place


@pytest.fixture(scope="module")
def venv(wheels, tmp_path_factory) -> Path:
    """With the product alone."""
    return fresh_venv(tmp_path_factory.mktemp("product") / "venv", wheels[0])


@pytest.fixture(scope="module")
def core(wheels, tmp_path_factory) -> Path:
    """With the product and what it cannot do without: numpy and cffi."""
    needed = ("numpy", "numpy.libs", "_cffi_backend*", "cffi", "cffi.libs")
    return fresh_venv(tmp_path_factory.mktemp("core") / "venv", wheels[0], lent=needed)


@pytest.fixture(scope="module")
def lab(wheels, tmp_path_factory) -> Path:
    """With product and laboratory."""
    return fresh_venv(tmp_path_factory.mktemp("lab") / "venv", *wheels)


def bare_environment(**more: str) -> dict[str, str]:
    return {key: value for key, value in os.environ.items() if key != "PYTHONPATH"} | more


def test_the_command_line_works(venv):
    said = run(venv / "bin/whisker", "--help", env=bare_environment(), cwd=venv).stdout
    assert "  record " in said and "  localise " in said
    assert (
        "adaptive" in run(venv / "bin/whisker", "localise", "--list-filters", env=bare_environment(), cwd=venv).stdout
    )


def test_one_wheel_serves_every_python_from_3_11(wheels):
    assert all("-cp311-abi3-" in wheel.name for wheel in wheels)


def test_filters_ring_and_perception_need_numpy_and_cffi_alone(core):
    environment = bare_environment()
    assert "adaptive" in run(core / "bin/whisker", "localise", "--list-filters", env=environment, cwd=core).stdout
    assert run(core / "bin/whisker", "--version", env=environment, cwd=core).stdout == f"whisker {__version__}\n"
    modules = ("nav.filters", "nav.own", "bridge.ring", "touch.contact_filter", "touch.radial.model")
    modules += ("touch.texture.model", "touch.texture.train", "scene", "observation", "pilot.pilot")
    run(core / "bin/python", "-c", "\n".join(f"import crunchbot.{one}" for one in modules), env=environment, cwd=core)


@pytest.mark.parametrize(
    ("command", "extra"), [("record", "record"), ("view", "view"), ("robot", "robot"), ("navigator", "robot")]
)
def test_a_command_names_the_extra_that_it_needs(core, command, extra):
    done = subprocess.run(
        [core / "bin/whisker", command], env=bare_environment(), cwd=core, capture_output=True, text=True
    )
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert re.fullmatch(
        rf"whisker: {command}: needs the package \w+; run: pip install 'crunchbot\[{extra}\]'\n", done.stderr
    )


def test_import_is_quick(core):
    """In modules, for time depends on the machine: what the package itself imports is next to nothing."""
    count = "import sys; before = set(sys.modules); import crunchbot; print(len(set(sys.modules) - before))"
    assert int(run(core / "bin/python", "-c", count, env=bare_environment(), cwd=core).stdout) <= 2


def test_the_laboratory_is_named_where_it_is_missing(venv):
    # This environment's editable packages must not stand in for the missing one.
    block = "import sys; sys.modules['crunchbot_lab'] = None; from crunchbot.cli import main; sys.exit(main())"
    for words in (["scene", "make"], ["bridge-sim"], ["robot", "--simulated", "--out", "run"]):
        done = subprocess.run(
            [venv / "bin/python", "-c", block, *words], env=bare_environment(), cwd=venv, capture_output=True, text=True
        )
        assert done.returncode == 2 and done.stderr.count("\n") == 1
        assert "make wheels, then pip install --find-links dist 'crunchbot[lab]'" in done.stderr


def metadata_of(wheel: Path) -> str:
    with zipfile.ZipFile(wheel) as file:
        return file.read(next(name for name in file.namelist() if name.endswith(".dist-info/METADATA"))).decode()


def test_the_wheels_have_what_remedies_name(wheels, lab):
    """Extras by their metadata, commands and options by their own `whisker`."""
    metadata = [metadata_of(path) for path in wheels]
    assert "Provides-Extra: lab\n" in metadata[0] and "Name: crunchbot-lab\n" in metadata[1]
    assert re.search(r"Requires-Dist: crunchbot-lab; extra == .lab.", metadata[0])
    assert re.search(r"Requires-Dist: crunchbot-sim==", metadata[1])
    assert commands(lab / "bin/python", env=bare_environment(), cwd=lab) == commands(sys.executable)


def test_a_simulated_robot_runs_where_the_wheels_are(lab):
    """Its simulation's programs come from the build; nothing else of the source tree is used."""
    where = "import crunchbot_lab.signals as s; print(s.__file__)"
    assert run(lab / "bin/python", "-c", where, env=bare_environment(), cwd=lab).stdout.startswith(str(lab))
    words = ["robot", "--simulated", "--seconds", "3", "--out", lab / "run", "--ring", "whisker-test-lab"]
    words += ["--first-port", "7691"]
    said = run(lab / "bin/whisker", *words, env=bare_environment(WHISKER_BUILD=str(BUILD)), cwd=lab).stdout
    assert "all ended" in said
    assert (lab / "run/truth.csv").stat().st_size > 0 and (lab / "run/models/texture.json").exists()


def test_ring_filters_and_messages_are_inside(venv):
    run(venv / "bin/python", "-c", ROUND_TRIP, venv, env=bare_environment(), cwd=venv)
