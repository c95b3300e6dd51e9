"""Pages lead where they say: links reach a file, and the code tour names functions that are there."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [
    ROOT / path
    for path in subprocess.run(
        ["git", "-C", ROOT, "ls-files", "*.md"], capture_output=True, text=True, check=True
    ).stdout.split()
]
TRACKED = subprocess.run(["git", "-C", ROOT, "ls-files"], capture_output=True, text=True, check=True).stdout.split()
FOLDERS = {path.partition("/")[0] for path in TRACKED if "/" in path}
SOURCE = re.compile(r"[\w./*\[\]-]+\.(?:c|h|cpp|py|v|vh|js|mjs|rs|sh|md|pml|ld)")
MADE = {"OUT.v"}  # files that a page has the user make
LINK = re.compile(r"\]\(([^)\s]+)\)")
TOUR = ROOT / "docs/code_tour.md"


def text_of(page: Path) -> str:
    """A page without its code, in which brackets mean something else."""
    return re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text(), flags=re.DOTALL)


def anchors(page: Path) -> set[str]:
    """What can be linked to in a page: its headings, as GitHub names them."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", re.sub(r"[`*]", "", heading).lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_reach_what_they_name(page):
    lost = []
    for link in LINK.findall(text_of(page)):
        if "://" in link or link.startswith("mailto:"):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        if not target.exists() or (anchor and target.suffix == ".md" and anchor not in anchors(target)):
            lost.append(link)
    assert lost == []


def spans(page: Path) -> list[str]:
    """What stands in back quotes in the running text of a page."""
    return re.findall(r"`([^`\n]+)`", re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL))


def is_there(span: str, page: Path) -> bool:
    """Whether what a code span names is in the tree, if it names a file or folder of it: a path from the root or from the
    page's folder; of a source file the end of a path is enough."""
    path = span.removeprefix("./").rstrip("/")
    if "NAME" in path or path in MADE:
        return True
    if path.partition("/")[0] in FOLDERS and "/" in span and re.fullmatch(r"[\w./*\[\]-]+", path):
        return any(list(place.glob(path)) for place in (ROOT, page.parent))
    if SOURCE.fullmatch(path):
        end = re.compile("(?:^|/)" + re.escape(path).replace(r"\*", "[^/]*").replace(r"\[ch\]", "[ch]") + "$")
        return any(end.search(file) for file in TRACKED)
    return True


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_code_spans_name_files_that_are_there(page):
    assert [span for span in spans(page) if not is_there(span, page)] == []


def test_a_code_span_that_names_no_file_is_found():
    there = (
        "host/nav/filter",
        "filter.c",
        "nav/filter/filter.c",
        "core/service.[ch]",
        "tests/",
        "robot/topic",
        "a.json",
    )
    assert [span for span in there if not is_there(span, ROOT / "README.md")] == []
    gone = ("host/nav/gone", "gone.c", "whisker/pilot/rules.py", "docs/gone.md", "tests/gone/")
    assert [span for span in gone if is_there(span, ROOT / "README.md")] == []


def tables(text: str) -> list[str]:
    """Code of a page that is TOML: blocks that begin with a table's name or a key."""
    blocks = re.findall(r"```\w*\n(.*?)```", text, re.DOTALL)
    blocks += [part.replace("\n    ", "\n") for part in re.findall(r"(?:^\n?    .*\n)+", text, re.MULTILINE)]
    return [block for block in map(str.strip, blocks) if re.match(r"\[\[?\w[\w.]*\]|\w+ = [\[{\"\d]", block)]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_tables_of_toml_can_be_read(page):
    for block in tables(page.read_text()):
        tomllib.loads(block)


def test_every_page_stands_on_a_shelf():
    shelves = (ROOT / "docs/README.md").read_text()
    pages = [
        str(page.relative_to(ROOT / "docs")) for folder in (".", "methods") for page in ROOT.glob(f"docs/{folder}/*.md")
    ]
    assert [page for page in pages if f"({page})" not in shelves] == ["README.md"]


def test_the_code_tour_names_what_is_there():
    rows = [row.split("|") for row in TOUR.read_text().splitlines() if row.startswith("|") and "`" in row]
    assert len(rows) > 25
    for _, _, names, files, _ in rows:
        text = "".join((ROOT / file).read_text() for file in re.findall(r"`([^`]+)`", files))
        for name in re.findall(r"`([^`]+)`", names):
            word = name.removeprefix("class ").rpartition(".")[2]
            assert re.search(rf"\b{word}\b", text), f"{name} is not in {files}"
