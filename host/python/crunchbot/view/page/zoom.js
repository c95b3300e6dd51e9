/* A closer look at the plan: buttons, keys, Ctrl and the wheel, a double click; a drag moves what is shown. */
const CLOSER = 1.5; // a step
const CLOSEST = 16;

class Zoom {
  constructor(plan, poseTool, robotAt) {
    Object.assign(this, { plan, poseTool, robotAt }); // robotAt: where the robot is, m; falsy: not known
    $('closer').addEventListener('click', () => this.by(CLOSER));
    $('farther').addEventListener('click', () => this.by(1 / CLOSER));
    $('whole').addEventListener('click', () => this.by(0));
    const { live } = plan;
    live.addEventListener('wheel', (event) => { if (event.ctrlKey) { event.preventDefault(); this.by(event.deltaY < 0 ? CLOSER : 1 / CLOSER, poseTool.at(event)); } }, { passive: false });
    live.addEventListener('dblclick', (event) => { if (!poseTool.on) this.by(CLOSER, poseTool.at(event)); });
    live.addEventListener('pointerdown', (event) => { if (!poseTool.on && plan.zoom.factor > 1) { live.setPointerCapture(event.pointerId); this.from = poseTool.at(event); } });
    live.addEventListener('pointermove', (event) => { if (this.from) this.drag(poseTool.at(event)); });
    for (const end of ['pointerup', 'pointercancel']) live.addEventListener(end, () => { this.from = null; });
    this.tell();
  }

  /* So many times as large; a place `at`, m, else the robot, stays where it is on the screen. 0: the whole. */
  by(step, at = this.robotInSight()) {
    const { factor, x, y } = this.plan.zoom;
    const next = Math.min(CLOSEST, Math.max(1, factor * step));
    const [atX, atY] = at ?? [x, y];
    this.plan.look(next, atX + ((x - atX) * factor) / next, atY + ((y - atY) * factor) / next);
    this.tell();
  }

  robotInSight() {
    const [x0, y0, x1, y1] = this.plan.bounds;
    const at = this.robotAt();
    return at && at[0] >= x0 && at[0] <= x1 && at[1] >= y0 && at[1] <= y1 ? at : undefined;
  }

  drag([x, y]) {
    const { zoom } = this.plan;
    this.plan.look(zoom.factor, zoom.x + this.from[0] - x, zoom.y + this.from[1] - y);
  }

  tell() {
    const { factor } = this.plan.zoom;
    $('closer').disabled = factor >= CLOSEST;
    $('farther').disabled = $('whole').disabled = factor <= 1;
    this.plan.live.classList.toggle('near', factor > 1);
  }
}
