/* The plan: metres to pixels, the floor by texture, obstacles, axes and a scale bar; drawn anew for a size, theme or scene. */
const PLAN = { left: 34, foot: 44, edge: 16, head: 170, least: 260 }; // px around the floor; of the window above it; least height
const STRIPE = 9; // px from one line or dot of a pattern to the next
const PATTERNS = [ // distinguished by shape, so that grey will do
  () => {},
  (pen, n) => { pen.fillRect(n * 0.25, n * 0.25, n * 0.22, n * 0.22); },
  (pen, n) => { pen.moveTo(0, n); pen.lineTo(n, 0); },
  (pen, n) => { pen.moveTo(0, n / 2); pen.lineTo(n, n / 2); pen.moveTo(n / 2, 0); pen.lineTo(n / 2, n); },
  (pen, n) => { pen.moveTo(0, n / 2); pen.lineTo(n, n / 2); },
  (pen, n) => { pen.moveTo(0, 0); pen.lineTo(n, n); },
];
const STEPS_M = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200];

class Plan {
  constructor(box) {
    this.box = box;
    [this.floor, this.live] = box.querySelectorAll('canvas');
    this.scene = null; // as topic scene holds it
    this.map = null; // as topic map holds it: in the arena's place, for it has a frame of its own
    this.mapLayer = new MapLayer(this);
    this.whole = this.bounds = [0, 0, 1, 1]; // all of it, and what is shown
    this.zoom = { factor: 1, x: 0.5, y: 0.5 }; // x, y: the middle
    new ResizeObserver(() => { if (box.clientWidth && box.clientWidth !== this.wide) this.layOut(); }).observe(box);
  }

  show(scene) {
    this.scene = scene;
    if (scene.arena && !this.map) this.whole = arenaBounds(scene);
    this.layOut();
  }

  get arena() { return this.map ? null : this.scene?.arena; }

  /* A map that grows, in place of the arena; null: the arena again. */
  showMap(map) {
    const wanted = map ? mapBounds(map) : this.scene?.arena ? arenaBounds(this.scene) : [0, 0, 1, 1];
    const fits = Boolean(map) === Boolean(this.map) && wanted.every((value, n) => value === this.whole[n]);
    this.map = map;
    this.whole = wanted;
    if (fits && this.scale) this.drawFloor();
    else this.layOut();
  }

  /* Without an arena: as much as is needed to show these points, by whole steps so that it seldom moves. */
  fit(points) {
    if (this.map || this.scene?.arena || !points.length) return;
    const side = (axis, round, pick) => round(pick(...points.slice(-500).map((p) => p[axis])) / 0.5 + (round === Math.ceil ? 1 : -1)) * 0.5;
    const wanted = [side(0, Math.floor, Math.min), side(1, Math.floor, Math.min), side(0, Math.ceil, Math.max), side(1, Math.ceil, Math.max)];
    const inside = wanted[0] >= this.whole[0] && wanted[1] >= this.whole[1] && wanted[2] <= this.whole[2] && wanted[3] <= this.whole[3];
    if (inside && this.fitted) return;
    this.fitted = true;
    this.whole = wanted;
    this.layOut();
  }

  /* So many times as large as the whole, with this place, m, in the middle as far as the whole reaches. */
  look(factor, x, y) {
    this.zoom = { factor, x, y };
    this.layOut();
  }

  /* What of the whole is shown. */
  window() {
    const [x0, y0, x1, y1] = this.whole;
    const { zoom } = this;
    const middle = (at, low, high) => Math.min(Math.max(at, low + (high - low) / 2 / zoom.factor), high - (high - low) / 2 / zoom.factor);
    [zoom.x, zoom.y] = [middle(zoom.x, x0, x1), middle(zoom.y, y0, y1)];
    if (zoom.factor === 1) return this.whole;
    const [wide, high] = [(x1 - x0) / 2 / zoom.factor, (y1 - y0) / 2 / zoom.factor];
    return [zoom.x - wide, zoom.y - high, zoom.x + wide, zoom.y + high];
  }

  layOut() {
    this.ratio = devicePixelRatio || 1;
    this.wide = this.box.clientWidth;
    this.bounds = this.window();
    if (!this.wide) return;
    const [x0, y0, x1, y1] = this.whole;
    const [across, up] = [this.wide - PLAN.left - PLAN.edge, Math.max(PLAN.least, innerHeight - PLAN.head) - PLAN.edge - PLAN.foot];
    const scale = Math.min(across / (x1 - x0), up / (y1 - y0));
    const high = PLAN.edge + scale * (y1 - y0) + PLAN.foot;
    this.box.style.height = `${high}px`;
    for (const canvas of [this.floor, this.live]) [canvas.width, canvas.height] = [Math.round(this.wide * this.ratio), Math.round(high * this.ratio)];
    this.scale = scale * this.ratio * this.zoom.factor; // px of the device per metre
    this.left = (PLAN.left + (across - scale * (x1 - x0)) / 2) * this.ratio;
    this.bottom = (PLAN.edge + scale * (y1 - y0)) * this.ratio;
    this.drawFloor();
    this.onSize?.();
  }

  x(metres) { return this.left + (metres - this.bounds[0]) * this.scale; }

  y(metres) { return this.bottom - (metres - this.bounds[1]) * this.scale; }

  css(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }

  drawFloor() {
    const pen = this.floor.getContext('2d');
    pen.clearRect(0, 0, this.floor.width, this.floor.height);
    pen.save();
    this.clip(pen);
    if (this.map) this.mapLayer.draw(pen, this.map);
    if (this.arena) this.drawArena(pen, this.arena);
    pen.restore();
    this.drawAxes(pen);
    this.drawScale(pen);
  }

  /* From here on nothing outside the axes, but for what walls and a robot at them need. */
  clip(pen) {
    const [[x0, y0, x1, y1], edge] = [this.bounds, this.zoom.factor > 1 || this.map ? 0 : PLAN.edge * this.ratio];
    pen.beginPath();
    pen.rect(this.left - edge, this.y(y1) - edge, (x1 - x0) * this.scale + 2 * edge, (y1 - y0) * this.scale + 2 * edge);
    pen.clip();
  }

  /* In the arena's frame, which has a place on the map. */
  drawArena(pen, arena) {
    const [left, foot, turn] = this.scene.origin;
    pen.save();
    pen.translate(this.x(left), this.y(foot));
    pen.rotate(-turn);
    pen.translate(-this.x(0), -this.y(0));
    arena.floor.forEach((row, fromTop) => [...row].forEach((letter, column) => {
      const y = (arena.floor.length - 1 - fromTop) * arena.tile_m;
      this.drawTile(pen, arena, letter, column * arena.tile_m, y);
    }));
    const hatch = this.pattern(2, '--soft', 0.7);
    for (const box of arena.unknown) this.drawUnknown(pen, box);
    for (const box of arena.obstacles) this.drawObstacle(pen, box, hatch);
    pen.strokeStyle = this.css('--ink');
    pen.strokeRect(this.x(0), this.y(arena.size_m[1]), arena.size_m[0] * this.scale, arena.size_m[1] * this.scale);
    pen.restore();
  }

  /* The last row and column may be cut off by the walls. */
  drawTile(pen, arena, letter, x, y) {
    const [right, top] = [Math.min(x + arena.tile_m, arena.size_m[0]), Math.min(y + arena.tile_m, arena.size_m[1])];
    const place = [this.x(x), this.y(top), (right - x) * this.scale, (top - y) * this.scale];
    const nth = arena.textures.findIndex((name) => name[0] === letter);
    pen.fillStyle = this.pattern(nth, '--pattern');
    pen.fillRect(...place);
    pen.strokeStyle = this.css('--line');
    pen.lineWidth = 1;
    pen.strokeRect(...place);
    this.text(pen, letter, place[0] + 5 * this.ratio, place[1] + 10 * this.ratio, '--soft', 11);
  }

  /* Ground that was never mapped: neither floor nor obstacle is known. */
  drawUnknown(pen, [x0, y0, x1, y1]) {
    const place = [this.x(x0), this.y(y1), (x1 - x0) * this.scale, (y1 - y0) * this.scale];
    pen.fillStyle = this.css('--card');
    pen.fillRect(...place);
    this.text(pen, '?', place[0] + place[2] / 2, place[1] + place[3] / 2, '--soft', 11, 'center');
  }

  drawObstacle(pen, [x0, y0, x1, y1], hatch) {
    const place = [this.x(x0), this.y(y1), (x1 - x0) * this.scale, (y1 - y0) * this.scale];
    pen.fillStyle = this.css('--block');
    pen.fillRect(...place);
    pen.fillStyle = hatch;
    pen.fillRect(...place);
    pen.strokeStyle = this.css('--ink');
    pen.lineWidth = 1.5 * this.ratio;
    pen.strokeRect(...place);
  }

  /* The nth texture's pattern in a colour; the plan and its legend use the same. */
  pattern(nth, colour, thick = 0.8) {
    const tile = make('canvas');
    const n = (tile.width = tile.height = Math.round(STRIPE * (this.ratio ?? 1)));
    const pen = tile.getContext('2d');
    pen.fillStyle = pen.strokeStyle = this.css(colour);
    pen.lineWidth = thick * (this.ratio ?? 1);
    pen.beginPath();
    PATTERNS[Math.max(0, nth) % PATTERNS.length](pen, n);
    pen.stroke();
    return pen.createPattern(tile, 'repeat');
  }

  drawAxes(pen) {
    const [x0, y0, x1, y1] = this.bounds;
    const steps = this.arena ? [1, 2, 5, 10, 20, 50, 100].map((tiles) => tiles * this.arena.tile_m) : STEPS_M;
    const step = steps.find((s) => s * this.scale >= 46 * this.ratio) ?? steps.at(-1);
    const ticks = (from, to) => Array.from({ length: Math.floor((to - from) / step + 1e-6) + 1 }, (_, n) => Number((Math.ceil(from / step - 1e-6) * step + n * step).toFixed(3)));
    const axis = (metres) => signed(metres, step % 0.1 > 1e-6 && step % 0.1 < 0.1 - 1e-6 ? 2 : 1);
    for (const x of ticks(x0, x1)) this.text(pen, axis(x), this.x(x), this.bottom + 11 * this.ratio, '--soft', 11, 'center');
    for (const y of ticks(y0, y1)) this.text(pen, axis(y), this.left - 5 * this.ratio, this.y(y), '--soft', 11, 'right');
    pen.strokeStyle = this.css('--ink');
    const walls = this.arena && !this.scene.origin[2] && this.zoom.factor === 1;
    pen.lineWidth = (walls ? 2 : 1) * this.ratio;
    if (!walls) pen.setLineDash([2 * this.ratio, 4 * this.ratio]); // what is shown, not walls
    pen.strokeRect(this.left, this.y(y1), (x1 - x0) * this.scale, (y1 - y0) * this.scale);
    pen.setLineDash([]);
  }

  drawScale(pen) {
    const long = STEPS_M.findLast((s) => s * this.scale <= 150 * this.ratio) ?? STEPS_M[0];
    const [x, y, px] = [this.left, this.bottom + 31 * this.ratio, this.ratio];
    pen.fillStyle = this.css('--ink');
    pen.fillRect(x, y, long * this.scale, 2 * px);
    for (const end of [0, long * this.scale - 2 * px]) pen.fillRect(x + end, y - 4 * px, 2 * px, 10 * px);
    this.text(pen, `${long} m`, x + long * this.scale + 6 * px, y + px, '--ink', 12);
    this.text(pen, 'x, y in metres', this.x(this.bounds[2]), y + px, '--soft', 11, 'right');
  }

  text(pen, words, x, y, colour, size, align = 'left', weight = '') {
    pen.font = `${weight} ${size * this.ratio}px system-ui, "DejaVu Sans", sans-serif`;
    pen.textAlign = align;
    pen.textBaseline = 'middle';
    pen.fillStyle = this.css(colour);
    pen.fillText(words, x, y);
  }
}

/* What an arena takes of its map, metres. */
function arenaBounds({ arena, origin: [x, y, turn] }) {
  const [[wide, high], c, s] = [arena.size_m, Math.cos(turn), Math.sin(turn)];
  const corners = [[0, 0], [wide, 0], [0, high], [wide, high]].map(([a, b]) => [x + c * a - s * b, y + s * a + c * b]);
  return [Math.min, Math.max].flatMap((pick) => [0, 1].map((axis) => pick(...corners.map((corner) => corner[axis]))));
}

/* A number with so many places and a proper minus; what is no number is said to be not known. */
function signed(value, places, unit = '') {
  if (typeof value !== 'number') return 'not known';
  const text = value.toFixed(places);
  return `${Number(text) ? text.replace('-', '−') : text.replace('-', '')}${unit}`;
}
