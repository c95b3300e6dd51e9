"""The second guest: a Debian with systemd, in which the project is installed, with the bridge and two Creates on USB."""

import os
import shutil
import socket
import subprocess
import time
from contextlib import ExitStack
from pathlib import Path

from guest import OUT, Device, Guest, Report, converse, qemu, shared
from image import MissingError, debian, initramfs, kernel, load_order

from crunchbot.programs import program

HERE = Path(__file__).resolve().parent
NAME = "services"
FOLDER = OUT / NAME
LAYER = FOLDER / "layer"
MODULES = ("virtio_pci", "virtio_blk", "virtio_net", "squashfs", "overlay")
MODULES += ("xhci-pci", "vhci-hcd", "usbhid", "hid-generic", "ftdi_sio")
CREATES = ("create0", "create1")
QUIET = "systemd.mask=serial-getty@ttyS0.service systemd.mask=getty@tty1.service systemd.firstboot=off net.ifnames=0"
JOURNAL = "systemd.journald.forward_to_console=1 systemd.show_status=0"
CHECKS_UNIT = """[Unit]
Description=What the services do
After=multi-user.target
[Service]
ExecStart=/usr/bin/python3 /opt/checks/guest_services.py
ExecStopPost=/usr/bin/systemctl --no-block poweroff
StandardOutput=journal
"""


def install(build: Path) -> None:
    """Put what `cmake --install` puts down, and the checks, into LAYER."""
    shutil.rmtree(LAYER, ignore_errors=True)
    words = ["cmake", "--install", str(build), "--prefix", "/usr/local"]
    done = subprocess.run(words, env={**os.environ, "DESTDIR": str(LAYER)}, capture_output=True, text=True)
    if done.returncode != 0:
        raise MissingError(f"cmake --install {build}: {done.stderr.strip().splitlines()[-1]}; run make build first")
    checks, units = LAYER / "opt/checks", LAYER / "etc/systemd/system"
    (units / "multi-user.target.wants").mkdir(parents=True)
    checks.mkdir(parents=True)
    for path in (HERE / "guest_talk.py", HERE / "guest_services.py", Path(program("kernel_ring_probe"))):
        shutil.copy(path, checks)
    (units / "checks.service").write_text(CHECKS_UNIT)
    (units / "multi-user.target.wants/checks.service").symlink_to("../checks.service")
    (LAYER / "etc/machine-id").write_text(f"{1:032x}\n")  # otherwise a first start enables every unit


def guest_words(vmlinuz: Path, packed: Path) -> list[str]:
    """The guest beside its devices: Debian's files as a disk, two serial adapters, a monitor that pulls them."""
    words = qemu(NAME, vmlinuz, packed, f"{QUIET} {JOURNAL}")
    words += ["-drive", f"file={FOLDER / 'debian.sqfs'},format=raw,if=virtio,readonly=on"]
    words += ["-chardev", f"socket,id=monitor,path={FOLDER / 'monitor.sock'},server=on,wait=off", "-mon", "monitor"]
    words += ["-device", "qemu-xhci"]
    for name in CREATES:
        words += ["-chardev", f"serial,id={name},path={FOLDER / name}", "-device", adapter(name)]
    return words


def adapter(name: str) -> str:
    """A USB serial adapter with a Create at its other end."""
    return f"usb-serial,chardev={name},id={name}-usb,always-plugged=on"


def monitor(order: str) -> None:
    """Give QEMU an order."""
    with socket.socket(socket.AF_UNIX) as link:
        link.connect(str(FOLDER / "monitor.sock"))
        link.sendall(order.encode() + b"\n")
        link.shutdown(socket.SHUT_WR)
        while link.recv(4096):
            pass


def obey(word: str, port: str) -> str:
    """Do what the guest asks for: plug create1, unplug create1; or say where the bridge is served."""
    order, _, device = word.partition(" ")
    if order == "usbip":
        return port
    if order == "plug":
        monitor(f"device_add {adapter(device)}")
    else:
        monitor(f"device_del {device}-usb")
    return "done"


def create(name: str) -> list[str]:
    """Command of a simulated Create 2: its encoders count what the wheels really do."""
    return [program("whisker-create-sim"), "--model", "2", "--link", str(FOLDER / name)]


def run(report: Report) -> None:
    """From making the Debian to the guest's end."""
    build = Path(program("whisker-bridge-sim")).resolve().parents[2]
    vmlinuz, modules = kernel(OUT / "debian")
    report.note("making a Debian with systemd (once)")
    debian(FOLDER)
    install(build)
    packed = initramfs(FOLDER, load_order(modules, MODULES), HERE / "services_init.sh", "")
    with ExitStack() as stack:
        bridge = stack.enter_context(Device("services-bridge", shared(), r"port (\d+)"))
        for name in CREATES:
            stack.enter_context(Device(name, create(name), r" at (\S+)"))
        began = time.monotonic()
        guest = stack.enter_context(Guest(NAME, guest_words(vmlinuz, packed)))
        report.note(f"booting {vmlinuz.name} with systemd")
        converse(NAME, guest, lambda word: obey(word, bridge.place), report)
        report.note(f"{NAME} guest ended after {time.monotonic() - began:.0f} s")
