"""What a release says of itself: versions, citation, licences, the forges' files."""

import importlib.util
import re

import pytest
import yaml
from chainrun import ROOT

from crunchbot import __version__
from crunchbot.recording.reading import FORMAT as RECORDING
from crunchbot.robot.bags.played import FORMAT as BAG
from crunchbot.touch.texture.spectral import FORMAT as TEXTURE
from whisker_protocol import LIMITS, WIRE_VERSION

NOTES = (ROOT / "CHANGELOG.md").read_text()


def test_the_table_of_versions_is_that_of_the_sources():
    table = dict(re.findall(r"^\| ([^|]+) \| (?:soname )?([\d.]+) \|", NOTES, re.MULTILINE))
    layout = (ROOT / "host/libwhisker/src/ring/ring_layout.h").read_text()
    assert table == {
        "wire between node, bridge and host": str(WIRE_VERSION),
        "gateware": str(LIMITS["gateware_version"]),
        "ring in shared memory": re.search(r"RING_LAYOUT_VERSION (\d+)u", layout)[1],
        "libwhisker, libwhisker-nav, libwhisker-create": __version__.rpartition(".")[0],
        "recording": RECORDING,
        "robot's bag": BAG,
        "texture model": TEXTURE.rpartition(" ")[2],
    }
    assert re.search(rf"^## {re.escape(__version__)}\b", NOTES, re.MULTILINE)


def test_the_citation_is_of_this_version_and_names_the_paper():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert cited["version"] == __version__ and cited["license"] == "Apache-2.0"
    (paper,) = cited["references"]
    assert paper["year"] == 2011 and [one["family-names"] for one in paper["authors"]][0] == "Fox"


def test_every_file_has_a_licence_whose_text_is_here():
    text = (ROOT / "REUSE.toml").read_text()
    assert 'path = "**"' in text and 'SPDX-License-Identifier = "Apache-2.0"' in text
    assert (ROOT / "LICENSES/Apache-2.0.txt").read_bytes() == (ROOT / "LICENSE").read_bytes()


@pytest.mark.parametrize("path", sorted((ROOT / ".github").rglob("*.yml")), ids=lambda path: path.name)
def test_forges_files_can_be_read_and_call_what_is_there(path):
    content = yaml.safe_load(path.read_text())
    assert content
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert set(re.findall(r"run: make ([a-z-]+)", path.read_text())) <= targets


@pytest.mark.parametrize("name", ["bug", "hardware", "wish"])
def test_issue_forms_have_what_a_forge_asks_for(name):
    form = yaml.safe_load((ROOT / f".github/ISSUE_TEMPLATE/{name}.yml").read_text())
    assert form["name"] and form["description"] and form["body"]
    ids = [field["id"] for field in form["body"]]
    assert len(set(ids)) == len(ids) and all(field["attributes"]["label"] for field in form["body"])


def test_the_debian_packages_are_of_this_version_and_all_are_built():
    first = (ROOT / "debian/changelog").read_text().splitlines()[0]
    assert first.startswith(f"crunchbot ({__version__}) ")
    named = re.findall(r"^Package: (\S+)", (ROOT / "debian/control").read_text(), re.MULTILINE)
    tool = (ROOT / "tools/debian/__main__.py").read_text()
    built = re.search(r"^PACKAGES = \((.*?)^\)", tool, re.MULTILINE | re.DOTALL)[1]
    assert sorted(named) == sorted(re.findall(r'"(\S+)"', built.replace("DEVELOPMENT", '"libwhisker-dev"')))
    soname = __version__.rpartition(".")[0]
    assert {name for name in named if name.startswith("lib")} == {
        "libwhisker-dev",
        *(f"libwhisker{part}{soname}" for part in ("", "-nav", "-create")),
    }


def test_the_second_of_two_releases_copies_no_run_of_the_first(monkeypatch):
    """The tools of the bitstreams keep their runs; a comparison with a copy would always find the same bytes."""
    spec = importlib.util.spec_from_file_location("release", ROOT / "tools/release/__main__.py")
    release = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(release)
    kept = []
    monkeypatch.setenv(release.kept_runs.VARIABLE, "")
    monkeypatch.setattr(release, "make", lambda *_: kept.append(release.kept_runs.cache_folder()) or "0  a\n")
    monkeypatch.setattr(release.sys, "argv", ["release", "--twice", "--boards", "ulx3s"])
    assert release.main() == 0
    first, second = kept
    assert first != second and not first.is_relative_to(second) and not second.exists()
