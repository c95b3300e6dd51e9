#!/usr/bin/env python3
"""Writes the software bill of materials, CycloneDX 1.6 as JSON: `make sbom`.

Python packages with their hashes from requirements-demo.lock and requirements.lock, Debian packages that the build asks for
(tools/setup.sh) and that hold the libraries of the programs, with the versions of this machine. Scope `required`: on a robot or in its bitstream;
`excluded`: builds and tests only. The same tree and packages give the same bytes.
"""

import argparse
import os
import re
import subprocess
import sys
import tomllib
import uuid
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path

from cyclonedx.model import ExternalReference, ExternalReferenceType, HashAlgorithm, HashType, XsUri
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentScope, ComponentType
from cyclonedx.output import make_outputter
from cyclonedx.schema import OutputFormat, SchemaVersion
from packageurl import PackageURL
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
ON_ROBOT = ("robot", "record", "scenes", "view")  # extras of pyproject.toml
GATEWARE = ["luna-usb"]  # its USB core becomes Verilog of the bridge
PROGRAMS = ("whiskerd", "whisker-log", "whisker-flash", "whisker-base")
LOCKS = ("requirements-demo.lock", "requirements.lock")
LOCKED = re.compile(r"^([^\s[]+)(?:\[\S+\])?==(\S+)((?: \\\n +--hash=sha256:[0-9a-f]{64})+)$", re.MULTILINE)


class SbomError(Exception):
    """Something that the list needs is not there; the text is one line with the remedy."""


def output(*words: str) -> str:
    """What a program printed; SbomError with its complaint."""
    try:
        return subprocess.run(words, capture_output=True, text=True, check=True, cwd=ROOT).stdout
    except FileNotFoundError:
        raise SbomError(
            f"{words[0]}: not installed; the list is made on Debian, in a clone of the repository"
        ) from None
    except subprocess.CalledProcessError as error:
        text = error.stderr.strip().splitlines() or [f"exit code {error.returncode}"]
        raise SbomError(f"{' '.join(words[:3])}: {text[-1]}") from None


def component(kind: str, name: str, version: str, required: bool, **more) -> Component:
    """A library by its package URL; `kind`: pypi, or deb."""
    url = PackageURL(kind, "debian" if kind == "deb" else None, name, version)
    scope = ComponentScope.REQUIRED if required else ComponentScope.EXCLUDED
    text = url.to_string()
    return Component(
        type=ComponentType.LIBRARY, name=name, version=version, purl=url, bom_ref=text, scope=scope, **more
    )


def needed(names: Iterable[str], known: set[str]) -> set[str]:
    """These Python packages and all they need, of those known."""
    waiting, found = [canonicalize_name(name) for name in names], set()
    while waiting:
        name = waiting.pop()
        if name in known - found:
            found.add(name)
            asked = [Requirement(line) for line in requires(name) or []]
            here = [one for one in asked if one.marker is None or one.marker.evaluate({"extra": ""})]
            waiting += [canonicalize_name(one.name) for one in here]
    return found


def python_packages(lock: str) -> Iterator[Component]:
    """Each entry of the two locks."""
    entries = LOCKED.findall(lock)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = [line for extra, lines in project["optional-dependencies"].items() if extra in ON_ROBOT for line in lines]
    names = [Requirement(line).name for line in (*project["dependencies"], *extras)] + GATEWARE
    on_robot = needed(names, {canonicalize_name(name) for name, _, _ in entries})
    for name, version, hashes in entries:
        found = [HashType(alg=HashAlgorithm.SHA_256, content=one) for one in re.findall(r"sha256:(\w+)", hashes)]
        page = XsUri(f"https://pypi.org/project/{name}/{version}/")
        files = ExternalReference(type=ExternalReferenceType.DISTRIBUTION, url=page, hashes=found)
        yield component("pypi", name, version, canonicalize_name(name) in on_robot, external_references=[files])


def linked_packages(build: Path) -> set[str]:
    """Debian packages of the libraries that the programs load."""
    programs = [build / "host/apps" / name for name in PROGRAMS]
    if missing := [path.name for path in programs if not path.exists()]:
        raise SbomError(f"{build}: no {', '.join(missing)}; run make build first")
    listed = output("ldd", *map(str, programs))
    files = {os.path.realpath(path) for path in re.findall(r" => (/\S+)", listed) if not path.startswith(str(build))}
    patterns = sorted("*" + path.removeprefix("/usr") for path in files)  # packages may name /lib, which is /usr/lib
    return {line.split(":")[0] for line in output("dpkg-query", "--search", *patterns).splitlines()}


def debian_packages(build: Path) -> Iterator[Component]:
    """What the programs load and what tools/setup.sh installs."""
    linked = linked_packages(build)
    asked = re.findall(r"^(?:cmd|mod|file|py):\S+ (\S+)$", (ROOT / "tools/setup.sh").read_text(), re.MULTILINE)
    listed = output("dpkg-query", "--show", "--showformat=${Package} ${Version} ${db:Status-Status}\\n")
    installed = {line.split()[0]: line.split()[1] for line in listed.splitlines() if line.endswith(" installed")}
    for name in sorted(linked | set(asked)):
        if name in installed:  # a tool may come from another place than Debian's package
            yield component("deb", name, installed[name], name in linked)


def bill(build: Path) -> str:
    """The whole list as JSON."""
    lock = "".join((ROOT / name).read_text() for name in LOCKS)
    found = [*python_packages(lock), *debian_packages(build)]
    named = "\n".join(sorted(f"{one.bom_ref.value} {one.scope}" for one in found))
    bom = Bom(components=found, serial_number=uuid.uuid5(uuid.NAMESPACE_URL, named))
    version = re.search(r"^project\(whisker VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)[1]
    bom.metadata.component = Component(
        type=ComponentType.APPLICATION, name="whisker", version=version, bom_ref="whisker"
    )
    seconds = os.environ.get("SOURCE_DATE_EPOCH") or output("git", "log", "-1", "--format=%ct")
    bom.metadata.timestamp = datetime.fromtimestamp(int(seconds), UTC)
    bom.register_dependency(bom.metadata.component, [one for one in found if one.scope == ComponentScope.REQUIRED])
    return make_outputter(bom, OutputFormat.JSON, SchemaVersion.V1_6).output_as_string(indent=1) + "\n"


def main(argv: list[str] | None = None) -> int:
    """Write it; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build-dir", type=Path, default=ROOT / "build/release", help="with the programs")
    parser.add_argument("--out", type=Path, default=ROOT / "build/sbom.json")
    options = parser.parse_args(argv)
    try:
        options.out.write_text(bill(options.build_dir.resolve()))
    except (SbomError, PackageNotFoundError, OSError) as error:
        print(f"sbom: {error}", file=sys.stderr)
        return 1
    print(f"sbom: {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
