// serve.mjs IMAGE LANES PACE FIELDS: the executed board for whisker-pico-sim: transfers in on descriptor 3, their results on 4.
// Its time goes at PACE of the wall's, or slower; it waits for a host that reads frames and has not asked for the next yet.
import fs from 'node:fs';
import { Board } from './board.mjs';
import { Host } from './host.mjs';
import { Tmag5170 } from './sensors.mjs';

const [image, lanes, pace, pipe] = process.argv.slice(2);
const CONTROL = 0, BULK = 1, CANCEL = 2, RESET = 3, HEAD = 24, EPIPE = -32, EPROTO = -71;
const SLICE_NS = 1e6, HOST_GONE_MS = 200; // without a read for so long no host waits for frames

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
const host = new Host(board), reads = new Map();
let address = 0, heard = Buffer.alloc(0), readAt = -Infinity;

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
  else if (kind === BULK) reads.set(id, host.read(length, (why, bytes) => { reads.delete(id); readAt = Date.now(); tell(id, why, bytes); }));
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
  const waits = reads.size === 0 && Date.now() - readAt < HOST_GONE_MS;
  if (waits || due > 20 * SLICE_NS) { wall = performance.now(); time = board.mcu.clock.nanos; }
  if (!waits && due > 0) board.run(SLICE_NS);
  if (board.drive) process.exit(0); // it is a drive now
  due > 0 && !waits ? setImmediate(go) : setTimeout(go, 1);
})();
