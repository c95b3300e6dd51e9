/* Bins of the traces as they came: lowest and highest counts of each lane and axis, by bin number modulo KEEP. */
const KEEP = 4096;
const NOTHING = { low: 0xffff, high: 0 };
const HEADER_BYTES = 24;

class History {
  constructor(lanes) {
    this.planes = Array.from({ length: lanes }, () => ({
      low: [new Uint16Array(KEEP), new Uint16Array(KEEP)], // alpha, beta
      high: [new Uint16Array(KEEP), new Uint16Array(KEEP)],
      bad: new Uint8Array(KEEP),
    }));
    this.subscription = 0;
    this.clear();
  }

  clear() {
    this.end = 0; // the bin after the newest
    this.begin = 0; // the oldest held
    this.skipped = 0; // bins that this page was too slow for
    this.width = 0; // ticks per bin
  }

  /* Takes a block of topic traces (docs/view.md); one of an earlier subscription is left alone. */
  take(buffer) {
    const head = new DataView(buffer);
    if (head.getUint32(12, true) !== this.subscription) return false;
    const bins = head.getUint16(4, true);
    const first = Number(head.getBigUint64(16, true));
    if (head.getUint8(1) & 1) {
      this.clear();
      this.begin = this.end = first;
    }
    this.width = head.getUint16(2, true);
    this.forget(first);
    this.store(buffer, head.getUint32(8, true), head.getUint8(6), first, bins);
    this.end = first + bins;
    this.begin = Math.max(this.begin, this.end - KEEP);
    return true;
  }

  forget(first) {
    this.skipped += first - this.end;
    for (let bin = Math.max(this.end, first - KEEP); bin < first; bin++) {
      for (const plane of this.planes) this.put(plane, bin % KEEP, NOTHING.low, NOTHING.high);
    }
  }

  put(plane, at, low, high) {
    plane.low[0][at] = plane.low[1][at] = low;
    plane.high[0][at] = plane.high[1][at] = high;
    plane.bad[at] = 0;
  }

  store(buffer, mask, lanes, first, bins) {
    const counts = new Uint16Array(buffer, HEADER_BYTES, 4 * lanes * bins);
    const bad = new Uint8Array(buffer, HEADER_BYTES + 8 * lanes * bins, lanes * bins);
    let row = 0;
    this.planes.forEach((plane, lane) => {
      if (!((mask >>> lane) & 1)) return;
      for (const axis of [0, 1]) {
        copy(plane.low[axis], counts, (axis * lanes + row) * bins, first, bins);
        copy(plane.high[axis], counts, ((2 + axis) * lanes + row) * bins, first, bins);
      }
      copy(plane.bad, bad, row * bins, first, bins);
      row += 1;
    });
  }
}

/* `bins` values of `from` at `offset` into the circular array `to`, at bin `first`. */
function copy(to, from, offset, first, bins) {
  const at = first % KEEP;
  const before = Math.min(bins, KEEP - at);
  to.set(from.subarray(offset, offset + before), at);
  if (before < bins) to.set(from.subarray(offset + before, offset + bins), 0);
}
