"""How long the bridge takes, in cycles of its clock: node_link's windows, and framer's way to the first byte for USB.

The bench of the whole bridge holds the Verilog to these; tools/benches bridge makes figures of them.
"""

RECORD_BITS, SERVICE_BITS, WORD_BITS = 64, 480, 16  # on each lane
SETUP, HOLD = 9, 4  # select low before the first edge of SCK and after the last
PAUSE = 2400  # between a tick's two windows
FRAMER = 5  # start, output register, FIFO's memory and its output register


def window(bits: int, divider: int, gap: int) -> int:
    """Select low: set-up, bits, gaps between words, hold."""
    return SETUP + bits * divider + (bits // WORD_BITS - 1) * gap + HOLD


def transfer(divider: int, gap: int) -> int:
    """One tick's records, from the rise of SYNC, which stays high for one gap."""
    return gap + window(RECORD_BITS, divider, gap)


def service(divider: int, gap: int) -> int:
    """The window that may follow: a pause, then its bytes."""
    return PAUSE + window(SERVICE_BITS, divider, gap)
