// A full-speed USB host at the level of tokens, on the buffers of the RP2040's device controller: frames of 1 ms with
// their start, SETUP, IN and OUT, NAK, STALL, DATA0 and DATA1; lost handshakes, storms of NAK, resets, suspend, unplugging.
const AVAILABLE = 1 << 10, STALL = 1 << 11, DATA1 = 1 << 13, FULL = 1 << 15, LENGTH = 0x3ff;
const PACKET_US = 52, CONTROL_US = 20, NAK_US = 8, FRAME_NS = 1e6, TRIES = 5000;
const BULK = 1;

export class Host {
  constructor(board) {
    Object.assign(this, { board, plugged: false, frame: 0, queue: [], bulk: [], errors: [], naks: 0, packets: 0, storm: 0, loseAcks: 0, lost: 0 });
    board.usbChanged = () => this.attach();
    this.attach();
  }

  attach() {
    const m = this.board.mcu, usb = this.usb = m.usbCtrl;
    const write = usb.writeUint32.bind(usb), read = usb.readUint32.bind(usb);
    // SUSPENDED is cleared by writing 1, the frame's interrupt by reading its number (data sheet; the stock model lacks both).
    usb.writeUint32 = (offset, value) => { if (offset === 0x74) this.muxing = value; if (offset === 0x50) usb.sieStatus &= ~(usb.rawWriteValue & 1 << 4); write(offset, value); };
    usb.readUint32 = (offset) => { if (offset === 0x48) { usb.intRaw &= ~(1 << 17); usb.checkInterrupts(); } return read(offset); };
    this.settling = {};
    this.muxing = 0;
    usb.DPRAMUpdated = (offset, value) => { if (offset >= 0x80 && offset <= 0xfc) this.armed(offset, value); };
    this.timer = m.clock.createAlarm(() => this.startFrame());
    this.poll = m.clock.createAlarm(() => this.token());
    if (this.plugged) this.plug();
  }

  // AVAILABLE must follow the other bits by a cycle of the controller's 48 MHz at least.
  armed(offset, value) {
    const now = this.board.mcu.clock.nanos, before = this.settling[offset];
    if (value & AVAILABLE && (!before || before.value !== (value & ~AVAILABLE) || now - before.at < 1e9 / 48e6)) this.errors.push(`buffer ${offset.toString(16)} is available before it has settled`);
    if (value & ~0xafff) this.errors.push(`buffer ${offset.toString(16)}: ${value.toString(16)} is of a second one`);
    this.settling[offset] = { value, at: now };
  }

  connected() { return this.plugged && (this.usb.sieCtrl & 1 << 16) !== 0 && (this.usb.mainCtrl & 3) === 1 && this.muxing === 9 && (this.usb.usbPwr & 12) === 12 && this.board.clocksRight(); }
  plug() { this.plugged = true; this.timer.schedule(FRAME_NS); }
  unplug() { this.plugged = false; this.timer.cancel(); this.poll.cancel(); this.fail('gone'); }
  fail(why) {
    for (const waiting of [this.now, ...this.queue, ...this.bulk]) waiting?.done(why, new Uint8Array(0));
    Object.assign(this, { now: null, queue: [], bulk: [], left: 0 });
  }
  reset() {
    this.fail('reset');
    Object.assign(this, { address: 0, toggles: [0, 0, 0], asleep: false, fresh: 2 });
    this.usb.sieStatus |= 1 << 19;
    this.usb.sieStatusUpdated();
  }
  suspend() { this.asleep = true; this.usb.sieStatus |= 1 << 4; this.usb.sieStatusUpdated(); }
  resume() { this.asleep = false; this.usb.sieStatus |= 1 << 11; this.usb.sieStatusUpdated(); }

  startFrame() {
    this.timer.schedule(FRAME_NS);
    if (!this.connected() || this.asleep) return;
    if (this.fresh > 0 && --this.fresh === 0 && !this.now) for (const offset of [0x80, 0x84, 0x88, 0x90]) if (this.buffer(offset) & (AVAILABLE | STALL)) this.errors.push(`buffer ${offset.toString(16)} is of before the reset`);
    this.frame = (this.frame + 1) & 0x7ff;
    this.usb.sofFrameNumber = this.frame;
    this.usb.intRaw |= 1 << 17;
    this.usb.checkInterrupts();
    this.left = FRAME_NS / 1000 - 20;
    this.token();
  }

  // A request of the control endpoint: done(null or why not, bytes).
  control(setup, data, done) { this.queue.push({ setup, data, done, stage: 'setup', got: [], tries: 0 }); }
  read(length, done) { const wanted = { length, got: [], bytes: 0, done }; this.bulk.push(wanted); return wanted; }
  cancel(wanted) { const at = this.bulk.indexOf(wanted); if (at >= 0) this.bulk.splice(at, 1); return wanted; }

  token() {
    if (!this.connected() || this.asleep) return;
    const us = this.storm > 0 ? (this.storm--, NAK_US) : this.controlToken() ?? this.bulkToken();
    if (us === undefined) { this.poll.schedule(NAK_US * 1000); this.left -= NAK_US; return; }
    this.left -= us;
    if (this.left > PACKET_US) this.poll.schedule(us * 1000);
  }

  buffer(offset) { return this.board.mcu.usbDPRAMView.getUint32(offset, true); }
  stalls(offset) { return (this.buffer(offset) & STALL) !== 0 && (offset > 0x84 || (this.usb.epStallArm & (offset === 0x80 ? 1 : 2)) !== 0); }
  offers(endpoint) { return (this.buffer(0x80 + 8 * endpoint) & AVAILABLE) !== 0; }
  isAsked() { return this.now != null || this.queue.length > 0; } // a request of the control endpoint is under way
  addressed() { return this.address === (this.usb.addrEndp & 0x7f); }

  // IN: bytes, null for NAK or no answer, 'stall'.
  in(endpoint) {
    const offset = 0x80 + 8 * endpoint, value = this.buffer(offset), m = this.board.mcu;
    const control = endpoint ? m.usbDPRAMView.getUint32(8 * endpoint, true) : 0;
    if (!this.addressed() || (endpoint && control >>> 26 !== (0xa0000000 | 2 << 26) >>> 26)) return null;
    if (this.stalls(offset)) return 'stall';
    if (!(value & AVAILABLE) || !(value & FULL)) return null;
    const again = (value & DATA1 ? 1 : 0) !== this.toggles[endpoint];
    const at = endpoint ? control & 0xffc0 : 0x100, bytes = m.usbDPRAM.slice(at, at + (value & LENGTH));
    if (again && !this.repeat) this.errors.push(`endpoint ${endpoint}: DATA${value & DATA1 ? 1 : 0} is not its turn`);
    if (!again) this.toggles[endpoint] ^= 1;
    this.repeat = false;
    if (endpoint && this.loseAcks > 0) { this.loseAcks--; this.lost++; this.repeat = true; return again ? null : bytes; }
    this.finish(offset, 2 * endpoint, FULL);
    return again ? null : bytes;
  }
  finish(offset, bit, clear) {
    this.board.mcu.usbDPRAMView.setUint32(offset, this.buffer(offset) & ~(AVAILABLE | clear), true);
    this.usb.buffStatus |= 1 << bit;
    this.usb.buffStatusUpdated();
  }
  out(bytes) {
    const value = this.buffer(0x84), m = this.board.mcu;
    if (!this.addressed()) return null;
    if (this.stalls(0x84)) return 'stall';
    if (!(value & AVAILABLE) || (value & LENGTH) < bytes.length) return null;
    if (!(value & DATA1)) this.errors.push('endpoint 0: it waits for DATA0');
    m.usbDPRAM.set(bytes, 0x100);
    m.usbDPRAMView.setUint32(0x84, (value & ~(AVAILABLE | LENGTH)) | FULL | bytes.length, true);
    this.usb.buffStatus |= 2;
    this.usb.buffStatusUpdated();
    return bytes;
  }

  controlToken() {
    if (!this.now && !(this.now = this.queue.shift() ?? null)) return undefined;
    const c = this.now, wanted = c.setup[6] | c.setup[7] << 8, inward = (c.setup[0] & 0x80) !== 0;
    let got = 'next';
    const idle = c.stage === 'out' ? 0x80 : c.stage === 'confirm' || (c.stage === 'in' && c.got.length === 0) ? 0x84 : null;
    if (idle && this.buffer(idle) & AVAILABLE) this.errors.push(`endpoint 0: ${c.stage}, and the other way is armed`);
    if (c.stage === 'setup') {
      if (this.addressed()) {
        this.board.mcu.usbDPRAM.set(c.setup, 0);
        this.usb.epStallArm = 0;
        this.usb.sieStatus |= 1 << 17;
        this.usb.sieStatusUpdated();
        this.toggles[0] = 1;
        c.stage = wanted === 0 ? 'confirm' : inward ? 'in' : 'out';
      } else got = null;
    } else if (c.stage === 'in') {
      got = this.in(0);
      if (got instanceof Uint8Array) { c.got.push(...got); if (got.length < 64 || c.got.length >= wanted) c.stage = 'status'; }
    } else if (c.stage === 'out') { got = this.out(Uint8Array.from(c.data)); if (got instanceof Uint8Array) { c.stage = 'confirm'; this.toggles[0] = 1; } }
    else if (c.stage === 'confirm') { got = this.in(0); if (got instanceof Uint8Array) c.stage = 'end'; }
    else if (c.stage === 'status') { got = this.out(new Uint8Array(0)); if (got instanceof Uint8Array) c.stage = 'end'; }
    if (c.abandon === c.stage) got = 'abandoned';
    if (got === null && ++c.tries > TRIES) got = 'timeout';
    if (typeof got === 'string' && got !== 'next') { this.now = null; c.done(got, new Uint8Array(0)); }
    else if (c.stage === 'end') {
      this.now = null;
      const [type, request, value] = c.setup;
      if (type === 0 && request === 5) this.address = value;
      if ((type === 0 && request === 9) || (type === 1 && request === 11)) this.toggles.fill(0, 1);
      if (type === 2 && request === 1) this.toggles[c.setup[4] & 15] = 0;
      c.done(null, Uint8Array.from(c.got));
    }
    return CONTROL_US;
  }

  bulkToken() {
    if (!this.bulk.length) return undefined;
    const got = this.in(BULK), wanted = this.bulk[0];
    if (got === null) { this.naks++; return NAK_US; }
    if (got === 'stall') { this.bulk.shift(); wanted.done('stall', new Uint8Array(0)); return NAK_US; }
    this.packets++;
    wanted.got.push(got);
    wanted.bytes += got.length;
    if (wanted.bytes >= wanted.length || got.length < 64) { this.bulk.shift(); wanted.done(null, Buffer.concat(wanted.got)); }
    return PACKET_US;
  }
}
