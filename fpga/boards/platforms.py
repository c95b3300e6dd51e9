"""What a board's public platform file says of its pins: amaranth-boards where it knows the board, else a table with its
source. Tests compare the boards' files with it; no bitstream is made of it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Platform:
    """`part` as the maker names it, `sockets` by name (pin number: ball), `phy` by the names of our ports, `leds`: balls, `flash`:
    the configuration flash by the names of our ports, WP and HOLD in `flash_high`."""

    part: str
    sockets: dict[str, dict[str, str]]
    phy: dict[str, str | list[str]]
    leds: list[str]
    flash: dict[str, str | list[str]]


def of_amaranth(platform, *leds: tuple[str, int, str]) -> Platform:
    """A board that amaranth-boards knows; `leds`: resource, its number, its part."""

    def pins(key, name):
        resource = platform.resources[key]
        found = resource if not name else next(io for io in resource.ios if io.name == name)
        return found.ios[0]

    usb = ("ulpi" if ("ulpi", 0) in platform.resources else "usb", 0)
    sockets = {f"{name} {number}": dict(c.mapping) for (name, number), c in platform.connectors.items()}
    phy = {}
    if any(io.name == "nxt" for io in platform.resources[usb].ios):
        names = {"data": "ulpi_data", "clk": "clk_60", "dir": "ulpi_dir", "nxt": "ulpi_nxt", "stp": "ulpi_stp"}
        names["rst"] = "ulpi_reset_n" if pins(usb, "rst").invert else "ulpi_reset"
        phy = {ours: pins(usb, theirs).names for theirs, ours in names.items()}
        phy = {port: found if port == "ulpi_data" else found[0] for port, found in phy.items()}
    else:
        names = {"d_p": "usb_d_p", "d_n": "usb_d_n", "pullup": "usb_pull_up"}
        phy = {ours: pins(usb, theirs).names[0] for theirs, ours in names.items()}
        phy |= {"clk_25": pins(("clk25", 0), "").names[0]}
    chip = next(key for key in platform.resources if key[0] in ("spi_flash", "spi_flash_1x"))
    io = {part.name: part.ios[0].names[0] for part in platform.resources[chip].ios if part.name != "clk"}
    flash = {"flash_cs_n": io["cs"], "flash_mosi": io["copi"], "flash_miso": io["cipo"]}
    flash |= {"flash_high": [io["wp"], io["hold"]]} if "wp" in io else {}
    return Platform(
        getattr(platform, "part", None) or platform.device,
        sockets,
        phy,
        [pins((resource, number), part).names[0] for resource, number, part in leds],
        flash,
    )


def table(text: str, numbers: str) -> dict[str, str]:
    """A socket's pins, `-` where the source names none."""
    named = zip(numbers.split(), text.split(), strict=True)
    return {number: ball for number, ball in named if ball != "-"}


# colorlight_i9_v7.2.md of github.com/wuxx/Colorlight-FPGA-Projects; the i5 has the same.
COLORLIGHT_FLASH = {"flash_cs_n": "R2", "flash_mosi": "W2", "flash_miso": "V2"}
PMOD = "1 2 3 4 7 8 9 10"
# github.com/wuxx/Colorlight-FPGA-Projects, doc/i5_extboard_v1.2_pinout.png: two rows of four for each half of a header. The
# i9 has L2 where the i5 has U16, on P2; both are the LED.
EXTENSION_BOARD = {
    "P2": table("P17 R18 C18 - M17 R17 T18 K18", PMOD),
    "P3 first": table("C17 B18 B20 F20 A18 A19 B19 D20", PMOD),
    "P3 second": table("D1 C1 C2 E3 E2 D2 B1 A3", PMOD),
    "P4 first": table("H4 G3 F1 F2 H3 F3 E4 E1", PMOD),
    "P4 second": table("- E19 B3 K5 - B2 K4 A2", PMOD),
    "P5 first": table("D18 G5 F5 E5 D17 D16 E6 F4", PMOD),
    "P5 second": table("J17 H17 H16 G16 H18 G18 F18 E18", PMOD),
}
# github.com/greatscottgadgets/cynthion, cynthion_r1_4.py (package cynthion 0.2.5): aux_phy, pmod 0 and 1, mezzanine, LEDs
CYNTHION = Platform(
    "LFE5U-12F",
    {
        "A": table("C9 B9 D11 C12 C8 D8 D9 C10", PMOD),
        "B": table("B4 B5 B6 B7 C5 A5 A6 A7", PMOD),
        "mezzanine": table(
            "B8 A9 B10 A10 B11 D14 C14 F14 E14 G13 G12 C16 C15 B16 B15 A14 B13 A13 D13 A12 B12 A11",
            "3 4 5 6 7 8 9 10 11 12 13 18 19 20 21 22 23 24 25 26 27 28",
        ),
    },
    {
        "ulpi_data": ["F16", "G15", "G16", "H15", "J15", "J16", "K15", "K16"],
        "ulpi_clk": "D16",
        "ulpi_dir": "E16",
        "ulpi_nxt": "F15",
        "ulpi_stp": "E15",
        "ulpi_reset_n": "J13",
        "clk_60": "A8",
    },
    ["E13", "C13", "B14", "A15", "D12", "C11"],
    {},
)


def platforms() -> dict[str, Platform]:
    """The platform by the name of our file."""
    from amaranth_boards.ecpix5 import ECPIX545Platform
    from amaranth_boards.tang_primer_20k import TangPrimer20kDockPlatform
    from amaranth_boards.ulx3s import ULX3S_85F_Platform

    return {
        "colorlight_i5": Platform("LFE5U-25F", EXTENSION_BOARD, {}, ["U16"], COLORLIGHT_FLASH),
        "colorlight_i9": Platform("LFE5U-45F", EXTENSION_BOARD, {}, ["L2"], COLORLIGHT_FLASH),
        "cynthion": CYNTHION,
        "ecpix5": of_amaranth(ECPIX545Platform(), *(("rgb_led", n, "g") for n in range(4))),
        "tang_primer_20k": of_amaranth(TangPrimer20kDockPlatform(), *(("led", n, "") for n in range(4))),
        "ulx3s": of_amaranth(ULX3S_85F_Platform(), *(("led", n, "") for n in range(8))),
    }
