"""LUNA's parts with the resets they lack, added from outside: no line of LUNA is changed."""

from amaranth import Elaboratable, Module, ResetInserter, Signal
from luna.gateware.usb.request.standard import StandardRequestHandler
from luna.gateware.usb.usb2.endpoint import EndpointInterface
from luna.gateware.usb.usb2.endpoints.stream import USBStreamInEndpoint


class FrameEndpoint(Elaboratable):
    """Bulk IN endpoint that starts afresh (data toggle DATA0, both packet buffers empty) while `restart` is high.

    LUNA resets the toggle only at CLEAR_FEATURE(ENDPOINT_HALT) and never empties the buffers, so after a bus reset or a
    SET_CONFIGURATION (USB 2.0 section 9.1.1.5) the host would drop the first packet or see stale frames.
    """

    def __init__(self, *, endpoint_number: int, max_packet_size: int):
        self._inner = USBStreamInEndpoint(endpoint_number=endpoint_number, max_packet_size=max_packet_size)
        self.stream = self._inner.stream
        self.interface = self._inner.interface
        self.restart = Signal()

    def elaborate(self, platform):
        return ResetInserter({"usb": self.restart})(self._inner)


class StandardRequests(Elaboratable):
    """LUNA's chapter 9 requests, starting afresh at each SETUP token.

    On its own the handler waits for the end of a request for ever: when a host gives a request up, the next SETUP would
    be taken for a part of it (USB 2.0 section 8.5.3: a SETUP always begins a new transfer).
    """

    def __init__(self, descriptors):
        self._inner = StandardRequestHandler(descriptors)
        self.interface = self._inner.interface

    def elaborate(self, platform):
        token = self.interface.tokenizer
        return ResetInserter({"usb": token.new_token & token.is_setup})(self._inner)


class SilentEndpoint(Elaboratable):
    """IN endpoint that has nothing to say: NAK to every IN token."""

    def __init__(self, *, endpoint_number: int):
        self._number = endpoint_number
        self.interface = EndpointInterface()

    def elaborate(self, platform):
        m = Module()
        token = self.interface.tokenizer
        m.d.comb += self.interface.handshakes_out.nak.eq(
            token.is_in & token.ready_for_response & (token.endpoint == self._number)
        )
        return m
