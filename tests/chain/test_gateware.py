"""Gateware updates end to end: an image file through whisker-flash, libusb and hidapi into the simulated bridge's flash; what is
refused changes nothing."""

import os
import random
import subprocess
import sys

from chainrun import END_S, FAST_LINK, ROOT, program, simulation, write_flat_scene

from whisker_protocol import BOARDS, GATEWARE_HEADER, LANES, LIMITS

sys.path[:0] = [str(ROOT / "fpga/boards")]
import image as images  # noqa: E402

WRITABLE = 4 << 16  # of the simulated bridge
SECTOR = 4096
SHORT, LONG = 300, SECTOR + 300


def bitstream(count: int = SHORT, seed: int = 1) -> bytes:
    return b"\xff\x00Part: none\x00" + images.PREAMBLE + random.Random(seed).randbytes(count - 17)


def image(**changes) -> bytes:
    """An image for the simulated bridge, but for these arguments of gateware_image."""
    reported = {"bitstream": bitstream(), "board": BOARDS["simulation"], "lanes": LANES, "commit": 0xABCD}
    return images.gateware_image(**(reported | changes))


def of_version(version: int) -> bytes:
    """The image, said to be of this version of the gateware."""
    now = images.LIMITS
    try:
        images.LIMITS = now | {"gateware_version": version}
        return image()
    finally:
        images.LIMITS = now


def command(folder, shell: str, *options) -> list[str]:
    scene, _ = write_flat_scene(folder, 3)
    words = simulation(folder, scene, 600, 3, "unused", "--flash", folder / "flash.bin", *options)
    return [*words[: words.index("--") + 1], "sh", "-c", shell]


def bridge_with(folder, shell: str, *options) -> subprocess.CompletedProcess:
    """Runs shell commands beside a simulated bridge; $FLASH is whisker-flash."""
    environment = os.environ | {"FLASH": program("whisker-flash"), "LINK": " ".join(FAST_LINK)}
    done = command(folder, shell, *options)
    return subprocess.run(done, capture_output=True, text=True, timeout=END_S, env=environment)


def write(folder, name: str, content: bytes):
    path = folder / name
    path.write_bytes(content)
    return path


def test_an_image_reaches_the_flash_and_sampling_goes_on(tmp_path):
    """A dry run first, which changes nothing; the image to fall back to is the one that was there."""
    made = image(bitstream=bitstream(LONG))
    path = write(tmp_path, "new.wgw", made)
    shell = f"$FLASH {path} --dry-run; echo dry $?; cp {tmp_path}/flash.bin {tmp_path}/before.bin; $FLASH {path}; echo first $?;"
    shell += "$FLASH $LINK --list >/dev/null; echo listed $?"
    done = bridge_with(tmp_path, shell, "--level", "bytes")
    for word in ("dry", "first", "listed"):
        assert f"{word} 0\n" in done.stdout, done.stdout + done.stderr
    assert "would be updated to gateware" in done.stdout and "build abcd is in the bridge's flash" in done.stdout
    before, flash = (tmp_path / "before.bin").read_bytes(), (tmp_path / "flash.bin").read_bytes()
    assert before[:WRITABLE] == b"\xff" * WRITABLE, "a dry run changes nothing"
    assert flash[WRITABLE:] == before[WRITABLE:]
    assert flash[: WRITABLE - SECTOR] == made[GATEWARE_HEADER.size :].ljust(WRITABLE - SECTOR, b"\xff")
    assert flash[WRITABLE - SECTOR : WRITABLE] == made[: GATEWARE_HEADER.size].ljust(SECTOR, b"\xff")


REFUSED = {
    "another board": (image(board=BOARDS["ecpix5"]), "for another board", "make bitstream"),
    "other lanes": (image(lanes=12), "another number of lanes", "LANES="),
    "truncated": (image()[:-1], "no gateware image, or it is damaged", "make it again"),
    "wrong CRC": (image()[:-1] + b"\x5a", "no gateware image, or it is damaged", "make it again"),
    "downgrade": (of_version(LIMITS["gateware_version"] - 1), "older than what the bridge runs", "--force"),
    "too long": (image(bitstream=bitstream(WRITABLE - SECTOR + 1)), "longer than its place", "programmer"),
}


def test_what_is_not_for_this_bridge_is_refused_in_a_line_and_changes_nothing(tmp_path):
    shell = ""
    for number, (content, _, _) in enumerate(REFUSED.values()):
        shell += f"$FLASH {write(tmp_path, f'{number}.wgw', content)} 2>&1; echo code $?;"
    shell += f"$FLASH {tmp_path}/4.wgw --force >/dev/null; echo forced $?"
    done = bridge_with(tmp_path, shell, "--level", "bytes")
    lines = [line for line in done.stdout.splitlines() if line.startswith("whisker-flash:")]
    assert len(lines) == len(REFUSED) and done.stdout.count("code 1\n") == len(REFUSED), done.stdout
    for line, (name, (_, reason, remedy)) in zip(lines, REFUSED.items(), strict=True):
        assert reason in line and remedy in line, (name, line)
    assert "forced 0\n" in done.stdout, done.stdout + done.stderr


def test_without_an_image_to_fall_back_to_nothing_is_written(tmp_path):
    write(tmp_path, "flash.bin", b"\xff" * (1 << 20))
    path = write(tmp_path, "new.wgw", image())
    done = bridge_with(tmp_path, f"$FLASH {path}; echo code $?", "--level", "bytes")
    assert "code 1\n" in done.stdout and "no image to fall back to" in done.stderr, done.stdout + done.stderr
    assert (tmp_path / "flash.bin").read_bytes() == b"\xff" * (1 << 20)


def test_an_update_that_power_was_cut_in_goes_on(tmp_path):
    """Bridge and host end in the midst of a write; what is left is no image, and the same command finishes it."""
    made = image(bitstream=bitstream(LONG))
    path = write(tmp_path, "new.wgw", made)
    old = bitstream(LONG, 2)
    bridge_with(tmp_path, "true")
    content = bytearray((tmp_path / "flash.bin").read_bytes())
    content[: len(old)] = old
    write(tmp_path, "flash.bin", content)
    cut = bridge_with(tmp_path, f"$FLASH {path}", "--level", "bytes", "--flash-cut", "8")
    assert cut.returncode == 1 and "power went" in cut.stderr
    half = (tmp_path / "flash.bin").read_bytes()
    assert images.PREAMBLE not in half[:SECTOR] and half[WRITABLE:] == content[WRITABLE:]
    assert half[WRITABLE - SECTOR : WRITABLE] == b"\xff" * SECTOR
    done = bridge_with(tmp_path, f"$FLASH {path}; echo code $?", "--level", "bytes")
    assert "code 0\n" in done.stdout, done.stdout + done.stderr
    flash = (tmp_path / "flash.bin").read_bytes()
    assert flash[:LONG] == made[GATEWARE_HEADER.size :] and flash[WRITABLE:] == content[WRITABLE:]
