"""The simulation's programs, compiled; crunchbot.programs finds them here."""

import ctypes.util
from pathlib import Path

PROGRAMS = Path(__file__).resolve().parent / "bin"
# library that the programs load: Debian's package
_PACKAGES = {
    "umockdev": "umockdev",
    "usb-1.0": "libusb-1.0-0",
    "hidapi-libusb": "libhidapi-libusb0",
    "systemd": "libsystemd0",
}


def missing_packages() -> list[str]:
    """Debian packages that the programs need and this machine lacks."""
    return [package for library, package in _PACKAGES.items() if ctypes.util.find_library(library) is None]
