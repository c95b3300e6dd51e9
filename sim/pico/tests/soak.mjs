// soak.mjs IMAGE FRAMES [LANES] [PERIOD]: a run of so many frames, each reading held against its sensor.
import { Bench, Judge, MS, tell, tmags } from './bench.mjs';

const [image, frames, lanes = 8, period = 30000] = process.argv.slice(2);
const bench = new Bench(image, tmags(+lanes));
const judge = new Judge(bench.board.sensors);
bench.enumerate();
bench.board.run(60 * MS);
bench.stream((raw) => judge.take(raw));
bench.board.measure();
const began = bench.board.mcu.clock.nanos, settings = { mask: 2 ** +lanes - 1, period: +period }, refused = bench.control(1, settings);
while (judge.frames < +frames) bench.board.run(10 * MS);
const seconds = (bench.board.mcu.clock.nanos - began) / 1e9, stopped = bench.control(0, settings);
bench.board.run(20 * MS);
tell({ refused, stopped, frames: judge.frames, lost: judge.lost, altered: judge.altered, doubled: judge.doubled, compared: judge.compared, off: judge.worst,
  last: judge.before.last, codes: judge.codes, counters: bench.counters(), worst_us: bench.board.worstReading / 120, busy: bench.board.busyNs / 1e9 / seconds,
  stack: 0x20040000 - bench.board.lowestStack, errors: bench.host.errors.slice(0, 5), naks: bench.host.naks, seconds });
