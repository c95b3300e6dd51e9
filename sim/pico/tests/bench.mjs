// What the checks share: a board with a host, requests that wait for their end, frames as objects held against the sensors.
import fs from 'node:fs';
import { Board } from '../board.mjs';
import { Host } from '../host.mjs';
import { Mlx90393, Tmag5170, counts, wandering } from '../sensors.mjs';

export const MS = 1e6, LANES = 28, FRAME = 256, VERSION = 2;
// Counts: what the firmware's angle may be off by; a conversion beside it is hundreds off.
const NEAR = 1.5;
export const CODE = { ok: 0, starting: 1, resync: 2, late: 3, sum: 4, start: 5, absent: 6, power: 8, watchdog: 9, trap: 10, magnet: 14, unknown: 15, stale: 34, off: 35 };

export class Bench {
  constructor(image, sensors, options = {}) {
    this.board = new Board(fs.readFileSync(image), sensors, options);
    this.host = new Host(this.board);
    this.board.run(5 * MS);
  }
  request(setup, data = new Uint8Array(setup[6]), abandon) {
    let answer;
    this.host.control(Uint8Array.from(setup), data, (why, bytes) => { answer = { why, bytes }; });
    if (abandon) this.host.queue.at(-1).abandon = abandon;
    for (let i = 0; i < 1000 && !answer; i++) this.board.run(1e5);
    return answer ?? { why: 'no end', bytes: new Uint8Array(0) };
  }
  get(id, length) { return this.request([0xa1, 1, id, 3, 1, 0, length & 255, length >> 8]); }
  set(bytes) { return this.request([0x21, 9, bytes[0], 3, 1, 0, bytes.length, 0], bytes).why; }
  enumerate(address = 5) {
    this.host.plug();
    this.board.run(MS);
    this.host.reset();
    this.board.run(2 * MS);
    for (const setup of [[0x80, 6, 0, 1, 0, 0, 18, 0], [0, 5, address, 0, 0, 0, 0, 0], [0x80, 6, 0, 2, 0, 0, 255, 0], [0, 9, 1, 0, 0, 0, 0, 0]]) {
      const { why } = this.request(setup);
      if (why) throw new Error(`enumeration: ${setup.slice(0, 2)}: ${why}`);
    }
  }
  control(run, { mask = 0xffff, period = 30000, options = 0 } = {}) {
    const bytes = new Uint8Array(16), view = new DataView(bytes.buffer);
    bytes.set([1, VERSION, run, 16, 180, 8, options]);
    view.setUint32(8, mask, true);
    view.setUint32(12, period, true);
    return this.set(bytes);
  }
  counters() {
    const view = new DataView(Uint8Array.from(this.get(2, 32).bytes).buffer);
    return Object.fromEntries(['ticks', 'frames', 'dropped', 'good', 'absent', 'crc', 'stale'].map((name, i) => [name, view.getUint32(4 + 4 * i, true)]));
  }
  // Frames go to `take` from now on, each as a Buffer; transfers as libwhisker asks for them.
  stream(take, bytes = 1024, transfers = 8) {
    const more = () => this.host.read(bytes, (why, got) => { for (let at = 0; at + FRAME <= got.length; at += FRAME) take(got.subarray(at, at + FRAME)); if (!why || why === 'stall') more(); });
    for (let i = 0; i < transfers; i++) more();
  }
}

export function crc8(bytes, n) {
  let crc = 0xff;
  for (let i = 0; i < n; i++) { crc ^= bytes[i]; for (let k = 0; k < 8; k++) crc = crc & 0x80 ? (crc << 1 ^ 0x2f) & 255 : crc << 1; }
  return crc ^ 0xff;
}

export function decode(frame) {
  const b = Buffer.from(frame);
  if (b.readUInt16LE(0) !== 0x4b57 || b[2] !== VERSION || b[28] !== LANES || crc8(b, 31) !== b[31]) throw new Error('a header is damaged');
  const lanes = [];
  for (let lane = 0; lane < LANES; lane++) {
    const r = b.subarray(32 + 8 * lane, 40 + 8 * lane);
    if (crc8(r, 7) !== r[7] || r[0] !== b[4]) throw new Error(`the record of lane ${lane} is damaged`);
    const status = r.readUInt16LE(5);
    lanes.push({ alpha: r.readUInt16LE(1), beta: r.readUInt16LE(3), code: status >> 10, errors: status & 1023 });
  }
  return { last: b[3] & 1, tick: b.readUInt32LE(4), time: b.readBigUInt64LE(8), sequence: b.readUInt32LE(16), dropped: b.readUInt32LE(20), mask: b.readUInt32LE(24), usb: b.readUInt16LE(29), lanes };
}

// Holds the frames of one run against the sensors' own logs. Each good reading must be one conversion's, each conversion's once,
// in order: its place in the log is its tick's, from the first good one on.
export class Judge {
  constructor(sensors) { Object.assign(this, { sensors, frames: 0, lost: 0, altered: 0, doubled: 0, compared: 0, worst: 0, codes: {}, before: null, base: new Map() }); }
  take(raw) {
    const f = decode(raw);
    this.frames++;
    if (f.tick === 0) { this.base.clear(); this.before = null; }
    if (this.before) {
      const step = f.sequence - this.before.sequence;
      if (step === 0) this.doubled++;
      else this.lost += step - 1;
    }
    f.lanes.forEach((lane, n) => { if (lane.code !== CODE.off) this.codes[`${n}:${lane.code}`] = (this.codes[`${n}:${lane.code}`] ?? 0) + 1; if (lane.code === 0) this.compare(n, lane, f.tick); else if (lane.code === CODE.stale) this.base.delete(n); }); // a conversion is missing from the log
    this.before = f;
    return f;
  }
  compare(n, lane, tick) {
    const sensor = this.sensors[n], fits = (i) => {
      const c = sensor.counts[i - (sensor.finished - sensor.counts.length)];
      if (!c) return Infinity;
      const [x, y, z] = sensor.shown(c);
      return Math.max(Math.abs(lane.alpha - counts(x, z)), Math.abs(lane.beta - counts(y, z)));
    };
    if (!this.base.has(n)) for (let i = sensor.finished - 1; i >= sensor.finished - 90; i--) if (fits(i) <= NEAR) { this.base.set(n, i - tick); break; }
    const off = fits((this.base.get(n) ?? NaN) + tick);
    this.compared++;
    if (off <= NEAR) this.worst = Math.max(this.worst, off);
    else this.altered++;
  }
}
// Conversions that have ended, for Judge.
for (const kind of [Mlx90393, Tmag5170]) {
  const ready = kind.prototype.ready;
  kind.prototype.ready = function (c) { this.finished = (this.finished ?? 0) + 1; ready.call(this, c); };
}

export function tmags(lanes, options, seed = 0) { return Array.from({ length: 16 }, (_, n) => (n < lanes ? new Tmag5170(wandering(n + 16 * seed), options) : null)); }
export function tell(object) { console.log(JSON.stringify(object)); }
