"""Bridges as the kernel's USB tree shows them: presence, speed, permissions, who holds them. Needs no USB library."""

import os
import re
from dataclasses import dataclass
from pathlib import Path

from whisker_protocol import LIMITS

from ..errors import UserError

TEST_ID = (LIMITS["usb_vendor_id"], LIMITS["usb_product_id"])  # for private tests only
HIGH_SPEED_MBIT = 480.0
PICO = "Whisker Pico"  # product of a board that knows no high speed


@dataclass(frozen=True)
class Bridge:
    """One bridge plugged in. node: its device file; speed in Mbit/s; serial and product as it says, or empty."""

    folder: Path
    node: Path
    product: str
    serial: str
    speed: float


def bridges(root: Path = Path("/")) -> list[Bridge]:
    """All bridges under root/sys; `root` is another only in tests."""
    folders = sorted((root / "sys/bus/usb/devices").glob("*")) if (root / "sys/bus/usb/devices").is_dir() else []
    return [_bridge(root, folder) for folder in folders if _is_bridge(folder)]


def holders(bridge: Bridge, root: Path = Path("/")) -> list[tuple[int, str]]:
    """(process id, name) of those that have its device file open, as far as this user may see."""
    found = []
    for folder in (root / "proc").glob("[0-9]*"):
        try:
            if any(os.readlink(link) == str(bridge.node) for link in (folder / "fd").iterdir()):
                found.append((int(folder.name), (folder / "comm").read_text().strip()))
        except OSError:
            continue  # ended meanwhile, or another user's
    return found


def identity() -> tuple[int, int]:
    """Vendor and product of the bridges: of $WHISKER_USB_ID ("1209:0001"), else TEST_ID. UserError: it is no such text."""
    text = os.environ.get("WHISKER_USB_ID")
    if text is None:
        return TEST_ID
    if not re.fullmatch("[0-9a-fA-F]{4}:[0-9a-fA-F]{4}", text):
        raise UserError(
            f"WHISKER_USB_ID {text!r}: not VID:PID; give the numbers of the bridge, as 1209:0001, or unset it"
        )
    return int(text[:4], 16), int(text[5:], 16)


def _is_bridge(folder: Path) -> bool:
    return (_hex(folder / "idVendor"), _hex(folder / "idProduct")) == identity()


def _bridge(root: Path, folder: Path) -> Bridge:
    bus, device = (int(_text(folder / name) or 0) for name in ("busnum", "devnum"))
    speed = float(_text(folder / "speed") or 0)
    node = root / f"dev/bus/usb/{bus:03d}/{device:03d}"
    return Bridge(folder, node, _text(folder / "product"), _text(folder / "serial"), speed)


def _hex(path: Path) -> int | None:
    try:
        return int(_text(path), 16)
    except ValueError:
        return None


def _text(path: Path) -> str:
    try:
        return path.read_text(errors="replace").strip()
    except OSError:
        return ""
