"""`make release`: what users of a release download, into dist/, with RELEASE.md, a line for each file, and SHA256SUMS.

Wheels, Debian packages, bitstreams of the boards, images of the nodes' firmware, the site of pages, the bill of materials and
the sources of the newest commit. What cannot be made on a machine is named in RELEASE.md with its reason. One commit gives the
same bytes each time: `--twice` makes what RELEASE.md does not except twice and compares.
"""

import argparse
import gzip
import hashlib
import io
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "fpga"))
import kept_runs  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
DIST = ROOT / "dist"
SUMS = "SHA256SUMS"
PAGE = "RELEASE.md"
GATEWARE = (".bit", ".fs", ".wgw")
ONCE = (
    "Debian packages",
    "site",
)  # not made again by --twice: other machines' compilers and dates of Sphinx are in them
BEGIN = (
    "sha256sum --check --ignore-missing SHA256SUMS",
    "python3 -m venv ~/whisker && . ~/whisker/bin/activate",
    "pip install --no-compile --find-links . 'crunchbot[view]' && whisker try",
    "pip install --no-compile --find-links . 'crunchbot[lab]' && whisker robot --simulated --desktop",
)
# Each file by its name's pattern: whose it is. A file that fits none fails the tool.
ABOUT = {
    "crunchbot-[0-9]*x86_64.whl": "Python: library, filters and the command `whisker`; Intel and AMD",
    "crunchbot-[0-9]*aarch64.whl": "the same for 64-bit ARM, as a Raspberry Pi",
    "crunchbot_lab-*x86_64.whl": "scenes and simulated signals; Intel and AMD",
    "crunchbot_lab-*aarch64.whl": "the same for 64-bit ARM; without programs of a simulated robot",
    "crunchbot_sim-*.whl": "programs of the simulated robot, and whiskerd, whisker-base, whisker-flash; Intel and AMD",
    "crunchbot-debian-*.tar": "Debian packages of this release of Debian: daemons, libraries, Python",
    "crunchbot-firmware.tar.gz": "images of the dsPIC node, and of the Pico in `pico/`: `whisker flash`",
    "crunchbot-site.tar.gz": "all pages, and the API of C and Python, to be read without a network",
    "crunchbot-source.tar.gz": "sources",
    "sbom.json": "software bill of materials (CycloneDX)",
    "*.wgw": "update of the board it is named by, for `whisker flash`",
    "*-testid.*": "bitstream of the board it is named by, with a USB number for tests only",
    "*.bit": "bitstream of the board it is named by",
    "*.fs": "bitstream of the board it is named by",
}


class CannotError(Exception):
    """What cannot be made on this machine; why, in one line."""


def run(*words: object, folder: Path = ROOT) -> str:
    """A command of the source tree; CannotError with its last line when it fails."""
    done = subprocess.run([str(word) for word in words], cwd=folder, capture_output=True, text=True, errors="replace")
    if done.returncode != 0:
        lines = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()] or ["no word"]
        print(*lines[-25:], sep="\n", file=sys.stderr)
        raise CannotError(f"{' '.join(map(str, words[1:3]))} failed: {lines[-1]}")
    return done.stdout


def boards() -> list[str]:
    return run(sys.executable, "fpga/boards/build.py", "--list").split()


def make_bitstream(board: str, usb_id: str | None) -> None:
    scratch = ROOT / "build/release-boards" / board
    shutil.rmtree(scratch, ignore_errors=True)
    run(sys.executable, "fpga/boards/build.py", board, "--out", scratch, *(["--usb-id", usb_id] if usb_id else []))
    for file in scratch.iterdir():
        if file.suffix in GATEWARE:
            shutil.copy(file, DIST)


def pack(folder: Path, name: str) -> None:
    """The files below a folder in an archive of dist/, the same bytes for the same files."""
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w") as archive:
        for path in sorted(path for path in folder.rglob("*") if path.is_file()):
            about = tarfile.TarInfo(f"{name.split('.')[0]}/{path.relative_to(folder)}")
            about.size = path.stat().st_size
            archive.addfile(about, io.BytesIO(path.read_bytes()))
    content = packed.getvalue()
    (DIST / name).write_bytes(gzip.compress(content, mtime=0) if name.endswith(".gz") else content)


def make_debian() -> None:
    if os.getuid() != 0 or shutil.which("mmdebstrap") is None:
        raise CannotError("needs root and mmdebstrap; run: apt-get install mmdebstrap, then: sudo make release")
    made, kept = DIST / "debian", ROOT / "build/debian"
    try:
        run(sys.executable, "tools/debian")
        for folder in sorted(made.glob("*/")):
            pack(folder, f"crunchbot-debian-{folder.name}.tar")
    finally:  # folders and logs are not downloaded
        shutil.rmtree(kept, ignore_errors=True)
        if made.exists():
            shutil.move(made, kept)


def make_site() -> None:
    run(sys.executable, "-m", "handbook", folder=ROOT / "tools")
    pack(ROOT / "build/site/html", "crunchbot-site.tar.gz")


def pack_sources() -> None:
    """A tar of the newest commit, compressed without a time."""
    done = subprocess.run(["git", "archive", "--prefix=crunchbot/", "HEAD"], cwd=ROOT, capture_output=True, check=True)
    (DIST / "crunchbot-source.tar.gz").write_bytes(gzip.compress(done.stdout, mtime=0))


def sums() -> str:
    """A line for each file of dist/."""
    files = sorted(path for path in DIST.iterdir() if path.name != SUMS)
    return "".join(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files)


def page(missing: dict[str, str]) -> str:
    """RELEASE.md: a line for each file, and what is missing and why."""
    lines = ["# CrunchBot: what to download", "", "Never yet run on silicon: see the README. Then, in this folder:", ""]
    lines += [f"    {command}" for command in BEGIN] + ["", "| file | MB | what |", "|---|---|---|"]
    for path in sorted(DIST.iterdir()):
        if path.name not in (SUMS, PAGE):
            about = next(text for pattern, text in ABOUT.items() if path.match(pattern))
            lines.append(f"| `{path.name}` | {path.stat().st_size / 1e6:.1f} | {about} |")
    lines += ["", "Missing, and why:", ""] if missing else []
    return "\n".join([*lines, *(f"- {what}: {why}" for what, why in missing.items())]) + "\n"


def make(chosen: list[str], usb_id: str | None, again: bool = False) -> str:
    """Everything, or `again` what is made alike; the text of SHA256SUMS."""
    steps = {"wheels": lambda: run(sys.executable, "tools/wheels"), "Debian packages": make_debian, "site": make_site}
    steps |= {f"bitstream of {name}": lambda name=name: make_bitstream(name, usb_id) for name in chosen}
    steps |= {"node images": lambda: pack(ROOT / "firmware/images", "crunchbot-firmware.tar.gz")}
    steps |= {"sources": pack_sources}
    missing = {f"bitstream of {name}": "was not asked for" for name in boards() if name not in chosen}
    for what, step in (bar := tqdm(steps.items(), desc="release", unit="part", disable=None)):
        bar.set_postfix_str(what)
        try:
            if not (again and what in ONCE):
                step()
        except CannotError as error:
            if what == "wheels":
                sys.exit(f"release: {error}")
            missing[what] = str(error)
            print(f"release: without {what}: {error}", file=sys.stderr)
    shutil.copy(ROOT / "build/sbom.json", DIST)
    (DIST / PAGE).write_text(page(missing))
    (DIST / SUMS).write_text(sums())
    return (DIST / SUMS).read_text()


def main() -> int:
    parser = argparse.ArgumentParser(prog="release", description=__doc__.splitlines()[0])
    parser.add_argument(
        "--boards", nargs="*", metavar="BOARD", help="bitstreams to make (default: all; a minute or more each)"
    )
    parser.add_argument(
        "--usb-id", metavar="VID:PID", help="USB numbers of your own; without, bitstreams are for tests only"
    )
    parser.add_argument("--twice", action="store_true", help="make everything twice and compare")
    arguments = parser.parse_args()
    known = boards()
    chosen = known if arguments.boards is None else arguments.boards
    if unknown := set(chosen) - set(known):
        sys.exit(f"release: no board '{min(unknown)}'; boards: {', '.join(known)}")
    made = make(chosen, arguments.usb_id)
    if arguments.twice:
        with tempfile.TemporaryDirectory(dir=ROOT / "build") as place:
            os.environ[kept_runs.VARIABLE] = f"{place}/runs"  # none is kept there that could be copied
            shutil.move(DIST, f"{place}/first")  # which is what is downloaded
            again = make(chosen, arguments.usb_id, again=True)
            shutil.rmtree(DIST)
            shutil.move(f"{place}/first", DIST)
        first, second = (dict(line.split()[::-1] for line in text.splitlines()) for text in (made, again))
        differ = sorted(name for name, digest in second.items() if name != PAGE and first.get(name) != digest)
        if differ:
            sys.exit(f"release: not the same bytes twice: {', '.join(differ)}")
        print("release: every file is the same twice")
    print(made, end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
