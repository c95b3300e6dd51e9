// serve.mjs IMAGE LANES PACE FIELDS [LOG]: the executed board for whisker-pico-sim: transfers in on descriptor 3, their
// results on 4. In LOG a record for each conversion of a sensor: lane, its pulse (32 bits each), the angles it shows
// (two floats, counts).
// Its time goes at PACE of the wall's, or slower; it stands still while a packet of frames is there and no program reads.
import fs from 'node:fs';
import { Board } from './board.mjs';
import { Host } from './host.mjs';
import { Tmag5170, counts } from './sensors.mjs';

const [image, lanes, pace, pipe, log] = process.argv.slice(2);
const CONTROL = 0, BULK = 1, CANCEL = 2, RESET = 3, HEAD = 24, EPIPE = -32, EPROTO = -71, FRAMES = 1;
const SLICE_NS = 1e6;

// The world's angles of each pulse, read from FIELDS as they are needed: counts of 180 degrees / 65536 from 0x8000, noise
// and all (sim/world/sensor_noise.c), as the field of a magnet of FIELD_MT.
const FIELD_MT = 60, TICK_BYTES = 4 * +lanes, fields = fs.openSync(pipe, 'r'), angles = Buffer.alloc(TICK_BYTES);
let ticks = 0;
function fieldOf(lane) {
  while (ticks < board.pulses) {
    for (let at = 0; at < TICK_BYTES;) {
      const got = fs.readSync(fields, angles, at, TICK_BYTES - at);
      if (got === 0) process.exit(0); // the world has ended
      at += got;
    }
    ticks++;
  }
  const [x, y] = [0, 2].map((at) => Math.tan((angles.readUInt16LE(4 * lane + at) - 32768) * Math.PI / 65536));
  const z = FIELD_MT / Math.hypot(1, x, y);
  return [x * z, y * z, z];
}

const board = new Board(fs.readFileSync(image), Array.from({ length: 16 }, (_, n) => (n < +lanes ? new Tmag5170(() => fieldOf(n)) : null)));
let conversions = [];
if (log) {
  board.sensors.forEach((sensor, lane) => {
    if (sensor) sensor.ready = (c) => { const [x, y, z] = sensor.shown(c); conversions.push([lane, board.pulses, counts(x, z), counts(y, z)]); Tmag5170.prototype.ready.call(sensor, c); };
  });
  fs.writeFileSync(log, '');
}
function keep() {
  const bytes = Buffer.alloc(16 * conversions.length);
  conversions.forEach(([lane, pulse, alpha, beta], i) => { bytes.writeUInt32LE(lane, 16 * i); bytes.writeUInt32LE(pulse, 16 * i + 4); bytes.writeFloatLE(alpha, 16 * i + 8); bytes.writeFloatLE(beta, 16 * i + 12); });
  if (log) fs.appendFileSync(log, bytes);
  conversions = [];
}
const host = new Host(board), reads = new Map();
let address = 0, heard = Buffer.alloc(0);

function tell(id, why, bytes) {
  const head = Buffer.alloc(12);
  head.writeUInt32LE(id, 0);
  head.writeInt32LE(why === null ? 0 : why === 'stall' ? EPIPE : EPROTO, 4);
  head.writeUInt32LE(bytes.length, 8);
  fs.writeSync(4, Buffer.concat([head, bytes]));
}
// A reset as a kernel makes it: the device has address and configuration again afterwards.
function reset(id) {
  host.reset();
  host.control(Uint8Array.from([0, 5, address = address % 100 + 1, 0, 0, 0, 0, 0]), [], () => {
    if (id === null) return;
    host.control(Uint8Array.from([0, 9, 1, 0, 0, 0, 0, 0]), [], (why) => tell(id, why, Buffer.alloc(0)));
  });
}
function take(kind, id, length, setup, data) {
  if (kind === CONTROL) host.control(setup, data, (why, bytes) => tell(id, why, bytes));
  else if (kind === BULK) reads.set(id, host.read(length, (why, bytes) => { reads.delete(id); tell(id, why, bytes); }));
  else if (kind === CANCEL && reads.has(id)) { host.cancel(reads.get(id)); reads.delete(id); }
  else if (kind === RESET) reset(id);
}
fs.createReadStream(null, { fd: 3 }).on('data', (more) => {
  heard = Buffer.concat([heard, more]);
  while (heard.length >= HEAD && heard.length >= HEAD + heard.readUInt32LE(12)) {
    const bytes = heard.readUInt32LE(12), setup = Uint8Array.from(heard.subarray(16, HEAD));
    take(heard.readUInt32LE(0), heard.readUInt32LE(4), heard.readUInt32LE(8), setup, Uint8Array.from(heard.subarray(HEAD, HEAD + bytes)));
    heard = heard.subarray(HEAD + bytes);
  }
}).on('end', () => process.exit(0));

board.run(100 * SLICE_NS); // until its sensors are found
host.plug();
board.run(2 * SLICE_NS);
reset(null);
let wall = performance.now(), time = board.mcu.clock.nanos;
(function go() {
  const due = (performance.now() - wall) * 1e6 * +pace - (board.mcu.clock.nanos - time);
  const waits = reads.size === 0 && host.offers(FRAMES) && !host.isAsked();
  if (waits || due > 20 * SLICE_NS) { wall = performance.now(); time = board.mcu.clock.nanos; }
  if (!waits && due > 0) { board.run(SLICE_NS); keep(); }
  if (board.drive) process.exit(0); // it is a drive now
  due > 0 && !waits ? setImmediate(go) : setTimeout(go, 1);
})();
