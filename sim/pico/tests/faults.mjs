// faults.mjs IMAGE COUNT SEED: faults drawn at random, each put into a run of 8 lanes; what was told of each. A line every
// 500 faults, the last one of all.
import { Bench, CODE, Judge, MS, tell, tmags } from './bench.mjs';

const [image, count, seed] = process.argv.slice(2);
let state = (+seed + 1) >>> 0;
const draw = (n) => { state = (Math.imul(state, 1664525) + 1013904223) >>> 0; return Math.floor(state / 2 ** 32 * n); };
const SETTINGS = { mask: 255 }, LANES = 8;
const sensors = tmags(LANES), bench = new Bench(image, sensors);
let judge, told, address = 1;

function begin() {
  bench.enumerate(address = address % 100 + 1);
  judge = new Judge(sensors);
  told = [];
  bench.stream((raw) => { const f = judge.take(raw); f.lanes.forEach((lane, n) => { if (lane.code !== CODE.ok && lane.code !== CODE.off) told.push([n, lane.code, f.tick]); }); });
  const refused = bench.control(1, SETTINGS);
  if (refused) throw new Error(`start: ${refused}`);
  bench.board.run(5 * MS);
}
// What was told since: pairs of lane and code, each once, and how often.
function since(act, ms) {
  const from = told.length;
  act();
  bench.board.run(ms * MS);
  const found = {};
  for (const [lane, code] of told.slice(from)) found[`${lane}:${code}`] = (found[`${lane}:${code}`] ?? 0) + 1;
  return found;
}
// One lane, this code so often, and then once that the sensor's next pair of axes was chosen anew.
function only(found, lane, code, least, most) {
  const keys = Object.keys(found).sort(), n = found[`${lane}:${code}`];
  return JSON.stringify(keys) === JSON.stringify([`${lane}:${CODE.resync}`, `${lane}:${code}`].sort()) && n >= least && n <= most && found[`${lane}:${CODE.resync}`] === 1 ? null : found;
}
// As it begins and ends a frame may be cut in two: its sum is wrong.
function marred(mark, code) {
  const lane = draw(LANES), ms = 2 + draw(20), cut = `${lane}:${CODE.sum}`;
  const found = since(() => { sensors[lane][mark] = true; bench.board.run(ms * MS); sensors[lane][mark] = false; }, 8);
  if (found[cut] <= 2) delete found[cut];
  return only(found, lane, code, 2 * ms - 2, 2 * ms + 2);
}

const KINDS = {
  crc_of_an_answer() { const lane = draw(LANES), bit = 2 ** (draw(28) + 4); return only(since(() => sensors[lane].flips.push(...(draw(2) ? [0, bit] : [bit])), 6), lane, CODE.sum, 1, 1); },
  absent_for_a_while() { return marred('away', CODE.absent); },
  line_low_for_a_while() { return marred('low', CODE.start); },
  conversion_line_stuck() {
    const ms = 2 + draw(20), found = since(() => { bench.board.lineStuck = true; bench.board.run(ms * MS); bench.board.lineStuck = false; }, 6);
    return Object.keys(found).length === LANES && Object.entries(found).every(([key, n]) => key.endsWith(`:${CODE.stale}`) && Math.abs(n - 2 * ms) <= 2) ? null : found;
  },
  nak_storm() {
    const naks = 100 + draw(6000), dropped = judge.before.dropped, lost = judge.lost, found = since(() => { bench.host.storm = naks; }, naks * 8 / 1000 * 1.1 + 40);
    return Object.keys(found).length === 0 && judge.lost - lost === judge.before.dropped - dropped && (naks > 3500 || judge.lost === lost) ? null : { found, naks };
  },
  lost_handshakes() { const lost = judge.lost, found = since(() => { bench.host.loseAcks = 1 + draw(5); }, 5); return Object.keys(found).length === 0 && judge.lost === lost ? null : found; },
  bus_reset() { bench.host.reset(); bench.board.run(draw(5) * MS); begin(); return judge.frames > 5 && judge.lost === 0 ? null : { frames: judge.frames }; },
  unplugged() { bench.host.unplug(); bench.board.run(draw(30) * MS); begin(); return judge.frames > 5 && judge.lost === 0 ? null : { frames: judge.frames }; },
};

bench.enumerate();
bench.board.run(60 * MS);
begin();
const wrong = [], kinds = {};
let altered = 0;
for (let i = 0; i < +count; i++) {
  const kind = Object.keys(KINDS)[draw(Object.keys(KINDS).length)], before = judge;
  const trouble = KINDS[kind]();
  kinds[kind] = (kinds[kind] ?? 0) + 1;
  for (const j of before === judge ? [judge] : [before, judge]) { altered += j.altered + j.doubled; j.altered = j.doubled = 0; }
  if (trouble || altered || bench.host.errors.length) { wrong.push({ i, kind, trouble, altered, errors: bench.host.errors.splice(0) }); altered = 0; if (wrong.length > 20) break; }
  if ((i + 1) % 500 === 0 && i + 1 < +count) tell({ faults: i + 1, kinds, wrong });
}
tell({ faults: +count, kinds, wrong });
