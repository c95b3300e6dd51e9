"""`make debian`: Debian packages, each release's built in a root of its own, judged by lintian, and tried in an empty one.

Each root is made by mmdebstrap and removed at the end; building takes some minutes a release. The packages go to
dist/debian/RELEASE. Needs root, mmdebstrap and a mirror of Debian.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DIST = ROOT / "dist/debian"
RELEASES = ("bookworm", "trixie")  # Debian 12 and 13
STALE = '--aptopt=Acquire::Check-Valid-Until "false"'  # a mirror that lags behind serves for this check
QUICK = "--dpkgopt=force-unsafe-io"  # the roots are thrown away: nothing of them need reach the disk
DEVELOPMENT = "libwhisker-dev"
PACKAGES = (
    "whiskerd",
    "libwhisker0.1",
    "libwhisker-nav0.1",
    "libwhisker-create0.1",
    DEVELOPMENT,
    "python3-crunchbot",
)
# In the root where the packages were built: a program in C and one in C++ by one command each.
COMPILED = """
cd /build/src/host/examples
for source in *.c; do cc -o /tmp/example $source $(pkg-config --cflags --libs whisker whisker-nav whisker-create) -lm; done
for source in *.cpp; do c++ -std=c++17 -o /tmp/example $source $(pkg-config --cflags --libs whisker whisker-nav); done
"""
# In an empty root.
TRIED = """
cd /tmp
whiskerd --version
whisker --version
whisker examples
whisker localise examples/scene --filter adaptive --json
getent passwd whisker whisker-base
python3 -c 'import crunchbot.nav.filters, crunchbot.touch.texture.model, crunchbot.bridge.ring'
"""
ENVIRONMENT = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/root", "LC_ALL": "C.UTF-8"}
PROXIES = ("http_proxy", "https_proxy", "no_proxy")


class DebianError(Exception):
    """A step that failed; one line, and its log's end."""


def run(title: str, log: Path, *words: object, **options) -> str:
    """A step, announced; its output, which also goes to the log. DebianError when it fails."""
    print(f"debian: {title}; log: {log}", flush=True)
    done = subprocess.run(list(map(str, words)), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    with open(log, "a") as file:
        file.write(done.stdout)
    if done.returncode != 0:
        raise DebianError(f"debian: {title} failed\n" + "\n".join(done.stdout.splitlines()[-25:]))
    return done.stdout


def build_dependencies() -> list[str]:
    """Package names of debian/control's Build-Depends."""
    field = re.search(r"^Build-Depends:(.*?)^\S", (ROOT / "debian/control").read_text(), re.MULTILINE | re.DOTALL)[1]
    names = (re.sub(r"\(.*?\)", "", part).strip() for part in field.split(","))
    return ["debhelper" if name.startswith("debhelper") else name for name in names if name]


def make_root(release: str, variant: str, packages: list[str], folder: Path, log: Path) -> None:
    included = [f"--include={','.join(packages)}"] if packages else []
    run(f"{release}: root with {len(packages)} packages", log, "mmdebstrap", f"--variant={variant}", STALE, QUICK, *included,
        release, folder)  # fmt: skip


def chroot(title: str, log: Path, folder: Path, script: str) -> str:
    """A script of sh in a root, which has this machine's names and proxies, and nothing else of it."""
    shutil.copy("/etc/resolv.conf", folder / "etc/resolv.conf")
    environment = ENVIRONMENT | {name: os.environ[name] for name in PROXIES if name in os.environ}
    return run(title, log, "chroot", folder, "sh", "-euc", script, env=environment)


def copy_sources(folder: Path) -> None:
    """The files that git knows."""
    for name in subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True).stdout.decode().split("\0"):
        if name and (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name, follow_symlinks=False)


def build(release: str, work: Path, log: Path) -> list[Path]:
    """The packages of a release, built, judged, and compiled against."""
    root = work / "build"
    make_root(release, "buildd", [*build_dependencies(), "lintian"], root, log)
    copy_sources(root / "build/src")
    chroot(
        f"{release}: building", log, root, "cd /build/src; DEB_BUILD_OPTIONS=parallel=2 dpkg-buildpackage -us -uc -b"
    )
    judged = chroot(
        f"{release}: lintian", log, root, "cd /build; lintian --allow-root --fail-on error,warning *.changes"
    )
    print("\n".join(f"  {line}" for line in judged.splitlines()), flush=True)
    made = [next((root / "build").glob(f"{name}_*.deb")) for name in PACKAGES]
    files = " ".join(f"/build/{path.name}" for path in made)
    chroot(f"{release}: programs in C and C++", log, root, f"apt-get update; apt-get install -y {files}; {COMPILED}")
    place = DIST / release
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    return [Path(shutil.copy(path, place)) for path in made]


def try_out(release: str, made: list[Path], work: Path, log: Path) -> str:
    """What a user gets in a system that has nothing else."""
    root = work / "empty"
    make_root(release, "minbase", ["ca-certificates"], root, log)
    (root / "debs").mkdir()
    for path in made:
        shutil.copy(path, root / "debs")
    files = " ".join(f"/debs/{path.name}" for path in made if path.name.split("_")[0] != DEVELOPMENT)
    install = f"apt-get update; apt-get install -y --no-install-recommends {files}"
    chroot(f"{release}: installing in an empty root", log, root, install)
    return chroot(f"{release}: running it", log, root, TRIED)


def main() -> int:
    parser = argparse.ArgumentParser(description="Debian packages.", epilog="example: sudo make debian RELEASES=trixie")
    parser.add_argument("releases", nargs="*", default=RELEASES, help=f"of Debian ({' '.join(RELEASES)})")
    arguments = parser.parse_args()
    if os.getuid() != 0 or shutil.which("mmdebstrap") is None:
        sys.exit("debian: needs root and mmdebstrap; run: apt-get install mmdebstrap, then: sudo make debian")
    DIST.mkdir(parents=True, exist_ok=True)
    for release in arguments.releases:
        log = DIST / f"{release}.log"
        log.unlink(missing_ok=True)
        with tempfile.TemporaryDirectory(prefix="debian-") as folder:
            try:
                made = build(release, Path(folder), log)
                printed = try_out(release, made, Path(folder), log)
            except DebianError as error:
                print(error, file=sys.stderr)
                return 1
        print("\n".join(f"  {line}" for line in printed.splitlines()), flush=True)
        print(f"debian: {release}: {', '.join(path.name for path in made)}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
