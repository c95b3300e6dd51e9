// peers.mjs IMAGE KIND [LANES PERIOD]: samples a second and instructions a sample: of this firmware, on so many lanes in ticks of
// PERIOD; without them, of a peer's program (tools/benches/node/peers) on one sensor that its bus starts. Of a peer, waiting is
// not counted: it waits with the lamp on.
import fs from 'node:fs';
import { Bench, MS, decode, tell } from './bench.mjs';
import { Board, LAMP } from '../board.mjs';
import { Mlx90393, Tmag5170, wandering } from '../sensors.mjs';

const [image, kind, lanes, period] = process.argv.slice(2), FOR_MS = 2000;
const CONVERSION_US = [[1270, 1840, 3000, 5300], [1460, 2230, 3760, 6840], [1840, 3000, 5300, 9910], [2610, 4530, 8370, 16050],
  [4150, 7600, 14520, 28340], [7220, 13750, 26800, 52920], [13360, 26040, 51380, 102070], [25650, 50610, 100530, 200370]]; // data sheet, table 18

// A single measurement by command, its bytes of status as the data sheet has them.
class CommandedMlx90393 extends Mlx90393 {
  triggered() { return true; }
  byte(mosi) {
    const out = super.byte(mosi), [command] = this.got;
    if (this.at === 1 && command === 0x3e) { this.conversionNs = 1e3 * CONVERSION_US[this.registers[2] >> 2 & 7][this.registers[2] & 3]; this.pulse(this.now); }
    if (this.at !== 2 || ![0x3e, 0xf0, 0x4e].includes(command)) return out;
    return { 0x3e: 0x20, 0xf0: 0x04 }[command] ?? (out === 0x10 ? 0x10 : 0x02);
  }
  select(now) { this.now = now; super.select(now); }
}
// A conversion by the command bits of a frame.
class CommandedTmag5170 extends Tmag5170 {
  triggered() { return (this.registers[0] >> 4 & 7) === 3; }
  take() { super.take(); if (this.heard >> 4 & 1) this.pulse(this.now); }
  select(now) { this.now = now; super.select(now); }
}

function ours() {
  const Kind = kind === 'mlx90393' ? Mlx90393 : Tmag5170, bench = new Bench(image, Array.from({ length: 16 }, (_, n) => (n < +lanes ? new Kind(wandering(n)) : null)));
  let good = 0;
  bench.enumerate();
  bench.board.run(80 * MS);
  bench.stream((raw) => { good += decode(raw).lanes.filter((lane) => lane.code === 0).length; });
  const refused = bench.control(1, { mask: 2 ** +lanes - 1, period: +period });
  if (refused) throw new Error(refused);
  bench.board.run(100 * MS);
  bench.board.measure();
  good = 0;
  bench.board.run(FOR_MS * MS);
  return { good, instructions: bench.board.instructions };
}

function peer() {
  const board = new Board(fs.readFileSync(image), [new (kind === 'mlx90393' ? CommandedMlx90393 : CommandedTmag5170)(wandering(0)), ...Array(15).fill(null)]);
  let waited = 0, since = 0;
  board.mcu.gpio[LAMP].addListener((state) => { if (state === 1) since = board.instructions; else waited += board.instructions - since; });
  for (let i = 0; i < 300 && !board.restarts; i++) board.run(MS);
  if (board.restarts) throw new Error('the peer gave up');
  const samples = () => board.mcu.peripherals[0x40058].scratchData[1], before = samples();
  board.measure();
  waited = since = 0;
  board.run(FOR_MS * MS);
  if (board.lampOn()) waited += board.instructions - since;
  if (board.restarts) throw new Error('the peer gave up');
  return { good: samples() - before, instructions: board.instructions - waited };
}

const { good, instructions } = lanes ? ours() : peer();
tell({ samples_per_s: good * 1000 / FOR_MS, instructions_a_sample: Math.round(instructions / good) });
