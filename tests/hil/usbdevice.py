"""The bridge by pyusb: descriptors, HID feature reports, short runs. Holds the device while it is open."""

import sys
import warnings
from contextlib import contextmanager
from pathlib import Path

import usb.core
import usb.util
from checks import CheckError, require

from crunchbot.bridge.usbtree import Bridge
from whisker_protocol import FRAME_BYTES, FRAME_FLAGS, FRAME_HEADER, LIMITS, REPORTS, WIRE_VERSION

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "fpga/usb"))
warnings.filterwarnings("ignore", category=DeprecationWarning)  # LUNA's, about Amaranth's
from descriptors import SELF_POWERED, SERIAL_INDEX, Build, descriptors  # noqa: E402

GET_DESCRIPTOR = 6
FROM_DEVICE, FROM_INTERFACE, TO_INTERFACE = 0x80, 0x81, 0x21  # bmRequestType: standard, standard, class
GET_REPORT, SET_REPORT, FEATURE, FROM_CLASS = 0x01, 0x09, 0x0300, 0xA1
REPORT_DESCRIPTOR = 0x22  # of HID: asked of the interface
CONFIGURATION_DESCRIPTOR = 2
PRODUCT_INDEX = 2  # of its string
ALL = {1: "device", 2: "configuration", 6: "device qualifier", 7: "other speed", 15: "BOS", 34: "HID report"}
NO_SERIAL = "0000"  # strings are not compared
ANSWER_BYTES = 4096
TIMEOUT_MS = 60_000  # a simulation may be slow
DRAIN_MS = 100
READ_BYTES = 16 * LIMITS["bulk_packet"]
PERIOD, DIVIDER = LIMITS["tick_period"], LIMITS["sck_divider_default"]
DEFAULTS = {
    "wire_version": WIRE_VERSION,
    "sck_divider": DIVIDER,
    "word_gap": LIMITS["word_gap_default"],
    "sample_point": LIMITS["sample_point_default"],
    "lane_mask": (1 << LIMITS["lanes"]) - 1,
    "tick_period": PERIOD,
}


class Device:
    """An open bridge with both interfaces claimed."""

    def __init__(self, device):
        self._device = device

    def descriptor(self, kind: int, index: int = 0) -> bytes:
        """One descriptor; that of HID reports is asked of its interface."""
        of_interface = kind == REPORT_DESCRIPTOR
        request, target = (FROM_INTERFACE, LIMITS["usb_hid_interface"]) if of_interface else (FROM_DEVICE, 0)
        return bytes(self._transfer(request, GET_DESCRIPTOR, kind << 8 | index, target, ANSWER_BYTES))

    @property
    def product(self) -> str:
        """Its name, as it says."""
        return usb.util.get_string(self._device, PRODUCT_INDEX)

    @property
    def serial(self) -> str:
        """Its serial number, as it says."""
        return usb.util.get_string(self._device, SERIAL_INDEX)

    def report(self, name: str) -> dict[str, int]:
        """A feature report's fields."""
        wanted = REPORTS[name]
        got = bytes(
            self._transfer(FROM_CLASS, GET_REPORT, FEATURE | wanted.id, LIMITS["usb_hid_interface"], wanted.size)
        )
        require(len(got) == wanted.size and got[0] == wanted.id, f"report {name}: {len(got)} of {wanted.size} bytes")
        return wanted.unpack(got)

    def control(self, run: bool, **settings: int) -> None:
        """Sends the control report: the defaults with these settings."""
        report = REPORTS["control"]
        data = report.pack(id=report.id, run=int(run), **DEFAULTS | settings)
        self._transfer(TO_INTERFACE, SET_REPORT, FEATURE | report.id, LIMITS["usb_hid_interface"], data)

    def refuses(self, **settings: int) -> bool:
        """Whether it answers this control report by STALL."""
        try:
            self.control(False, **settings)
        except usb.core.USBError as error:
            if error.errno is None:
                raise
            return True
        return False

    def run(self, frames: int, **settings: int) -> dict[str, int]:
        """Starts the bridge, takes at least so many frames, stops it, takes the rest. Its counters afterwards."""
        self.drain()
        self.control(True, **settings)
        taken = 0
        while taken < frames * FRAME_BYTES:
            taken += len(self._device.read(LIMITS["usb_bulk_in"], READ_BYTES, TIMEOUT_MS))
        self.control(False, **settings)
        while not self._has_last(bytes(self._device.read(LIMITS["usb_bulk_in"], READ_BYTES, TIMEOUT_MS))):
            continue
        return self.report("counters")

    @staticmethod
    def _has_last(data: bytes) -> bool:
        flags = data[FRAME_HEADER.fields["flags"].offset :: FRAME_BYTES]
        return any(flag & FRAME_FLAGS["last"] for flag in flags)

    def drain(self) -> None:
        """Stops a bridge that still runs for somebody who is gone, and throws its frames away."""
        self.control(False)
        try:
            while True:
                self._device.read(LIMITS["usb_bulk_in"], READ_BYTES, DRAIN_MS)
        except usb.core.USBTimeoutError:
            return

    def _transfer(self, kind: int, request: int, value: int, index: int, data_or_size):
        return self._device.ctrl_transfer(kind, request, value, index, data_or_size, TIMEOUT_MS)


@contextmanager
def opened(bridge: Bridge):
    """The bridge's Device. CheckError when it may not be opened or another process has it."""
    found = usb.core.find(find_all=True, idVendor=LIMITS["usb_vendor_id"], idProduct=LIMITS["usb_product_id"])
    device = next((one for one in found if bridge.node.name == f"{one.address:03d}"), None)
    require(device is not None, "libusb does not find the bridge that the kernel shows; plug it in again")
    interfaces = (LIMITS["usb_bulk_interface"], LIMITS["usb_hid_interface"])
    bound = False
    try:
        bound = device.is_kernel_driver_active(interfaces[1])
        if bound:
            device.detach_kernel_driver(interfaces[1])
        for interface in interfaces:
            usb.util.claim_interface(device, interface)
        yield Device(device)
    except usb.core.USBError as error:
        remedy = "stop the whiskerd that has it, install the udev rule; see whisker doctor"
        raise CheckError(f"{error}; {remedy}") from error
    finally:
        usb.util.dispose_resources(device)
        if bound:
            device.attach_kernel_driver(interfaces[1])


def differing_descriptors(device: Device) -> list[str]:
    """Names of the descriptors that differ from those the gateware was made of (fpga/usb/descriptors.py); what power the
    board takes is its own affair."""
    attributes, power = device.descriptor(CONFIGURATION_DESCRIPTOR)[7:9]
    build = Build(NO_SERIAL, self_powered=bool(attributes & SELF_POWERED), milliamps=2 * power)
    wanted = {(kind, index): bytes(raw) for kind, index, raw in descriptors(build)}
    return [name for kind, name in ALL.items() if device.descriptor(kind) != wanted[(kind, 0)]]
