// checks.mjs IMAGE [NAME | --first]: what the image does by itself and on the bus, a line of JSON: name and null, or what went wrong;
// --first: until something does.
import { Bench, CODE, Judge, MS, decode, tell, tmags } from './bench.mjs';
import { Registers, SET_TO } from '../registers.mjs';
import { Mlx90393, Stranger, Tmag5170, wandering } from '../sensors.mjs';

const [image, only] = process.argv.slice(2);
const PERIOD = 30000, START = 5, HOST_REPORT = 44;

function want(is, text) { if (!is) throw new Error(text); }
function same(a, b, text) { want(JSON.stringify(a) === JSON.stringify(b), `${text}: ${JSON.stringify(a)}, not ${JSON.stringify(b)}`); }

function started(sensors, settings = {}, options = {}) {
  const bench = new Bench(image, sensors, options), judge = new Judge(bench.board.sensors), frames = [];
  bench.enumerate();
  bench.board.run(80 * MS);
  bench.stream((raw) => frames.push(judge.take(raw)), settings.bytes ?? 1024);
  same(bench.control(1, settings), null, 'start');
  return { bench, judge, frames, settings };
}
function regular({ bench, judge }) {
  same([judge.lost, judge.altered, judge.doubled, bench.host.errors], [0, 0, 0, []], 'lost, altered, doubled, errors of the bus');
  want(judge.compared > 0, 'no reading was compared');
}
function codes(run, lane) { return run.frames.map((f) => f.lanes[lane].code); }

/** A board that a host knows, and the frames that it will send. */
function recorded(lanes) {
  const bench = new Bench(image, tmags(lanes));
  bench.enumerate();
  bench.board.run(60 * MS);
  const frames = [];
  bench.stream((raw) => frames.push(decode(raw)));
  return [bench, frames];
}

const CHECKS = {
  what_the_chip_is_set_to() {
    const registers = new Registers(), run = started(tmags(16), { period: 30000 }, { registers });
    run.bench.board.run(20 * MS);
    same(registers.differences(), [], `of ${Object.keys(SET_TO).length} registers`);
    same(registers.memory(run.bench.board.mcu), [], 'memory of the controller');
    regular(run);
  },
  a_run_begins_with_tick_0_at_any_moment() {
    const [bench, frames] = recorded(1);
    for (let i = 0; i < 80; i++) {
      frames.length = 0;
      same(bench.control(1, { mask: 1 }), null, 'start');
      bench.board.run(1.9 * MS);
      same(bench.control(0, { mask: 1 }), null, 'stop');
      bench.board.run(1.2 * MS + 6.7e3 * i);
      same(frames.map((f) => f.tick), frames.map((_, at) => at), `ticks of start ${i}`);
      want(frames.length > 3 && frames.length < 8, `frames ${frames.length}`);
    }
  },
  lanes_that_were_idle_begin_with_a_good_reading() {
    const [bench, frames] = recorded(4);
    for (let idle = 1; idle < 18; idle++) { // conversions are numbered modulo 8
      same(bench.control(1, { mask: 3 }), null, 'start');
      bench.board.run(2 * MS);
      same(bench.control(1, { mask: 15 }), null, 'more lanes');
      bench.board.run(2 * MS);
      same(bench.control(1, { mask: 3 }), null, 'fewer');
      bench.board.run(idle * MS / 2);
      same(bench.control(1, { mask: 15 }), null, 'more again');
      bench.board.run(2 * MS);
      same(bench.control(0, { mask: 3 }), null, 'stop');
      bench.board.run(1.2 * MS + idle * MS / 2);
      const found = new Set(frames.splice(0).flatMap((f) => f.lanes.map((lane) => lane.code)));
      same([...found].filter((code) => code !== CODE.off), [CODE.ok], `codes after ${idle} ticks`);
    }
  },
  layouts_of_a_pair_of_axes() {
    for (const order of ['maker', 'plain', 'sheet'])
      for (const inverted of [0, 1]) {
        const run = started(tmags(2, { order, inverted }), { mask: 3 });
        run.bench.board.run(20 * MS);
        regular(run);
        want(run.frames.length > 30 && codes(run, 1).every((c) => c === 0), `${order} ${inverted}`);
      }
  },
  plain_registers_where_no_pair_fits() {
    const run = started(tmags(2, { special: false }), { mask: 3 });
    run.bench.board.run(20 * MS);
    regular(run);
    want(codes(run, 0).every((c) => c === 0), 'a code');
  },
  sixteen_lanes_at_1_khz() {
    const run = started(tmags(16), { mask: 0xffff, period: 60000 });
    run.bench.board.run(100 * MS);
    regular(run);
    want(run.frames.length >= 98 && run.judge.compared === 16 * run.frames.length, 'frames');
  },
  all_lanes_are_sampled_at_one_instant() {
    const run = started(tmags(16), { period: 60000 }), at = new Map();
    for (const [lane, sensor] of run.bench.board.sensors.entries()) { const pulse = sensor.pulse.bind(sensor); sensor.pulse = (now) => { at.set(lane, now); pulse(now); }; }
    run.bench.board.run(10 * MS);
    same(new Set(at.values()).size, 1, 'instants');
    same(at.size, 16, 'lanes');
  },
  mlx90393_at_500_hz() {
    const run = started([new Mlx90393(wandering(0)), new Mlx90393(wandering(1)), new Tmag5170(wandering(2))], { mask: 7, period: 120000 });
    run.bench.board.run(100 * MS);
    regular(run);
    want(run.frames.length >= 45, 'frames');
    for (const lane of [0, 1, 2]) want(codes(run, lane).slice(8).every((c) => c === 0), `lane ${lane}: ${codes(run, lane)}`);
  },
  mlx90393_faster_than_it_converts_is_late() {
    const run = started([new Mlx90393(wandering(0))], { mask: 1 });
    run.bench.board.run(50 * MS);
    same([...new Set(codes(run, 0).slice(50))].sort(), [CODE.ok, CODE.late], 'codes');
  },
  lanes_without_a_sensor_and_with_a_strange_one() {
    const sensors = tmags(2);
    sensors[2] = new Stranger();
    const run = started(sensors, { mask: 15 });
    run.bench.board.run(30 * MS);
    same([codes(run, 0).at(-1), codes(run, 2).at(-1), codes(run, 3).at(-1), codes(run, 4).at(-1), codes(run, 27).at(-1)], [CODE.ok, CODE.unknown, CODE.absent, CODE.off, CODE.off], 'codes');
  },
  a_line_stuck_low_is_told() {
    const sensors = tmags(1);
    sensors[2] = Object.assign(new Stranger(), { byte: () => 0 });
    const run = started(sensors, { mask: 5 });
    run.bench.board.run(30 * MS);
    same([codes(run, 0).at(-1), codes(run, 2).at(-1)], [CODE.ok, CODE.start], 'codes');
  },
  a_lost_and_a_weak_magnet() {
    const sensors = [new Tmag5170(() => [0.05, 0, 0.02]), new Tmag5170(() => [1, 1, 4.5]), new Tmag5170(() => [1, 1, 5.5]), new Mlx90393(() => [1, 1, 4.5]), new Tmag5170(() => [3, 5, -30])];
    const run = started(sensors, { mask: 31, period: 120000 });
    run.bench.board.run(30 * MS);
    same([0, 1, 2, 3, 4].map((lane) => codes(run, lane).at(-1)), [CODE.magnet, CODE.magnet, CODE.ok, CODE.magnet, CODE.ok], 'codes');
  },
  a_field_beyond_the_range_is_told() {
    const run = started([new Tmag5170(() => [110, 0, 20]), new Tmag5170(() => [0, 0, -110])], { mask: 3 });
    run.bench.board.run(10 * MS);
    same([0, 1].map((lane) => run.frames.at(-1).lanes[lane].errors), [2, 2], 'errors');
  },
  a_sensor_that_comes_later_is_found() {
    const run = started(tmags(1), { mask: 3 });
    run.bench.board.run(10 * MS);
    run.bench.board.sensors[1] = new Tmag5170(wandering(1));
    run.bench.board.run(100 * MS);
    same(codes(run, 1).at(-1), CODE.ok, 'code');
    regular(run);
  },
  a_sensor_that_lost_its_supply_is_set_up_again() {
    const run = started(tmags(2), { mask: 3 });
    run.bench.board.run(10 * MS);
    run.bench.board.sensors[1].registers.fill(0);
    run.bench.board.run(300 * MS);
    same(codes(run, 1).at(-1), CODE.ok, 'code');
  },
  the_conversion_line_stuck() {
    const run = started(tmags(2), { mask: 3 });
    run.bench.board.run(10 * MS);
    run.bench.board.lineStuck = true;
    run.bench.board.run(20 * MS);
    want(codes(run, 0).slice(-30).every((c) => c === CODE.stale), `codes ${codes(run, 0)}`);
    want(run.bench.counters().stale > 60, 'counter');
    run.bench.board.lineStuck = false;
    run.bench.board.run(5 * MS);
    same(codes(run, 1).at(-1), CODE.ok, 'code');
  },
  a_line_low_while_the_number_of_conversions_comes_round() {
    const run = started(tmags(2), { mask: 3 });
    run.bench.board.run(10.4 * MS);
    for (const ticks of [7, 15]) {
      const from = run.frames.length;
      run.bench.board.sensors[1].low = true;
      run.bench.board.run(ticks * MS / 2);
      run.bench.board.sensors[1].low = false;
      run.bench.board.run(10 * MS);
      same(codes({ frames: run.frames.slice(from) }, 1).filter((c) => c !== 0), [...Array(ticks).fill(CODE.start), CODE.resync], 'codes');
    }
  },
  a_damaged_frame_with_a_right_sum_is_seen() { // its number of the conversion, or Y, is not the other frame's
    const run = started(tmags(1), { mask: 1 }), plain = started(tmags(1, { special: false }), { mask: 1 });
    for (const [of, before, bits] of [[run, [], 0x13 << 4], [run, [], 0x13 << 8], [run, [0], 0x13 << 8], [run, [0], 0x13 << 21], [run, [], 0x13 << 27], [plain, [0, 0], 0x13 << 2]]) {
      of.bench.board.run(10.4 * MS);
      const from = of.frames.length;
      of.bench.board.sensors[0].flips.push(...before, bits);
      of.bench.board.run(10 * MS);
      const told = codes({ frames: of.frames.slice(from) }, 0).filter((c) => c !== 0);
      same(told[0], CODE.sum, `bits ${bits} behind ${before.length} frames: ${told}`);
      same(of.judge.altered, 0, 'altered');
    }
  },
  requests_of_chapter_9() {
    const OK = null, NO = 'stall', bench = new Bench(image, tmags(1));
    const rows = [
      [[0x80, 0, 0, 0, 0, 0, 2, 0], [OK, OK, OK]], [[0x80, 0, 1, 0, 0, 0, 2, 0], [NO, NO, NO]], [[0x81, 0, 0, 0, 1, 0, 2, 0], [NO, NO, OK]], [[0x81, 0, 0, 0, 2, 0, 2, 0], [NO, NO, NO]],
      [[0x82, 0, 0, 0, 0, 0, 2, 0], [OK, OK, OK]], [[0x82, 0, 0, 0, 0x81, 0, 2, 0], [NO, NO, OK]], [[0x82, 0, 0, 0, 0x83, 0, 2, 0], [NO, NO, NO]], [[0x82, 0, 0, 0, 1, 0, 2, 0], [NO, NO, NO]],
      [[2, 1, 0, 0, 0x81, 0, 0, 0], [NO, NO, OK]], [[2, 3, 0, 0, 0x82, 0, 0, 0], [NO, NO, OK]], [[2, 1, 5, 0, 0x81, 0, 0, 0], [NO, NO, NO]], [[2, 3, 0, 0, 0x81, 0, 2, 0], [NO, NO, NO]], [[0, 3, 1, 0, 0, 0, 0, 0], [NO, NO, NO]],
      [[0, 5, 128, 0, 0, 0, 0, 0], [NO, NO, NO]], [[0, 5, 5, 0, 1, 0, 0, 0], [NO, NO, NO]], [[0x80, 6, 0, 1, 0, 0, 18, 0], [OK, OK, OK]], [[0x80, 6, 0, 1, 0, 0, 0, 0], [OK, OK, OK]], [[0x80, 6, 1, 1, 0, 0, 18, 0], [NO, NO, NO]],
      [[0x80, 6, 0, 2, 0, 0, 255, 0], [OK, OK, OK]], [[0x80, 6, 0, 2, 0, 0, 9, 0], [OK, OK, OK]], [[0x80, 6, 3, 3, 9, 4, 255, 0], [OK, OK, OK]], [[0x80, 6, 99, 3, 9, 4, 255, 0], [NO, NO, NO]], [[0x80, 6, 0, 6, 0, 0, 10, 0], [NO, NO, NO]],
      [[0x80, 6, 0, 15, 0, 0, 255, 0], [OK, OK, OK]], [[0x80, 6, 0, 8, 0, 0, 255, 0], [NO, NO, NO]], [[0x81, 6, 0, 0x22, 1, 0, 255, 0], [OK, OK, OK]], [[0x81, 6, 0, 0x22, 0, 0, 255, 0], [NO, NO, NO]], [[0x80, 6, 0, 0x22, 0, 0, 255, 0], [NO, NO, NO]],
      [[0x80, 8, 0, 0, 0, 0, 1, 0], [OK, OK, OK]], [[0x80, 8, 1, 0, 0, 0, 1, 0], [NO, NO, NO]], [[0, 9, 2, 0, 0, 0, 0, 0], [NO, NO, NO]], [[0, 9, 1, 0, 1, 0, 0, 0], [NO, NO, NO]], [[0x81, 10, 0, 0, 1, 0, 1, 0], [NO, NO, OK]],
      [[0x81, 10, 0, 0, 2, 0, 1, 0], [NO, NO, NO]], [[1, 11, 0, 0, 0, 0, 0, 0], [NO, NO, OK]], [[1, 11, 1, 0, 0, 0, 0, 0], [NO, NO, NO]], [[0x82, 12, 0, 0, 0x81, 0, 2, 0], [NO, NO, NO]], [[0x80, 255, 0, 0, 0, 0, 64, 0], [NO, NO, NO]],
      [[0xc0, 0x20, 0, 0, 7, 0, 255, 0], [OK, OK, OK]], [[0xc0, 0x20, 0, 0, 5, 0, 255, 0], [NO, NO, NO]], [[0xc0, 0x21, 0, 0, 7, 0, 255, 0], [NO, NO, NO]], [[0xe0, 0, 0, 0, 0, 0, 2, 0], [NO, NO, NO]],
      [[0xa1, 2, 0, 0, 1, 0, 1, 0], [NO, NO, OK]], [[0x21, 10, 0, 4, 1, 0, 0, 0], [NO, NO, OK]], [[0x21, 10, 0, 0, 0, 0, 0, 0], [NO, NO, NO]], [[0xa1, 3, 0, 0, 1, 0, 1, 0], [NO, NO, NO]], [[0xa1, 1, 3, 3, 1, 0, 16, 0], [NO, NO, OK]],
      [[0xa1, 1, 99, 3, 1, 0, 64, 0], [NO, NO, NO]], [[0xa1, 1, 4, 3, 1, 0, 56, 0], [NO, NO, NO]], [[0x21, 9, 2, 3, 1, 0, 32, 0], [NO, NO, NO]], [[0x21, 9, 1, 3, 1, 0, 15, 0], [NO, NO, NO]],
    ];
    for (const state of [0, 1, 2]) {
      bench.host.plug();
      bench.board.run(MS);
      bench.host.reset();
      bench.board.run(2 * MS);
      if (state >= 1) same(bench.request([0, 5, 9, 0, 0, 0, 0, 0]).why, null, 'address');
      if (state >= 2) same(bench.request([0, 9, 1, 0, 0, 0, 0, 0]).why, null, 'configuration');
      for (const [setup, outcome] of rows) {
        same(bench.request(setup).why, outcome[state], `state ${state}, request ${setup}`);
        same(bench.request([0x80, 6, 0, 1, 0, 0, 18, 0]).bytes.length, 18, `after ${setup}`);
      }
    }
    same(bench.request([0, 5, 7, 0, 0, 0, 0, 0]).why, 'stall', 'an address once configured');
    same(bench.host.errors, [], 'errors of the bus');
  },
  descriptors_and_the_serial_number() {
    const bench = new Bench(image, tmags(1));
    bench.enumerate();
    const text = (index) => String.fromCharCode(...bench.request([0x80, 6, index, 3, 9, 4, 255, 0]).bytes.filter((_, i) => i >= 2 && i % 2 === 0));
    same([text(1), text(2), text(3)], ['CrunchBot', 'Whisker Pico', 'E661385283' + '7F2B21'], 'strings');
    const configuration = bench.request([0x80, 6, 0, 2, 0, 0, 255, 0]).bytes;
    same([configuration.length, configuration[7], configuration[8]], [50, 0x80, 50], 'configuration');
    same(bench.request([0x80, 6, 0, 2, 0, 0, 20, 0]).bytes.length, 20, 'part of it');
    same(bench.request([0xc0, 0x20, 0, 0, 7, 0, 255, 0]).bytes.length, 178, 'what Windows asks for');
  },
  reports() {
    const bench = new Bench(image, tmags(1));
    bench.enumerate();
    bench.board.run(80 * MS);
    const identity = Buffer.from(bench.get(3, 16).bytes);
    same([identity[0], identity[1], identity[2], identity[3], identity.readUInt32LE(4), identity.readUInt16LE(8), identity.readUInt16LE(10), identity[12], identity[13]], [3, 2, 28, 4, 60000000, 256, 16384, 8, 16], 'identity');
    same([bench.get(1, 16).bytes.length, bench.get(2, 32).bytes.length, bench.get(5, 176).bytes.length, bench.get(6, 32).bytes.length, bench.get(7, 44).bytes.length], [16, 32, 176, 32, 44], 'lengths');
    same([...bench.get(1, 16).bytes], [1, 2, 0, 16, 180, 8, 0, 0, 255, 255, 0, 0, 0x30, 0x75, 0, 0], 'control');
    const order = (command, item) => { const b = new Uint8Array(56); b.set([4, 2, command, item]); return bench.set(b); };
    const answer = (item) => { order(1, item); order(0, 0); const b = Buffer.from(bench.get(5, 176).bytes); return [0, 6].flatMap((at) => [b.readUInt16LE(8 + at), b.readUInt16LE(10 + at), b.readUInt16LE(12 + at) >> 10]); };
    same(answer(0), [0x2040, 0, 11, 0, 0, 32], 'chip');
    same(answer(2), [2, 0, 11, 0, 0, 32], 'wire');
    same(answer(3), [65535, 65535, 11, 0, 0, 32], 'serial number');
    same(answer(16 + 4), [0, 4, 11, 0, 0, 32], 'health');
    same(order(9, 0), 'stall', 'an order that there is not');
  },
  settings_out_of_their_limits_change_nothing() {
    const bench = new Bench(image, tmags(1));
    bench.enumerate();
    const before = [...bench.get(1, 16).bytes];
    const wrong = { 0: [7], 1: [1, 3], 2: [2], 3: [4, 7, 34], 4: [29], 5: [0, 17], 6: [1, 2, 16], 7: [1], 11: [0x10], 13: [0x69], 15: [1] };
    for (const [place, values] of Object.entries(wrong))
      for (const value of values) {
        const bytes = Uint8Array.from([1, 2, 1, 16, 180, 8, 0, 0, 1, 0, 0, 0, 0x30, 0x75, 0, 0]);
        bytes[place] = value;
        same(place === '0' ? bench.request([0x21, 9, 1, 3, 1, 0, 16, 0], bytes).why : bench.set(bytes), 'stall', `byte ${place} is ${value}`);
      }
    same([...bench.get(1, 16).bytes], before, 'control');
    same(bench.control(0, { mask: 0xfffffff }), null, 'lanes that are not wired');
    same([...bench.get(1, 16).bytes].slice(8, 12), [255, 255, 0, 0], 'lane mask');
  },
  a_run_begins_at_0_and_ends_with_a_short_transfer() {
    const run = started(tmags(1), { mask: 1, bytes: 16384 });
    run.bench.board.run(20 * MS);
    same(run.bench.control(0, run.settings), null, 'stop');
    run.bench.board.run(20 * MS);
    const f = run.frames;
    same([f[0].tick, Number(f[0].time), f.at(-1).last, f.filter((x) => x.last).length], [0, 0, 1, 1], 'first and last');
    want(f.every((x, i) => x.tick === i && Number(x.time) === PERIOD * i && x.mask === 1), 'ticks and times');
    const c = run.bench.counters();
    same([c.ticks, c.frames, c.dropped, c.good], [f.length, f.length, 0, f.length], 'counters');
    same(run.bench.control(1, run.settings), null, 'start again');
    run.bench.board.run(45 * MS);
    same(run.bench.control(0, run.settings), null, 'stop again');
    run.bench.board.run(20 * MS);
    same([run.frames.filter((x) => x.last).length, run.frames[f.findIndex((x) => x.last) + 1].tick], [2, 0], 'second run');
    regular(run);
  },
  a_configuration_ends_the_run_the_same_one_too() {
    const run = started(tmags(1), { mask: 1 });
    run.bench.board.run(10 * MS);
    run.bench.host.bulk.length = run.bench.host.toggles[1] = 0;
    same(run.bench.request([0, 9, 1, 0, 0, 0, 0, 0]).why, null, 'configuration');
    const frames = [];
    run.bench.stream((raw) => frames.push(decode(raw)));
    run.bench.board.run(10 * MS);
    same([frames.length, run.bench.get(1, 16).bytes[2]], [0, 0], 'frames and run after it');
    same(run.bench.control(1, run.settings), null, 'start');
    run.bench.board.run(10 * MS);
    same([frames[0]?.tick, run.bench.host.errors], [0, []], 'first frame, errors of the bus');
  },
  start_of_frame_numbers() {
    const run = started(tmags(1), { mask: 1 });
    run.bench.board.run(10 * MS);
    const known = run.frames.slice(1).map((f) => f.usb);
    want(known.every((u) => u & 0x8000 && (u & 7) === 0), `usb_time ${known}`);
    want(Math.abs((known.at(-1) >> 3 & 2047) - run.bench.host.frame) <= 1, 'frame number');
    const timing = Buffer.from(run.bench.get(6, 32).bytes);
    want(timing.readUInt16LE(8) <= 65400, 'cycles since the start of frame');
  },
  a_full_fifo_drops_and_counts() {
    const run = started(tmags(1), { mask: 1 });
    run.bench.board.run(10 * MS);
    run.bench.host.storm = 6000;
    run.bench.board.run(100 * MS);
    want(run.frames.at(-1).dropped > 10 && run.judge.lost === run.frames.at(-1).dropped, `dropped ${run.frames.at(-1).dropped}, lost ${run.judge.lost}`);
    same([run.judge.altered, run.judge.doubled], [0, 0], 'altered, doubled');
    run.bench.host.storm = 6000;
    same(run.bench.control(0, run.settings) ?? 'timeout', 'timeout', 'stop') ?? 0;
    run.bench.board.run(60 * MS);
    same(run.frames.at(-1).last, 1, 'the last frame finds a place');
  },
  lost_handshakes_double_nothing() {
    const run = started(tmags(2), { mask: 3 });
    for (let i = 0; i < 50; i++) { run.bench.host.loseAcks = 1 + i % 3; run.bench.board.run(3 * MS); }
    regular(run);
    want(run.bench.host.lost > 90, 'handshakes');
  },
  a_control_transfer_given_up() {
    const bench = new Bench(image, tmags(1));
    bench.enumerate();
    for (const [setup, data] of [[[0x80, 6, 0, 2, 0, 0, 255, 0]], [[0xa1, 1, 5, 3, 1, 0, 176, 0]], [[0x21, 9, 1, 3, 1, 0, 16, 0], new Uint8Array(16)], [[0, 9, 1, 0, 0, 0, 0, 0]]])
      for (const stage of ['in', 'out', 'status', 'confirm']) {
        bench.request(setup, data, stage);
        same(bench.get(3, 16).bytes.length, 16, `after ${setup} given up at ${stage}`);
        bench.request(setup, data, stage);
        same(bench.control(0), null, `a report after ${setup} given up at ${stage}`);
      }
    bench.request([0x80, 6, 0, 1, 0, 0, 18, 0], undefined, 'status');
    bench.host.reset();
    bench.board.run(4 * MS);
    same(bench.host.errors, [], 'errors of the bus');
  },
  a_halted_endpoint_goes_on_with_data0() {
    const run = started(tmags(1), { mask: 1 });
    run.bench.board.run(5 * MS);
    same(run.bench.request([2, 3, 0, 0, 0x81, 0, 0, 0]).why, null, 'halt');
    run.bench.board.run(5 * MS);
    const before = run.frames.length;
    let why;
    run.bench.host.read(1024, (end) => { why = end; });
    run.bench.board.run(2 * MS);
    same(why, 'stall', 'a read of the halted endpoint');
    same(run.bench.request([0x82, 0, 0, 0, 0x81, 0, 2, 0]).bytes[0], 1, 'status');
    same(run.bench.request([2, 1, 0, 0, 0x81, 0, 0, 0]).why, null, 'clear');
    run.bench.host.toggles[1] = 0;
    run.bench.stream((raw) => run.frames.push(run.judge.take(raw)));
    run.bench.board.run(10 * MS);
    want(run.frames.length > before + 10, 'frames');
    same(run.bench.host.errors, [], 'errors of the bus');
    const idle = new Bench(image, tmags(1));
    idle.enumerate();
    for (const feature of [3, 1]) same(idle.request([2, feature, 0, 0, 0x81, 0, 0, 0]).why, null, 'halt and clear without a run');
    idle.host.read(1024, (end) => { why = end ?? 'data'; });
    why = null;
    idle.board.run(2 * MS);
    same(why, null, 'a read with nothing to give');
  },
  a_reset_ends_the_run() {
    const run = started(tmags(1), { mask: 1 });
    run.bench.board.run(10 * MS);
    run.bench.host.storm = 400; // a packet waits, so that the reset finds one
    run.bench.board.run(2 * MS);
    run.bench.host.reset();
    run.bench.board.run(5 * MS);
    run.bench.enumerate(9);
    same(Buffer.from(run.bench.get(2, 32).bytes)[2], 0, 'running');
    const frames = [];
    run.bench.stream((raw) => frames.push(decode(raw)));
    same(run.bench.control(1, { mask: 1 }), null, 'start');
    run.bench.board.run(10 * MS);
    want(frames.length > 10 && frames.every((f, i) => f.tick === i), 'ticks');
    same(run.bench.host.errors, [], 'errors of the bus');
  },
  unplugged_and_plugged_in_again() {
    const run = started(tmags(1), { mask: 1 });
    run.bench.board.run(10 * MS);
    run.bench.host.unplug();
    run.bench.board.run(50 * MS);
    run.bench.enumerate(3);
    const frames = [];
    run.bench.stream((raw) => frames.push(decode(raw)));
    same(run.bench.control(1, { mask: 1 }), null, 'start');
    run.bench.board.run(10 * MS);
    want(frames.length > 10 && frames[0].tick === 0, 'frames');
  },
  in_suspend_ticks_are_counted_not_made() {
    const run = started(tmags(1), { mask: 1 });
    run.bench.board.run(10 * MS);
    run.bench.host.suspend();
    run.bench.board.run(2 * MS);
    const pulses = run.bench.board.pulses, made = run.frames.length;
    run.bench.board.run(50 * MS);
    same([run.bench.board.pulses - pulses, run.bench.board.restarts], [0, 0], 'conversions, restarts');
    run.bench.host.resume();
    run.bench.board.run(20 * MS);
    const steps = run.frames.slice(1).map((f, i) => [f.tick - run.frames[i].tick, f.sequence - run.frames[i].sequence]);
    want(steps.filter(([t, s]) => t > 90 && s === 1).length === 1 && steps.filter(([t]) => t > 1).length === 1, `steps ${steps}`);
    want(run.frames.length > made + 20, 'frames');
  },
  every_frame_in_a_transfer_of_its_own_and_the_pattern() {
    const run = started(tmags(1), { mask: 1, options: 12, bytes: 16384 });
    run.bench.board.run(20 * MS);
    want(run.frames.length > 25, `frames ${run.frames.length}`);
    for (const f of run.frames) same([f.lanes[0].alpha, f.lanes[0].beta], [0x8000 + 255 - (f.tick & 255), 0x4000 + (f.tick & 255)], 'pattern');
  },
  the_watchdog_and_a_fault_begin_anew() {
    for (const [name, harm, code, ms] of [['watchdog', (m) => { m.ppb.systickIntEnable = false; }, CODE.watchdog, 1100], ['fault', (m) => { m.core.PC = m.readUint32(0x2000000c) & ~1; }, CODE.trap, 5]]) {
      const bench = new Bench(image, tmags(1)), frames = [];
      bench.board.run(60 * MS);
      harm(bench.board.mcu);
      for (let i = 0; i < ms && !bench.board.restarts; i++) bench.board.run(MS);
      same(bench.board.restarts, 1, `${name}: restarts`);
      bench.enumerate();
      bench.stream((raw) => frames.push(decode(raw)));
      bench.control(1, { mask: 1 });
      bench.board.run(40 * MS);
      same([frames[0].lanes[0].code, frames.at(-1).lanes[0].code], [code, CODE.ok], `${name}: codes`);
      bench.board.mcu.ppb.systickIntEnable = false;
      for (let i = 0; i < 1100 && bench.board.restarts < 2; i++) bench.board.run(MS);
      const later = [];
      bench.enumerate();
      bench.stream((raw) => later.push(decode(raw)));
      bench.control(1, { mask: 1 });
      bench.board.run(2 * MS);
      same(later[0].lanes[0].code, CODE.watchdog, `${name}, then the watchdog`);
    }
  },
  the_kind_of_reset_is_told_until_the_sensor_is_there() {
    const bench = new Bench(image, tmags(16));
    bench.board.power(null, 1 << 16);
    const frames = [];
    bench.board.run(MS);
    bench.enumerate();
    bench.stream((raw) => frames.push(decode(raw)));
    bench.control(1);
    bench.board.run(60 * MS);
    same([...new Set(frames.map((f) => f.lanes[15].code))], [CODE.power, CODE.ok], 'codes');
  },
  the_order_for_the_boot_drive() {
    const run = started(tmags(1), { mask: 1 }), order = new Uint8Array(HOST_REPORT);
    order.set([7, 2, 4]);
    same(run.bench.set(order), 'stall', 'in a run');
    run.bench.control(0, run.settings);
    run.bench.board.run(5 * MS);
    order[2] = 3;
    same(run.bench.set(order), 'stall', 'another order');
    order[2] = 4;
    same([run.bench.set(order), run.bench.board.drive], [null, false], 'confirmed first');
    run.bench.board.run(40 * MS);
    same(run.bench.board.drive, true, 'boot drive');
  },
  the_lamp() {
    const bench = new Bench(image, tmags(1)), changes = (ms) => { let n = 0; for (let i = 0, was = bench.board.lampOn(); i < ms; i++) { bench.board.run(MS); if (bench.board.lampOn() !== was) { n++; was = !was; } } return n; };
    const idle = changes(1200);
    bench.enumerate();
    bench.board.run(20 * MS);
    const used = changes(300);
    bench.control(1, { mask: 3 });
    bench.board.run(20 * MS);
    const missing = changes(500);
    want(idle >= 2 && idle <= 3 && used === 0 && bench.board.lampOn() !== undefined && missing >= 3 && missing <= 5, `changes ${[idle, used, missing]}`);
  },
};

for (const [name, check] of Object.entries(CHECKS)) {
  if (only && only !== '--first' && name !== only) continue;
  let error = null;
  const began = process.cpuUsage().user;
  try { check(); } catch (thrown) { error = process.env.TRACE ? thrown.stack : thrown.message; }
  tell({ name, error, cpu_s: +((process.cpuUsage().user - began) / 1e6).toFixed(2) });
  if (error && only === '--first') break;
}
