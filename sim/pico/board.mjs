// A Pico with sensors: rp2040js executes the image; here are the chip's ROM, the flash's number, resets, wiring, pulses.
import { ConsoleLogger, LogLevel, RP2040 } from 'rp2040js';

export const SELECT = [5, 16, 6, 17, 7, 18, 8, 19, 9, 20, 13, 21, 14, 26, 15, 27];
export const BUSES = [{ sck: 2, mosi: 3, miso: 4 }, { sck: 10, mosi: 11, miso: 12 }];
export const CONVERT = 22, LAMP = 25;
const RAM = 0x20000000, BOOT2_AT = 0x20041f00, FLASH_NUMBER = [0xe6, 0x61, 0x38, 0x52, 0x83, 0x7f, 0x2b, 0x21];
const IRQ_READING = 16, NEEDED = { io: 1 << 5, pads: 1 << 8, spi0: 1 << 16, spi1: 1 << 17, timer: 1 << 21, usb: 1 << 24, plls: 3 << 12 };

// CRC-32 of boot stage 2, bit by bit, as the ROM checks it.
export function romCrc(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc = (crc ^ (byte << 24)) >>> 0;
    for (let i = 0; i < 8; i++) crc = ((crc << 1) ^ (crc & 0x80000000 ? 0x04c11db7 : 0)) >>> 0;
  }
  return crc;
}

// The flash behind the SSI: answers command 4Bh with its number; else XIP.
class Flash {
  constructor(number) { Object.assign(this, { number, enabled: 0, control: 0, control1: null, baud: 0, select: 0, out: [], place: 0, xip: false }); }
  writeUint32Atomic(offset, value) {
    if (offset === 0x00) this.control = value;
    else if (offset === 0x08) { this.enabled = value; this.place = 0; this.out = []; }
    else if (offset === 0x04) this.control1 = value;
    else if (offset === 0x10) this.select = value;
    else if (offset === 0x14) this.baud = value;
    else if (offset === 0xf4) this.xip = value === ((0x03 << 24) | (2 << 8) | (6 << 2));
    else if (offset === 0x60 && this.enabled && this.select === 1 && this.baud >= 4 && this.control === 7 << 16) {
      if (this.place === 0) this.command = value;
      this.out.push(this.command === 0x4b && this.place >= 5 ? this.number[this.place - 5] : 0xff);
      this.place++;
    }
  }
  readUint32(offset) { return offset === 0x24 ? this.out.length : offset === 0x60 ? this.out.shift() ?? 0 : 0; }
  readable() { return this.enabled === 1 && this.xip && this.control1 === 0 && this.baud >= 4 && this.baud % 2 === 0 && this.control === ((31 << 16) | (3 << 8)); }
}

export class Board {
  constructor(image, sensors, { number = FLASH_NUMBER, registers = null } = {}) {
    Object.assign(this, { image, sensors, number, registers, pulses: 0, lineStuck: false, drive: false, restarts: 0 });
    this.power();
  }

  // Power is given, or a watchdog begins anew: then its reason and its scratch registers stay.
  power(kept = null, chipReset = 1 << 8) {
    if (kept && this.mcu.peripherals[0x40010].wdsel !== 0x1fffc) throw new Error('the watchdog leaves parts of the chip as they are');
    const m = this.mcu = new RP2040(), { clock } = m;
    clock.nanosCounter = kept?.nanos ?? 0;
    for (const sensor of this.sensors) if (sensor) sensor.pending = null;
    m.logger = new ConsoleLogger(LogLevel.Error);
    m.flash.set(this.image);
    m.usbDPRAM.fill(0xa5); // what the ROM left there
    this.measure();
    const flash = m.peripherals[0x18000] = new Flash(this.number);
    m.peripherals[0x40064] = { readUint32: (offset) => (offset === 8 ? chipReset : 0), writeUint32Atomic() {} };
    const resets = this.resets = m.peripherals[0x4000c], watchdog = m.peripherals[0x40058];
    resets.reset = 0x1ffffff;
    Object.defineProperty(resets, 'reset_done', { get: () => ~resets.reset & 0x1ffffff });
    if (kept) { watchdog.scratchData.set(kept.scratch); watchdog.reason = kept.reason; }
    watchdog.tickEnable = false;
    const ticks = watchdog.writeUint32.bind(watchdog);
    watchdog.writeUint32 = (offset, value) => { if (offset === 0 && ![1 << 30, 2 ** 31, -(2 ** 31)].includes(value)) throw new Error(`the watchdog is told ${value}`); if (offset === 0x2c) this.microsecond = (value & 0x3ff) === (12 | 1 << 9); ticks(offset, value); };
    this.microsecond = false;
    watchdog.onWatchdogTrigger = () => {
      watchdog.timer.enable = false; // the stock model would fire again at once
      this.again = { nanos: clock.nanos, scratch: watchdog.scratchData, reason: watchdog.reason };
    };
    // ROM: the table and what looks up in it; the function found stops the processor (BKPT).
    m.bootrom[0x14 / 4] = 0x0040;
    m.bootrom[0x18 / 4] = 0x0021;
    m.bootrom.set([0x47704800, 0x00000031], 0x20 / 4); // ldr r0, [pc]; bx lr; 0x31
    m.bootrom[0x30 / 4] = 0xbe55be55;
    m.onBreak = (code) => { if (code === 0x55) this.drive = true; else throw new Error(`breakpoint ${code}`); };
    this.wire(m);
    const boot2 = this.image.subarray(0, 256);
    if (romCrc(boot2.subarray(0, 252)) !== new DataView(boot2.buffer, boot2.byteOffset).getUint32(252, true)) throw new Error('the ROM refuses boot stage 2: its CRC is wrong');
    m.sram.set(boot2, BOOT2_AT - RAM);
    m.core.SP = 0x20041f00;
    m.core.PC = BOOT2_AT;
    this.registers?.watch(m, resets);
    const program = m.readUint32.bind(m);
    m.readUint32 = (at) => { if (at >>> 0 >= 0x10000000 && at >>> 0 < 0x11000000 && !flash.readable()) throw new Error('flash is read before it is readable'); return program(at); };
    this.usbChanged?.();
  }

  wire(m) {
    this.chosen = [null, null];
    SELECT.forEach((pin, lane) => m.gpio[pin].addListener((state) => this.select(lane, state === 0)));
    m.gpio[CONVERT].addListener((state, before) => {
      if (state === 1 && before === 0 && !this.lineStuck) {
        this.pulses++;
        for (const sensor of this.sensors) sensor?.pulse(m.clock.nanos);
      }
    });
    m.spi.forEach((spi, bus) => {
      let received = 0;
      const write = spi.writeUint32.bind(spi);
      spi.writeUint32 = (offset, value) => { if (offset === 0 && spi.enabled) throw new Error('SSPCR0 is changed while the SPI is on'); write(offset, value); };
      const done = m.clock.createAlarm(() => spi.completeTransmit(received));
      spi.onTransmit = (value) => {
        received = 0;
        for (let left = spi.dataBits - 8; left >= 0; left -= 8) received = (received << 8) | this.exchange(bus, value >> left & 255, spi);
        if (spi.clockFrequency > 10e6) throw new Error('SCK is faster than the sensors take');
        done.schedule(spi.dataBits * 1e9 / spi.clockFrequency);
      };
    });
  }

  select(lane, low) {
    const bus = lane % 2;
    if (low && this.chosen[bus] !== null) throw new Error(`lanes ${this.chosen[bus]} and ${lane} are selected at once`);
    this.chosen[bus] = low ? lane : null;
    if (low) this.sensors[lane]?.select(this.mcu.clock.nanos);
  }

  // One byte each way. Nothing drives MISO: the pad's pull-up does, if it is on.
  exchange(bus, value, spi) {
    const { sck, mosi, miso } = BUSES[bus], m = this.mcu, sensor = this.sensors[this.chosen[bus]];
    const pulled = m.gpio[miso].pullupEnabled && !m.gpio[miso].pulldownEnabled && m.gpio[miso].inputEnable ? 0xff : 0;
    const wired = [sck, mosi, miso].every((pin) => m.gpio[pin].functionSelect === 1) && spi.dataBits % 8 === 0 && spi.enabled;
    if (sensor?.low) return 0; // a short: nothing else counts
    if (!sensor || sensor.away || !wired || this.resets.reset & (NEEDED.io | NEEDED.pads | NEEDED[`spi${bus}`])) return pulled;
    const mode = spi.control0 >> 6 & 3; // SPH, SPO
    if (sensor.mode !== null && mode !== sensor.mode) return sensor.mode === 3 ? 0 : pulled;
    return sensor.byte(value);
  }

  lampOn() { return this.mcu.gpio[LAMP].value === 1; }
  clocksRight() { const m = this.mcu; return this.microsecond && m.clkSys === 120e6 && m.clkPeri === 120e6 && m.pllUsb.frequency === 48e6 && (m.clocks.usbCtrl & 0x800) !== 0 && m.clocks.refCtrl === 2 && m.peripherals[0x40024].startup * 256 / 12e6 > 1e-3 && !(this.resets.reset & (NEEDED.usb | NEEDED.plls)); }
  measure() { Object.assign(this, { busyNs: 0, instructions: 0, worstReading: 0, reading: 0, lowestStack: 0x20040000 }); }

  // Executes for so long. The stock loop does not let SysTick end WFI.
  run(ns) {
    const end = this.mcu.clock.nanos + ns;
    while (this.mcu.clock.nanos < end && !this.drive) {
      const m = this.mcu, core = m.core, clock = m.clock;
      if (core.waiting && core.interruptsUpdated && core.checkForInterrupts()) core.waiting = false;
      if (core.waiting) {
        clock.tick(Math.max(1, Math.min(clock.nextAlarm ? clock.nanosToNextAlarm : 1e5, end - clock.nanos)));
      } else {
        const cycles = core.executeInstruction(), time = cycles * 1e9 / m.clkSys;
        this.instructions++;
        this.busyNs += time;
        if (core.IPSR === IRQ_READING || this.reading) {
          this.reading += cycles;
          if (core.IPSR === 0) { if (this.reading > this.worstReading) this.worstReading = this.reading; this.reading = 0; }
        }
        if (core.SP < this.lowestStack && core.SP >= RAM) this.lowestStack = core.SP;
        clock.tick(time);
      }
      if (this.again) {
        const kept = this.again;
        this.again = null;
        this.restarts++;
        this.power(kept, 0);
      }
    }
  }
}
