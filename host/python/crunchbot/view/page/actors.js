/* What moves on the plan: paths, contacts, the robot as it is estimated and, in simulation, as it is. */
const NOSE = 1.0; // of the body's radius: length of the heading line
const GUESSED_M = 0.08; // of a mark for a robot whose outline is not known
const SURFACE_M = 0.14; // half of the line along a surface
const GAP_S = 1.5; // a path is not drawn across longer silences
const JUMP_M_S = 1.5; // nor where it was never driven: an estimate that is now of another place

class Actors {
  constructor(plan) { this.plan = plan; }

  /* `world`: { word, path, truth, contacts, surfaces, belief }, `layers`: name -> whether it is shown. */
  draw(world, layers) {
    const { plan } = this;
    if (!plan.scale) return;
    const pen = (this.pen = plan.live.getContext('2d'));
    pen.clearRect(0, 0, plan.live.width, plan.live.height);
    pen.save();
    plan.clip(pen);
    if (layers.belief) world.belief.draw(plan, pen);
    if (layers.estimate) this.path(world.path, '--alpha', []);
    if (layers.truth) this.path(world.truth, '--beta', [7, 6]);
    if (layers.contacts) for (const surface of world.surfaces) this.surface(surface);
    if (layers.contacts) for (const contact of world.contacts) this.contact(contact);
    if (layers.estimate && world.word?.pose) this.robot(world.word.pose, '--alpha', [], world.word, world.stale);
    if (layers.others) for (const other of world.word?.filters.slice(1) ?? []) this.other(other);
    if (layers.truth && world.word?.truth) this.robot(world.word.truth, '--beta', [6, 6], null);
    if (layers.belief) world.belief.drawHeadings(plan, pen);
    if (layers.belief) world.belief.drawShares(plan, pen);
    pen.restore();
  }

  /* Where another filter has the robot: a small ring, its heading and its name. */
  other({ name, x, y, theta }) {
    const { pen, plan } = this;
    const [at, size] = [[plan.x(x), plan.y(y)], 6 * plan.ratio];
    pen.beginPath();
    pen.arc(...at, size, 0, 2 * Math.PI);
    pen.moveTo(...at);
    pen.lineTo(at[0] + 2 * size * Math.cos(theta), at[1] - 2 * size * Math.sin(theta));
    this.stroke('--soft', 1.6, []);
    plan.text(pen, name, at[0] + 1.6 * size, at[1] + 1.6 * size, '--ink', 11);
  }

  /* Points [t, x, y, theta, ...], with gaps where nothing was driven; a light edge keeps the line apart from what it crosses. */
  path(points, colour, dashes) {
    const { pen, plan } = this;
    pen.beginPath();
    points.forEach(([, x, y], n) => {
      pen[n && driven(points[n - 1], points[n]) ? 'lineTo' : 'moveTo'](plan.x(x), plan.y(y));
    });
    this.stroke(colour, 2, dashes);
  }

  /* Dashes have light edges each, so that a line beneath is seen between them. */
  stroke(colour, width, dashes) {
    const { pen, plan } = this;
    pen.lineJoin = 'round';
    pen.setLineDash(dashes.map((n) => n * plan.ratio));
    pen.strokeStyle = plan.css('--card');
    pen.lineWidth = (width + 2.4) * plan.ratio;
    pen.stroke();
    pen.strokeStyle = plan.css(colour);
    pen.lineWidth = width * plan.ratio;
    pen.stroke();
    pen.setLineDash([]);
  }

  /* Body and heading; with its word also whiskers, contacts under way and the texture under each tip. */
  robot(pose, colour, dashes, word, stale) {
    const { pen, plan } = this;
    const outline = plan.scene?.robot;
    const radius = (outline?.body_radius_m || GUESSED_M) * plan.scale;
    const [x, y] = [plan.x(pose.x), plan.y(pose.y)];
    pen.globalAlpha = stale ? 0.45 : 1;
    pen.beginPath();
    if (outline) pen.arc(x, y, radius, 0, 2 * Math.PI);
    else { pen.moveTo(x - radius / 2, y); pen.lineTo(x + radius / 2, y); pen.moveTo(x, y - radius / 2); pen.lineTo(x, y + radius / 2); }
    pen.moveTo(x, y);
    pen.lineTo(x + NOSE * radius * Math.cos(pose.theta), y - NOSE * radius * Math.sin(pose.theta));
    this.stroke(colour, 2.2, dashes);
    if (word && outline) for (const whisker of outline.whiskers) this.whisker(pose, whisker, word, colour, radius);
    pen.globalAlpha = 1;
  }

  whisker(pose, whisker, word, colour, radius) {
    if (whisker.role === 'texture') this.tip(pose, whisker, word, colour, radius);
    else this.ray(pose, whisker, word, colour);
  }

  /* A point (forward, left) of the robot, in pixels. */
  at(pose, [forward, left]) {
    const [c, s] = [Math.cos(pose.theta), Math.sin(pose.theta)];
    return [this.plan.x(pose.x + forward * c - left * s), this.plan.y(pose.y + forward * s + left * c)];
  }

  ray(pose, whisker, word, colour) {
    const { pen } = this;
    const along = (m) => this.at(pose, [whisker.base_m[0] + m * Math.cos(whisker.yaw_rad), whisker.base_m[1] + m * Math.sin(whisker.yaw_rad)]);
    const touch = word.touching.find((contact) => contact.whisker === whisker.name);
    pen.beginPath();
    pen.moveTo(...along(0));
    pen.lineTo(...along(whisker.length_m));
    this.stroke(touch ? '--ink' : colour, touch ? 3 : 1.5, []);
    if (touch) this.mark(...along(Math.min(touch.radius_m ?? whisker.length_m, whisker.length_m)), touch.part, 5);
  }

  tip(pose, whisker, word, colour, radius) {
    const { pen, plan } = this;
    const [x, y] = this.at(pose, whisker.tip_m);
    const far = Math.hypot(...whisker.tip_m) || 1;
    const rim = Math.min(1, radius / plan.scale / far);
    pen.beginPath();
    pen.moveTo(...this.at(pose, whisker.tip_m.map((m) => m * rim)));
    pen.lineTo(x, y);
    this.stroke(colour, 1.5, []);
    const read = word.row?.tips.find((tip) => tip.name === whisker.name);
    pen.beginPath();
    pen.arc(x, y, 8.5 * plan.ratio, 0, 2 * Math.PI);
    pen.fillStyle = plan.css('--card');
    pen.fill();
    pen.strokeStyle = plan.css(colour);
    pen.lineWidth = 1.2 * plan.ratio;
    pen.stroke();
    plan.text(pen, likeliest(read)?.[0] ?? '?', x, y + 0.5 * plan.ratio, '--ink', 11, 'center', '700');
  }

  /* A line along the surface, and as far to both sides as its direction may be off by two standard deviations. */
  surface({ x, y, normal, normal_sd: sd }) {
    const { pen, plan } = this;
    const end = (turn) => [plan.x(x - SURFACE_M * Math.sin(normal + turn)), plan.y(y + SURFACE_M * Math.cos(normal + turn))];
    const wide = Math.min(2 * sd, Math.PI / 2);
    pen.beginPath();
    for (const side of [0, Math.PI]) {
      pen.moveTo(plan.x(x), plan.y(y));
      for (let n = -4; n <= 4; n += 1) pen.lineTo(...end(side + (wide * n) / 4));
      pen.closePath();
    }
    pen.globalAlpha = 0.35;
    pen.fillStyle = plan.css('--ink');
    pen.fill();
    pen.globalAlpha = 1;
    pen.beginPath();
    pen.moveTo(...end(0));
    pen.lineTo(...end(Math.PI));
    pen.strokeStyle = plan.css('--ink');
    pen.lineWidth = 1.4 * plan.ratio;
    pen.stroke();
  }

  contact({ x, y, part }) {
    if (x !== null) this.mark(this.plan.x(x), this.plan.y(y), part, 3.5);
  }

  /* Tip: a disc; shaft: an open square; not known which: a cross. */
  mark(x, y, part, size) {
    const { pen, plan } = this;
    const n = size * plan.ratio;
    pen.beginPath();
    if (part === 'tip') pen.arc(x, y, n, 0, 2 * Math.PI);
    else if (part === 'shaft') pen.rect(x - n, y - n, 2 * n, 2 * n);
    else { pen.moveTo(x - n, y - n); pen.lineTo(x + n, y + n); pen.moveTo(x - n, y + n); pen.lineTo(x + n, y - n); }
    pen.fillStyle = plan.css(part === 'tip' ? '--ink' : '--card');
    this.stroke('--ink', 1.6, []);
    pen.fill();
    if (part === 'shaft') this.stroke('--ink', 1.6, []);
  }
}

/* Whether one point of a path leads to the next. */
function driven(from, to) {
  const seconds = to[0] - from[0];
  return seconds < GAP_S && Math.hypot(to[1] - from[1], to[2] - from[2]) < JUMP_M_S * Math.max(seconds, 0.1);
}

/* The texture whose log-likelihood is highest under a tip; undefined when it was not read. */
function likeliest(tip) {
  const read = tip?.loglik.filter(([, value]) => value !== null) ?? [];
  return read.length ? read.reduce((best, one) => (one[1] > best[1] ? one : best))[0] : undefined;
}
