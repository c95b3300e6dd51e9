"""The locks hold what pyproject.toml's extras ask for, each package once; the demo's lock no more than the demo needs."""

import re
import tomllib
from importlib.metadata import requires
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[2]
OWN = {"crunchbot": "pyproject.toml", "crunchbot-lab": "lab/pyproject.toml"}
UNLOCKED = {"rerun"}  # 170 MB that no test needs: its own is skipped without it
IN_WHEELS_ONLY = "crunchbot-sim"  # the programs that a source tree compiles


def locked(name: str) -> list[str]:
    return re.findall(r"^([\w-]+)(?:\[\w+\])?==", (ROOT / name).read_text(), re.MULTILINE)


def asked(name: str, extra: str) -> list[Requirement]:
    """What a package asks for with one of its extras ("": without any)."""
    if name in OWN:
        project = tomllib.loads((ROOT / OWN[name]).read_text())["project"]
        lines = project["optional-dependencies"][extra] if extra else project["dependencies"]
    else:
        lines = requires(name) or []
    found = map(Requirement, lines)
    return [one for one in found if one.marker is None or one.marker.evaluate({"extra": extra})]


def closure(*roots: str) -> set[str]:
    """Names of all packages that these requirements bring, but for the project's own."""
    waiting, seen = [Requirement(root) for root in roots], set()
    while waiting:
        one = waiting.pop()
        name = canonicalize_name(one.name)
        for extra in {"", *one.extras} if name != IN_WHEELS_ONLY else ():
            if (name, extra) not in seen:
                seen.add((name, extra))
                waiting += asked(name, extra)
    return {name for name, _ in seen} - OWN.keys()


def test_the_demos_lock_is_what_the_demo_needs():
    assert set(locked("requirements-demo.lock")) == closure("crunchbot[demo]")


def test_both_locks_together_are_what_all_extras_need_each_package_once():
    names = locked("requirements-demo.lock") + locked("requirements.lock")
    extras = (
        f"{name}[{','.join(tomllib.loads((ROOT / path).read_text())['project']['optional-dependencies'].keys() - UNLOCKED)}]"
        for name, path in OWN.items()
    )
    assert sorted(names) == sorted(closure(*extras))
