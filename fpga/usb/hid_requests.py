"""HID class requests on the control endpoint: feature reports in and out of the bridge's registers."""

from amaranth import Module, Mux, Signal
from luna.gateware.usb.request.control import ControlRequestHandler
from usb_protocol.types import USBRequestRecipient, USBRequestType

from whisker_protocol import LIMITS, REPORTS

GET_REPORT = 0x01
SET_REPORT = 0x09
GET_IDLE = 0x02
SET_IDLE = 0x0A
FEATURE = 3  # report type in the high byte of wValue
PACKET = 64  # bytes of the control endpoint
WRITTEN = ("control", "service", "flash")  # by the host, each in one packet
READ = tuple(name for name in REPORTS if name != "service")


class HidRequests(ControlRequestHandler):
    """Answers GET_REPORT and SET_REPORT of feature reports, GET_IDLE and SET_IDLE once configured; stalls every other class
    request (GET_PROTOCOL and SET_PROTOCOL are for boot devices: HID 1.11 sections 7.2.5 and 7.2.6).

    A request is decoded afresh at each SETUP, whatever became of the one before. A report being set is accepted or
    refused once, at the first token of the status stage: until then the host may repeat its data, afterwards it only
    repeats the question.

        write: start                 a report is to come: forget what was gathered
               index, data, valid    its bytes; index 0 begins it again
               done, accept          accept is read in the cycle of done; refused: STALL
        read:  start, id, packet     a read of report `id` begins at byte 64 * packet
               next, data            data is the report's next byte from two cycles after start on; up to two are
                                     read before they are sent
               open                  from the first start to the status stage, or to the next SETUP
    """

    def __init__(self):
        super().__init__()
        self.write_start = Signal()
        self.write_valid = Signal()
        self.write_index = Signal(6)
        self.write_data = Signal(8)
        self.write_done = Signal()
        self.write_accept = Signal()
        self.read_start = Signal()
        self.read_id = Signal(8)
        self.read_packet = Signal(2)
        self.read_next = Signal()
        self.read_data = Signal(8)
        self.read_open = Signal()

    def elaborate(self, platform):
        m = Module()
        self.kind = Signal(4)  # one bit per request served: get, set, idle, get idle; none: stall
        self.idle = Signal(8)  # as the host set it, 4 ms; with nothing to report it never matters
        self.left = Signal(range(max(report.size for report in REPORTS.values()) + 1))  # bytes not yet acknowledged
        self.sent = Signal()  # the packet of a read, and not yet acknowledged
        self.sending = Signal()
        self.unread = Signal(range(PACKET + 1))  # bytes of a read's packet that are not read yet
        self.held = Signal(2)  # bytes read ahead, not sent yet
        self.decided = Signal()
        is_class = self.interface.setup.type == USBRequestType.CLASS
        m.d.comb += self.interface.claim.eq(is_class)
        with m.If(is_class):
            with m.If(self.kind[0]):
                self._get_report(m)
            with m.Elif(self.kind[1]):
                self._set_report(m)
            with m.Elif(self.kind[2] & self.interface.status_requested):
                m.d.comb += self.send_zlp()
                m.d.usb += self.idle.eq(self.interface.setup.value[8:])
            with m.Elif(self.kind[3]):
                self._get_idle(m)
            with m.Elif(self._answer_wanted()):
                m.d.comb += self.interface.handshakes_out.stall.eq(1)
        with m.If(self.interface.status_requested | self.interface.setup.received):
            m.d.usb += self.read_open.eq(0)
        with m.Elif(self.read_start):
            m.d.usb += self.read_open.eq(1)
        self._decode(m)  # last: a SETUP overrides what the request before it wants
        return m

    def _answer_wanted(self):
        itf = self.interface
        return itf.data_requested | itf.status_requested | itf.rx_ready_for_response

    def _decode(self, m):
        """At a SETUP packet: which request is it, and how many bytes may the report send."""
        setup = self.interface.setup
        with m.If(setup.received):
            m.d.usb += [self.kind.eq(0), self.sending.eq(0), self.decided.eq(0)]
            m.d.usb += [self.unread.eq(0), self.held.eq(0)]
            m.d.usb += [self.sent.eq(0), self.read_packet.eq(0), self.interface.tx_data_pid.eq(1)]
            ours = (setup.recipient == USBRequestRecipient.INTERFACE) & (setup.index == LIMITS["usb_hid_interface"])
            ours &= self.interface.active_config != 0
            feature = ours & (setup.value[8:] == FEATURE)
            get = feature & setup.is_in_request & (setup.request == GET_REPORT) & (setup.length != 0)
            for report in (REPORTS[name] for name in READ):
                with m.If(get & (setup.value[:8] == report.id)):
                    size = Mux(setup.length < report.size, setup.length, report.size)
                    m.d.usb += [self.kind.eq(0b001), self.left.eq(size)]
            put = feature & ~setup.is_in_request & (setup.request == SET_REPORT)
            for report in (REPORTS[name] for name in WRITTEN):
                with m.If(put & (setup.value[:8] == report.id) & (setup.length == report.size)):
                    m.d.usb += self.kind.eq(0b010)
                    m.d.comb += self.write_start.eq(1)
            with m.If(ours & ~setup.is_in_request & (setup.request == SET_IDLE) & (setup.length == 0)):
                m.d.usb += self.kind.eq(0b100)
            with m.If(ours & setup.is_in_request & (setup.request == GET_IDLE) & (setup.length != 0)):
                m.d.usb += self.kind.eq(0b1000)

    def _get_idle(self, m):
        """Data stage of one byte. Status stage: ACK."""
        itf, tx = self.interface, self.interface.tx
        m.d.comb += [tx.valid.eq(self.sending), tx.first.eq(self.sending), tx.last.eq(self.sending)]
        m.d.comb += [tx.payload.eq(self.idle), itf.handshakes_out.ack.eq(itf.status_requested)]
        with m.If(itf.data_requested):
            m.d.usb += self.sending.eq(1)
        with m.Elif(itf.tx.ready):
            m.d.usb += self.sending.eq(0)

    def _get_report(self, m):
        """Data stage: packets of 64 bytes, each sent again from its first byte when the host asks again before it has
        acknowledged it. Status stage: ACK.

        Two bytes are read ahead: whether the next one is read follows from registers alone, so that no path leads from
        the transmitter's `ready` through the registers' memories and back to its payload within a cycle."""
        itf, tx = self.interface, self.interface.tx
        loading, first, taken = Signal(), Signal(), Signal()
        ahead, after = Signal(8), Signal(8)  # the byte to send, and the one behind it
        size = Mux(self.left < PACKET, self.left, PACKET)
        m.d.usb += loading.eq(itf.data_requested)
        m.d.comb += [
            self.read_start.eq(itf.data_requested),
            self.read_id.eq(itf.setup.value[:8]),
            self.read_next.eq((self.unread != 0) & (self.held != 2)),
            tx.valid.eq(self.held != 0),
            tx.first.eq((self.held != 0) & first),
            tx.last.eq((self.held == 1) & (self.unread == 0)),
            tx.payload.eq(ahead),
            taken.eq(tx.valid & tx.ready),
            itf.handshakes_out.ack.eq(itf.status_requested),
        ]
        with m.If(itf.data_requested):
            m.d.usb += [self.unread.eq(0), self.held.eq(0)]
        with m.Elif(loading):
            m.d.usb += [self.unread.eq(size), first.eq(1), self.sent.eq(self.left != 0)]
        with m.Else():
            m.d.usb += [self.unread.eq(self.unread - self.read_next), self.held.eq(self.held + self.read_next - taken)]
        with m.If(taken):
            m.d.usb += [ahead.eq(after), first.eq(0)]
        with m.If(self.read_next):
            with m.If(self.held == taken):
                m.d.usb += ahead.eq(self.read_data)
            with m.Else():
                m.d.usb += after.eq(self.read_data)
        with m.If(itf.handshakes_in.ack & self.sent):
            m.d.usb += [self.sent.eq(0), self.left.eq(self.left - size), self.read_packet.eq(self.read_packet + 1)]
            m.d.usb += itf.tx_data_pid.eq(~itf.tx_data_pid)

    def _set_report(self, m):
        """Data stage: pass the bytes on and ACK a good packet. Status stage: nothing if accepted, STALL if refused."""
        itf = self.interface
        decided = self.decided
        accepted = Signal()
        m.d.comb += [
            self.write_valid.eq(itf.rx.valid & itf.rx.next),
            self.write_data.eq(itf.rx.payload),
            itf.handshakes_out.ack.eq(itf.rx_ready_for_response),
            self.write_done.eq(itf.status_requested & ~decided),
        ]
        with m.If(itf.tokenizer.new_token):
            m.d.usb += self.write_index.eq(0)
        with m.Elif(self.write_valid & ~self.write_index.all()):
            m.d.usb += self.write_index.eq(self.write_index + 1)
        with m.If(itf.status_requested):
            m.d.usb += decided.eq(1)
            with m.If(~decided):
                m.d.usb += accepted.eq(self.write_accept)
            with m.If(Mux(decided, accepted, self.write_accept)):
                m.d.comb += self.send_zlp()
            with m.Else():
                m.d.comb += itf.handshakes_out.stall.eq(1)
