"""The requests of USB 2.0 chapter 9 (section 9.4, table 9-3) on the control endpoint, each in each state.

Decided when the SETUP packet arrives: what is not served is refused (STALL) at the first stage after it. What a request
changes is changed once, when the host asks for the status the first time, so a lost ACK changes nothing more. The address
alone waits for the host's ACK, or for a token to the new address should the ACK have been lost (section 9.4.6).
"""

from amaranth import Array, Cat, Module, Mux, Signal
from luna.gateware.usb.request.control import ControlRequestHandler
from luna.gateware.usb.usb2.descriptor import GetDescriptorHandlerBlock
from usb_protocol.types import USBRequestRecipient, USBRequestType

GET_STATUS, CLEAR_FEATURE, SET_FEATURE, SET_ADDRESS = 0, 1, 3, 5
GET_DESCRIPTOR, GET_CONFIGURATION, SET_CONFIGURATION, GET_INTERFACE, SET_INTERFACE = 6, 8, 9, 10, 11
ENDPOINT_HALT = 0
DEVICE, CONFIGURATION, STRING, QUALIFIER, OTHER_SPEED, BOS = 1, 2, 3, 6, 7, 15  # descriptor types; table 9-5
HID, REPORT = 0x21, 0x22  # HID 1.11 section 7.1
OF_DEVICE = (DEVICE, CONFIGURATION, STRING, QUALIFIER, OTHER_SPEED, BOS)
OF_INTERFACE = (HID, REPORT)
# Where the descriptors of the other speed lie in the ROM: types nobody can ask for.
CONFIGURATION_AT_FULL_SPEED, OTHER_SPEED_AT_FULL_SPEED, WINDOWS_SET = 8, 9, 10
WINDOWS_REQUEST = 0x20  # bRequest by which Windows asks for its descriptor set; the BOS descriptor names it
WINDOWS_INDEX = 7  # wIndex of that request: MS_OS_20_DESCRIPTOR_INDEX
PACKET = 64  # bytes of the control endpoint
DIGITS = 16  # of the serial number


class Kind:
    """What a request wants; one bit each, none: refused."""

    ANSWER, DESCRIPTOR, SERIAL, ADDRESS, CONFIGURE, HALT, UNHALT = (1 << i for i in range(7))
    COUNT = 7


class StandardRequests(ControlRequestHandler):
    """
    serial_index: of the serial number's string; in_endpoints: addresses of the IN endpoints; interfaces: how many;
    hid_interface: which of them is HID.

        full_speed               in: the bus runs at full speed
        self_powered             in: what GET_STATUS reports of the device
        serial                   in: serial number, shown as 16 hexadecimal digits; 0: the text among the descriptors
        address                  in: the device's, 0 in the default state
        other_token, other_address   in: strobe and address of any token on the bus, whomever it is for
        halt, unhalt             out: strobes per IN endpoint, in the order of in_endpoints; unhalt resets the toggle
        halted                   in: per IN endpoint
    """

    def __init__(self, descriptors, serial_index, in_endpoints, interfaces, hid_interface):
        super().__init__()
        self._serial_index = serial_index
        self.serial = Signal(64)
        self.self_powered = Signal()
        self._descriptors = descriptors
        self._endpoints = in_endpoints
        self._interfaces = interfaces
        self._hid = hid_interface
        self.full_speed = Signal()
        self.address = Signal(7)
        self.other_token = Signal()
        self.other_address = Signal(7)
        self.halt = Signal(len(in_endpoints))
        self.unhalt = Signal(len(in_endpoints))
        self.halted = Signal(len(in_endpoints))

    def elaborate(self, platform):
        m = Module()
        itf = self.interface
        self.kind = Signal(Kind.COUNT)
        self.answer, self.answer_bytes = Signal(16), Signal(2)
        self.target = Signal(len(self._endpoints))  # whose halt is set or cleared
        self.done = Signal()  # the host has asked for the status
        self.refused = Signal()  # the descriptor does not exist
        self.rom_value = Signal(16)  # descriptor type and index in the ROM
        self.position = Signal(11)  # in the descriptor, of the packet to send
        self.sent = Signal()  # that packet, and not yet acknowledged
        ours = (itf.setup.type == USBRequestType.STANDARD) | (itf.setup.type == USBRequestType.VENDOR)
        asked = itf.data_requested | itf.status_requested | itf.rx_ready_for_response
        m.d.comb += itf.claim.eq(ours)
        with m.If(ours):
            with m.If((self.kind == 0) | self.refused):
                m.d.comb += itf.handshakes_out.stall.eq(asked)
            with m.Elif(self.kind == Kind.ANSWER):
                self._send_answer(m)
            with m.Elif(self.kind == Kind.DESCRIPTOR):
                self._send_descriptor(m)
            with m.Elif(self.kind == Kind.SERIAL):
                self._send_serial(m)
            with m.Else():
                self._confirm(m)
        self._change_address(m, ours)
        self._decode(m)  # last: a SETUP overrides what the request before it wants
        return m

    # ------------------------------------------------------------------------------------------------- which request

    def _decode(self, m):
        itf, setup = self.interface, self.interface.setup
        device = setup.recipient == USBRequestRecipient.DEVICE
        with m.If(setup.received):
            m.d.usb += [self.kind.eq(0), self.done.eq(0), self.refused.eq(0), itf.tx_data_pid.eq(1)]
            m.d.usb += [self.answer.eq(0), self.answer_bytes.eq(1), self.position.eq(0), self.sent.eq(0)]
            m.d.usb += self.rom_value.eq(Cat(setup.value[:8], self._place(setup.value[8:])))
            with m.If(setup.type == USBRequestType.VENDOR):
                windows = device & setup.is_in_request & (setup.index == WINDOWS_INDEX) & (setup.value == 0)
                self._serve(m, windows & (setup.request == WINDOWS_REQUEST), Kind.DESCRIPTOR)
                m.d.usb += self.rom_value.eq(WINDOWS_SET << 8)
            with m.Else(), m.Switch(setup.request):
                self._decode_device(m, device)
                self._decode_parts(m, device)

    def _place(self, kind):
        """Where the ROM has a descriptor of this type at the bus's speed."""
        slow = Mux(kind == CONFIGURATION, CONFIGURATION_AT_FULL_SPEED, OTHER_SPEED_AT_FULL_SPEED)
        return Mux(self.full_speed & ((kind == CONFIGURATION) | (kind == OTHER_SPEED)), slow, kind)

    def _decode_device(self, m, device):
        """Requests to the device as a whole, and descriptors."""
        itf, setup = self.interface, self.interface.setup
        no_index = device & (setup.index == 0)
        with m.Case(SET_ADDRESS):
            sound = self._plain() & no_index & (setup.value < 128)
            self._serve(m, sound & (itf.active_config == 0), Kind.ADDRESS)
        with m.Case(GET_DESCRIPTOR):
            hid = (setup.recipient == USBRequestRecipient.INTERFACE) & (setup.index == self._hid)
            known = (device & self._one_of(OF_DEVICE)) | (hid & self._one_of(OF_INTERFACE))
            self._serve(m, setup.is_in_request & known, Kind.DESCRIPTOR)
            is_serial = (self.serial != 0) & device & (setup.value == STRING << 8 | self._serial_index)
            self._serve(m, self._reads() & is_serial, Kind.SERIAL)
        with m.Case(GET_CONFIGURATION):
            self._serve(m, self._reads() & no_index & (setup.value == 0), Kind.ANSWER)
            m.d.usb += self.answer.eq(itf.active_config)
        with m.Case(SET_CONFIGURATION):
            sound = self._plain() & no_index & (setup.value < 2)
            self._serve(m, sound & (self.address != 0), Kind.CONFIGURE)

    def _decode_parts(self, m, device):
        """Status and features, and requests to interfaces."""
        setup = self.interface.setup
        configured = self.interface.active_config != 0
        interface = (setup.recipient == USBRequestRecipient.INTERFACE) & configured & (setup.index < self._interfaces)
        chosen = Cat(setup.index == address for address in self._endpoints)
        of_control = setup.index & 0xFF7F == 0  # endpoint 0, either direction
        known_endpoint = of_control | (configured & chosen.any())
        endpoint = (setup.recipient == USBRequestRecipient.ENDPOINT) & known_endpoint
        halt = self._plain() & endpoint & (setup.value == ENDPOINT_HALT)
        with m.Case(GET_STATUS):
            known = (device & (setup.index == 0)) | interface | endpoint
            self._serve(m, self._reads() & (setup.value == 0) & known, Kind.ANSWER)
            m.d.usb += self.answer.eq((endpoint & (chosen & self.halted).any()) | (device & self.self_powered))
            m.d.usb += self.answer_bytes.eq(Mux(setup.length == 1, 1, 2))
        with m.Case(CLEAR_FEATURE):
            self._serve(m, halt, Kind.UNHALT)
            m.d.usb += self.target.eq(chosen)
        with m.Case(SET_FEATURE):
            self._serve(m, halt, Kind.HALT)
            m.d.usb += self.target.eq(chosen)
        with m.Case(GET_INTERFACE):
            self._serve(m, self._reads() & interface & (setup.value == 0), Kind.ANSWER)
        with m.Case(SET_INTERFACE):
            # The only setting there is; its endpoint starts afresh (section 9.1.1.5).
            self._serve(m, self._plain() & interface & (setup.value == 0), Kind.UNHALT)
            m.d.usb += self.target.eq(Cat(setup.index == n for n in range(len(self._endpoints))))

    def _plain(self):
        return ~self.interface.setup.is_in_request & (self.interface.setup.length == 0)

    def _reads(self):
        return self.interface.setup.is_in_request & (self.interface.setup.length != 0)

    def _one_of(self, types):
        kind = self.interface.setup.value[8:]
        return Cat(kind == one for one in types).any()

    def _serve(self, m, condition, kind):
        with m.If(condition):
            m.d.usb += self.kind.eq(kind)

    # --------------------------------------------------------------------------------------------------- its answer

    def _send_answer(self, m):
        """Data stage of one or two bytes, again from the first whenever it is asked for. Status stage: ACK."""
        itf = self.interface
        left, first = Signal(2), Signal()
        m.d.comb += [
            itf.tx.valid.eq(left != 0),
            itf.tx.first.eq((left != 0) & first),
            itf.tx.last.eq(left == 1),
            itf.tx.payload.eq(Mux(first, self.answer[:8], self.answer[8:])),
            itf.handshakes_out.ack.eq(itf.status_requested),
        ]
        with m.If(itf.data_requested):
            m.d.usb += [left.eq(self.answer_bytes), first.eq(1)]
        with m.Elif((left != 0) & itf.tx.ready):
            m.d.usb += [left.eq(left - 1), first.eq(0)]

    def _send_descriptor(self, m):
        itf, setup = self.interface, self.interface.setup
        m.submodules.rom = rom = GetDescriptorHandlerBlock(self._descriptors, max_packet_length=PACKET)
        m.d.comb += [
            rom.value.eq(self.rom_value),
            rom.start_position.eq(self.position),
            rom.length.eq(setup.length),
            rom.start.eq(itf.data_requested),
            rom.tx.attach(itf.tx),
            itf.handshakes_out.stall.eq(rom.stall),
            itf.handshakes_out.ack.eq(itf.status_requested & setup.is_in_request & (setup.length != 0)),
        ]
        with m.If(itf.status_requested & (setup.length == 0)):
            m.d.comb += self.send_zlp()
        with m.If(rom.stall):
            m.d.usb += [self.sent.eq(0), self.refused.eq(1)]
        with m.Elif(itf.data_requested):
            m.d.usb += self.sent.eq(1)
        with m.Elif(itf.handshakes_in.ack & self.sent):
            m.d.usb += [self.sent.eq(0), itf.tx_data_pid.eq(~itf.tx_data_pid), self.position.eq(self.position + PACKET)]

    def _send_serial(self, m):
        """String descriptor (section 9.6.7) of the serial number: two bytes, then a digit in UTF-16 each."""
        itf, size = self.interface, 2 + 2 * DIGITS
        place, sending = Signal(range(size)), Signal()
        digits = Array(self.serial[60 - 4 * i : 64 - 4 * i] for i in range(DIGITS))
        digit = digits[(place - 2)[1:5]]
        text = Mux(place[0], 0, Mux(digit < 10, ord("0") + digit, ord("A") - 10 + digit))
        m.d.comb += [
            itf.tx.valid.eq(sending),
            itf.tx.first.eq(sending & (place == 0)),
            itf.tx.last.eq(sending & ((place == size - 1) | (place + 1 == itf.setup.length))),
            itf.tx.payload.eq(Mux(place == 0, size, Mux(place == 1, STRING, text))),
            itf.handshakes_out.ack.eq(itf.status_requested),
        ]
        with m.If(itf.data_requested):
            m.d.usb += [sending.eq(1), place.eq(0)]
        with m.Elif(sending & itf.tx.ready):
            m.d.usb += [sending.eq(~itf.tx.last), place.eq(place + 1)]

    def _confirm(self, m):
        """Status stage of a request without data: an empty packet; what it changes changes at the first one."""
        itf = self.interface
        with m.If(itf.status_requested):
            m.d.comb += self.send_zlp()
            m.d.usb += self.done.eq(1)
        first = itf.status_requested & ~self.done
        m.d.comb += [
            itf.new_config.eq(itf.setup.value[:8]),
            itf.config_changed.eq(first & (self.kind == Kind.CONFIGURE)),
            self.halt.eq(Mux(first & (self.kind == Kind.HALT), self.target, 0)),
            self.unhalt.eq(Mux(first & (self.kind == Kind.UNHALT), self.target, 0)),
        ]

    def _change_address(self, m, ours):
        itf = self.interface
        waiting = Signal()  # the status was given; was it heard?
        is_address = ours & (self.kind == Kind.ADDRESS)
        of_other = self.other_token & (self.other_address == itf.setup.value[:7])
        m.d.comb += [
            itf.new_address.eq(itf.setup.value[:7]),
            itf.address_changed.eq(waiting & (itf.handshakes_in.ack | of_other)),
        ]
        with m.If(is_address & itf.status_requested):
            m.d.usb += waiting.eq(1)
        with m.Elif(itf.address_changed | itf.setup.received):
            m.d.usb += waiting.eq(0)
