/* Confidence and, in simulation, the error of the estimate, over the time that the path covers. */
const TIMELINE = { left: 40, right: 10, strip: 74, gap: 20, foot: 20 }; // px
const PAIR_S = 0.2; // an estimate and the truth are of the same time if they are not further apart

class Timeline {
  constructor(box) {
    this.box = box;
    this.canvas = box.querySelector('canvas');
    new ResizeObserver(() => { if (box.clientWidth && box.clientWidth !== this.wide) { this.wide = 0; this.onSize?.(); } }).observe(box);
  }

  /* path: [t, x, y, theta, confidence], truth: [t, x, y, theta]; both in order of time. */
  draw(plan, path, truth) {
    this.wide = this.box.clientWidth;
    if (!this.wide) return;
    this.plan = plan;
    this.px = devicePixelRatio || 1;
    const errors = errorsOf(path, truth);
    const strips = truth.length ? 2 : 1;
    const high = strips * (TIMELINE.strip + TIMELINE.gap) + TIMELINE.foot;
    this.box.style.height = `${high}px`;
    [this.canvas.width, this.canvas.height] = [Math.round(this.wide * this.px), Math.round(high * this.px)];
    this.pen = this.canvas.getContext('2d');
    const newest = Math.max(path.at(-1)?.[0] ?? 0, truth.at(-1)?.[0] ?? 0);
    const oldest = Math.min(path[0]?.[0] ?? newest, truth[0]?.[0] ?? newest, newest - 10);
    this.x = (t) => (TIMELINE.left + ((this.wide - TIMELINE.left - TIMELINE.right) * (t - oldest)) / (newest - oldest)) * this.px;
    this.strip(0, 'Confidence, 0 to 1', 1, path.map((p) => [p[0], p[4]]), '--alpha', []);
    const most = Math.max(0.2, ...errors.map((e) => e[1]));
    const top = [0.2, 0.5, 1, 2, 5, 10].find((m) => m >= most) ?? Math.ceil(most);
    if (strips === 2) this.strip(1, 'Error of the estimate, m (simulation knows the truth)', top, errors, '--beta', [6, 3]);
    this.times(oldest, newest, high);
  }

  strip(nth, title, top, points, colour, dashes) {
    const { pen, px, plan } = this;
    const low = (nth + 1) * (TIMELINE.strip + TIMELINE.gap);
    const y = (value) => (low - (TIMELINE.strip * value) / top) * px;
    for (const share of [0, 0.5, 1]) {
      pen.fillStyle = plan.css(share ? '--grid' : '--line');
      pen.fillRect(TIMELINE.left * px, y(share * top), (this.wide - TIMELINE.left - TIMELINE.right) * px, px);
      plan.text(pen, `${Number((share * top).toFixed(2))}`, (TIMELINE.left - 6) * px, y(share * top), '--soft', 11, 'right');
    }
    plan.text(pen, title, TIMELINE.left * px, y(top) - 11 * px, '--soft', 11);
    pen.beginPath();
    points.forEach(([t, value], n) => {
      if (value === null) return;
      const joined = n && points[n - 1][1] !== null && t - points[n - 1][0] < GAP_S;
      pen[joined ? 'lineTo' : 'moveTo'](this.x(t), y(Math.min(value, top)));
    });
    pen.strokeStyle = plan.css(colour);
    pen.lineWidth = 1.6 * px;
    pen.setLineDash(dashes.map((n) => n * px));
    pen.stroke();
    pen.setLineDash([]);
    if (!points.length) plan.text(pen, 'not known yet', (this.wide / 2) * px, y(top / 2), '--soft', 12, 'center');
  }

  times(oldest, newest, high) {
    const step = [2, 5, 10, 20, 30, 60, 120, 300].find((s) => (newest - oldest) / s <= Math.max(3, this.wide / 90)) ?? 600;
    for (let back = 0; back <= newest - oldest; back += step) {
      const label = back ? `−${back} s` : 'newest';
      this.plan.text(this.pen, label, this.x(newest - back), (high - 9) * this.px, '--soft', 11, back ? 'center' : 'right');
    }
  }
}

/* [t, metres] for each estimate of whose time the truth is known. */
function errorsOf(path, truth) {
  let at = 0;
  return path.flatMap(([t, x, y]) => {
    while (at + 1 < truth.length && Math.abs(truth[at + 1][0] - t) <= Math.abs(truth[at][0] - t)) at++;
    const near = truth[at];
    return near && Math.abs(near[0] - t) <= PAIR_S ? [[t, Math.hypot(near[1] - x, near[2] - y)]] : [];
  });
}
