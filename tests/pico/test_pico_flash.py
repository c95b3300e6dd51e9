"""`whisker flash pico` on a model of the boot drive: a FAT image (fat.py), mounted in a folder, of which the ROM takes the sectors."""

import struct
import threading
import time
from pathlib import Path

import pytest
from pico.emulated import IMAGE
from pico.fat import Drive

from crunchbot.bridge import pico_drive
from crunchbot.errors import UserError

UF2 = IMAGE.with_suffix(".uf2")


class Machine:
    """A root folder with USB tree, mounts and a drive; a thread that is the board."""

    def __init__(self, root: Path, serial: str = "E6613852837F2B21"):
        self.root, self.serial, self.asked, self.drive = root, serial, 0, root / "media/user/RPI-RP2"
        self.flash, self.image = b"", Drive()
        for folder in ("proc", "dev/disk/by-label", "sys/bus/usb/devices", "media/user"):
            (root / folder).mkdir(parents=True)
        (root / "proc/mounts").write_text("proc /proc proc rw 0 0\n")
        self.ending = threading.Event()
        self.thread = threading.Thread(target=self.rom, daemon=True)

    def plug(self, name: str = "1-1", serial: str | None = None) -> None:
        folder = self.root / "sys/bus/usb/devices" / name
        folder.mkdir()
        values = {"idVendor": "1209", "idProduct": "0001", "busnum": "1", "devnum": "2", "speed": "12"}
        values |= {"product": "Whisker Pico", "serial": serial or self.serial}
        for key, value in values.items():
            (folder / key).write_text(value + "\n")

    def unplug(self) -> None:
        for folder in (self.root / "sys/bus/usb/devices").iterdir():
            for file in folder.iterdir():
                file.unlink()
            folder.rmdir()

    def show_drive(self) -> None:
        """As a desktop mounts it: what the image holds, in a folder of its label's name."""
        assert self.image.label() == self.drive.name
        self.drive.mkdir()
        for name, content in self.image.files().items():
            (self.drive / name).write_bytes(content)
        (self.root / "proc/mounts").write_text("proc /proc proc rw 0 0\n/dev/sdb1 /media/user/RPI-RP2 vfat rw 0 0\n")
        self.thread.start()

    def ask(self, serial: str | None) -> int:
        assert serial == self.serial
        self.asked += 1
        self.unplug()
        self.show_drive()
        return 0

    def rom(self) -> None:
        """Takes blocks of its family; when it has them all it leaves the bus as a drive and comes back as the board."""
        while not self.ending.wait(0.01):
            files = [path for path in self.drive.iterdir() if path.suffix == ".uf2"]
            raw = files[0].read_bytes() if files else b""
            if len(raw) >= 512 and len(raw) == 512 * struct.unpack_from("<I", raw, 24)[0]:
                self.image.write("PICO    UF2", raw)
                self.flash = self.image.whole()
                assert self.image.files()["PICO.UF2"] == raw
                self.leave()
                self.plug()
                return

    def leave(self) -> None:
        (self.root / "proc/mounts").write_text("proc /proc proc rw 0 0\n")
        for file in self.drive.iterdir():
            file.unlink()
        self.drive.rmdir()


@pytest.fixture
def machine(tmp_path):
    made = Machine(tmp_path)
    yield made
    made.ending.set()


def test_the_board_is_asked_takes_the_image_and_is_awaited(machine):
    machine.plug()
    pico_drive.flash(UF2, None, machine.ask, machine.root)
    assert machine.asked == 1
    assert machine.flash[: IMAGE.stat().st_size] == IMAGE.read_bytes()


def test_a_board_that_is_a_drive_already_needs_no_order(machine):
    machine.show_drive()
    pico_drive.flash(UF2, None, machine.ask, machine.root)
    assert machine.asked == 0 and machine.flash


def other_family(raw: bytes) -> bytes:
    return b"".join(
        raw[at : at + 28] + struct.pack("<I", 0xE48BFF59) + raw[at + 32 : at + 512] for at in range(0, len(raw), 512)
    )


BAD = {
    "another family": (other_family, "for another chip"),
    "cut short": (lambda raw: raw[:-512], "damaged or missing"),
    "half a block": (lambda raw: raw[:-100], "cut short"),
    "no UF2": (lambda raw: bytes(1024), "damaged"),
    "empty": (lambda raw: b"", "no UF2 file"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_wrong_file_is_refused_before_the_board_is_asked(machine, tmp_path, name):
    change, text = BAD[name]
    machine.plug()
    (tmp_path / "wrong.uf2").write_bytes(change(UF2.read_bytes()))
    with pytest.raises(UserError, match=text) as refused:
        pico_drive.flash(tmp_path / "wrong.uf2", None, machine.ask, machine.root)
    assert ";" in str(refused.value) and machine.asked == 0


def test_two_boards_are_told_apart_or_not_at_all(machine):
    machine.plug()
    machine.plug("1-2", "E661000000000000")
    with pytest.raises(UserError, match="name one with --bridge"):
        pico_drive.flash(UF2, None, machine.ask, machine.root)
    machine.plug("1-3")
    with pytest.raises(UserError, match="unplug all but one"):
        pico_drive.flash(UF2, machine.serial, machine.ask, machine.root)


def test_nothing_there_and_a_board_that_does_not_go(machine):
    with pytest.raises(UserError, match="hold BOOTSEL"):
        pico_drive.flash(UF2, None, machine.ask, machine.root)
    machine.plug()
    with pytest.raises(UserError, match="stop whiskerd"):
        pico_drive.flash(UF2, None, lambda serial: 1, machine.root)


def test_a_drive_that_nobody_mounted(machine, monkeypatch):
    monkeypatch.setattr(pico_drive, "DRIVE_S", 0.2)
    machine.plug()
    with pytest.raises(UserError, match="udisksctl mount"):
        pico_drive.flash(UF2, None, lambda serial: 0, machine.root)


def test_the_cable_pulled_while_copying(machine, monkeypatch):
    machine.show_drive()
    real = pico_drive.os.fsync
    calls = []

    def pulled(descriptor):
        calls.append(descriptor)
        if len(calls) == 2:
            raise OSError(5, "Input/output error")
        real(descriptor)

    monkeypatch.setattr(pico_drive.os, "fsync", pulled)
    with pytest.raises(UserError, match="bytes copied, then Input/output error; check the cable; hold BOOTSEL"):
        pico_drive.flash(UF2, None, machine.ask, machine.root)


def test_a_board_that_does_not_come_back(machine, monkeypatch):
    monkeypatch.setattr(pico_drive, "RETURN_S", 0.5)
    machine.plug = lambda: time.sleep(0)
    machine.show_drive()
    with pytest.raises(UserError, match="has not come back"):
        pico_drive.flash(UF2, None, machine.ask, machine.root)


def test_the_drive_takes_blocks_of_its_family_alone():
    wrong, half = Drive(), Drive()
    wrong.write("WRONG   UF2", other_family(UF2.read_bytes()))
    half.write("HALF    UF2", UF2.read_bytes()[: 512 * 20])
    assert wrong.whole() is None and half.whole() is None
    half.write("PICO    UF2", UF2.read_bytes())  # what was pulled while copying is begun again
    assert half.whole()[: IMAGE.stat().st_size] == IMAGE.read_bytes()


def test_two_drives_are_told(machine):
    other = machine.root / "media/user/RPI-RP21"
    machine.show_drive()
    machine.ending.set()
    other.mkdir()
    (other / "INFO_UF2.TXT").write_bytes(machine.image.files()["INFO_UF2.TXT"])
    mounts = machine.root / "proc/mounts"
    mounts.write_text(mounts.read_text() + "/dev/sdc1 /media/user/RPI-RP21 vfat rw 0 0\n")
    with pytest.raises(UserError, match="2 drives"):
        pico_drive.flash(UF2, None, machine.ask, machine.root)
