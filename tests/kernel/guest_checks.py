"""Runs inside the guest: what a user's programs do with the bridge."""

import ctypes
import fcntl
import itertools
import os
import re
import struct
import subprocess
import sys
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "protocol"), str(ROOT / "tests")]
from guest_talk import (  # noqa: E402
    HOST,
    PLUG_S,
    PROGRAM_S,
    CheckError,
    Checks,
    Talk,
    attach,
    await_that,
    command,
    detach,
    require,
)
from pico.readings import Log  # noqa: E402

from whisker_protocol import FRAME_BYTES, LANES, LIMITS, REPORTS, WIRE_VERSION, decode_frame  # noqa: E402

PICO_LANES = 8
LONG_RUN_FRAMES = 20000
SHORT_RUN_FRAMES = 2000
RING = "kernel"
FRAMES_FILE = "/run/frames-{}"  # of a reader of so many
PYUSB, FREE = "pyusb", "free"  # the argument that makes this program the one that pyusb(), or free_run(), runs
FREE_FRAMES = 128
MICROFRAMES, PER_TICK = 1 << 14, 4
FINIT_MODULE, DELETE_MODULE = 313, 176  # system calls of x86-64
USBTEST_TIMES, USBTEST_QUEUED = 20, 16
LINK = ["--sck-divider", "6", "--word-gap", "30", "--sample-point", "5"]
SPEEDS = {"Whisker bridge": "480", "Whisker Pico": "12"}  # Mbit/s, by what the device says it is
KEPT = struct.Struct(
    f"<Q{4 * LANES}H"
)  # a frame as ring_probe keeps it: tick, then alpha, beta, status, 0 of each lane
IDENTITY = f"{LIMITS['usb_vendor_id']:04x}:{LIMITS['usb_product_id']:04x}"
MICROSOFT_OS_20 = "{d8dd60df-4589-4cc7-9cd2-659d9e648a9f}"  # the platform capability by which Windows picks its driver
# What a kernel says when it does not like a device.
COMPLAINT = re.compile(
    r"(usb|hid|xhci|vhci|input).*(error|fail|unable|invalid|bogus|unexpect|not accept|can.t|cannot|warn|unknown|"
    r"exceed|ignor|skip|timed? ?out|no config|malform|did not claim)",
    re.IGNORECASE,
)


class BridgeChecks(Checks):
    """Checks with the programs of a build, on a bridge that has so many lanes."""

    def __init__(self, talk: Talk, build: Path, lanes: int = LANES):
        super().__init__(talk)
        self.build, self.lanes = build, range(lanes)

    def program(self, name: str) -> str:
        """Path of a program of the build."""
        return next(str(path) for path in self.build.rglob(name) if path.is_file())


def kernel_log() -> list[str]:
    """The kernel's messages since the start."""
    return command("dmesg").splitlines()


def device() -> Path | None:
    """The bridge in sysfs."""
    for vendor in Path("/sys/bus/usb/devices").glob("*/idVendor"):
        if f"{vendor.read_text().strip()}:{(vendor.parent / 'idProduct').read_text().strip()}" == IDENTITY:
            return vendor.parent
    return None


def await_state(there: bool) -> None:
    """Until the bridge is there, with its hidraw node, or gone."""
    await_that(
        lambda: bool(device()) == there and (not there or any(Path("/sys/class/hidraw").glob("*"))),
        f"the bridge is not {'there' if there else 'gone'}",
    )


# ------------------------------------------------------------------------------------------------------------- checks


def enumerates(_: Checks) -> str:
    """The kernel finds the device at its speed and binds its HID driver."""
    await_state(True)
    product, speed = ((device() / name).read_text().strip() for name in ("product", "speed"))
    driver = (next(device().glob("*:1.1")) / "driver").resolve().name
    require(speed == SPEEDS[product], f"speed {speed} Mbit/s, not {SPEEDS[product]}")
    require(driver == "usbhid", f"driver {driver}, not usbhid")
    return (
        f"{product} at {speed} Mbit/s, {driver} bound, Linux {Path('/proc/sys/kernel/osrelease').read_text().strip()}"
    )


def lsusb(_: Checks) -> str:
    """`lsusb -v` reads every descriptor, the HID report descriptor's place included.

    Classes by number (255: vendor specific, 3: HID): their names come from udev's database, which not every system has.
    """
    done = subprocess.run(["lsusb", "-v", "-d", IDENTITY], capture_output=True, text=True, timeout=PROGRAM_S)
    wanted = [
        (device() / "product").read_text().strip(),
        "CrunchBot",
        "bInterfaceClass 255 ",
        "bInterfaceClass 3 ",
        "HID Device Descriptor",
    ]
    wanted += ["EP 1 IN", "EP 2 IN", "Binary Object Store Descriptor", MICROSOFT_OS_20]
    reported = re.sub(r" +", " ", done.stdout)
    missing = [text for text in wanted if text not in reported]
    require(done.returncode == 0 and not missing, f"exit code {done.returncode}, missing: {', '.join(missing)}")
    return f"{len(done.stdout.splitlines())} lines"


def libusb_stream(checks: BridgeChecks) -> str:
    """A libusb program streams; every frame's sequence, tick and CRCs are checked."""
    return command(checks.program("kernel_usb_probe"), "stream", str(SHORT_RUN_FRAMES)).strip()


def libusb_stall(checks: BridgeChecks) -> str:
    """Unknown and refused requests end with EPIPE, and the next is served."""
    return command(checks.program("kernel_usb_probe"), "stall").strip() + " after two stalls"


def libusb_cancel(checks: BridgeChecks) -> str:
    """Waiting transfers can be cancelled and time out."""
    return command(checks.program("kernel_usb_probe"), "cancel").strip() + " after cancelled transfers"


def libusb_reset(checks: BridgeChecks) -> str:
    """A reset in the midst of a run."""
    return command(checks.program("kernel_usb_probe"), "reset").strip() + " after a reset"


def libusb_halt(checks: BridgeChecks) -> str:
    """SET_FEATURE and CLEAR_FEATURE of the endpoint's halt, and SET_INTERFACE, in the midst of a run: no frame lost, none twice."""
    return command(checks.program("kernel_usb_probe"), "halt").strip() + " through a halt and a SET_INTERFACE"


class UsbTest(ctypes.Structure):
    """struct usbtest_param_64 of the kernel's drivers/usb/misc/usbtest.c."""

    _fields_ = [(name, ctypes.c_uint32) for name in ("test", "iterations", "length", "vary", "sglen")]
    _fields_ += [("seconds", ctypes.c_int64), ("microseconds", ctypes.c_int64)]


class UsbIoctl(ctypes.Structure):
    """struct usbdevfs_ioctl of linux/usbdevice_fs.h."""

    _fields_ = [("interface", ctypes.c_int), ("code", ctypes.c_int), ("data", ctypes.c_void_p)]


def request_code(number: int, structure: type) -> int:
    """_IOWR('U', number, structure), as C's int has it."""
    return 3 << 30 | ctypes.sizeof(structure) << 16 | ord("U") << 8 | number


def system_call(number: int, *arguments) -> None:
    """OSError if it fails; Python has no function for those about modules."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.syscall(number, *arguments) < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


@contextmanager
def usbtest_driver():
    """The kernel's usbtest, asked to take this bridge: it binds to the frames' interface, which has no driver."""
    release = Path("/proc/sys/kernel/osrelease").read_text().strip()
    module = ROOT / f"build/kernel/debian/root/lib/modules/{release}/kernel/drivers/usb/misc/usbtest.ko"
    vendor, product = (LIMITS[f"usb_{name}_id"] for name in ("vendor", "product"))
    with module.open("rb") as file:
        system_call(FINIT_MODULE, file.fileno(), f"vendor={vendor} product={product}".encode(), 0)
    try:
        yield
    finally:
        system_call(DELETE_MODULE, b"usbtest", 0)


def usbtest(_: Checks) -> str:
    """The kernel's own usbtest: case 9, chapter 9 requests, and 10, many control requests queued at once."""
    interface = LIMITS["usb_bulk_interface"]
    node = "/dev/bus/usb/{:03d}/{:03d}".format(*(int((device() / name).read_text()) for name in ("busnum", "devnum")))
    with usbtest_driver(), open(node, "r+b", buffering=0) as file:
        await_that((device() / f"{device().name}:1.{interface}/driver").exists, "usbtest did not take the interface")
        for case in (9, 10):
            test = UsbTest(case, USBTEST_TIMES, 0, 0, USBTEST_QUEUED)
            job = UsbIoctl(interface, ctypes.c_int(request_code(100, UsbTest)).value, ctypes.addressof(test))
            fcntl.ioctl(file, request_code(18, UsbIoctl), job)
    return f"cases 9 and 10, {USBTEST_TIMES} times each"


def hidapi_hidraw(checks: BridgeChecks) -> None:
    """Feature reports through the kernel's hidraw."""
    await_state(True)
    command(checks.program("kernel_hid_probe_hidraw"))


def hidapi_libusb(checks: BridgeChecks) -> None:
    """The same through libusb; the kernel's driver comes back afterwards."""
    command(checks.program("kernel_hid_probe_libusb"))
    await_state(True)


def pyusb(_: Checks) -> str:
    """pyusb in a process of its own: the guest has no udevd, so libusb sees what was plugged before its start only."""
    reported = command(sys.executable, __file__, PYUSB).strip()
    await_state(True)
    return reported


def pyusb_session() -> str:
    """Strings, a stalled request, a time-out, and a run through pyusb."""
    import usb.core

    bridge = usb.core.find(idVendor=LIMITS["usb_vendor_id"], idProduct=LIMITS["usb_product_id"])
    bridge.default_timeout = PROGRAM_S * 1000  # a second, as by default, may be too short for an emulated guest
    names = f"{bridge.manufacturer}, {bridge.product}, serial number {bridge.serial_number}"
    # lsusb asks devices of USB 2.00 for it, not those of 2.01 (table 9-8 is the same for both)
    require(bytes(bridge.ctrl_transfer(0x80, 6, 0x0600, 0, 10))[:4] == bytes([10, 6, 1, 2]), "no device qualifier")
    with control_of(bridge) as run:
        expect_usb_error(usb.core.USBError, lambda: bridge.ctrl_transfer(0xC0, 0x55, 0, 0, 8))
        expect_usb_error(usb.core.USBTimeoutError, lambda: bridge.read(LIMITS["usb_bulk_in"], 512, 100))
        frames = pyusb_run(bridge, run)
    return f"{names}; {frames} frames"


def expect_usb_error(kind: type, attempt: Callable) -> None:
    """The attempt must fail so."""
    try:
        attempt()
    except kind:
        return
    raise CheckError(f"no {kind.__name__} where one was due")


@contextmanager
def control_of(bridge):
    """A function that starts (1) and stops (0) the run; the HID interface is the kernel's again afterwards."""
    import usb.util

    control, hid = REPORTS["control"], LIMITS["usb_hid_interface"]
    settings = {"id": control.id, "wire_version": WIRE_VERSION, "lane_mask": (1 << LIMITS["lanes"]) - 1}
    settings |= {"sck_divider": 6, "word_gap": 30, "sample_point": 5, "tick_period": LIMITS["tick_period"]}

    def run(on: int) -> None:
        report = control.pack(run=on, **settings)
        bridge.ctrl_transfer(0x21, 0x09, 0x0300 | control.id, hid, report, PROGRAM_S * 1000)

    bridge.detach_kernel_driver(hid)
    try:
        yield run
    finally:
        usb.util.dispose_resources(bridge)
        bridge.attach_kernel_driver(hid)


def pyusb_run(bridge, run: Callable) -> int:
    """Start, read, stop; the number of frames."""
    run(1)
    taken = len(bridge.read(LIMITS["usb_bulk_in"], 512 * 64, PROGRAM_S * 1000))
    run(0)
    data = bridge.read(LIMITS["usb_bulk_in"], 512 * 64, PROGRAM_S * 1000)
    require(data[-256 + 3] & 1, "the last frame is not marked as the last")
    return (taken + len(data)) // 256


@contextmanager
def daemon(checks: BridgeChecks):
    """whiskerd on the bridge, stopped as a service manager stops it."""
    mask = str((1 << len(checks.lanes)) - 1)
    words = [checks.program("whiskerd"), "--ring", RING, "--wait", "--lane-mask", mask, *LINK]
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.terminate()
            _, reported = process.communicate(timeout=PLUG_S)
    require(process.returncode == 0, f"whiskerd: exit code {process.returncode}: {reported.strip().splitlines()[-1:]}")


def read_ring(checks: BridgeChecks, frames: int, cuts: int = 0, at_first_thousand: Callable = lambda: None) -> str:
    """A reader's own account of so many frames, every one in its place."""
    words = [checks.program("kernel_ring_probe"), RING, str(frames), str(cuts), FRAMES_FILE.format(frames)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as reader:
        line = ""
        for line in reader.stdout:
            if line.strip() == "1000":
                at_first_thousand()
            checks.talk.say("note", f"{line.strip()} frames read" if line.strip().isdigit() else "reader done")
        complaint = reader.stderr.read()
    require(reader.returncode == 0, complaint.strip())
    return line.strip()


def daemon_long(checks: BridgeChecks) -> str:
    """whiskerd and a reader of its ring for the long run."""
    with daemon(checks):
        return read_ring(checks, LONG_RUN_FRAMES)


def daemon_short(checks: BridgeChecks) -> str:
    """The same, short."""
    with daemon(checks):
        return read_ring(checks, SHORT_RUN_FRAMES)


def replug(checks: BridgeChecks) -> str:
    """The cable is pulled while whiskerd runs; it goes on when the bridge is back."""

    def pull_and_plug() -> None:
        usbip_detach(checks)
        usbip_attach(checks)

    with daemon(checks):
        return read_ring(checks, 2 * SHORT_RUN_FRAMES, 1, pull_and_plug) + ", unplugged and replugged once"


def no_complaint(_: Checks) -> str:
    """The kernel had nothing to say against the device."""
    said = [line for line in kernel_log() if COMPLAINT.search(line)]
    require(not said, "; ".join(said[:8]))
    return "nothing in the kernel's log"


def usbip_attach(checks: BridgeChecks, which: str = "usbip") -> str:
    """`usbip list` and `usbip attach`, as in the README."""
    port = checks.talk.ask(which)
    listed = command("usbip", "--tcp-port", port, "list", "-r", HOST)
    require(IDENTITY in listed, f"not in the list: {listed}")
    attach(port)
    await_state(True)
    return "listed and attached"


def usbip_detach(_: Checks) -> str:
    """`usbip detach` unplugs it."""
    detach()
    await_state(False)
    return "detached"


def free_attach(checks: BridgeChecks) -> str:
    """The bridge whose ticks are its own divider's."""
    return usbip_attach(checks, "free")


def free_run(_: Checks) -> str:
    """Frames of a bridge on its own divider, each dated by the host's start-of-frame packets."""
    reported = command(sys.executable, __file__, FREE).strip()
    await_state(True)
    return reported


def free_session() -> str:
    """Read frames: every tick comes, and its SYNC is four microframes after the one before, give or take one."""
    import usb.core

    bridge = usb.core.find(idVendor=LIMITS["usb_vendor_id"], idProduct=LIMITS["usb_product_id"])
    bridge.default_timeout = PROGRAM_S * 1000
    data = b""
    with control_of(bridge) as run:
        run(1)
        while len(data) < FREE_FRAMES * FRAME_BYTES:
            data += bytes(bridge.read(LIMITS["usb_bulk_in"], 512 * 8, PROGRAM_S * 1000))
        run(0)
        while not data[-FRAME_BYTES + 3] & 1:
            data += bytes(bridge.read(LIMITS["usb_bulk_in"], 512 * 8, PROGRAM_S * 1000))
    frames = [decode_frame(data[at : at + FRAME_BYTES])[0] for at in range(0, len(data), FRAME_BYTES)]
    require([frame["tick"] for frame in frames] == list(range(len(frames))), "a tick is missing")
    times = [frame["usb_time"] for frame in frames]
    require(all(time >> 15 for time in times), "a frame without the host's time")
    steps = [(after - before) % MICROFRAMES for before, after in itertools.pairwise(times)]
    require(all(abs(step - PER_TICK) <= 1 for step in steps), f"SYNC comes after {sorted(set(steps))} microframes")
    require(abs(sum(steps) - PER_TICK * len(steps)) <= 1, f"{sum(steps)} microframes for {len(steps)} ticks")
    return f"{len(frames)} frames, {PER_TICK} microframes from SYNC to SYNC"


def free_daemon(checks: BridgeChecks) -> str:
    """whiskerd on it, with a reader of its ring."""
    with daemon(checks):
        return read_ring(checks, FREE_FRAMES)


def readings(checks: BridgeChecks) -> str:
    """Every reading that readers of the ring got is what the sensor's model logged of its tick."""
    log = Log(Path(checks.talk.ask("log")))
    files = [Path(FRAMES_FILE.format(frames)) for frames in (SHORT_RUN_FRAMES, 2 * SHORT_RUN_FRAMES, LONG_RUN_FRAMES)]
    compared = []
    for file in files:
        rows = KEPT.iter_unpack(file.read_bytes())
        frames = ((tick, [lanes[at : at + 3] for at in range(0, len(lanes), 4)]) for tick, *lanes in rows)
        compared.append(log.compare(frames, checks.lanes))
    return f"{' + '.join(map(str, compared))} readings"


def pico(talk: Talk) -> None:
    """The checks of the Pico, whose sensors have logged what they showed."""
    checks = BridgeChecks(talk, Path(sys.argv[1]), PICO_LANES)
    # A reset comes after those that leave frames unread.
    for check in (usbip_attach, enumerates, lsusb, usbtest, hidapi_hidraw, hidapi_libusb, libusb_reset, libusb_stream):
        checks.run(f"pico {check.__name__.removeprefix('usbip_')}", check)
    for check in (libusb_stall, libusb_halt, libusb_cancel, daemon_short, replug, daemon_long, readings, usbip_detach):
        checks.run(f"pico {check.__name__.removeprefix('usbip_')}", check)
    checks.run("pico no_complaint", no_complaint)


def bridge(talk: Talk) -> None:
    """The checks of the Verilated bridges."""
    checks = BridgeChecks(talk, Path(sys.argv[1]))
    for check in (usbip_attach, enumerates, lsusb, usbtest, libusb_stream, libusb_stall, libusb_halt, libusb_cancel):
        checks.run(check.__name__.removeprefix("usbip_"), check)
    for check in (libusb_reset, hidapi_hidraw, hidapi_libusb, pyusb, daemon_short, replug, daemon_long, usbip_detach):
        checks.run(check.__name__.removeprefix("usbip_"), check)
    checks.run("attach again", usbip_attach)
    checks.run("stream again", libusb_stream)
    checks.run("detach again", usbip_detach)
    for check in (free_attach, enumerates, free_run, free_daemon):
        checks.run(f"free {check.__name__.removeprefix('free_')}", check)
    checks.run("no_complaint", no_complaint)


def main() -> None:
    """All checks of a guest over USB/IP."""
    talk = Talk()
    pico(talk) if sys.argv[2] == "pico" else bridge(talk)
    for line in kernel_log():
        talk.say("log", line)
    talk.say("end")


if __name__ == "__main__":
    if sys.argv[1] in (PYUSB, FREE):
        print(pyusb_session() if sys.argv[1] == PYUSB else free_session())
    else:
        main()
