"""The Pico's boot drive: finds it by its label, checks an image's family, copies it, waits until the board is back."""

import os
import re
import struct
import time
from collections.abc import Callable
from pathlib import Path

from ..errors import UserError
from . import usbtree

LABEL = "RPI-RP2"  # of the file system that the chip's ROM shows
FAMILY = 0xE48BFF56  # RP2040, as UF2 files name it
BLOCK = struct.Struct("<IIIIIIII476sI")
MAGIC = (0x0A324655, 0x9E5D5157, 0x0AB16F30)
PIECE = 4096  # bytes a write: a cable pulled is noticed in the middle
DRIVE_S, RETURN_S = 15.0, 30.0  # to wait for the drive (a desktop mounts it), for the board
BY_HAND = (
    "hold BOOTSEL while plugging the board in, then run this again: the drive is in the chip's ROM and cannot be lost"
)


def check_image(path: Path) -> bytes:
    """The file's bytes. UserError: it is no whole UF2 file of this chip's family."""
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}; give firmware/images/pico/pico.uf2") from error
    if not raw or len(raw) % BLOCK.size:
        raise UserError(f"{path}: no UF2 file, or cut short; fetch or build it again")
    total = len(raw) // BLOCK.size
    for number in range(total):
        first, second, flags, _, _, place, blocks, family, _, last = BLOCK.unpack_from(raw, number * BLOCK.size)
        if (first, second, last) != MAGIC or (place, blocks) != (number, total):
            raise UserError(f"{path}: block {number} is damaged or missing; fetch or build it again")
        if not flags & 0x2000 or family != FAMILY:
            raise UserError(f"{path}: for another chip (family {family:#010x}); a Pico's image has {FAMILY:#010x}")
    return raw


def drives(root: Path = Path("/")) -> list[Path]:
    """Where drives with the label are mounted; `root` is another only in tests."""
    link = root / "dev/disk/by-label" / LABEL
    device = os.path.realpath(link) if link.exists() else None
    try:
        mounts = [line.split()[:2] for line in (root / "proc/mounts").read_text().splitlines()]
    except OSError:
        mounts = []
    places = [root / re.sub(r"\\040", " ", place).lstrip("/") for source, place in mounts]
    found = [
        place
        for (source, _), place in zip(mounts, places, strict=True)
        if source == device or place.name.startswith(LABEL)
    ]
    return [place for place in found if _is_boot_drive(place)]


def _is_boot_drive(place: Path) -> bool:
    try:
        return "Board-ID: RPI-RP2" in (place / "INFO_UF2.TXT").read_text(errors="replace")
    except OSError:
        return False


def board(serial: str | None, root: Path = Path("/")) -> usbtree.Bridge | None:
    """The one Pico on the bus that is meant; None: there is none. UserError: several, or several of one number."""
    found = [one for one in usbtree.bridges(root) if one.product == usbtree.PICO and serial in (None, one.serial)]
    if len(found) > 1:
        numbers = ", ".join(one.serial for one in found)
        same = len({one.serial for one in found}) == 1
        remedy = "unplug all but one" if same else "name one with --bridge"
        raise UserError(f"pico: {len(found)} boards ({numbers}); {remedy}")
    return found[0] if found else None


def copy(raw: bytes, drive: Path) -> None:
    """UserError: the drive went away before its end, or took nothing. The last piece may end with the drive's own leaving."""
    done = 0
    try:
        with open(drive / "pico.uf2", "wb", buffering=0) as file:
            while done < len(raw):
                done += file.write(raw[done : done + PIECE])
                os.fsync(file.fileno())
    except OSError as error:
        if done + PIECE < len(raw) or not done:
            text = f"pico: {done} of {len(raw)} bytes copied, then {error.strerror}"
            raise UserError(f"{text}; check the cable; {BY_HAND}") from error


def wait(what: Callable[[], object], seconds: float) -> object:
    """What `what` gives as soon as it gives something; None if it does not in time."""
    until = time.monotonic() + seconds
    while not (found := what()):
        if time.monotonic() > until:
            return None
        time.sleep(0.1)
    return found


def flash(image: Path, serial: str | None, ask: Callable[[str | None], int], root: Path = Path("/")) -> None:
    """Loads an image into the Pico on the bus, or into one that is a drive already. `ask` orders it into its drive: 0 if it
    goes. UserError with one line."""
    raw = check_image(image)
    present = board(serial, root)
    if not drives(root):
        if not present:
            raise UserError(f"pico: neither a board nor its drive {LABEL} is there; {BY_HAND}")
        if ask(present.serial or None):
            raise UserError(f"pico: the board does not go into its drive; stop whiskerd, or {BY_HAND}")
    found = wait(lambda: drives(root), DRIVE_S)
    if not found:
        mount = f"udisksctl mount -b /dev/disk/by-label/{LABEL}"
        raise UserError(f"pico: its drive {LABEL} is not mounted; run: {mount}, then this again")
    if len(found) > 1:
        raise UserError(f"pico: {len(found)} drives {LABEL}; unplug all boards but one")
    copy(raw, found[0])
    if not wait(lambda: not drives(root) and board(serial, root), RETURN_S):
        raise UserError(f"pico: the image is copied, and the board has not come back; {BY_HAND}")
