// soak.mjs IMAGE FRAMES [LANES] [PERIOD] [SEED]: a run of so many frames, each reading held against its sensor. A line every 20 000
// frames, the last one of all.
import { Bench, Judge, MS, tell, tmags } from './bench.mjs';

const [image, frames, lanes = 8, period = 30000, seed = 0] = process.argv.slice(2);
const bench = new Bench(image, tmags(+lanes, {}, +seed));
const judge = new Judge(bench.board.sensors);
bench.enumerate();
bench.board.run(60 * MS);
bench.stream((raw) => judge.take(raw));
bench.board.measure();
const began = bench.board.mcu.clock.nanos, settings = { mask: 2 ** +lanes - 1, period: +period }, refused = bench.control(1, settings);
const so_far = () => ({ frames: judge.frames, lost: judge.lost, altered: judge.altered, doubled: judge.doubled, compared: judge.compared, off: judge.worst,
  codes: judge.codes, worst_us: bench.board.worstReading / 120, stack: 0x20040000 - bench.board.lowestStack, errors: bench.host.errors.slice(0, 5) });
for (let next = 20000; judge.frames < +frames; next += 20000) {
  while (judge.frames < Math.min(next, +frames)) bench.board.run(10 * MS);
  if (next < +frames) tell(so_far());
}
const seconds = (bench.board.mcu.clock.nanos - began) / 1e9, busy = bench.board.busyNs / 1e9 / seconds, stopped = bench.control(0, settings);
bench.board.run(20 * MS);
tell({ ...so_far(), refused, stopped, last: judge.before.last, counters: bench.counters(), busy, naks: bench.host.naks, seconds });
