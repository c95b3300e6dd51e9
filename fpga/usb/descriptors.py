"""What the bridge reports to a USB host about itself: device, configuration, strings and the HID report descriptor."""

import struct
from dataclasses import dataclass

from standard_requests import (
    BOS,
    CONFIGURATION,
    CONFIGURATION_AT_FULL_SPEED,
    HID,
    OTHER_SPEED,
    OTHER_SPEED_AT_FULL_SPEED,
    QUALIFIER,
    REPORT,
    WINDOWS_REQUEST,
    WINDOWS_SET,
)
from usb_protocol.emitters import DeviceDescriptorCollection
from usb_protocol.emitters.descriptors.standard import ConfigurationDescriptorEmitter
from usb_protocol.types import USBTransferType

from whisker_protocol import BOARDS, LIMITS, REPORTS

HID_CLASS = 0x03
VENDOR_CLASS = 0xFF
HID_PACKET = 64  # bytes; the interrupt endpoint only ever answers NAK
HID_INTERVAL = 8  # 2**7 microframes = 16 ms between the host's polls
HID_INTERVAL_FULL_SPEED = 16  # ms
FULL_SPEED_PACKET = 64  # bytes of a bulk packet at full speed, USB 2.0 section 5.8.3
USB_RELEASE = 0x0201  # may have a BOS descriptor (LPM addendum to USB 2.0); 0x0210 is for USB 3 devices on a USB 2 bus
SERIAL_INDEX = 3  # of its string
PLATFORM_CAPABILITY = bytes.fromhex("df60ddd88945c74c9cd2659d9e648a9f")  # Microsoft OS 2.0: D8DD60DF-4589-...
WINDOWS_8_1 = 0x06030000  # the first Windows that asks
# Programs on Windows find the frame interface under this class of devices.
INTERFACE_GUID = "{7E2A9C51-3C0B-4B7A-9D52-5B6E1F0C28D4}"


SELF_POWERED = 0x40  # bit of bmAttributes
ATTRIBUTES = 0x80  # its bit 7 is always 1


@dataclass(frozen=True)
class Build:
    """What differs from board to board and from build to build; the default is the simulated bridge.

    commit: first 16 bits, 0 if unknown; milliamps: drawn from the host at most, 0 to 500; full_speed_only: the PHY has no
    high speed, so there is no other speed to describe (USB 2.0 section 9.6.2); usb_id: vendor and product.
    """

    serial: str = "0001"
    board: int = BOARDS["simulation"]
    commit: int = 0
    self_powered: bool = True
    milliamps: int = 2
    full_speed_only: bool = False
    usb_id: tuple[int, int] = (LIMITS["usb_vendor_id"], LIMITS["usb_product_id"])
    product: str = "Whisker bridge"

    @property
    def attributes(self) -> int:
        """bmAttributes: self-powered or not; no remote wake-up."""
        return ATTRIBUTES | (SELF_POWERED if self.self_powered else 0)

    @property
    def max_power(self) -> int:
        """bMaxPower, in 2 mA; ValueError if no host may give so much (USB 2.0 section 7.2.1)."""
        if not 0 <= self.milliamps <= 500:
            raise ValueError(f"milliamps is {self.milliamps}; a USB 2.0 device draws 0 to 500")
        return (self.milliamps + 1) // 2


def report_descriptor() -> bytes:
    """HID 1.11 section 6.2.2: one vendor-defined feature report per report of the protocol, bytes after its id."""
    items = bytes([0x06, 0x00, 0xFF, 0x09, 0x01, 0xA1, 0x01])  # vendor page, usage 1, application collection
    items += bytes([0x15, 0x00, 0x26, 0xFF, 0x00, 0x75, 0x08])  # logical 0 to 255, 8 bits each
    for report in REPORTS.values():
        items += bytes(
            [0x85, report.id, 0x09, report.id, 0x95, report.size - 1, 0xB1, 0x02]
        )  # id, usage, count, feature
    return items + bytes([0xC0])


def hid_descriptor(report_length: int) -> bytes:
    """HID 1.11 section 6.2.1: version 1.11, no country, one report descriptor."""
    return bytes([9, HID, 0x11, 0x01, 0, 1, REPORT, report_length & 0xFF, report_length >> 8])


def device_qualifier() -> bytes:
    """USB 2.0 section 9.6.2: at the other speed the device looks the same, with one configuration."""
    return struct.pack("<BBHBBBBBB", 10, QUALIFIER, USB_RELEASE, 0, 0, 0, 64, 1, 0)


def windows_set() -> bytes:
    """Microsoft OS 2.0 descriptor set: WinUSB for the frame interface, HID as it is, so Windows needs no driver file."""
    name, guid = ("DeviceInterfaceGUIDs\0".encode("utf-16-le"), f"{INTERFACE_GUID}\0\0".encode("utf-16-le"))
    compatible = struct.pack("<HH8s8s", 20, 3, b"WINUSB", b"")
    registry = struct.pack("<HHHH", 10 + len(name) + len(guid), 4, 7, len(name)) + name  # 7: REG_MULTI_SZ
    registry += struct.pack("<H", len(guid)) + guid
    function = compatible + registry
    function = struct.pack("<HHBBH", 8, 2, LIMITS["usb_bulk_interface"], 0, 8 + len(function)) + function
    configuration = struct.pack("<HHBBH", 8, 1, 0, 0, 8 + len(function)) + function
    return struct.pack("<HHIH", 10, 0, WINDOWS_8_1, 10 + len(configuration)) + configuration


def binary_object_store() -> bytes:
    """BOS descriptor (USB 3.2 section 9.6.2): where Windows finds its set. No USB 2.0 extension: link power management
    is all that it could offer."""
    platform = bytes([28, 0x10, 5, 0]) + PLATFORM_CAPABILITY
    platform += struct.pack("<IHBB", WINDOWS_8_1, len(windows_set()), WINDOWS_REQUEST, 0)
    return struct.pack("<BBHB", 5, BOS, 5 + len(platform), 1) + platform


def configuration(build: Build, at_full_speed: bool, kind: int = CONFIGURATION) -> bytes:
    """Configuration 1 as it is at that speed: interface 0 vendor bulk IN, interface 1 HID; kind 7: as other-speed
    configuration (USB 2.0 section 9.6.4)."""
    emitter = ConfigurationDescriptorEmitter()
    emitter.bmAttributes = build.attributes
    emitter.bMaxPower = build.max_power  # of the FPGA board; the nodes have their own supply
    with emitter.InterfaceDescriptor() as frames:
        frames.bInterfaceNumber = LIMITS["usb_bulk_interface"]
        frames.bInterfaceClass = VENDOR_CLASS
        with frames.EndpointDescriptor() as endpoint:
            endpoint.bEndpointAddress = LIMITS["usb_bulk_in"]
            endpoint.bmAttributes = USBTransferType.BULK
            endpoint.wMaxPacketSize = FULL_SPEED_PACKET if at_full_speed else LIMITS["bulk_packet"]
            endpoint.bInterval = 0  # NAKs are not limited (table 9-13)
    with emitter.InterfaceDescriptor() as control:
        control.bInterfaceNumber = LIMITS["usb_hid_interface"]
        control.bInterfaceClass = HID_CLASS
        control.bInterfaceSubclass = control.bInterfaceProtocol = 0  # no boot device (HID 1.11 sections 4.2, 4.3)
        control.add_subordinate_descriptor(hid_descriptor(len(report_descriptor())))
        with control.EndpointDescriptor() as endpoint:
            endpoint.bEndpointAddress = LIMITS["usb_hid_in"]
            endpoint.bmAttributes = USBTransferType.INTERRUPT
            endpoint.wMaxPacketSize = HID_PACKET
            endpoint.bInterval = HID_INTERVAL_FULL_SPEED if at_full_speed else HID_INTERVAL
    raw = bytearray(emitter.emit())
    raw[1] = kind
    return bytes(raw)


def descriptors(build: Build) -> DeviceDescriptorCollection:
    """All descriptors, by the type under which they lie in the ROM (standard_requests.py)."""
    collection = DeviceDescriptorCollection()
    reports = report_descriptor()
    with collection.DeviceDescriptor() as device:
        device.bcdUSB = float(f"{USB_RELEASE >> 8:x}.{USB_RELEASE & 0xFF:02x}")  # the emitter's way of writing BCD
        device.idVendor, device.idProduct = build.usb_id
        device.bcdDevice = LIMITS["gateware_version"]
        device.iManufacturer = "CrunchBot"
        device.iProduct = build.product
        device.iSerialNumber = build.serial
        device.bNumConfigurations = 1
    collection.add_descriptor(configuration(build, True), descriptor_type=CONFIGURATION_AT_FULL_SPEED)
    if not build.full_speed_only:
        collection.add_descriptor(configuration(build, False), descriptor_type=CONFIGURATION)
        collection.add_descriptor(configuration(build, True, OTHER_SPEED), descriptor_type=OTHER_SPEED)
        collection.add_descriptor(configuration(build, False, OTHER_SPEED), descriptor_type=OTHER_SPEED_AT_FULL_SPEED)
        collection.add_descriptor(device_qualifier(), descriptor_type=QUALIFIER)
    collection.add_descriptor(binary_object_store(), descriptor_type=BOS)
    collection.add_descriptor(windows_set(), descriptor_type=WINDOWS_SET)
    collection.add_descriptor(hid_descriptor(len(reports)), descriptor_type=HID)
    collection.add_descriptor(reports, descriptor_type=REPORT)
    return collection
