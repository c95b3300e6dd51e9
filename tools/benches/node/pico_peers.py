"""Public drivers of the Pico's two sensors, compiled from a copy that was fetched, on the same board in the same emulator."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
SHIMS = Path(__file__).resolve().parent / "peers"
FIRMWARE = ROOT / "firmware/pico"
SCRIPT, IMAGE = ROOT / "sim/pico/tests/peers.mjs", ROOT / "firmware/images/pico/pico.bin"
# Headers that the drivers include: all of them are the one shim.
ARDUINO = ("Arduino.h", "Adafruit_I2CDevice.h", "Adafruit_SPIDevice.h", "Adafruit_Sensor.h")
ZEPHYR = [
    f"zephyr/{name}.h" for name in ("device", "devicetree", "kernel", "drivers/gpio", "drivers/sensor", "drivers/spi")
]
ZEPHYR += [
    f"zephyr/{name}.h" for name in ("logging/log", "pm/device", "sys/__assert", "sys/byteorder", "sys/crc", "sys/util")
]
COMMON = "-mcpu=cortex-m0plus -mthumb -O3 -w -ffreestanding -fno-builtin -fno-common -ffunction-sections -c"
CPP = "-std=c++17 -fno-exceptions -fno-rtti -fno-threadsafe-statics"
LINK = "-mcpu=cortex-m0plus -mthumb -nostdlib -Wl,--gc-sections,--build-id=none"
# Row: shim's source, its header, headers it stands for, options, the driver's file, the sensor of the emulator.
PEERS = {
    "Adafruit_MLX90393, as it begins": (
        "adafruit.cpp",
        "arduino_shim.h",
        ARDUINO,
        CPP,
        "Adafruit_MLX90393.cpp",
        "mlx90393",
    ),
    "Adafruit_MLX90393, fastest": (
        "adafruit.cpp",
        "arduino_shim.h",
        ARDUINO,
        f"{CPP} -DFAST",
        "Adafruit_MLX90393.cpp",
        "mlx90393",
    ),
    "Zephyr tmag5170": ("zephyr.c", "zephyr_shim.h", ZEPHYR, "-std=gnu11", "tmag5170.c", "tmag5170"),
}
OURS = {"this firmware, one MLX90393": (1, "mlx90393", 120000), "this firmware, eight TMAG5170": (8, "tmag5170", 30000)}


def build(name: str, fetched: Path, out: Path) -> Path:
    """The peer's image. RuntimeError with what the compiler said."""
    sys.path.insert(0, str(ROOT / "tools/firmware"))
    import pico_image

    source, shim, headers, options, _, _ = PEERS[name]
    for header in headers:
        (out / header).parent.mkdir(parents=True, exist_ok=True)
        (out / header).write_text(f'#include "{shim}"\n')
    places = [f"-I{folder}" for folder in (out, fetched, SHIMS, FIRMWARE, ROOT / "protocol/gen")]
    objects = []
    for one in (SHIMS / source, SHIMS / "start.c", FIRMWARE / "boot2.c", FIRMWARE / "board.c", FIRMWARE / "memory.c"):
        compiler = "g++" if one.suffix == ".cpp" else "gcc"
        objects.append(out / f"{one.stem}.o")
        chosen = options if one.parent == SHIMS and one.name == source else "-std=c99"
        command = f"{pico_image.PREFIX}{compiler} {COMMON} {chosen}".split()
        pico_image._run(*command, *places, str(one), "-o", str(objects[-1]))
    words = [f"{pico_image.PREFIX}gcc", *LINK.split(), *map(str, objects), "-lgcc", "-T", str(FIRMWARE / "pico.ld")]
    pico_image._run(*words, "-o", str(out / "peer.elf"))
    image = out / "peer.bin"
    pico_image._run(f"{pico_image.PREFIX}objcopy", "-O", "binary", "--gap-fill", "0", str(out / "peer.elf"), str(image))
    image.write_bytes(pico_image.with_boot_crc(image.read_bytes()))
    return image


def measured(*words) -> dict:
    """What the script prints of an image."""
    done = subprocess.run(["node", SCRIPT, *map(str, words)], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def rows(fetched: Path | None) -> dict[str, dict | str]:
    """By driver: samples a second and instructions a sample; of a peer that is not there: "not run"."""
    found: dict[str, dict | str] = {
        name: measured(IMAGE, kind, lanes, period) for name, (lanes, kind, period) in OURS.items()
    }
    for name, (*_, file, sensor) in PEERS.items():
        if fetched is None or not (fetched / file).is_file():
            found[name] = "not run"
            continue
        with tempfile.TemporaryDirectory() as folder:
            found[name] = measured(build(name, fetched, Path(folder)), sensor)
    return found
