"""Whether a base is known to stop by itself when its driver falls silent: the file that says so, by a trial or by a person."""

import time
from pathlib import Path

from ...base_table import Topics
from ...files import UnreadableError, read_toml
from ...outputs import put, put_aside

FILE = "base_stops.toml"  # beside robot.toml
SIGNED, SEEN, COMMAND = "signed_by", "stands_after_s", "command"
STOP_S = 10.0  # a base that turns on for longer does not stop by itself


def why_untrusted(scene: Path, topics: Topics) -> str:
    """One line with the remedy; empty: this base was seen to stop by itself, or somebody has signed for it."""
    path = scene / FILE
    remedy = f'wheels up, run: whisker base {scene} --trial; or sign for it: {SIGNED} = "YOUR NAME" in {path}'
    if not path.exists():
        return f"nobody has seen this base stop by itself; {remedy}"
    try:
        _, content = read_toml(path)
    except UnreadableError as error:
        return f"{path}: {error}; {remedy}"
    return "" if _is_trusted(content, topics) else f"{path}: it does not speak for {topics.command}; {remedy}"


def _is_trusted(content: dict, topics: Topics) -> bool:
    stands, signed = content.get(SEEN), content.get(SIGNED)
    seen = isinstance(stands, float) and 0.0 < stands <= STOP_S and content.get(COMMAND) == topics.command
    return seen or (isinstance(signed, str) and bool(signed.strip()))


def note(scene: Path, topics: Topics, stands_after_s: float) -> Path:
    """Write what was seen; what a person wrote there is kept beside it."""
    path, seen = scene / FILE, time.strftime("%Y-%m-%d %H:%M")
    lines = ["# Written by `whisker base --trial`: after one order to drive the wheels stood by themselves."]
    lines += [f'seen = "{seen}"', f"{SEEN} = {stands_after_s:.2f}", f'{COMMAND} = "{topics.command}"']
    if path.exists() and not _is_own(path):
        put_aside(path)
    put(path, "\n".join(lines) + "\n")
    return path


def _is_own(path: Path) -> bool:
    try:
        _, content = read_toml(path)
    except UnreadableError:
        return False
    return SEEN in content and SIGNED not in content


def sign(scene: Path, name: str) -> None:
    """Somebody answers for it."""
    put(scene / FILE, f'{SIGNED} = "{name}"\n')
