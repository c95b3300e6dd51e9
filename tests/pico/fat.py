"""The boot drive as the chip's ROM shows it: a FAT16 image of which a host writes sectors, and the ROM takes those of its family."""

import struct

from crunchbot.bridge import pico_drive

SECTOR, SECTORS, RESERVED, FAT_SECTORS, ROOT_ENTRIES = 512, 8192, 1, 32, 64
ROOT = RESERVED + FAT_SECTORS
DATA = ROOT + ROOT_ENTRIES * 32 // SECTOR
LABEL, ARCHIVE, LAST = 0x08, 0x20, 0xFFFF
INFO = b"UF2 Bootloader v3.0\r\nModel: Raspberry Pi RP2\r\nBoard-ID: RPI-RP2\r\n"


class Drive:
    """One FAT, one sector a cluster."""

    def __init__(self):
        self.raw = bytearray(SECTOR * SECTORS)
        self.taken: dict[int, bytes] = {}
        self.blocks = 0
        head = struct.pack(
            "<3s8sHBHBHHBHHHII",
            b"\xeb\x3c\x90",
            b"MSDOS5.0",
            SECTOR,
            1,
            RESERVED,
            1,
            ROOT_ENTRIES,
            SECTORS,
            0xF8,
            FAT_SECTORS,
            1,
            1,
            0,
            0,
        )
        self.raw[: len(head)] = head
        self.raw[510:512] = b"\x55\xaa"
        self._entry(pico_drive.LABEL.ljust(11).encode(), LABEL, 0, 0)
        self.write("INFO_UF2TXT", INFO)

    def _entry(self, name: bytes, kind: int, first: int, size: int) -> None:
        used = range(ROOT * SECTOR, DATA * SECTOR, 32)
        at = next(at for at in used if not self.raw[at])
        struct.pack_into("<11sB14xHI", self.raw, at, name, kind, first, size)

    def _fat(self) -> memoryview:
        return memoryview(self.raw)[RESERVED * SECTOR : ROOT * SECTOR].cast("H")

    def write(self, name: str, content: bytes) -> None:
        """A file, as a host writes it: its sectors, then table and entry. The ROM sees each sector as it comes."""
        fat = self._fat()
        free = [cluster for cluster in range(2, len(fat)) if not fat[cluster]][: -(-len(content) // SECTOR)]
        for number, cluster in enumerate(free):
            piece = content[number * SECTOR : (number + 1) * SECTOR]
            at = (DATA + cluster - 2) * SECTOR
            self.raw[at : at + len(piece)] = piece
            self._see(piece)
        for cluster, following in zip(free, [*free[1:], LAST], strict=True):
            fat[cluster] = following
        self._entry(name.encode(), ARCHIVE, free[0], len(content))

    def _see(self, sector: bytes) -> None:
        """The ROM takes blocks of its family wherever they lie."""
        if len(sector) == SECTOR and struct.unpack_from("<I", sector)[0] == pico_drive.MAGIC[0]:
            block = pico_drive.BLOCK.unpack(sector)
            if block[7] == pico_drive.FAMILY:
                self.taken[block[5]], self.blocks = block[8][: block[4]], block[6]

    def whole(self) -> bytes | None:
        """What is in the flash once all blocks have come."""
        done = self.blocks and len(self.taken) == self.blocks
        return b"".join(self.taken[number] for number in range(self.blocks)) if done else None

    def label(self) -> str:
        return next(name for name, kind, _, _ in self._entries() if kind == LABEL)

    def files(self) -> dict[str, bytes]:
        """What a host that mounts it finds."""
        return {
            f"{name[:8].rstrip()}.{name[8:].rstrip()}": self._content(first, size)
            for name, kind, first, size in self._entries()
            if kind == ARCHIVE
        }

    def _entries(self):
        for at in range(ROOT * SECTOR, DATA * SECTOR, 32):
            name, kind, first, size = struct.unpack_from("<11sB14xHI", self.raw, at)
            if name[0]:
                yield name.decode().rstrip() if kind == LABEL else name.decode(), kind, first, size

    def _content(self, first: int, size: int) -> bytes:
        out, fat = b"", self._fat()
        while first != LAST:
            at = (DATA + first - 2) * SECTOR
            out += self.raw[at : at + SECTOR]
            first = fat[first]
        return out[:size]
