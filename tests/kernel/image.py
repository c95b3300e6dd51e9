"""What a guest boots: Debian's kernel, unpacked from its package, a small initramfs with the modules it needs, and a
Debian with systemd.
"""

import os
import re
import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

KERNEL_PACKAGE = "linux-image-amd64"  # depends on the newest
MODULES = (
    "virtio_pci",
    "virtio_net",
    "9pnet_virtio",
    "9p",
    "usbhid",
    "hid-generic",
    "vhci-hcd",
)
# polkitd: without it logind lets root alone delay the machine's sleep.
ROOT_PACKAGES = ("systemd-sysv", "udev", "dbus", "polkitd", "python3", "libusb-1.0-0", "libhidapi-libusb0", "usbip")
# What must be there: program (or file), Debian package.
TOOLS = {
    "qemu-system-x86_64": "qemu-system-x86",
    "busybox": "busybox-static",
    "cpio": "cpio",
    "usbip": "usbip",
    "lsusb": "usbutils",
    "dpkg-deb": "dpkg",
    "mmdebstrap": "mmdebstrap",
    "tar2sqfs": "squashfs-tools-ng",
    "/usr/lib/python3/dist-packages/usb/core.py": "python3-usb",
}


class MissingError(Exception):
    """Something is not installed; the text is one line with the remedy."""


def check_tools() -> None:
    """MissingError names all that is missing, with the command that installs it."""
    path = f"{os.environ['PATH']}:/usr/sbin:/sbin"
    missing = [
        package for tool, package in TOOLS.items() if not (shutil.which(tool, path=path) or Path(tool).is_file())
    ]
    if missing:
        raise MissingError(f"missing for the guest: apt-get install --no-install-recommends {' '.join(missing)}")


def _output(*words: str, cwd: Path | None = None) -> str:
    done = subprocess.run(words, capture_output=True, text=True, cwd=cwd)
    if done.returncode != 0:
        text = (done.stderr or done.stdout).strip().splitlines() or ["no reason given"]
        raise MissingError(f"{' '.join(words[:3])}: {text[-1]}; check the package mirror, then try again")
    return done.stdout


def kernel(folder: Path) -> tuple[Path, Path]:
    """(vmlinuz, folder of modules) of Debian's kernel, fetched into `folder` once."""
    found = sorted((folder / "root/boot").glob("vmlinuz-*"))
    if not found:
        package = re.search(r"Depends: (linux-image-\S+)", _output("apt-cache", "depends", KERNEL_PACKAGE))
        if not package:
            raise MissingError(f"no package {KERNEL_PACKAGE} is known; run: apt-get update")
        folder.mkdir(parents=True, exist_ok=True)
        _output("apt-get", "download", package[1], cwd=folder)
        _output("dpkg-deb", "-x", str(next(folder.glob("linux-image-*.deb"))), str(folder / "root"))
        found = sorted((folder / "root/boot").glob("vmlinuz-*"))
    release = found[-1].name.removeprefix("vmlinuz-")
    return found[-1], folder / "root/lib/modules" / release


def load_order(modules: Path, names: Iterable[str]) -> list[Path]:
    """Files of these modules and of what they depend on, each after what it needs."""
    files = {path.stem.replace("-", "_"): path for path in modules.rglob("*.ko")}
    order: list[Path] = []

    def add(name: str) -> None:
        path = files.get(name.replace("-", "_"))
        if path is None or path in order:
            return  # built in, or there already
        depends = re.search(rb"\0depends=([^\0]*)\0", path.read_bytes())
        for one in depends[1].decode().split(",") if depends else []:
            if one:
                add(one)
        order.append(path)

    for name in names:
        add(name)
    return order


def initramfs(folder: Path, order: list[Path], init: Path, job: str) -> Path:
    """Packs busybox, modules, the first process and what is in folder/layer; `job` is the line that the first process reads."""
    root, packed = folder / "initramfs", folder / "initramfs.gz"
    shutil.rmtree(root, ignore_errors=True)
    for name in ("bin", "dev", "proc", "sys", "host", "modules"):
        (root / name).mkdir(parents=True)
    shutil.copy(shutil.which("busybox"), root / "bin/busybox")
    shutil.copy(init, root / "init")
    (root / "init").chmod(0o755)
    (root / "job").write_text(job + "\n")
    for path in order:
        shutil.copy(path, root / "modules" / path.name)
    (root / "modules/order").write_text("".join(f"{path.name}\n" for path in order))
    if (folder / "layer").is_dir():
        shutil.copytree(folder / "layer", root / "layer", symlinks=True)
    _output("sh", "-c", f"find . | cpio --quiet -o -H newc -R +0:+0 | gzip -1 >'{packed}'", cwd=root)
    return packed


def apt_sources() -> str:
    """This machine's sources of Debian packages, others left out."""
    words = ["--format", "deb $(REPO_URI) $(RELEASE) $(COMPONENT)", "Created-By: Packages", "Origin: Debian"]
    sources = sorted(set(_output("apt-get", "indextargets", *words).splitlines()))
    if not sources:
        raise MissingError("apt knows no source of Debian packages; name one in /etc/apt, then run: apt-get update")
    return "\n".join(sources) + "\n"


def debian(folder: Path) -> Path:
    """A Debian with systemd as a squashfs file, made in `folder` by mmdebstrap once for a list of packages."""
    packed, made_of = folder / "debian.sqfs", folder / "debian.packages"
    packages = ",".join(ROOT_PACKAGES)
    if not (packed.exists() and made_of.exists() and made_of.read_text() == packages):
        folder.mkdir(parents=True, exist_ok=True)
        made_of.unlink(missing_ok=True)
        (folder / "sources.list").write_text(apt_sources())
        options = ["--variant=essential", f"--include={packages}", "--skip=output/dev"]
        options += [
            f"--dpkgopt=path-exclude=/usr/share/{name}/*" for name in ("doc", "locale", "man", "info", "zoneinfo")
        ]
        _output("mmdebstrap", "--quiet", *options, "", str(packed), str(folder / "sources.list"))
        made_of.write_text(packages)
    return packed
