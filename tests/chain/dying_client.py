"""A client of the simulated bridge, by umockdev's own words, that claims an interface and ends before it has the answer.

What a process does that is killed at the worst moment, each time: an answer cannot be written to it. Run inside the simulation.
"""

import os
import socket
import struct

CLAIM_INTERFACE = 0x8004550F  # linux/usbdevice_fs.h
IOCTL, READ_MEMORY = 1, 5  # as libumockdev-preload numbers them
WORDS = struct.Struct("<3Q")  # which of them; request or address; argument or length
ADDRESS = 4096  # of the argument; nothing is there
INTERFACE = struct.pack("<I", 0)


def main() -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as link:
        link.connect(os.environ["UMOCKDEV_DIR"] + "/ioctl/dev/bus/usb/001/002")
        link.sendall(WORDS.pack(IOCTL, CLAIM_INTERFACE, ADDRESS))
        assert WORDS.unpack(link.recv(WORDS.size, socket.MSG_WAITALL)) == (READ_MEMORY, ADDRESS, len(INTERFACE))
        link.shutdown(socket.SHUT_RD)
        link.sendall(INTERFACE)
        link.shutdown(socket.SHUT_WR)


if __name__ == "__main__":
    main()
