/* The belief as it is: weighted poses with their widths as a density with headings, and the places where they gather. */
const POSE = 6; // numbers of a pose: x, y, theta, weight, sigma m, sigma rad
const CELL_M = 0.04; // of the density
const CELLS_MOST = 250; // across: in a large arena cells are larger
const ROSE_M = 0.16; // of the headings: an arrow for each direction that weighs something
const SECTORS = 16;
const ARROWS_MOST = 200;
const ARROW_LEAST = 0.06; // of the heaviest
const MODE_M = 0.16; // poses in neighbouring squares of this size, headings alike, are of one place
const MODE_SECTORS = 8;
const MODE_EDGE = 0.03; // of the heaviest square: what is lighter joins nothing
const MODE_LEAST = 0.04; // of the whole: what weighs less is no place of its own
const HALF = 2 ** 15; // squares are numbered from -HALF to HALF

class Belief {
  constructor() { this.clear(); }

  clear() {
    this.poses = this.image = null;
    this.modes = [];
    this.weight = 0;
  }

  /* A binary message of topic belief. */
  take(message) {
    const head = new DataView(message);
    this.total = head.getUint32(4, true);
    this.mass = head.getFloat64(16, true);
    this.poses = new Float32Array(message, 24, POSE * head.getUint16(2, true));
    this.image = null;
    this.weight = 0;
    this.each((x, y, theta, weight) => { this.weight += weight; });
    this.modes = this.weight ? this.gather() : [];
    this.roses = this.bin(ROSE_M, SECTORS);
  }

  each(visit) {
    const p = this.poses;
    for (let at = 0; at < p.length; at += POSE) visit(p[at], p[at + 1], p[at + 2], p[at + 3], p[at + 4], p[at + 5]);
  }

  /* [weight, weight x, weight y, weight distance² from the origin] by square (edge in m) and heading sector. */
  bin(edge, sectors) {
    const bins = new Map();
    this.each((x, y, theta, weight, wide, turn) => {
      const [i, j] = [Math.floor(x / edge), Math.floor(y / edge)];
      const middle = Math.round((theta / (2 * Math.PI)) * sectors);
      const share = bell(turn, (2 * Math.PI) / sectors, sectors / 2 - 1);
      share.forEach((part, n) => {
        const key = keyOf(i, j, (((middle + n - (share.length - 1) / 2) % sectors) + sectors) % sectors);
        const held = bins.get(key) ?? [0, 0, 0, 0];
        [weight, weight * x, weight * y, weight * (x * x + y * y + 2 * wide * wide)].forEach((value, k) => { held[k] += value * part; });
        bins.set(key, held);
      });
    });
    return bins;
  }

  /* Places, heaviest first: { share, x, y, spread } of neighbouring bins taken together. */
  gather() {
    const bins = this.bin(MODE_M, MODE_SECTORS);
    const edge = MODE_EDGE * [...bins.values()].reduce((most, held) => Math.max(most, held[0]), 0);
    const left = new Map([...bins].filter(([, held]) => held[0] >= edge));
    const modes = [];
    while (left.size) modes.push(this.flood(left));
    return modes.filter((mode) => mode.share >= MODE_LEAST).sort((a, b) => b.share - a.share);
  }

  /* Takes one place's bins out of those left. */
  flood(left) {
    const open = [left.keys().next().value];
    const sum = { weight: 0, x: 0, y: 0, square: 0 };
    while (open.length) {
      const key = open.pop();
      const held = left.get(key);
      if (!held) continue;
      left.delete(key);
      const [i, j, sector] = placeOf(key);
      sum.weight += held[0];
      sum.x += held[1];
      sum.y += held[2];
      sum.square += held[3];
      for (const di of [-1, 0, 1]) for (const dj of [-1, 0, 1]) for (const turn of [-1, 0, 1]) open.push(keyOf(i + di, j + dj, (sector + turn + MODE_SECTORS) % MODE_SECTORS));
    }
    const [x, y] = [sum.x / sum.weight, sum.y / sum.weight];
    return { share: sum.weight, x, y, spread: Math.sqrt(Math.max(0, sum.square / sum.weight - x * x - y * y)) };
  }

  draw(plan, pen) {
    if (!this.weight) return;
    const key = [plan.bounds, plan.css('--belief')].join();
    if (!this.image || this.key !== key) this.paint(plan);
    this.key = key;
    const [x0, y0, x1, y1] = plan.bounds;
    pen.imageSmoothingEnabled = true;
    pen.drawImage(this.image, plan.x(x0), plan.y(y1), (x1 - x0) * plan.scale, (y1 - y0) * plan.scale);
  }

  /* The density as an image of a pixel per cell; darkness goes with the root, so that a faint place is seen. */
  paint(plan) {
    const [x0, y0, x1, y1] = plan.bounds;
    const cell = Math.max(CELL_M, (x1 - x0) / CELLS_MOST, (y1 - y0) / CELLS_MOST);
    const [across, up] = [Math.max(1, Math.round((x1 - x0) / cell)), Math.max(1, Math.round((y1 - y0) / cell))];
    const cells = new Float32Array(across * up);
    this.each((x, y, theta, weight, wide) => {
      const share = bell(wide, cell, 12);
      const [i, j] = [Math.floor((x - x0) / cell) - (share.length - 1) / 2, Math.floor((y1 - y) / cell) - (share.length - 1) / 2];
      share.forEach((down, row) => share.forEach((along, column) => {
        if (i + column >= 0 && i + column < across && j + row >= 0 && j + row < up) cells[(j + row) * across + i + column] += weight * down * along;
      }));
    });
    const most = cells.reduce((a, b) => Math.max(a, b), 0);
    this.image = make('canvas', [], { width: across, height: up });
    const image = new ImageData(across, up);
    const pixels = new Uint32Array(image.data.buffer);
    const colour = pixelOf(plan.css('--belief')) & 0xffffff;
    cells.forEach((weight, n) => { if (weight > 0) pixels[n] = (colour | (Math.round(200 * Math.sqrt(weight / most)) << 24)) >>> 0; });
    this.image.getContext('2d').putImageData(image, 0, 0);
  }

  /* Arrows from where the poses of a square gather, each as long as its direction weighs. */
  drawHeadings(plan, pen) {
    if (!this.weight) return;
    const bins = [...this.roses].sort((a, b) => b[1][0] - a[1][0]);
    const most = bins[0][1][0];
    for (const [key, [weight, x, y]] of bins.slice(0, ARROWS_MOST)) {
      if (weight < ARROW_LEAST * most) break;
      const theta = (2 * Math.PI * placeOf(key)[2]) / SECTORS;
      this.arrow(plan, pen, [plan.x(x / weight), plan.y(y / weight)], theta, 0.9 * ROSE_M * plan.scale * Math.sqrt(weight / most));
    }
  }

  arrow(plan, pen, [x, y], theta, reach) {
    const [tipX, tipY] = [x + reach * Math.cos(theta), y - reach * Math.sin(theta)];
    for (const [colour, width] of [['--card', 3], ['--belief-ink', 1.2]]) {
      pen.strokeStyle = plan.css(colour);
      pen.lineWidth = width * plan.ratio;
      pen.beginPath();
      pen.moveTo(x, y);
      pen.lineTo(tipX, tipY);
      for (const turn of [0.5, -0.5]) {
        pen.moveTo(tipX, tipY);
        pen.lineTo(tipX - 0.4 * reach * Math.cos(theta + turn), tipY + 0.4 * reach * Math.sin(theta + turn));
      }
      pen.stroke();
    }
  }

  /* The share of each place above it, when there is more than one. */
  drawShares(plan, pen) {
    for (const mode of this.modes.length < 2 ? [] : this.modes.slice(0, 6)) {
      const up = mode.y + 0.24 > plan.bounds[3] ? -1 : 1; // at the upper wall
      const [x, y, wide] = [plan.x(mode.x), plan.y(mode.y + 0.24 * up), 38 * plan.ratio];
      pen.fillStyle = plan.css('--card');
      pen.fillRect(x - wide / 2, y - 9 * plan.ratio, wide, 18 * plan.ratio);
      plan.text(pen, `${Math.round(100 * mode.share)} %`, x, y, '--belief-ink', 12, 'center', '600');
    }
  }

  /* In words. */
  said() {
    if (!this.poses) return 'not known: no belief has come';
    const shares = this.modes.slice(0, 4).map((mode) => `${Math.round(100 * mode.share)} % within ± ${signed(mode.spread, 2)} m`).join(', ');
    const places = this.modes.length === 1 ? 'one place' : `${this.modes.length} places`;
    const unsent = this.mass < 0.995 ? `; ${Math.round(100 * (1 - this.mass))} % too light to be sent` : '';
    return `${count(this.total)} poses in ${places}${shares ? `: ${shares}` : ''}${unsent}`;
  }
}

const keyOf = (i, j, sector) => ((i + HALF) * 2 * HALF + (j + HALF)) * SECTORS + sector;
const placeOf = (key) => [Math.floor(key / SECTORS / (2 * HALF)) - HALF, (Math.floor(key / SECTORS) % (2 * HALF)) - HALF, key % SECTORS];

/* How a component of this width shares out over steps around its own, at most so many to either side. */
const BELLS = new Map();
function bell(sigma, step, most) {
  const tenths = Math.round((10 * sigma) / step);
  const key = tenths * 64 + most;
  if (!BELLS.has(key)) {
    const reach = Math.min(most, Math.ceil(tenths / 4));
    const share = Array.from({ length: 2 * reach + 1 }, (_, n) => Math.exp(-0.5 * (((n - reach) * 10) / Math.max(tenths, 1)) ** 2));
    const all = sum(share);
    BELLS.set(key, share.map((part) => part / all));
  }
  return BELLS.get(key);
}
