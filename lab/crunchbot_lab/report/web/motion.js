/* The run as a motion: on a plan for each filter the robot, the way it really went, the estimate and the belief of a moment. */
const HEAD = 24; // bytes before the poses of a belief, as topic belief of the live page has them
const LAYERS_SHOWN = { belief: true, estimate: true, truth: true, contacts: false };

/* Base64 of 16-bit numbers, a pose in six of them, as what Belief takes. */
function beliefOf({ poses, total, mass }, scales) {
  const numbers = new Int16Array(Uint8Array.from(atob(poses), (letter) => letter.charCodeAt(0)).buffer);
  const message = new ArrayBuffer(HEAD + 4 * numbers.length);
  const head = new DataView(message);
  head.setUint16(2, numbers.length / POSE, true);
  head.setUint32(4, total, true);
  head.setFloat64(16, mass, true);
  new Float32Array(message, HEAD).set(Array.from(numbers, (value, n) => value * scales[n % POSE]));
  const belief = new Belief();
  belief.take(message);
  return belief;
}

/* One filter's plan. */
class Scene {
  constructor(motion, name, filter) {
    Object.assign(this, { motion, filter, name, held: -1, shown: null, belief: new Belief() });
    this.box = make('div', [make('canvas'), make('canvas')], { class: 'plan', role: 'img' });
    this.line = make('p');
    $('motion-plans').append(make('section', [make('h3', filter.title), this.box, this.line]));
    this.plan = new Plan(this.box);
    this.actors = new Actors(this.plan);
    this.plan.show(motion.data.scene);
    this.plan.onSize = () => this.draw();
  }

  /* What is known at a row: the newest belief that is not of a later one. */
  at(row) {
    this.row = row;
    const newest = this.filter.beliefs.findLastIndex((belief) => belief.row <= row);
    if (newest !== this.held) {
      this.held = newest;
      this.belief = newest < 0 ? new Belief() : beliefOf(this.filter.beliefs[newest], this.motion.data.scales);
    }
    if (this.filter.maps) this.show(this.filter.maps.findLast((map) => map.row <= row) ?? this.filter.maps[0]);
    this.draw();
    this.tell();
  }

  show(map) {
    if (map === this.shown) return;
    this.shown = map;
    this.plan.showMap(map);
  }

  draw() {
    if (this.row === undefined) return;
    const { truth } = this.motion.data;
    const until = (poses) => poses.slice(0, this.row + 1);
    const [path, way] = [until(this.filter.poses), until(truth)];
    const pose = ([, x, y, theta]) => ({ x, y, theta });
    const word = { pose: pose(path.at(-1)), truth: pose(way.at(-1)), touching: [], row: null };
    this.actors.draw({ word, stale: false, path, truth: way, contacts: [], surfaces: [], belief: this.belief }, LAYERS_SHOWN);
  }

  tell() {
    const [t, x, y, theta] = this.filter.poses[this.row];
    const [, tx, ty, turn] = this.motion.data.truth[this.row];
    const off = Math.atan2(Math.sin(theta - turn), Math.cos(theta - turn));
    const error = `${signed(Math.hypot(x - tx, y - ty), 2)} m and ${signed((Math.abs(off) * 180) / Math.PI, 0)}° off`;
    const belief = this.filter.note ?? (this.filter.beliefs.length ? `belief: ${this.belief.said()}` : 'no belief was recorded');
    const said = this.shown && mapSaid(this.shown);
    this.line.textContent = `${error}; ${said ? `${said.faces}; ${said.tiles}; ${said.area}` : belief}`;
    this.box.setAttribute('aria-label', `Arena from above at ${signed(t, 1)} s. True place x ${signed(tx, 2)} m, y ${signed(ty, 2)} m; ${this.filter.title} says x ${signed(x, 2)} m, y ${signed(y, 2)} m, ${this.line.textContent}`);
  }
}

class Motion {
  constructor(data) {
    this.data = data;
    this.last = data.truth.length - 1;
    this.scenes = Object.entries(data.filters).map(([name, filter]) => new Scene(this, name, filter));
    $('motion-time').max = this.last;
    $('motion-time').addEventListener('input', () => { this.play(false); this.at(Number($('motion-time').value)); });
    $('motion-play').addEventListener('click', () => this.play(!this.playing));
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.themed());
    $('motion-textures').replaceChildren(...data.scene.arena.textures.map((name, nth) => this.swatch(name, nth)), ...$('motion-textures').children);
    this.at(this.last);
  }

  swatch(name, nth) {
    const sample = make('canvas', [], { width: 26, height: 16, 'aria-hidden': 'true' });
    const pen = sample.getContext('2d');
    pen.fillStyle = this.scenes[0].plan.pattern(nth, '--pattern');
    pen.fillRect(0, 0, 26, 16);
    return make('li', [sample, `${name[0]} ${name}`]);
  }

  themed() {
    for (const scene of this.scenes) { scene.plan.layOut(); scene.draw(); }
  }

  at(row) {
    this.row = row;
    const clock = `${signed(this.data.truth[row][0], 1)} s of ${signed(this.data.truth[this.last][0], 1)} s`;
    $('motion-time').value = row;
    $('motion-time').setAttribute('aria-valuetext', clock);
    $('motion-clock').textContent = clock;
    for (const scene of this.scenes) scene.at(row);
  }

  play(on) {
    this.playing = on;
    $('motion-play').textContent = on ? 'Pause' : 'Play';
    $('motion-play').setAttribute('aria-pressed', on);
    if (!on) return;
    const from = this.row === this.last ? 0 : this.row;
    const [began, start] = [performance.now(), this.data.truth[from][0]];
    const step = (now) => {
      if (!this.playing) return;
      const due = start + (Number($('motion-speed').value) * Math.max(0, now - began)) / 1000;
      const row = this.data.truth.findLastIndex(([t]) => t <= due);
      if (row !== this.row) this.at(Math.max(row, 0));
      if (this.row === this.last) this.play(false);
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}

globalThis.motion = new Motion(JSON.parse($('motion-data').textContent));
if (!matchMedia('(prefers-reduced-motion: reduce)').matches) motion.play(true);
