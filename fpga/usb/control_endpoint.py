"""Endpoint 0 with LUNA's interfaces and its own state machine (USB 2.0 section 8.5.3); takes the place of LUNA's.

LUNA's own answers a SETUP to any endpoint, takes data that no token announced, waits for a damaged SETUP's data until the
next token has gone unanswered, and leaves the data stage at an OUT token whose data never comes.
"""

from amaranth import Cat, Elaboratable, Module, ResetInserter, Signal
from luna.gateware.usb.usb2.endpoint import EndpointInterface
from luna.gateware.usb.usb2.request import RequestHandlerInterface, USBRequestHandlerMultiplexer

SETUP_BYTES = 8


class StallEverything(Elaboratable):
    """Refuses at whatever stage a request is refused: what no handler claims ends here (USB 2.0 section 9.2.7)."""

    def __init__(self):
        self.interface = RequestHandlerInterface()

    def elaborate(self, platform):
        m = Module()
        itf = self.interface
        asked = itf.data_requested | itf.status_requested | itf.rx_ready_for_response
        m.d.comb += itf.handshakes_out.stall.eq(asked)
        return m


class _Control(Elaboratable):
    """The state machine; ControlEndpoint resets it with the bus."""

    def __init__(self, utmi, handlers):
        self.utmi, self.handlers = utmi, handlers
        self.interface = EndpointInterface()

    def elaborate(self, platform):
        m = Module()
        m.submodules.mux = mux = USBRequestHandlerMultiplexer()
        m.submodules.refusal = refusal = StallEverything()
        mux.set_fallback_interface(refusal.interface)
        for number, handler in enumerate(self.handlers):
            m.submodules[f"handler_{number}"] = handler
            mux.add_interface(handler.interface)
        request = mux.shared
        self._connect(m, request)
        announced = self._announced(m)
        received = self._gather_setup(m, request.setup, announced)
        self._stages(m, request, announced, received)
        return m

    def _connect(self, m, request):
        itf = self.interface
        m.d.comb += [
            itf.tokenizer.connect(request.tokenizer),
            request.tx.attach(itf.tx),
            itf.tx_pid_toggle.eq(request.tx_data_pid),
            itf.handshakes_out.nak.eq(request.handshakes_out.nak),
            itf.handshakes_in.connect(request.handshakes_in),
            itf.address_changed.eq(request.address_changed),
            itf.new_address.eq(request.new_address),
            itf.clear_endpoint_halt_out.eq(request.clear_endpoint_halt),
            request.active_config.eq(itf.active_config),
            itf.config_changed.eq(request.config_changed),
            itf.new_config.eq(request.new_config),
        ]

    def _announced(self, m):
        """The packet on the bus is the first since an OUT or SETUP token to endpoint 0 (USB 2.0 section 8.4.6.3)."""
        token = self.interface.tokenizer
        packets = Signal(2)  # begun since the token, at most 2
        active_before = Signal()
        m.d.usb += active_before.eq(self.utmi.rx_active)
        with m.If(token.new_token):
            m.d.usb += packets.eq(0)
        with m.Elif(self.utmi.rx_active & ~active_before & ~packets[1]):
            m.d.usb += packets.eq(packets + 1)
        return (packets == 1) & (token.endpoint == 0) & (token.is_out | token.is_setup)

    def _gather_setup(self, m, setup, announced):
        """Eight bytes of DATA0 after a SETUP token are a request (USB 2.0 section 8.5.3). True in the cycle to answer."""
        itf = self.interface
        count = Signal(range(SETUP_BYTES + 2))
        byte = itf.rx.valid & itf.rx.next
        fields = Cat(setup.recipient, setup.type, setup.is_in_request, setup.request, setup.value, setup.index)
        fields = Cat(fields, setup.length)
        gathered = Signal(8 * SETUP_BYTES)
        with m.If(itf.tokenizer.new_token):
            m.d.usb += count.eq(0)
        with m.Elif(byte & (count <= SETUP_BYTES)):
            m.d.usb += [count.eq(count + 1), gathered.eq(Cat(gathered[8:], itf.rx.payload))]
        is_data0 = ~itf.rx_pid_toggle[0]
        good = announced & itf.tokenizer.is_setup & itf.rx_ready_for_response & (count == SETUP_BYTES) & is_data0
        m.d.usb += setup.received.eq(good)
        with m.If(good):
            m.d.usb += fields.eq(gathered)
        return good

    def _stages(self, m, request, announced, received):
        itf, token, setup = self.interface, self.interface.tokenizer, request.setup
        mine = token.endpoint == 0
        asked_in = mine & token.is_in & token.ready_for_response
        pinged = mine & token.is_ping & token.ready_for_response
        data_came = announced & token.is_out & itf.rx_ready_for_response
        ack, stall = Signal(), Signal()
        m.d.comb += [
            itf.handshakes_out.ack.eq(received | ack | request.handshakes_out.ack),
            itf.handshakes_out.stall.eq(stall | request.handshakes_out.stall),
        ]
        with m.FSM(domain="usb"):
            with m.State("NOTHING"):  # no request: the host's request is out of place (protocol stall, section 8.5.3.4)
                m.d.comb += stall.eq(asked_in | data_came | pinged)
                self._begin(m, setup)
            with m.State("DATA_IN"):
                m.d.comb += [request.data_requested.eq(asked_in), ack.eq(pinged)]
                m.d.comb += request.status_requested.eq(data_came)
                with m.If(data_came):
                    m.next = "STATUS_OUT"
                self._begin(m, setup)
            with m.State("DATA_OUT"):
                with m.If(announced & token.is_out):
                    m.d.comb += [itf.rx.connect(request.rx), request.rx_invalid.eq(itf.rx_invalid)]
                m.d.comb += [request.rx_ready_for_response.eq(data_came), ack.eq(pinged)]
                m.d.comb += request.status_requested.eq(asked_in)
                with m.If(asked_in):
                    m.next = "STATUS_IN"
                self._begin(m, setup)
            with m.State("STATUS_IN"):
                m.d.comb += [request.status_requested.eq(asked_in), stall.eq(data_came | pinged)]
                self._begin(m, setup)
            with m.State("STATUS_OUT"):
                m.d.comb += [request.status_requested.eq(data_came), ack.eq(pinged), stall.eq(asked_in)]
                self._begin(m, setup)

    def _begin(self, m, setup):
        """A SETUP begins a new request whatever became of the one before; its token alone already ends that."""
        token = self.interface.tokenizer
        with m.If(token.new_token & token.is_setup & (token.endpoint == 0)):
            m.next = "NOTHING"
        with m.If(setup.received):
            with m.If(setup.length == 0):
                m.next = "STATUS_IN"
            with m.Elif(setup.is_in_request):
                m.next = "DATA_IN"
            with m.Else():
                m.next = "DATA_OUT"


class ControlEndpoint(Elaboratable):
    """Endpoint 0: `add_request_handler` before elaboration; while `reset` is high no request is in progress."""

    def __init__(self, utmi):
        self._handlers = []
        self._inner = _Control(utmi, self._handlers)
        self.interface = self._inner.interface
        self.reset = Signal()

    def add_request_handler(self, handler) -> None:
        """A handler with LUNA's RequestHandlerInterface; the first that claims a request serves it."""
        self._handlers.append(handler)

    def elaborate(self, platform):
        return ResetInserter({"usb": self.reset})(self._inner)
