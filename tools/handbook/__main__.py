"""The site: every page of the repository and the API of C and Python, in build/site/html. Command: make docs.

Doxygen reads the installed headers, Breathe and Sphinx the rest. Every warning fails it, and so does a link within the site
that leads nowhere. Addresses outside are tried by --external, with a network.
"""

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from benches import tables
from protogen import markdown

from .links import broken, unreached
from .reference import write_reference

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="handbook", description=__doc__.splitlines()[0])
    parser.add_argument("--build-dir", type=Path, default=ROOT / "build/release")
    parser.add_argument("--out", type=Path, default=ROOT / "build/site")
    parser.add_argument("--external", action="store_true", help="try the addresses outside, too; needs a network")
    options = parser.parse_args(argv)
    if shutil.which("doxygen") is None:
        print("handbook: doxygen is not installed; run: apt-get install doxygen", file=sys.stderr)
        return 1
    source, html = options.out / "source", options.out / "html"
    shutil.rmtree(options.out, ignore_errors=True)
    stage(source)
    headers = read_headers(options.build_dir, options.out)
    write_reference(source / "api", headers)
    if run_sphinx("html", source, html, options.out).returncode:
        return 1
    complaints = broken(html)
    if options.external:
        run_sphinx(
            "linkcheck",
            source,
            options.out / "external",
            options.out,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.STDOUT,
        )
        complaints += unreached(options.out / "external/output.json")
    print("\n".join(complaints) or f"handbook: {len(list(html.rglob('*.html')))} pages: {html / 'index.html'}")
    return 1 if complaints else 0


def run_sphinx(builder: str, source: Path, out: Path, place: Path, **options: Any) -> subprocess.CompletedProcess:
    """place: where the site is made, and what all builders share."""
    words = ["-b", builder, "-c", HERE, "-W", "--keep-going", "-q", "-j", "2", "-d", place / "trees", source, out]
    return subprocess.run([sys.executable, "-m", "sphinx", *words], check=False, env=environment(place), **options)


def environment(out: Path) -> dict[str, str]:
    """For the configuration: where Doxygen's answer is."""
    return os.environ | {"HANDBOOK_XML": str(out / "doxygen/xml")}


def stage(source: Path) -> None:
    """Copies of the tracked files: pages, and what pages refer to; with the tables that git does not hold, and the wire format as
    such, which pages name by its definition."""
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "-z"], capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        path = source / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).is_file():
            shutil.copyfile(ROOT / name, path)
        if path.suffix == ".md":
            text = path.read_text().replace("protocol/whisker.toml)", "protocol/wire_format.md)")
            path.write_text(tables.of_site(text))
    (source / "protocol/wire_format.md").write_text(markdown())
    shutil.copyfile(HERE / "index.rst", source / "index.rst")


def read_headers(build: Path, out: Path) -> list[str]:
    """The headers that `cmake --install` puts down, read by Doxygen; their paths below include/."""
    words = ["cmake", "--install", build, "--prefix", out / "prefix"]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    include = out / "prefix/include"
    settings = (HERE / "Doxyfile").read_text()
    settings += f"INPUT = {include}\nSTRIP_FROM_PATH = {include}\nOUTPUT_DIRECTORY = {out / 'doxygen'}\n"
    settings += f"FILTER_PATTERNS = *.h={HERE / 'comments.sed'}\n"
    (out / "doxygen").mkdir()
    subprocess.run(["doxygen", "-"], input=settings, text=True, check=True, stdout=subprocess.DEVNULL)
    return sorted(path.relative_to(include).as_posix() for path in include.rglob("*.h"))


if __name__ == "__main__":
    sys.exit(main())
