// TMAG5170 and MLX90393 at the level of bytes on SPI and of the pulse that begins a conversion, as their data sheets say;
// where users found otherwise, a parameter.

const CRC4 = [0, 3, 6, 5, 12, 15, 10, 9, 11, 8, 13, 14, 7, 4, 1, 2];
export function crc4(word) {
  let crc = 15;
  for (let shift = 28; shift >= 4; shift -= 4) crc = CRC4[crc ^ ((word >>> shift) & 15)];
  return CRC4[crc];
}

// A field in mT that differs from conversion to conversion and from lane to lane.
export function wandering(lane) {
  return (n) => {
    const mix = (k) => {
      let v = Math.imul(n + 1, 0x9e3779b1) ^ Math.imul(lane + 1, 0x85ebca6b) ^ Math.imul(k + 1, 0xc2b2ae35);
      v = Math.imul(v ^ (v >>> 15), 0x2c1b3c6d);
      return ((v ^ (v >>> 13)) >>> 0) / 2 ** 32;
    };
    return [30 * mix(0) - 15, 30 * mix(1) - 15, 20 + 20 * mix(2)];
  };
}

// The angle that a record gives for these components, with fractions of a count.
export function counts(side, axis) { return Math.max(0, Math.min(65535, 32768 + Math.atan(side / axis) * 65536 / Math.PI)); }

class Sensor {
  constructor(field) {
    this.field = field;
    this.conversions = 0; // begun since power
    this.counts = []; // of the last conversions, the newest last: what a reading may show
    this.pending = null;
  }
  // The pulse on the conversion line: the field is taken now, its counts are there after `conversionNs`.
  pulse(now) {
    if (!this.triggered() || (this.pending && now < this.pending.at)) return;
    this.settle(now);
    this.pending = { at: now + this.conversionNs, counts: this.quantise(this.field(this.conversions++)) };
  }
  settle(now) {
    if (!this.pending || now < this.pending.at) return;
    this.latest = this.pending.counts;
    this.counts.push(this.latest);
    if (this.counts.length > 2000) this.counts.splice(0, 1000);
    this.ready(this.pending.counts);
    this.pending = null;
  }
  select(now) {
    this.settle(now);
    this.at = 0;
  }
}

const ORDERS = { maker: [[16, 12, 4], [24, 20, 8], 28], plain: [[24, 20, 16], [12, 8, 4], 28], sheet: [[20, 16, 8], [28, 24, 12], 4] };

export class Tmag5170 extends Sensor {
  constructor(field, { order = 'maker', inverted = 0, special = true } = {}) {
    super(field);
    Object.assign(this, { mode: 0, order: ORDERS[order], inverted, special });
    this.registers = new Uint16Array(32);
    this.results = [0, 0, 0];
    this.sets = 0;
    this.flips = []; // of coming answers, one entry an answer: the bits to invert
  }
  triggered() {
    return (this.registers[0] >> 4 & 7) === 3 && (this.registers[2] >> 9 & 3) === 2 && (this.registers[1] >> 6 & 7) === 7;
  }
  get conversionNs() { return 25e3 * (1 + 3 * 2 ** (this.registers[0] >> 12 & 7)) * 1.05; } // 5 % slower than typical
  quantise(field) {
    return field.map((mT, axis) => Math.max(-32768, Math.min(32767, Math.round(mT * 32768 / [50, 25, 100][this.registers[1] >> 2 * axis & 3]))));
  }
  // What a reading of these counts shows: 12 bits of pairs, 16 of registers.
  shown(counts) {
    return this.special ? counts.map((c) => c & ~15) : counts;
  }
  ready(counts) {
    this.results = counts;
    this.sets = (this.sets + 1) & 7;
  }
  answer() {
    const type = this.special ? this.registers[2] >> 6 & 7 : 0;
    if (type === 0) return (reg) => ((this.sets << 4) | (this.register(reg) << 8)) >>> 0;
    const [a, b] = { 1: [0, 1], 2: [0, 2], 3: [2, 1] }[type].map((axis) => (this.results[axis] & 0xffff) >> 4);
    let word = (this.sets << this.order[2]) >>> 0;
    [a, b].forEach((value, channel) => [8, 4, 0].forEach((from, i) => { word = (word | ((value >> from & 15) << this.order[channel][i])) >>> 0; }));
    return () => word;
  }
  register(reg) {
    return reg >= 9 && reg <= 11 ? this.results[reg - 9] & 0xffff : this.registers[reg];
  }
  // The first byte of a frame says which register its answer is of: the answer's data begin with its second byte.
  byte(mosi) {
    if (this.at === 0) {
      this.heard = 0;
      this.form = this.answer();
      this.answerSpecial = this.special && (this.registers[2] >> 6 & 7) !== 0;
      if (this.answerSpecial) this.word = this.finish(this.form(0));
    }
    this.heard = ((this.heard << 8) | mosi) >>> 0;
    const place = this.at++;
    if (place === 0) return this.answerSpecial ? this.word >>> 24 : this.flip(0, true);
    if (place === 1 && !this.answerSpecial) this.word = this.finish(this.form(this.heard >>> 8 & 0x7f));
    if (place === 3) this.take();
    let value = this.word >>> (24 - 8 * place) & 255;
    // The last bit of its CRC is inverted if the frame's own CRC was wrong.
    if (place === 3 && crc4(this.heard) !== (this.heard & 15)) value ^= 1;
    return value;
  }
  flip(word, first) {
    if (first) return 0;
    return (word ^ (this.flips.shift() ?? 0)) >>> 0;
  }
  finish(word) {
    return this.flip((word | (crc4(word) ^ (this.answerSpecial ? this.inverted : 0))) >>> 0);
  }
  take() {
    if (crc4(this.heard) === (this.heard & 15) && !(this.heard >>> 31)) this.registers[this.heard >>> 24 & 31] = this.heard >>> 8 & 0xffff;
  }
}

export class Mlx90393 extends Sensor {
  constructor(field) {
    super(field);
    Object.assign(this, { mode: 3, conversionNs: 1.2e6, fresh: false });
    this.registers = new Uint16Array(64);
    this.results = [0, 0, 0];
  }
  triggered() {
    return (this.registers[1] & 0x8800) === 0x0800 && (this.registers[1] >> 6 & 15) === 0xe;
  }
  quantise([x, y, z]) {
    return [x / 1.96e-3, y / 1.96e-3, z / 3.16e-3].map((c) => Math.max(-32768, Math.min(32767, Math.round(c))));
  }
  // In the unit of Z, as the firmware takes them.
  shown([x, y, z]) {
    return [(x * 635) >> 10, (y * 635) >> 10, z];
  }
  ready(counts) {
    this.results = counts;
    this.fresh = true;
  }
  byte(mosi) {
    const place = this.at++;
    if (place === 0) this.got = [mosi];
    else if (this.got.length < (this.got[0] === 0x60 ? 4 : this.got[0] === 0x50 ? 2 : 1)) this.got.push(mosi);
    const [command, high, low, at] = this.got;
    const status = this.got.length - 1;
    if (place === 0 || place <= status) return 0xff;
    if (command === 0x60 && place === 4) this.registers[at >> 2] = (high << 8) | low;
    if (command === 0x50 && place > 2) return place === 3 ? this.registers[high >> 2] >> 8 : this.registers[high >> 2] & 255;
    if (command === 0xf0 && place === 1) this.registers.fill(0);
    if (command === 0x4e && place === 1) {
      this.out = this.results.flatMap((c) => [(c & 0xffff) >> 8, c & 255]);
      const stale = !this.fresh;
      this.fresh = false;
      return stale ? 0x10 : 0x22;
    }
    if (command === 0x4e) return this.out[place - 2] ?? 0xff;
    return place === status + 1 ? 0 : 0xff;
  }
}

// A chip that answers and is neither: a shift register.
export class Stranger extends Sensor {
  constructor() {
    super(() => [0, 0, 0]);
    Object.assign(this, { mode: null, last: 0x5a });
  }
  triggered() { return false; }
  byte(mosi) { const out = this.last; this.last = mosi ^ 0x31; return out; }
}
