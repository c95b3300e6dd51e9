/* Tells the robot where it is: press on the plan and drag, or type x, y and heading. */
const DRAG_PX = 8; // a shorter drag leaves the heading as it is typed
const TOLD_S = 4; // so long is it said that a pose was given

class PoseTool {
  constructor(plan, wire, redraw) {
    Object.assign(this, { plan, wire, redraw });
    $('set-pose').addEventListener('click', () => this.choose(!this.on));
    $('pose-send').addEventListener('click', () => this.send(this.typed()));
    const { live } = plan;
    live.addEventListener('pointerdown', (event) => { if (this.on) { live.setPointerCapture(event.pointerId); this.from = this.to = this.at(event); this.redraw(); } });
    live.addEventListener('pointermove', (event) => { if (this.from) { this.to = this.at(event); this.redraw(); } });
    live.addEventListener('pointerup', () => { if (this.from) this.send(this.dragged()); });
    live.addEventListener('pointercancel', () => { this.from = null; this.redraw(); });
    addEventListener('keydown', (event) => { if (event.key === 'Escape' && this.on) this.choose(false); });
  }

  hello(hello) {
    $('set-pose').hidden = !hello.may_set_pose;
    if (!hello.may_set_pose) this.choose(false);
  }

  choose(on) {
    this.on = on && !$('set-pose').hidden;
    this.from = null;
    $('set-pose').setAttribute('aria-pressed', this.on);
    $('pose-tool').hidden = !this.on;
    this.plan.live.classList.toggle('pointing', this.on);
    this.redraw();
  }

  /* Metres of the map under a pointer. */
  at(event) {
    const { plan } = this, box = plan.live.getBoundingClientRect();
    const [x, y] = [(event.clientX - box.left) * plan.ratio, (event.clientY - box.top) * plan.ratio];
    return [plan.bounds[0] + (x - plan.left) / plan.scale, plan.bounds[1] + (plan.bottom - y) / plan.scale];
  }

  typed() {
    const [x, y, heading] = ['x', 'y', 'heading'].map((name) => $(`pose-${name}`).valueAsNumber);
    return { x, y, theta: (Number.isNaN(heading) ? 0 : heading) * Math.PI / 180 };
  }

  dragged() {
    const [[x, y], [toX, toY]] = [this.from, this.to];
    const far = Math.hypot(toX - x, toY - y) * this.plan.scale >= DRAG_PX * this.plan.ratio;
    return { x, y, theta: far ? Math.atan2(toY - y, toX - x) : this.typed().theta };
  }

  send(pose) {
    this.from = null;
    this.redraw();
    if (!Number.isFinite(pose.x) || !Number.isFinite(pose.y)) return this.say('Type x and y, or press on the plan.');
    $('pose-x').value = pose.x.toFixed(2);
    $('pose-y').value = pose.y.toFixed(2);
    $('pose-heading').value = (pose.theta * 180 / Math.PI).toFixed(0);
    this.wire.send({ type: 'set_pose', ...pose });
    this.say('Reported.');
  }

  /* Whether an error of the server was about a pose; then it is said here. */
  refused(text) {
    if (!text.startsWith('set_pose: ')) return false;
    this.say(text.slice(10));
    return true;
  }

  say(text) {
    $('pose-said').textContent = text;
    clearTimeout(this.silence);
    this.silence = setTimeout(() => { $('pose-said').textContent = ''; }, 1000 * TOLD_S);
  }

  /* The arrow that is being drawn. */
  draw() {
    if (!this.from) return;
    const { plan } = this, pen = plan.live.getContext('2d');
    const [x, y, toX, toY] = [plan.x(this.from[0]), plan.y(this.from[1]), plan.x(this.to[0]), plan.y(this.to[1])];
    pen.save();
    pen.strokeStyle = pen.fillStyle = plan.css('--alpha');
    pen.lineWidth = 3 * plan.ratio;
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(toX, toY);
    pen.stroke();
    pen.beginPath();
    pen.arc(x, y, 5 * plan.ratio, 0, 2 * Math.PI);
    pen.fill();
    pen.restore();
  }
}
