"""Writes manual pages and shell completion of every program: host/manual. Command: make manual."""

import argparse
from pathlib import Path

from .completion import bash, fish, zsh
from .pages import page
from .programs import all_programs

ROOT = Path(__file__).resolve().parents[2]


def files(build: Path) -> dict[str, str]:
    """Path below host/manual -> text."""
    programs = all_programs(build)
    names = [program.name for program in programs]
    made = {}
    for one in programs:
        made[f"man/{one.name}.1"] = page(one, [name for name in names if name != one.name])
        made[f"bash/{one.name}"] = bash(one)
        made[f"zsh/_{one.name}"] = zsh(one)
        made[f"fish/{one.name}.fish"] = fish(one)
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build-dir", type=Path, default=ROOT / "build/release")
    parser.add_argument("--out", type=Path, default=ROOT / "host/manual")
    options = parser.parse_args()
    for name, text in files(options.build_dir).items():
        path = options.out / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


if __name__ == "__main__":
    main()
