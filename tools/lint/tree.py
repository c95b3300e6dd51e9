"""The tracked files of the repository, as the guards of `make lint` read them."""

import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TEXT = {".c", ".h", ".cpp", ".hpp", ".cc", ".py", ".v", ".vh", ".js", ".css", ".html", ".md", ".sh", ".toml", ".txt"}
TEXT |= {".cmake", ".in", ".msg", ".rules", ".conf", ".rs", ".pml", ".yml", ".yaml", ".json", "Makefile"}
# What a tool or another program wrote: its words and layout are not ours.
GENERATED = (
    "protocol/gen/",
    "bench/results/",
    "firmware/images/",
    "requirements.lock",
    "requirements-demo.lock",
)


def tracked(root: Path = ROOT) -> list[str]:
    """Paths of all tracked files that exist, relative to the root, sorted."""
    done = subprocess.run(["git", "-C", str(root), "ls-files", "-z"], capture_output=True, text=True, check=True)
    return sorted(path for path in done.stdout.split("\0") if path and (root / path).is_file())


def written(root: Path = ROOT, suffixes: set[str] = TEXT) -> list[str]:
    """Tracked text files with one of the suffixes that people write."""
    return [
        path
        for path in tracked(root)
        if (Path(path).suffix or Path(path).name) in suffixes and not path.startswith(GENERATED)
    ]


def read(path: str, root: Path = ROOT) -> str:
    return (root / path).read_text(encoding="utf-8", errors="replace")
