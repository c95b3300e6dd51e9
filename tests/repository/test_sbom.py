"""The software bill of materials: valid, complete, and the same twice."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from chainrun import BUILD, END_S, ROOT
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator


def make(path: Path, *options) -> subprocess.CompletedProcess:
    words = [sys.executable, str(ROOT / "tools/sbom.py"), "--build-dir", str(BUILD), "--out", str(path), *options]
    return subprocess.run(words, capture_output=True, text=True, timeout=END_S)


@pytest.fixture(scope="module")
def text(tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("sbom") / "sbom.json"
    done = make(path)
    assert done.returncode == 0, done.stderr
    return path.read_text()


@pytest.fixture
def components(text) -> dict[str, dict]:
    return {one["purl"]: one for one in json.loads(text)["components"]}


def test_schema_accepts_it_and_refuses_a_damaged_one(text):
    validator = JsonStrictValidator(SchemaVersion.V1_6)
    assert validator.validate_str(text) is None
    assert validator.validate_str(text.replace('"version":', '"versoin":', 1)) is not None


def test_every_locked_package_is_there_with_all_its_hashes(components):
    lock = "".join((ROOT / name).read_text() for name in ("requirements-demo.lock", "requirements.lock"))
    locked = re.findall(r"^([\w-]+)(?:\[\w+\])?==(\S+)", lock, re.MULTILINE)
    assert {f"pkg:pypi/{name}@{version}" for name, version in locked} == {
        purl for purl in components if purl.startswith("pkg:pypi/")
    }
    reported = [
        part["content"]
        for one in components.values()
        for ref in one.get("externalReferences", [])
        for part in ref["hashes"]
    ]
    assert sorted(reported) == sorted(re.findall(r"sha256:(\w+)", lock))


def test_scope_reports_a_robot_from_its_tools(components):
    scope = {one["name"]: one["scope"] for one in components.values()}
    required = ("numpy", "pyro5", "serpent", "luna-usb", "amaranth", "libusb-1.0-0", "libhidapi-libusb0", "libc6")
    assert {name: scope[name] for name in required} == dict.fromkeys(required, "required")
    excluded = ("pytest", "ruff", "cmake", "libusb-1.0-0-dev")
    assert {name: scope[name] for name in excluded} == dict.fromkeys(excluded, "excluded")


def test_same_tree_gives_the_same_bytes(text, tmp_path):
    assert make(tmp_path / "again.json").returncode == 0
    assert (tmp_path / "again.json").read_text() == text


def test_missing_programs_are_one_line(tmp_path):
    done = make(tmp_path / "sbom.json", "--build-dir", str(tmp_path))
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert "no whiskerd, whisker-log, whisker-flash, whisker-base; run make build first" in done.stderr
