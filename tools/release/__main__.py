"""`make release`: what users of a release download, into dist/, with SHA256SUMS.

Wheels, bitstreams of the boards, images of the node's firmware, the bill of materials and the sources of the newest commit. One
commit gives the same bytes each time: `--twice` makes everything twice and compares.
"""

import argparse
import gzip
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tqdm import tqdm

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "fpga"))
import kept_runs  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
DIST = ROOT / "dist"
SUMS = "SHA256SUMS"
GATEWARE = (".bit", ".fs", ".wgw")


def run(*words: object) -> str:
    """A command of the source tree; the tool ends with its last lines when it fails."""
    done = subprocess.run([str(word) for word in words], cwd=ROOT, capture_output=True)
    if done.returncode != 0:
        sys.exit(
            f"release: {' '.join(map(str, words[:4]))} failed:\n{(done.stdout + done.stderr)[-2000:].decode(errors='replace')}"
        )
    return done.stdout.decode(errors="replace")


def boards() -> list[str]:
    return run(sys.executable, "fpga/boards/build.py", "--list").split()


def make_wheels() -> None:
    run(sys.executable, "tools/wheels")


def make_bitstream(board: str, usb_id: str | None) -> None:
    scratch = ROOT / "build/release-boards" / board
    shutil.rmtree(scratch, ignore_errors=True)
    run(sys.executable, "fpga/boards/build.py", board, "--out", scratch, *(["--usb-id", usb_id] if usb_id else []))
    place = DIST / "gateware"
    place.mkdir(exist_ok=True)
    for file in scratch.iterdir():
        if file.suffix in GATEWARE:
            shutil.copy(file, place)


def copy_images() -> None:
    shutil.copytree(ROOT / "firmware/images", DIST / "firmware")


def pack_sources() -> None:
    """A tar of the newest commit, compressed without a time."""
    done = subprocess.run(["git", "archive", "--prefix=crunchbot/", "HEAD"], cwd=ROOT, capture_output=True, check=True)
    (DIST / "crunchbot-source.tar.gz").write_bytes(gzip.compress(done.stdout, mtime=0))


def sums() -> str:
    """A line for each file below dist/."""
    files = sorted(path for path in DIST.rglob("*") if path.is_file() and path.name != SUMS)
    return "".join(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(DIST)}\n" for path in files)


def make(chosen: list[str], usb_id: str | None) -> str:
    """Everything once; the text of SHA256SUMS."""
    steps = [("wheels", make_wheels)]
    steps += [(f"bitstream of {name}", lambda name=name: make_bitstream(name, usb_id)) for name in chosen]
    steps += [("node images", copy_images), ("sources", pack_sources)]
    for what, step in (bar := tqdm(steps, desc="release", unit="part", disable=None)):
        bar.set_postfix_str(what)
        step()
    shutil.copy(ROOT / "build/sbom.json", DIST)
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
        with tempfile.TemporaryDirectory() as nothing:  # where no run is kept that could be copied
            os.environ[kept_runs.VARIABLE] = nothing
            again = make(chosen, arguments.usb_id)
        differ = sorted({line.split()[1] for line in set(made.splitlines()) ^ set(again.splitlines())})
        if differ:
            sys.exit(f"release: not the same bytes twice: {', '.join(differ)}")
        print("release: every file is the same twice")
    print(made, end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
