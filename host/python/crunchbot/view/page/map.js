/* A map by touch as far as it has come: occupancy, tiles with their likeliest textures, faces and corners with their uncertainty. */
const SURE_TILE = 0.8; // of a texture: below, its letter has a question mark
const DEVIATIONS = 2; // of faces and corners, that are shown
const BAND_LEAST = 1.5; // px, half of the band about a face
const FACE_LEAST = 6; // px, of a stretch that was felt at one point
const STEP_FIT_M = 0.5; // of what the plan shows, so that it seldom moves
const NO_CELL = 255;

class MapLayer {
  constructor(plan) { this.plan = plan; }

  /* { textures, lattice: [x, y, turn, pitch] or null, tiles: [column, row, texture, probability], faces: [x0, y0, x1, y1, normal, its sd,
   * offset's sd], corners: [x, y, sd], grid: { x, y, turn, cell, columns, rows, cells: base64 of bytes, per cent or NO_CELL } or null }. */
  draw(pen, map) {
    this.pen = pen;
    if (map.grid) this.occupancy(map.grid);
    if (map.lattice) for (const tile of map.tiles) this.tile(map, tile);
    const faces = map.faces.map((face) => this.visible(face));
    for (const face of faces) this.band(face);
    for (const face of faces) this.line(face);
    for (const corner of map.corners) this.corner(corner);
  }

  occupancy({ x, y, turn, cell, columns, rows, cells }) {
    const { plan, pen } = this;
    const bytes = Uint8Array.from(atob(cells), (letter) => letter.charCodeAt(0));
    const image = make('canvas', [], { width: columns, height: rows });
    const data = new ImageData(columns, rows);
    const pixels = new Uint32Array(data.data.buffer);
    const [free, solid] = ['--free', '--ink'].map((name) => pixelOf(plan.css(name)) & 0xffffff);
    for (let n = 0; n < bytes.length; n += 1) {
      if (bytes[n] === NO_CELL) continue;
      const off = bytes[n] - 50;
      const at = (rows - 1 - Math.floor(n / columns)) * columns + (n % columns);
      pixels[at] = ((off < 0 ? free : solid) | (Math.round((Math.abs(off) / 50) * (off < 0 ? 255 : 150)) << 24)) >>> 0;
    }
    image.getContext('2d').putImageData(data, 0, 0);
    pen.save();
    pen.imageSmoothingEnabled = false;
    pen.translate(plan.x(x), plan.y(y));
    pen.rotate(-turn);
    pen.drawImage(image, 0, -rows * cell * plan.scale, columns * cell * plan.scale, rows * cell * plan.scale);
    pen.restore();
  }

  tile({ lattice: [x, y, turn, pitch], textures }, [column, row, texture, sure]) {
    const { plan, pen } = this;
    const [c, s] = [Math.cos(turn), Math.sin(turn)];
    const at = (u, v) => [plan.x(x + pitch * (u * c - v * s)), plan.y(y + pitch * (u * s + v * c))];
    pen.beginPath();
    for (const [u, v] of [[0, 0], [1, 0], [1, 1], [0, 1]]) pen.lineTo(...at(column + u, row + v));
    pen.closePath();
    pen.globalAlpha = sure >= SURE_TILE ? 1 : 0.4;
    pen.fillStyle = plan.pattern(texture, '--pattern');
    pen.fill();
    pen.globalAlpha = 1;
    pen.strokeStyle = plan.css('--line');
    pen.lineWidth = 1;
    pen.stroke();
    const [px, py] = at(column + 0.5, row + 0.5);
    plan.text(pen, `${textures[texture]?.[0] ?? '?'}${sure >= SURE_TILE ? '' : '?'}`, px, py, '--soft', 11, 'center');
  }

  /* The stretch, long enough to be seen. */
  visible([x0, y0, x1, y1, normal, ...rest]) {
    const { plan } = this;
    const more = Math.max(FACE_LEAST * (plan.ratio / plan.scale) - Math.hypot(x1 - x0, y1 - y0), 0) / 2;
    const [ux, uy] = [-more * Math.sin(normal), more * Math.cos(normal)];
    return [x0 - ux, y0 - uy, x1 + ux, y1 + uy, normal, ...rest];
  }

  /* As far to both sides as a face may be off: its offset, and, away from its middle, its direction. */
  band([x0, y0, x1, y1, normal, turned, off]) {
    const { plan, pen } = this;
    const half = Math.hypot(x1 - x0, y1 - y0) / 2;
    const wide = Math.max(DEVIATIONS * Math.hypot(off, half * turned), BAND_LEAST * (plan.ratio / plan.scale));
    const [nx, ny] = [wide * Math.cos(normal), wide * Math.sin(normal)];
    pen.beginPath();
    for (const [x, y] of [[x0 + nx, y0 + ny], [x1 + nx, y1 + ny], [x1 - nx, y1 - ny], [x0 - nx, y0 - ny]]) pen.lineTo(plan.x(x), plan.y(y));
    pen.closePath();
    pen.globalAlpha = 0.35;
    pen.fillStyle = plan.css('--good');
    pen.fill();
    pen.globalAlpha = 1;
  }

  line([x0, y0, x1, y1]) {
    const { plan, pen } = this;
    pen.beginPath();
    pen.moveTo(plan.x(x0), plan.y(y0));
    pen.lineTo(plan.x(x1), plan.y(y1));
    pen.strokeStyle = plan.css('--good');
    pen.lineWidth = 2.4 * plan.ratio;
    pen.stroke();
  }

  corner([x, y, sd]) {
    const { plan, pen } = this;
    pen.strokeStyle = plan.css('--good');
    pen.lineWidth = 1.4 * plan.ratio;
    pen.beginPath();
    pen.arc(plan.x(x), plan.y(y), Math.max(DEVIATIONS * sd * plan.scale, 4 * plan.ratio), 0, 2 * Math.PI);
    pen.stroke();
  }
}

/* What a map needs of the plan: [x0, y0, x1, y1] by whole steps, unless it says so itself. */
function mapBounds({ grid, faces, bounds }) {
  if (bounds) return bounds;
  const xs = [0, ...faces.flatMap(([x0, , x1]) => [x0, x1])];
  const ys = [0, ...faces.flatMap(([, y0, , y1]) => [y0, y1])];
  if (grid) {
    xs.push(grid.x, grid.x + grid.columns * grid.cell);
    ys.push(grid.y, grid.y + grid.rows * grid.cell);
  }
  const [down, up] = [(list) => Math.floor(Math.min(...list) / STEP_FIT_M) * STEP_FIT_M, (list) => Math.ceil(Math.max(...list) / STEP_FIT_M) * STEP_FIT_M];
  return [down(xs), down(ys), up(xs), up(ys)];
}

/* In words. */
function mapSaid(map) {
  const sure = map.tiles.filter(([, , , share]) => share >= SURE_TILE).length;
  const off = map.faces.map((face) => DEVIATIONS * face[6]).sort((a, b) => a - b);
  const faces = map.faces.length ? `${map.faces.length} stretches of faces, half of them to ± ${signed(1000 * off[Math.floor(off.length / 2)], 0)} mm` : 'no face yet';
  const tiles = map.lattice ? `tiles of ${signed(map.lattice[3], 3)} m, ${map.tiles.length} felt, ${sure} sure` : 'no tiles found in the floor';
  const area = map.grid ? `${signed(map.grid.free_m2, 1)} m² free` : 'nothing known to be free';
  return { faces, tiles, area, corners: `${map.corners.length}` };
}
