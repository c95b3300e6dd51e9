/* The traces: a row per lane, in it a strip per axis; one bin is one column of device pixels. Plots are drawn on a canvas by
   our own code: the page works without a network, and no plot library has to be served with it. */
const GUTTER = 86; // px left of the strips, for labels
const FOOT = 22; // px below, for the time axis
const HEAD = 280; // px of the window that are not for traces
const ROW_MIN = 26;
const ROW_MAX = 130;
const SPANS = [0.5, 1, 1.5, 2, 3, 5, 7, 10, 15, 20, 30, 50, 70, 100, 180]; // degrees a strip may show
const QUIET = 1; // degrees: an automatic height does not go below, or noise would look like motion
const SHRINK = 2.5; // an automatic height shrinks when it is so many times too large
const LABELS_MIN = 30; // px of a strip that has room for the labels of both its ends
const GLYPH = ['α', 'β'];

class Traces {
  constructor(history, view) {
    this.history = history;
    this.view = view; // { lanes: [numbers], axes: [0, 1], range: 'auto', tickS }
    this.box = document.getElementById('plot');
    this.grid = document.getElementById('grid');
    this.curves = document.getElementById('curves');
    this.marker = document.getElementById('cursor');
    this.strips = [];
    this.column = null; // of the cursor, in device pixels from the right
    this.columns = 1; // of pixels, for bins
    new ResizeObserver(() => { if (this.box.clientWidth !== this.wide) this.layOut(); }).observe(this.box);
  }

  /* Make a strip per lane and axis and as much room as they need. */
  layOut() {
    const { lanes, axes } = this.view;
    const room = Math.max(300, innerHeight - HEAD);
    const row = Math.min(ROW_MAX, Math.max(ROW_MIN * Math.sqrt(axes.length), Math.floor((room - FOOT) / Math.max(1, lanes.length))));
    const height = Math.max(120, row * lanes.length + FOOT);
    this.box.style.height = `${height}px`;
    this.ratio = devicePixelRatio || 1;
    this.wide = this.box.clientWidth;
    const size = [Math.round(this.wide * this.ratio), Math.round(height * this.ratio)];
    for (const canvas of [this.grid, this.curves, this.marker]) [canvas.width, canvas.height] = size;
    this.strips = lanes.flatMap((lane, n) => axes.map((axis, part) => {
      const share = (row - 4) / axes.length;
      const top = n * row + 2 + part * share;
      return { lane, axis, top: Math.round(top * this.ratio), height: Math.max(4, Math.floor((share - 1) * this.ratio)), middle: 0, degrees: 0, first: part === 0 };
    }));
    this.rowPixels = row * this.ratio;
    const columns = Math.max(1, size[0] - Math.round(GUTTER * this.ratio));
    const changed = columns !== this.columns;
    this.columns = columns;
    this.image = new ImageData(columns, size[1]);
    this.pixels = new Uint32Array(this.image.data.buffer);
    if (changed) this.onColumns?.();
    this.readColours();
    this.draw();
  }

  readColours() {
    const style = getComputedStyle(document.documentElement);
    this.css = (name) => style.getPropertyValue(name).trim();
    this.paint = Object.fromEntries(['alpha', 'beta', 'bad', 'gap'].map((name) => [name, pixelOf(this.css(`--${name}`))]));
  }

  draw() {
    if (!this.image) return;
    const end = this.history.end;
    const first = Math.max(this.history.begin, end - this.columns);
    this.fitHeights(first, end);
    this.pixels.fill(0);
    for (const strip of this.strips) this.drawStrip(strip, first, end);
    this.curves.getContext('2d').putImageData(this.image, this.curves.width - this.columns, 0);
    this.drawGrid();
    this.drawCursor();
  }

  /* Heights of the strips in degrees: fixed, or as much as each needs, or as much as the liveliest needs. */
  fitHeights(first, end) {
    const extents = this.strips.map((strip) => this.extent(strip, first, end));
    const needs = extents.map((extent) => (extent ? 1.1 * (extent[1] - extent[0]) : 0));
    const most = Math.max(0, ...needs);
    this.strips.forEach((strip, n) => {
      const need = { auto: needs[n], alike: most }[this.view.range];
      const before = strip.degrees;
      if (need === undefined) strip.degrees = Number(this.view.range);
      else if (need > before || Math.max(need, QUIET) * SHRINK < before) strip.degrees = SPANS.find((span) => span >= Math.max(need, QUIET)) ?? SPANS.at(-1);
      if (!extents[n]) strip.degrees = 0;
      else this.centre(strip, ...extents[n], strip.degrees !== before);
    });
  }

  /* Moves the middle of a strip, in steps, when what it shows would leave it. */
  centre(strip, low, high, anew) {
    const half = strip.degrees / 2;
    if (!anew && low >= strip.middle - half && high <= strip.middle + half) return;
    const step = strip.degrees / 20;
    strip.middle = Math.round((low + high) / 2 / step) * step;
  }

  extent(strip, first, end) {
    const plane = this.history.planes[strip.lane];
    const low = plane.low[strip.axis];
    const high = plane.high[strip.axis];
    let least = NOTHING.low;
    let most = NOTHING.high;
    for (let bin = first; bin < end; bin++) {
      const at = bin % KEEP;
      if (low[at] <= high[at]) {
        if (low[at] < least) least = low[at];
        if (high[at] > most) most = high[at];
      }
    }
    return least <= most ? [this.view.toDegrees(least), this.view.toDegrees(most)] : null;
  }

  drawStrip(strip, first, end) {
    const plane = this.history.planes[strip.lane];
    const low = plane.low[strip.axis];
    const high = plane.high[strip.axis];
    const colour = strip.axis === 0 ? this.paint.alpha : this.paint.beta;
    const stride = this.columns;
    const tall = Math.max(2, Math.round(2 * this.ratio)); // of a mark for bad records
    const y = (counts) => Math.round((0.5 - (this.view.toDegrees(counts) - strip.middle) / strip.degrees) * (strip.height - 1));
    let before = null;
    for (let bin = first; bin < end; bin++) {
      const at = bin % KEEP;
      const x = stride - (end - bin);
      const seen = low[at] <= high[at];
      if (seen) before = this.drawColumn(x, strip, y(high[at]), y(low[at]), before, colour);
      else {
        before = null;
        if (!plane.bad[at] && strip.degrees) this.hatch(x, strip);
      }
      if (plane.bad[at]) this.mark(x, strip.top + strip.height - tall, strip.top + strip.height);
    }
  }

  /* A column from y0 to y1, joined to the one before it; gives both ends for the next. */
  drawColumn(x, strip, y0, y1, before, colour) {
    let from = y0;
    let to = y1;
    if (before && before[1] < from) from = before[1];
    if (before && before[0] > to) to = before[0];
    const last = strip.height - 1;
    this.fill(x, strip.top + Math.min(last, Math.max(0, from)), strip.top + 1 + Math.min(last, Math.max(0, to)), colour);
    return [y0, y1];
  }

  fill(x, from, to, colour) {
    for (let at = from * this.columns + x, stop = to * this.columns; at < stop; at += this.columns) this.pixels[at] = colour;
  }

  /* A bad record is one tick, but must be seen. */
  mark(x, from, to) {
    for (let at = Math.max(0, x - 1); at <= Math.min(this.columns - 1, x + 1); at++) this.fill(at, from, to, this.paint.bad);
  }

  hatch(x, strip) {
    for (let y = 0; y < strip.height; y++) {
      if ((x + y) % 6 < 1) this.pixels[(strip.top + y) * this.columns + x] = this.paint.gap;
    }
  }

  drawGrid() {
    const pen = this.grid.getContext('2d');
    const px = this.ratio;
    pen.clearRect(0, 0, this.grid.width, this.grid.height);
    pen.textBaseline = 'middle';
    this.drawTimes(pen, px);
    for (const strip of this.strips) {
      const middle = strip.top + strip.height / 2;
      if (strip.first) {
        pen.fillStyle = this.css('--line');
        pen.fillRect(0, strip.top - Math.round(2 * px), this.grid.width, 1);
        this.text(pen, String(strip.lane), 4 * px, strip.top + this.rowPixels / 2 - 2 * px, '--ink', 13, '600');
      }
      pen.fillStyle = this.css('--grid');
      pen.fillRect(this.grid.width - this.columns, Math.round(middle), this.columns, 1);
      this.text(pen, GLYPH[strip.axis], 30 * px, middle, strip.axis ? '--beta' : '--alpha', 12);
      this.drawScale(pen, px, strip, middle);
    }
  }

  /* Both ends of a strip's scale, or, where there is no room, its height. */
  drawScale(pen, px, strip, middle) {
    if (!strip.degrees) return this.text(pen, this.view.stateOf(strip.lane), (GUTTER + 8) * px, middle, '--soft', 11);
    const put = (words, y) => this.text(pen, words, (GUTTER - 6) * px, y, '--soft', 10, '', 'right');
    if (strip.height < LABELS_MIN * px) return put(`↕ ${strip.degrees}°`, middle);
    const half = strip.degrees / 2;
    put(degreesText(strip.middle + half, half), strip.top + 6 * px);
    put(degreesText(strip.middle - half, half), strip.top + strip.height - 6 * px);
  }

  drawTimes(pen, px) {
    const seconds = (this.columns * this.history.width * this.view.tickS) || 0;
    if (!seconds) return;
    const step = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300].find((s) => seconds / s <= Math.max(4, this.columns / px / 90)) ?? 600;
    const bottom = this.grid.height - FOOT * px;
    for (let back = 0; back <= seconds; back += step) {
      const x = this.grid.width - 1 - Math.round((back / seconds) * this.columns);
      pen.fillStyle = this.css('--grid');
      pen.fillRect(x, 0, 1, bottom + 4 * px);
      const label = back === 0 ? 'newest' : `−${Number(back.toFixed(2))} s`;
      this.text(pen, label, x, bottom + 13 * px, '--soft', 11, '', back === 0 ? 'right' : 'center');
    }
  }

  text(pen, words, x, y, colour, size, weight = '', align = 'left') {
    pen.font = `${weight} ${size * this.ratio}px system-ui, "DejaVu Sans", sans-serif`;
    pen.textAlign = align;
    pen.fillStyle = this.css(colour);
    pen.fillText(words, x, y);
  }

  /* The cursor stands at a column; onRead gets the bin under it. */
  drawCursor() {
    const pen = this.marker.getContext('2d');
    pen.clearRect(0, 0, this.marker.width, this.marker.height);
    this.drawNames(pen);
    if (this.column === null) return;
    pen.fillStyle = this.css('--ink');
    pen.fillRect(this.marker.width - 1 - this.column, 0, 1, this.marker.height - FOOT * this.ratio);
    this.onRead?.(this.history.end - 1 - this.column, this.column * this.history.width * this.view.tickS, this.pointed);
  }

  /* The lanes' names, over the curves. */
  drawNames(pen) {
    for (const { lane, top, first } of this.strips) {
      const name = first && this.view.names?.[lane];
      if (!name) continue;
      const [left, px] = [(GUTTER + 4) * this.ratio, this.ratio];
      pen.font = `${11 * px}px system-ui, "DejaVu Sans", sans-serif`;
      pen.fillStyle = this.css('--card');
      pen.fillRect(left - 2 * px, top + px, pen.measureText(words(name)).width + 4 * px, 13 * px);
      pen.textBaseline = 'middle';
      this.text(pen, words(name), left, top + 8 * px, '--ink', 11);
    }
  }

  /* Puts the cursor under a pointer at (x, y) px of the box, or takes it away. */
  point(x, y) {
    const column = Math.round((this.box.clientWidth - x) * this.ratio);
    this.column = x >= GUTTER && column >= 0 && column < this.columns ? column : null;
    this.pointed = this.strips.find((strip) => y * this.ratio >= strip.top && y * this.ratio < strip.top + strip.height) ?? null;
    this.drawCursor();
  }

  step(columns) {
    const start = this.column === null ? 0 : this.column + columns;
    this.column = Math.min(this.columns - 1, Math.max(0, start));
    this.drawCursor();
  }
}

/* Degrees with as many places as a scale of this height needs, and a proper minus. */
function degreesText(degrees, scale) {
  const text = degrees.toFixed(scale < 1 ? 2 : scale < 20 ? 1 : 0);
  return `${Number(text) ? text.replace('-', '−') : text.replace('-', '')}°`;
}
