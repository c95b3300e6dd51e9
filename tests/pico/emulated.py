"""Runs the Pico's image in rp2040js, by the scripts of sim/pico/tests; tells what a machine lacks for it."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SIM = ROOT / "sim/pico"
IMAGE = ROOT / "firmware/images/pico/pico.bin"


def need_emulator() -> None:
    """Skips the test in a line that names what is not there."""
    if not shutil.which("node"):
        pytest.skip("the Pico's image is not executed: node is not there; run: apt-get install nodejs npm")
    if not (SIM / "node_modules/rp2040js").is_dir():
        pytest.skip("the Pico's image is not executed: rp2040js is not there; run: npm ci --prefix sim/pico")


def lines(script: str, *words: str, image: Path = IMAGE) -> list[dict]:
    """What a script prints: a JSON object a line."""
    need_emulator()
    command = ["node", str(SIM / "tests" / script), str(image), *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=3600)
    assert done.returncode == 0, done.stderr[-2000:]
    return [json.loads(line) for line in done.stdout.splitlines()]
