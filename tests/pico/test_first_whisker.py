"""docs/first_whisker.md has the firmware's pins, in its table and in its picture; the emulated board is wired so, too."""

import re

from pico.emulated import ROOT, SIM

PAGE = (ROOT / "docs/first_whisker.md").read_text()
# GPIO of each pin of the board: the Pico's data sheet, figure 2.
GPIO = dict(
    zip(
        (1, 2, 4, 5, 6, 7, 9, 10, 11, 12, 14, 15, 16, 17, 19, 20, 21, 22, 24, 25, 26, 27, 29, 31, 32, 34),
        range(23),
        strict=False,
    )
)
GPIO |= {31: 26, 32: 27, 34: 28}


def firmware() -> dict[str, int]:
    source = (ROOT / "firmware/pico/board.c").read_text()

    def numbers(name: str) -> list[int]:
        return [int(n) for n in re.search(rf"{name}\[\w+\] = \{{([^}}]*)\}}", source)[1].split(",")]

    pins = {f"lane {lane}": pin for lane, pin in enumerate(numbers("PIN_SELECT"))}
    for line in ("SCK", "MOSI", "MISO"):
        pins |= {f"{line} {bus}": pin for bus, pin in enumerate(numbers(f"PIN_{line}"))}
    return pins | {"convert": int(re.search(r"PIN_CONVERT (\d+)u", source)[1])}


def test_the_table_is_the_firmwares_wiring():
    rows = re.findall(r"^\| ([\w ]+) \| (\d+) \| (\d+) \|", PAGE, re.MULTILINE)
    assert {line: int(gpio) for line, gpio, _ in rows} == firmware()
    assert all(GPIO[int(pin)] == int(gpio) for _, gpio, pin in rows)


def test_the_picture_is_the_tables():
    names = {GPIO[pin]: pin for pin in GPIO}
    left = {int(pin): line.strip() for line, pin in re.findall(r"^ {6}([\w ]*?) (\d+) \|", PAGE, re.MULTILINE)}
    right = {int(pin): line for pin, line in re.findall(r"\| (\d+)  ([\w ]+)$", PAGE, re.MULTILINE)}
    drawn = {pin: line for pin, line in (left | right).items() if line and line not in ("GND", "RUN", "3V3")}
    assert drawn == {names[gpio]: line for line, gpio in firmware().items()}


def test_the_emulated_board_is_wired_so():
    source = (SIM / "board.mjs").read_text()
    pins = firmware()
    select = [int(n) for n in re.search(r"SELECT = \[([^\]]*)\]", source)[1].split(",")]
    assert select == [pins[f"lane {lane}"] for lane in range(16)]
    buses = re.findall(r"\{ sck: (\d+), mosi: (\d+), miso: (\d+) \}", source)
    assert [tuple(map(int, bus)) for bus in buses] == [
        tuple(pins[f"{line} {bus}"] for line in ("SCK", "MOSI", "MISO")) for bus in (0, 1)
    ]
    assert int(re.search(r"CONVERT = (\d+)", source)[1]) == pins["convert"]
