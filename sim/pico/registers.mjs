// Which registers the firmware sets, and to what: fields of the RP2040 data sheet. Registers that carry data are held
// against the sensors and the bus instead.
import { BUSES, CONVERT, LAMP, SELECT } from './board.mjs';

const WIRED = [...SELECT, CONVERT, LAMP], SPI_PINS = BUSES.flatMap((bus) => [bus.sck, bus.mosi, bus.miso]);
const bits = (pins) => pins.reduce((all, pin) => (all | 1 << pin) >>> 0, 0);
const RESETS = 0x4000c000, SIO_SET = 0xd0000014, SIO_CLEAR = 0xd0000018, OUTPUTS = 0xd0000024, ALARM = 0x40054010, READING_US = 200;
// Blocks that are held in reset at the start: a bit of RESETS, and where they are.
const BLOCKS = [[5, 0x40014000], [8, 0x4001c000], [12, 0x40028000], [13, 0x4002c000], [16, 0x4003c000], [17, 0x40040000], [21, 0x40054000], [24, 0x50110000]];
const AT_RESET = { [RESETS]: 0x1ffffff, 0x40028004: 0x2d, 0x4002c004: 0x2d }; // of those that are changed by bits
const ENDPOINT = (kind, buffer) => (0xa0000000 | kind << 26 | buffer) >>> 0;

export const SET_TO = {
  0x18000000: 7 << 16, 0x18000008: 0, 0x18000010: 1, // flash: eight bits both ways, off, its select
  0x4000c000: 0x1ffffff & ~bits(BLOCKS.map(([bit]) => bit)), 0x40010008: 0x1fffc, // out of reset; a watchdog resets all but oscillators
  0x40024000: 0xfabaa0, 0x4002400c: 3008, // crystal: 1 to 15 MHz, on, 64 ms
  0x40028004: 4, 0x40028008: 120, 0x4002800c: 6 << 16 | 2 << 12, 0x4002c004: 4, 0x4002c008: 100, 0x4002c00c: 5 << 16 | 5 << 12, // 120 and 48 MHz
  0x40008030: 2, 0x4000803c: 1, 0x40008048: 0x800, 0x40008054: 0x800, // clocks: crystal, PLL, both on
  0x40058000: 1 << 30, 0x40058004: 2000000, 0x4005800c: 0, 0x4005802c: 12 | 1 << 9, 0x40054038: 1, // watchdog: a second; timer: 1 MHz, alarm 0
  ...Object.fromEntries(WIRED.map((pin) => [0x40014004 + 8 * pin, 5])), ...Object.fromEntries(SPI_PINS.map((pin) => [0x40014004 + 8 * pin, 1])),
  ...Object.fromEntries(BUSES.map(({ miso }) => [0x4001c004 + 4 * miso, 0x5a])), [OUTPUTS]: bits(WIRED),
  ...Object.fromEntries([0x4003c000, 0x40040000].flatMap((spi) => [[spi, 15], [spi + 4, 2], [spi + 16, 12]])), // 16 bits, mode 0, on, 10 MHz
  0xe000e010: 7, 0xe000e014: 59999, 0xe000e018: 0, 0xe000e100: 0x21, 0xe000e400: 0x80, 0xe000e404: 0x4000, 0xe000ed08: 0x20000000, // ticks, priorities, vectors
  0x50110040: 1, 0x50110074: 9, 0x50110078: 12, 0x50110090: 0x1d010 | 1 << 17, 0x5011004c: 1 << 29 | 1 << 16, // USB: device, PHY, supply, interrupts, pull-up
};
const DATA = [0x4003c008, 0x40040008, SIO_SET, SIO_CLEAR, ALARM, 0x40054020, 0x40054034, 0x18000060, 0x18000014, 0x180000f4, 0x18000004, 0xd0000060, 0xd0000064, 0x50110000, 0x50110050, 0x50110058, 0x50110068];

// Notes what is written on a board from its start on.
export class Registers {
  constructor() { Object.assign(this, { value: new Map(), errors: [] }); }
  watch(m, resets) {
    const write = m.writeUint32.bind(m);
    Object.entries(AT_RESET).forEach(([at, value]) => this.value.set(+at, value));
    m.writeUint32 = (address, value) => { if (address >>> 0 >= 0x40000000 || address >>> 28 === 1) this.note(m, address >>> 0, value >>> 0, resets); write(address, value); };
  }
  note(m, address, value, resets) {
    const aliased = address < 0xd0000000 && !(address >= 0x50100000 && address < 0x50110000), at = aliased ? (address & ~0x3000) >>> 0 : address, way = address === OUTPUTS ? 2 : aliased ? address >>> 12 & 3 : 0;
    const before = this.value.get(at) ?? 0, wrong = (why) => this.errors.push(`${at.toString(16)}: ${value.toString(16)}: ${why}`);
    this.value.set(at, (way === 0 ? value : way === 2 ? before | value : way === 3 ? before & ~value : before ^ value) >>> 0);
    if (BLOCKS.some(([bit, from]) => at >= from && at < from + 0x4000 && resets.reset & 1 << bit)) wrong('its block is in reset');
    if ((at === SIO_SET || at === SIO_CLEAR) && value & ~bits(WIRED)) wrong('a pin that is not wired');
    if (at === 0x50110058 && value & ~m.usbCtrl.buffStatus) wrong('a buffer that has not ended');
    if (at === 0x50110050 && value & ~(1 << 4 | 1 << 11 | 1 << 17 | 1 << 19)) wrong('no cause of an interrupt');
    if ((at === 0x40054020 || at === 0x40054034) && value !== 1) wrong('another alarm');
    if (at === ALARM && Math.abs((value - m.readUint32(0x40054028)) - READING_US) > 1) wrong('the reading is not when the conversion has ended');
  }
  // What differs from SET_TO, once it runs.
  differences() {
    const found = [...this.errors];
    for (const [at, value] of Object.entries(SET_TO)) if (this.value.get(+at) !== value >>> 0) found.push(`${(+at).toString(16)}: ${this.value.get(+at)?.toString(16)}, not ${(value >>> 0).toString(16)}`);
    for (const [at] of this.value) if (!(at in SET_TO) && !DATA.includes(at) && !(at >>> 16 === 0x5010)) found.push(`${at.toString(16)}: written`);
    return found;
  }
  // The controller's memory: endpoints 1 and 2, and nothing else.
  memory(m) {
    const word = (at) => m.usbDPRAMView.getUint32(at, true), ours = { 0x08: ENDPOINT(2, 0x180), 0x10: ENDPOINT(3, 0x1c0) };
    return Array.from({ length: 0x1e }, (_, i) => 8 + 4 * i).filter((at) => word(at) !== (ours[at] ?? 0)).map((at) => `${at.toString(16)}: ${word(at).toString(16)}`);
  }
}
