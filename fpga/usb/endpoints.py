"""The endpoints besides endpoint 0: LUNA's parts with the resets and the halt they lack, added from outside."""

from amaranth import Cat, Elaboratable, Module, Mux, ResetInserter, Signal
from luna.gateware.usb.usb2.endpoint import EndpointInterface
from luna.gateware.usb.usb2.endpoints.stream import USBStreamInEndpoint


class InEndpoint(Elaboratable):
    """What every IN endpoint does: silent until configured, STALL while halted (USB 2.0 sections 9.1.1.5 and 9.4.9).

    restart     in: as new (bus reset, SET_CONFIGURATION)
    halt        in: strobe, SET_FEATURE(ENDPOINT_HALT)
    unhalt      in: strobe, CLEAR_FEATURE(ENDPOINT_HALT) or SET_INTERFACE: the next packet is DATA0
    halted      out
    """

    def __init__(self, endpoint_number: int):
        self._number = endpoint_number
        self.interface = EndpointInterface()
        self.restart = Signal()
        self.halt = Signal()
        self.unhalt = Signal()
        self.halted = Signal()

    def _guard(self, m):
        """An IN token to this endpoint that it may serve, in the cycle of the answer."""
        itf, token = self.interface, self.interface.tokenizer
        asked = token.is_in & token.ready_for_response & (token.endpoint == self._number) & (itf.active_config != 0)
        with m.If(self.restart | self.unhalt):
            m.d.usb += self.halted.eq(0)
        with m.Elif(self.halt):
            m.d.usb += self.halted.eq(1)
        m.d.comb += itf.handshakes_out.stall.eq(asked & self.halted)
        return asked & ~self.halted


class FrameEndpoint(InEndpoint):
    """Bulk IN endpoint with packets of one size at high speed, another at full speed (USB 2.0 section 5.8.3).

    Two of LUNA's endpoints, one in use. LUNA resets the toggle only at CLEAR_FEATURE(ENDPOINT_HALT), and not if a packet
    fills in that very cycle; it never empties the buffers, so after a bus reset or a SET_CONFIGURATION the host would
    drop the first packet or see stale frames.
    """

    def __init__(self, *, endpoint_number: int, max_packet_size: int, full_speed_packet: int = 64):
        super().__init__(endpoint_number)
        sizes = (max_packet_size, full_speed_packet)
        self._inner = [USBStreamInEndpoint(endpoint_number=endpoint_number, max_packet_size=n) for n in sizes]
        self.stream = type(self._inner[0].stream)()
        self.full_speed = Signal()

    def elaborate(self, platform):
        m = Module()
        asked = self._guard(m)
        itf = self.interface
        for at_full_speed, inner in enumerate(self._inner):
            m.submodules[f"inner_{at_full_speed}"] = ResetInserter({"usb": self.restart})(inner)
            self._connect(m, inner, self.full_speed == at_full_speed, asked)
        fast, slow = (inner.interface for inner in self._inner)
        for name in ("valid", "first", "last", "payload"):
            m.d.comb += itf.tx[name].eq(Mux(self.full_speed, slow.tx[name], fast.tx[name]))
        m.d.comb += [
            itf.tx_pid_toggle.eq(Mux(self.full_speed, slow.tx_pid_toggle, fast.tx_pid_toggle)),
            itf.handshakes_out.nak.eq(fast.handshakes_out.nak | slow.handshakes_out.nak),
            self.stream.ready.eq(
                Mux(self.full_speed, self._inner[1].stream.ready, self._inner[0].stream.ready) & ~self.unhalt
            ),
        ]
        return m

    def _connect(self, m, inner, chosen, asked):
        itf, bus, token = self.interface, inner.interface, self.interface.tokenizer
        m.d.comb += [
            bus.tokenizer.endpoint.eq(token.endpoint),
            bus.tokenizer.is_in.eq(token.is_in),
            bus.tokenizer.new_token.eq(token.new_token),
            bus.tokenizer.ready_for_response.eq(asked & chosen),
            bus.handshakes_in.ack.eq(itf.handshakes_in.ack & chosen),
            bus.tx.ready.eq(itf.tx.ready & chosen),
            bus.clear_endpoint_halt_in.enable.eq(self.unhalt),
            bus.clear_endpoint_halt_in.direction.eq(1),
            bus.clear_endpoint_halt_in.number.eq(self._number),
            inner.stream.valid.eq(self.stream.valid & chosen & ~self.unhalt),
            inner.stream.last.eq(self.stream.last),
            inner.stream.payload.eq(self.stream.payload),
        ]


class SilentEndpoint(InEndpoint):
    """IN endpoint that has nothing to say: NAK to every IN token."""

    def __init__(self, *, endpoint_number: int):
        super().__init__(endpoint_number)

    def elaborate(self, platform):
        m = Module()
        m.d.comb += self.interface.handshakes_out.nak.eq(self._guard(m))
        return m


def strobes(endpoints, name: str):
    """The named signal of each endpoint, lowest bit first."""
    return Cat(getattr(endpoint, name) for endpoint in endpoints)
