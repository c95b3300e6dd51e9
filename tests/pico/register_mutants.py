"""Takes single register writes out of the Pico's firmware, or changes their bits, drawn at random, and counts what the checks notice.

PYTHONPATH=tests python -m pico.register_mutants --count 20 --seed 1
"""

import argparse
import json
import random
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from pico.emulated import ROOT, SIM

sys.path.insert(0, str(ROOT / "tools/firmware"))
import pico_image as tool  # noqa: E402

WRITE = re.compile(r"^\s+(?:REG|SET|CLEAR)\([^;]*?\) = [^;]*;", re.MULTILINE)
CHECK_S = 240  # a mutant that takes longer stands still, and counts as noticed
# Same behaviour in the emulator and on the bus: without it the flash is read, too, and a low bit of a dividend turns an
# angle by less than a count.
EQUIVALENT = ("REG(SSI_SSIENR) = 0;", "REG(SSI_BAUDR) = FLASH_DIVIDER;", "REG(SIO_DIVIDEND) = dividend;")


def writes() -> list[tuple[str, int, int]]:
    """(file, begin, end) of every statement that writes a register."""
    found = []
    for path in sorted(tool.FIRMWARE.glob("*.c")):
        text = path.read_text()
        spans = [m.span() for m in WRITE.finditer(text)]
        found += [(path.name, *span) for span in spans if text[slice(*span)].strip() not in EQUIVALENT]
    return found


def mutate(text: str, begin: int, end: int, draw: random.Random) -> str:
    """The statement gone, or its value with one of the low 18 bits inverted."""
    statement = text[begin:end]
    target, value = statement.rstrip(";").rsplit(" = ", 1)
    changed = ";" if draw.random() < 0.5 else f"{target} = ({value}) ^ {1 << draw.randrange(18)}u;"
    return text[:begin] + changed + text[end:]


def noticed(folder: Path) -> str | None:
    """The first check that fails, what the compiler says, or that it stood still; None: nothing."""
    try:
        tool.build(folder / "out", folder)
    except RuntimeError as error:
        return f"compiler: {str(error).splitlines()[-1]}"
    command = ["node", str(SIM / "tests/checks.mjs"), str(folder / "out/pico.bin"), "--first"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=CHECK_S)
    except subprocess.TimeoutExpired:
        return "stood still"
    if done.returncode:
        return done.stderr.strip().splitlines()[-1][:100] or "ended"
    last = json.loads(done.stdout.splitlines()[-1])
    return f"{last['name']}: {last['error']}" if last["error"] else None


def run(count: int, seed: int) -> list[tuple[str, str | None]]:
    draw = random.Random(seed)
    results = []
    for name, begin, end in draw.sample(writes(), count):
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary) / "pico"
            shutil.copytree(tool.FIRMWARE, folder)
            text = (folder / name).read_text()
            line = text[:begin].count("\n") + 1
            changed = mutate(text, begin, end, draw)
            (folder / name).write_text(changed)
            became = " ".join(changed[begin : len(changed) - len(text) + end].split())
            results.append((f"{name}:{line}: {' '.join(text[begin:end].split())} {became}", noticed(folder)))
            print(*results[-1], sep="  ->  ", flush=True)
    return results


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    words = parser.parse_args()
    results = run(words.count, words.seed)
    print(f"{sum(bool(why) for _, why in results)} of {len(results)} noticed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
