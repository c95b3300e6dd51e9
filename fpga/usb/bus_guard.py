"""Between the PHY and LUNA: two things LUNA takes from the bus that it should not."""

from amaranth import Elaboratable, Module, Mux, Signal

ACK, DATA = 0x2, 0b11  # low nibble, low two bits of a packet identifier; USB 2.0 table 8-1
SE0, J, K = 0, 1, 2
# From our last byte into the PHY to its rx_active: at full speed two bytes in the PHY, 18 bit times (USB 2.0 section
# 7.1.19.1) and a synchronisation pattern, 225 cycles; 102 and the PHY's own at high speed (7.1.19.2).
HANDSHAKE_CYCLES = 300


class BusGuard(Elaboratable):
    """
    An ACK counts only after a data packet of ours, as the next packet, in time (USB 2.0 section 8.7.2). LUNA takes any:
    when our data is lost and the host goes on to acknowledge another device's, a frame would be gone for good.

    The end of a resume is the end of K (section 7.1.7.7). LUNA enters high speed when K begins, 20 ms too soon.

        rx_active, rx_valid, rx_data, tx_valid, tx_data, line_state    in: the PHY's, and ours
        suspended                                                      in
        valid, line                                                    out: to LUNA in place of rx_valid, line_state
    """

    def __init__(self):
        self.rx_active = Signal()
        self.rx_valid = Signal()
        self.rx_data = Signal(8)
        self.tx_valid = Signal()
        self.tx_data = Signal(8)
        self.line_state = Signal(2)
        self.suspended = Signal()
        self.valid = Signal()
        self.line = Signal(2)

    def elaborate(self, platform):
        m = Module()
        self._acknowledge(m)
        self._resume(m)
        return m

    def _acknowledge(self, m):
        sending, is_data = Signal(), Signal()
        left = Signal(range(HANDSHAKE_CYCLES + 1))  # cycles in which a handshake may begin
        inside, ignored, due = Signal(), Signal(), Signal()
        m.d.usb += sending.eq(self.tx_valid)
        with m.If(self.tx_valid & ~sending):
            m.d.usb += is_data.eq(self.tx_data[:2] == DATA)
        with m.If(self.tx_valid):
            m.d.usb += left.eq(HANDSHAKE_CYCLES)
        with m.Elif(left != 0):
            m.d.usb += left.eq(left - 1)
        with m.If(~self.rx_active):
            m.d.usb += [inside.eq(0), ignored.eq(0), due.eq(is_data & (left != 0) & ~sending)]
            with m.If(inside):
                m.d.usb += left.eq(0)
        with m.Elif(self.rx_valid & ~inside):
            m.d.usb += [inside.eq(1), ignored.eq((self.rx_data[:4] == ACK) & ~due)]
        first = ~inside & (self.rx_data[:4] == ACK) & ~due
        m.d.comb += self.valid.eq(self.rx_valid & ~ignored & ~first)

    def _resume(self, m):
        resuming = Signal()
        driven = self.line_state == K
        m.d.usb += resuming.eq(self.suspended & (driven | resuming))
        with m.If(self.suspended & driven):
            m.d.comb += self.line.eq(J)
        with m.Else():
            m.d.comb += self.line.eq(Mux(self.suspended & resuming, K, self.line_state))
