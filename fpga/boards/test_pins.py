"""The boards' pin files against the boards' public platform files: PHY, LEDs, flash, every lane in its socket. Faults drawn at random
are noticed. WHISKER_BENCH_SEED chooses them."""

import os
import random
import sys
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent))

import build  # noqa: E402
import platforms  # noqa: E402

ROW = {"first": "1 2 3 4", "second": "7 8 9 10", "both": "1 2 3 4 7 8 9 10"}
BUS = ("sync", "sck", "select_n", "mosi")
# Socket and its pins, in the order of the four common lines, then of the lanes.
WIRING = {
    "ecpix5": [("pmod 0", ROW["first"])] + [(f"pmod {n}", ROW["both"]) for n in (1, 2, 4)] + [("pmod 5", ROW["first"])],
    "cynthion": [("A", ROW["both"]), ("B", ROW["both"]), ("mezzanine", "3 4 5 6 7 8 9 10 11 12 13 18 19 20 21 22")],
    "colorlight_i9": [("P2", "1 2 3 7"), ("P3 first", ROW["both"]), ("P3 second", ROW["both"])]
    + [("P5 first", ROW["both"]), ("P5 second", ROW["first"])],
}
WIRING["tang_primer_20k"] = [(f"pmod {n}", ROW["both"]) for n in range(4)]
WIRING["ulx3s"] = [("gpio 0", " ".join(f"{n}+ {n}-" for n in [*range(11), *range(18, 23)]))]
WIRING["colorlight_i5"] = WIRING["colorlight_i9"]
# tick_in and tick_out, of a board that has pins left for them
TICKS = {"ecpix5": ("pmod 0", "7 8"), "cynthion": ("mezzanine", "23 24"), "colorlight_i9": ("P2", "8 9")}
TICKS["colorlight_i5"] = TICKS["colorlight_i9"]
TICKS["ulx3s"] = ("gpio 0", "23+ 23-")
# Where the PHY is a module, its lines lie on a socket too.
MODULE = {
    "ulpi_data": [("P4 first", "1 2 3 7 8 9 10"), ("P4 second", "3")],
    "clk_60": [("P4 first", "4")],
    "ulpi_dir": [("P4 second", "4")],
    "ulpi_nxt": [("P4 second", "8")],
    "ulpi_stp": [("P4 second", "9")],
    "ulpi_reset": [("P4 second", "10")],
}
FAULTS = 20  # of each board: nothing is simulated


def balls(platform, wiring) -> list[str]:
    return [platform.sockets[socket][pin] for socket, pins in wiring for pin in pins.split()]


def wrong(board, platform) -> list[str]:
    """Ports that do not lie where the platform file says."""
    module = {} if platform.phy else {port: balls(platform, wiring) for port, wiring in MODULE.items()}
    phy = platform.phy or {port: found if port == "ulpi_data" else found[0] for port, found in module.items()}
    lines = balls(platform, WIRING[board.name])
    expected = {**phy, **dict(zip(BUS, lines, strict=False)), "miso": lines[len(BUS) :]}
    expected |= platform.flash if board.flash else {}
    if board.name in TICKS:
        expected |= dict(zip(("tick_in", "tick_out"), balls(platform, [TICKS[board.name]]), strict=True))
    found = [port for port, place in expected.items() if board.pins.get(port) != place]
    lit = {"led", "led_n"}
    (leds,) = (board.pins[port] for port in lit if port in board.pins)
    leds = [leds] if isinstance(leds, str) else leds
    found += ["LED"] if leds != platform.leds[: len(leds)] else []
    found += ["part"] if board.part != platform.part else []
    return found + sorted(set(board.pins) - set(expected) - lit)


PLATFORMS = platforms.platforms()


@pytest.mark.parametrize("name", build.boards())
def test_pins_are_those_of_the_platform_file(name):
    assert wrong(build.load(name), PLATFORMS[name]) == []


def swapped(board, generator: random.Random):
    """The board with two of its pins exchanged, or one moved to a ball that nothing uses."""
    places = [
        (port, n) for port, value in board.pins.items() for n in range(len(value) if isinstance(value, list) else 1)
    ]
    pins = {port: list(value) if isinstance(value, list) else [value] for port, value in board.pins.items()}
    (port, n), (other, m) = generator.sample(places, 2)
    if generator.random() < 0.25:
        pins[port][n] = "ZZ99"
    else:
        pins[port][n], pins[other][m] = pins[other][m], pins[port][n]
    joined = {port: value if isinstance(board.pins[port], list) else value[0] for port, value in pins.items()}
    return replace(board, pins=joined), f"{port} {n}, {other} {m}"


@pytest.mark.parametrize("name", build.boards())
def test_a_fault_in_a_pin_file_is_noticed(name):
    generator = random.Random(f"{os.environ.get('WHISKER_BENCH_SEED', '1')} {name}")
    board = build.load(name)
    for _ in range(FAULTS):
        faulty, what = swapped(board, generator)
        assert wrong(faulty, PLATFORMS[name]), what
