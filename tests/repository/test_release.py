"""What a release says of itself: versions, citation, licences, the forges' files."""

import importlib.util
import os
import re
import tarfile

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


@pytest.fixture
def release(monkeypatch, tmp_path):
    """The tool, with a dist/ of its own."""
    spec = importlib.util.spec_from_file_location("release", ROOT / "tools/release/__main__.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    monkeypatch.setattr(made, "DIST", tmp_path)
    return made


def test_the_page_of_a_release_has_a_line_for_each_file_and_what_is_missing(release, tmp_path):
    version = __version__
    for name in (
        f"crunchbot-{version}-cp311-abi3-manylinux_2_27_x86_64.manylinux_2_28_x86_64.whl",
        f"crunchbot_sim-{version}-py3-none-manylinux_2_34_x86_64.whl",
        "crunchbot-debian-bookworm.tar",
        "crunchbot-firmware.tar.gz",
        "ecpix5-28-testid.bit",
        "ecpix5-28.wgw",
    ):
        (tmp_path / name).write_bytes(b"x" * 200_000)
    page = release.page({"site": "doxygen is not installed; run: apt-get install doxygen"})
    lines = [line.split("|") for line in page.splitlines() if line.startswith("| `")]
    assert [line[1].strip(" `") for line in lines] == sorted(path.name for path in tmp_path.iterdir())
    assert all(line[2].strip() == "0.2" and len(line[3]) > 10 for line in lines) and "for tests only" in page
    assert "\n- site: doxygen is not installed; run: apt-get install doxygen\n" in page
    (tmp_path / "of_nobody.bin").write_bytes(b"")
    with pytest.raises(StopIteration):
        release.page({})


def test_an_archive_of_a_release_is_the_same_for_the_same_files(release, tmp_path):
    folder = tmp_path / "folder"
    (folder / "a/b").mkdir(parents=True)
    (folder / "a/b/c.txt").write_text("c")
    (folder / "d.txt").write_text("d")
    for name in ("x.tar.gz", "x.tar"):
        release.pack(folder, name)
        first = (tmp_path / name).read_bytes()
        os.utime(folder / "d.txt", (1, 1))
        release.pack(folder, name)
        assert (tmp_path / name).read_bytes() == first
        with tarfile.open(tmp_path / name) as archive:
            assert sorted(archive.getnames()) == ["x/a/b/c.txt", "x/d.txt"]


def test_what_cannot_be_made_is_named_and_the_rest_is_made(release, tmp_path, monkeypatch, capsys):
    (tmp_path / "build").mkdir()
    (tmp_path / "build/sbom.json").write_text("{}")
    (tmp_path / "firmware/images").mkdir(parents=True)
    out = tmp_path / "dist"
    monkeypatch.setattr(release, "ROOT", tmp_path)
    monkeypatch.setattr(release, "DIST", out)

    def run(*words, folder=None):
        if "tools/wheels" in words:
            out.mkdir()
        if "--list" in words:
            return "ecpix5 ulx3s"
        if "handbook" in words:
            raise release.CannotError("-m handbook failed: doxygen is not installed")
        return ""

    monkeypatch.setattr(release, "run", run)
    monkeypatch.setattr(release, "pack_sources", lambda: None)
    monkeypatch.setattr(release.os, "getuid", lambda: 1000)
    sums = release.make([], None)
    assert [line.split()[1] for line in sums.splitlines()] == ["RELEASE.md", "crunchbot-firmware.tar.gz", "sbom.json"]
    page = (out / "RELEASE.md").read_text()
    for line in (
        "site: -m handbook failed: doxygen",
        "Debian packages: needs root",
        "bitstream of ulx3s: was not asked",
    ):
        assert f"- {line}" in page


def test_a_failed_build_of_packages_leaves_no_folder_among_the_downloads(release, tmp_path, monkeypatch):
    def run(*words, folder=None):
        (tmp_path / "dist/debian").mkdir(parents=True)
        (tmp_path / "dist/debian/trixie.log").write_text("no mirror")
        raise release.CannotError("no mirror")

    monkeypatch.setattr(release, "ROOT", tmp_path)
    monkeypatch.setattr(release, "DIST", tmp_path / "dist")
    monkeypatch.setattr(release, "run", run)
    monkeypatch.setattr(release.os, "getuid", lambda: 0)
    monkeypatch.setattr(release.shutil, "which", lambda name: name)
    (tmp_path / "build").mkdir()
    with pytest.raises(release.CannotError):
        release.make_debian()
    assert not list((tmp_path / "dist").iterdir()) and (tmp_path / "build/debian/trixie.log").exists()


def test_the_second_of_two_releases_copies_no_run_of_the_first_and_the_first_stays(release, tmp_path, monkeypatch):
    """The tools of the bitstreams keep their runs; a comparison with a copy would always find the same bytes."""
    kept = []
    (tmp_path / "build").mkdir()
    monkeypatch.setenv(release.kept_runs.VARIABLE, "")
    monkeypatch.setattr(release, "ROOT", tmp_path)
    monkeypatch.setattr(release, "DIST", tmp_path / "dist")
    monkeypatch.setattr(release, "boards", lambda: ["ulx3s"])

    def make(*_, **how):
        kept.append(release.kept_runs.cache_folder())
        (tmp_path / "dist").mkdir()
        (tmp_path / "dist/a").write_text(str(how))
        return "0  a\n"

    monkeypatch.setattr(release, "make", make)
    monkeypatch.setattr(release.sys, "argv", ["release", "--twice", "--boards", "ulx3s"])
    assert release.main() == 0
    first, second = kept
    assert first != second and not first.is_relative_to(second) and not second.exists()
    assert (tmp_path / "dist/a").read_text() == "{}"
