"""The site's parts: docstrings and headers' comments are taken over whole, links are followed. `make docs` builds all of it."""

import importlib
import json
import shutil
import subprocess
import sys
from xml.etree import ElementTree

import pytest
from chainrun import BUILD, ROOT

sys.path.insert(0, str(ROOT / "tools"))
from handbook import __main__ as handbook  # noqa: E402
from handbook import links, reference  # noqa: E402
from handbook.docstrings import marked  # noqa: E402

sys.path.remove(str(ROOT / "tools"))


def published(text: str) -> str:
    """What a reader sees of a docstring."""
    core = pytest.importorskip("docutils.core")
    settings = {"report_level": 1, "halt_level": 1, "raw_enabled": False}
    return core.publish_doctree("\n".join(marked(text.splitlines())), settings_overrides=settings).astext()


def test_a_docstring_reads_as_it_is_written():
    text = "Poses (n, 3) of *args, a_ and |b| by `Filter.step`; <x> is 2*3.\n\nSecond."
    assert published(text) == "Poses (n, 3) of *args, a_ and |b| by Filter.step; <x> is 2*3.\n\nSecond."
    assert marked(["`code`s"])[0] == "\\ \\ ``code``\\ s"


def test_lines_that_are_indented_keep_their_places():
    text = "Levels:\n    one   two_\n      three\nlast"
    assert published(text).split("\n\n") == ["Levels:", "    one   two_\n      three\nlast"]


def test_every_docstring_is_taken_without_complaint():
    """Of every module of the reference."""
    names = [name for package in ("crunchbot", "whisker_protocol") for name in modules(package)]
    assert len(names) > 100
    for name in names:
        module = importlib.import_module(name)
        for held in (module, *(v for v in vars(module).values() if getattr(v, "__module__", None) == name)):
            if held.__doc__:
                published(held.__doc__)


def modules(package: str) -> list[str]:
    pages = reference.python_pages(importlib.import_module(package))
    return [line.split(":: ")[1] for page in pages.values() for line in page.splitlines() if line.startswith("..")]


def test_links_that_lead_nowhere_are_named(tmp_path):
    (tmp_path / "a.html").write_text(
        '<a href="b.html#there">x</a><a href="https://example.org/x#y">y</a><a href="#top">'
    )
    (tmp_path / "b.html").write_text('<p id="there"><img src="c.svg"><a href="a.html#gone"></a><a href="d/e.html">')
    assert links.broken(tmp_path) == [
        "a.html: #top: there is no such place",
        "b.html: a.html#gone: there is no such place",
        "b.html: c.svg: there is no such file",
        "b.html: d/e.html: there is no such file",
    ]


@pytest.mark.skipif(shutil.which("doxygen") is None, reason="doxygen is not installed (make docs installs it)")
def test_every_exported_function_is_in_the_reference_of_c(tmp_path):
    headers = handbook.read_headers(BUILD, tmp_path)
    pages = "".join(reference.c_page(name, title, headers) for name, title in reference.LIBRARIES.items())
    assert all(f":: {header.rpartition('/')[2]}\n" in pages for header in headers) and len(headers) > 20
    documented, named = set(), set()
    for path in (tmp_path / "doxygen/xml").glob("*_8h.xml"):
        for member in ElementTree.parse(path).iter("memberdef"):
            named.add(member.findtext("name"))
            if "".join(member.find("detaileddescription").itertext()).strip():
                documented.add(member.findtext("name"))
    exported = set()
    for library in ("libwhisker/libwhisker", "nav/libwhisker-nav", "create/libwhisker-create"):
        words = ["nm", "--dynamic", "--defined-only", BUILD / f"host/{library}.so"]
        listed = subprocess.run(words, capture_output=True, text=True, check=True).stdout
        exported |= {line.split()[2] for line in listed.splitlines() if line.split()[1] == "T"}
    assert len(exported) > 100 and exported <= named
    assert len(exported & documented) > 0.6 * len(exported), "a comment may stand for several functions below it"


def test_an_address_that_is_not_reached_is_named_and_a_missing_network_is_one_line(tmp_path):
    def report(**status: str) -> list[str]:
        lines = [
            {"filename": "a.md", "lineno": 7, "uri": f"https://{name}", "status": found, "info": "404"}
            for name, found in status.items()
        ]
        (tmp_path / "output.json").write_text("".join(json.dumps(line) + "\n" for line in lines))
        return links.unreached(tmp_path / "output.json")

    assert report(one="working", two="redirected") == []
    assert report(one="working", two="broken") == ["a.md:7: https://two: 404"]
    (line,) = report(one="broken", two="timeout")
    assert "none of 2 addresses" in line and "EXTERNAL=1" in line
