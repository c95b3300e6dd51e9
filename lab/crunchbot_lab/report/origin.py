"""Where figures come from: the commit of the sources, the machine, the command."""

import os
import shlex
import subprocess
import sys
import time
from pathlib import Path

import crunchbot

SOURCES = Path(__file__).resolve().parents[3]  # of a source tree
NOT_RECORDED = "not recorded"
# Tracked files that measurements write, and pages: no part of the state that is measured.
WRITTEN = (":!bench/results", ":!docs", ":!*.md", ":!sim/mechanics/tests/reference_*.h")


def of_this_run() -> dict[str, str]:
    """Commit, version, machine, command and time of the process that runs: what a report's head says."""
    arguments = sys.orig_argv[1:] or ["-"]
    return {
        "command": shlex.join(["python", *arguments]),
        "commit": commit(),
        "version": crunchbot.__version__,
        "machine": machine(),
        "date": time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime()),
    }


def commit(root: Path = SOURCES) -> str:
    """The commit of a source tree; says so if tracked files differ from it, but for WRITTEN."""
    if not (root / "lab/crunchbot_lab").is_dir():  # installed: what is around it is of another project
        return NOT_RECORDED
    changes = ("status", "--porcelain", "--untracked-files=no", "--", ".", *WRITTEN)
    words = (("rev-parse", "--short=12", "HEAD"), changes)
    done = [_git(root, *w) for w in words]
    if done[0].returncode:
        return NOT_RECORDED
    return done[0].stdout.strip() + (", changed" if done[1].stdout.strip() else "")


def _git(root: Path, *words: str) -> subprocess.CompletedProcess:
    """What git answers; a code other than 0 without git."""
    try:
        return subprocess.run(["git", "-C", root, *words], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return subprocess.CompletedProcess(words, 127, "", "")


def machine() -> str:
    """Model and number of the processors, and the load of the last five minutes."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    processors, load = len(os.sched_getaffinity(0)), os.getloadavg()[1]
    return f"{models[0] if models else 'unknown processor'}, {processors} processors, load {load:.1f}"
