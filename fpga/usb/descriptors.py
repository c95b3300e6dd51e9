"""What the bridge tells a USB host about itself: device, configuration, strings and the HID report descriptor."""

from usb_protocol.emitters import DeviceDescriptorCollection
from usb_protocol.types import USBTransferType

from whisker.protocol import LIMITS, REPORTS

HID_CLASS = 0x03
VENDOR_CLASS = 0xFF
HID_DESCRIPTOR = 0x21
REPORT_DESCRIPTOR = 0x22
DEVICE_QUALIFIER = 0x06
HID_PACKET = 64  # bytes; the interrupt endpoint only ever answers NAK
HID_INTERVAL = 8  # 2**7 microframes = 16 ms between the host's polls


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
    return bytes([9, HID_DESCRIPTOR, 0x11, 0x01, 0, 1, REPORT_DESCRIPTOR, report_length & 0xFF, report_length >> 8])


def device_qualifier() -> bytes:
    """USB 2.0 section 9.6.2: at the other speed the device looks the same, with one configuration."""
    return bytes([10, DEVICE_QUALIFIER, 0x00, 0x02, 0, 0, 0, 64, 1, 0])


def descriptors(serial: str) -> DeviceDescriptorCollection:
    """All descriptors of the composite device: interface 0 vendor bulk IN, interface 1 HID."""
    collection = DeviceDescriptorCollection()
    reports = report_descriptor()
    with collection.DeviceDescriptor() as device:
        device.bcdUSB = 2.00
        device.idVendor = LIMITS["usb_vendor_id"]
        device.idProduct = LIMITS["usb_product_id"]
        device.bcdDevice = LIMITS["gateware_version"]
        device.iManufacturer = "CrunchBot"
        device.iProduct = "Whisker bridge"
        device.iSerialNumber = serial
        device.bNumConfigurations = 1
    with collection.ConfigurationDescriptor() as configuration:
        configuration.bMaxPower = 250  # 500 mA for the FPGA board; the nodes have their own supply
        with configuration.InterfaceDescriptor() as frames:
            frames.bInterfaceNumber = LIMITS["usb_bulk_interface"]
            frames.bInterfaceClass = VENDOR_CLASS
            with frames.EndpointDescriptor() as endpoint:
                endpoint.bEndpointAddress = LIMITS["usb_bulk_in"]
                endpoint.bmAttributes = USBTransferType.BULK
                endpoint.wMaxPacketSize = LIMITS["bulk_packet"]
        with configuration.InterfaceDescriptor() as control:
            control.bInterfaceNumber = LIMITS["usb_hid_interface"]
            control.bInterfaceClass = HID_CLASS
            control.add_subordinate_descriptor(hid_descriptor(len(reports)))
            with control.EndpointDescriptor() as endpoint:
                endpoint.bEndpointAddress = LIMITS["usb_hid_in"]
                endpoint.bmAttributes = USBTransferType.INTERRUPT
                endpoint.wMaxPacketSize = HID_PACKET
                endpoint.bInterval = HID_INTERVAL
    collection.add_descriptor(device_qualifier(), index=0, descriptor_type=DEVICE_QUALIFIER)
    collection.add_descriptor(reports, index=0, descriptor_type=REPORT_DESCRIPTOR)
    return collection
