/* The part of the page that shows the whole robot: keeps what came, draws at most once a picture, shows it while it is looked at. */
const POINTS_MOST = 3000; // of a path: 5 min at 10 Hz
const LAYERS = ['belief', 'estimate', 'truth', 'contacts', 'others'];

class RobotPart {
  constructor(wire) {
    this.plan = new Plan($('plan'));
    this.actors = new Actors(this.plan);
    this.timeline = new Timeline($('timeline'));
    this.plan.onSize = this.timeline.onSize = () => this.redraw();
    this.layers = Object.fromEntries(LAYERS.map((name) => [name, true]));
    for (const name of LAYERS) $(`layer-${name}`).addEventListener('change', (event) => { this.layers[name] = event.target.checked; this.redraw(); });
    this.forget();
    this.wire = wire;
    this.poseTool = new PoseTool(this.plan, wire, () => this.redraw());
    this.player = new Player(wire);
    this.zoom = new Zoom(this.plan, this.poseTool, () => { const pose = this.world.word?.pose; return pose && [pose.x, pose.y]; });
    wire.on('scene', (scene) => this.showScene(scene));
    wire.on('robot', (word) => this.take(word));
    wire.on('belief', (message) => this.takeBelief(message));
    wire.on('map', (word) => this.takeMap(word.map));
    this.note(robotAdvice(null));
  }

  forget() {
    this.world = { word: null, stale: false, path: [], truth: [], contacts: [], surfaces: [], belief: new Belief(), map: null };
  }

  /* Subscribes while the part is looked at: a page of traces costs nobody a belief. */
  look(shown) {
    for (const topic of ['scene', 'robot', 'belief', 'map']) {
      if (!shown) this.wire.unsubscribe(topic);
      else if (!this.wire.wanted.has(topic)) this.wire.subscribe(topic, {});
    }
    if (shown) this.redraw();
  }

  linked(up) {
    if (up) return this.forget(); // it sends everything again
    this.pill('gone', '■ not connected');
  }

  showScene(scene) {
    this.scene = scene;
    this.plan.show(scene);
    this.showTitle();
    if (!this.world.map) $('textures').replaceChildren(...(scene.arena?.textures ?? []).map((name, nth) => this.swatch(name, nth)));
    this.redraw();
  }

  showTitle() {
    const arena = this.scene?.arena;
    const known = arena ? `${signed(arena.size_m[0], 2)} m × ${signed(arena.size_m[1], 2)} m, tiles of ${signed(arena.tile_m, 2)} m` : this.scene?.text ?? 'not reported yet';
    $('plan-title').textContent = this.world.map ? 'Map from above' : 'Arena from above';
    $('scene').textContent = this.world.map ? 'as felt so far; the origin is the first pose' : known;
  }

  swatch(name, nth) {
    const sample = make('canvas', [], { width: 26 * (devicePixelRatio || 1), height: 16 * (devicePixelRatio || 1) });
    const pen = sample.getContext('2d');
    pen.fillStyle = this.plan.pattern(nth, '--pattern');
    pen.fillRect(0, 0, sample.width, sample.height);
    return make('li', [sample, `${name[0]} ${name}`]);
  }

  /* A message holds the parts that have changed since the one before. */
  take(message) {
    const { world } = this;
    if ('run' in message) world.belief.clear();
    const word = (world.word = { ...world.word, ...message });
    if (message.playback) this.player.take(message.playback);
    if (message.path) keep(world.path, message.path, POINTS_MOST);
    if (message.true_path) keep(world.truth, message.true_path, POINTS_MOST);
    world.contacts = word.contacts;
    world.surfaces = word.surfaces;
    world.stale = (word.ages.pose ?? 0) > AGED_S;
    this.plan.fit([...world.path, ...world.truth].map((point) => [point[1], point[2]]));
    this.tell(word);
    this.redraw();
  }

  takeBelief(message) {
    this.world.belief.take(message);
    if (this.world.word) this.tell(this.world.word);
    this.redraw();
  }

  /* null: a run without a mapper. */
  takeMap(map) {
    this.world.map = map;
    this.plan.showMap(map);
    this.showTitle();
    $('map-card').hidden = $('map-legend').hidden = !map;
    $('obstacle-legend').hidden = Boolean(map);
    $('textures').replaceChildren(...(map ?? this.scene?.arena)?.textures.map((name, nth) => this.swatch(name, nth)) ?? []);
    if (map) tellMap(map);
    this.redraw();
  }

  /* What topic status holds about the ring. */
  takeRing(status) {
    if (this.player.on) return;
    this.ring = status;
    if (this.world.word) this.tell(this.world.word);
  }

  tell(word) {
    const advice = robotAdvice(word);
    const flow = this.ring && flowSaid(this.ring);
    this.note(advice ?? flow?.advice);
    if (word.playback) this.pill(word.playback.playing ? 'live' : 'paused', word.playback.playing ? '▶ recording' : '❚❚ recording');
    else if (!advice) this.pill(flow?.state ?? 'live', flow?.pill ?? '● live');
    else if (word.heard_s !== null) this.pill('stalled', '▲ silent');
    else this.pill('waiting', word.link.state === 'off' ? '○ no robot' : '○ not heard yet');
    this.sure(word);
    tellPose(word, this.world.belief);
    tellFilters(word);
    tellBehaviour(word);
    tellRow(word);
    tellContacts(word, this.world.contacts);
    tellProcesses(word, this.ring);
    const now = word.now_s === null ? 'not known' : `${signed(word.now_s, 1)} s`;
    $('robot-time').textContent = `Robot’s clock: ${now}`;
    const lost = word.refused.missed ? `${count(word.refused.missed)} messages were lost on the way. ` : '';
    $('refused').textContent = lost + (word.refused.count ? `${count(word.refused.count)} could not be read, the last: ${word.refused.last}` : '');
    for (const [name, known] of [['belief', this.world.belief.poses], ['estimate', word.pose], ['truth', word.truth], ['contacts', this.world.contacts.length]]) $(`known-${name}`).textContent = known ? '' : ' (not known)';
  }

  pill(state, text) {
    $('robot-state').dataset.state = state;
    if ($('robot-state').textContent !== text) $('robot-state').textContent = text;
  }

  /* The header's word for how sure the robot is. */
  sure(word) {
    const reported = word.heard_s === null ? null : sureness(word, this.world, this.ring);
    $('sure').hidden = !reported;
    if (!reported) return;
    $('sure').dataset.state = reported[0];
    if ($('sure').textContent !== reported[1]) $('sure').textContent = reported[1];
  }

  note(reported) {
    const box = $('robot-note');
    box.hidden = !reported;
    if (!reported) return;
    const [headline, line, steps] = box.children;
    box.dataset.grave = reported[0] ? 'yes' : 'no';
    if (headline.textContent !== reported[1]) headline.textContent = reported[1];
    retell(line, reported[2], () => rich(reported[2]));
    retell(steps, reported[3], () => reported[3].map((step) => make('li', rich(step))));
  }

  themed() {
    if (this.scene) this.showScene(this.scene);
  }

  redraw() {
    if (this.due || $('robot-part').hidden) return;
    this.due = true;
    requestAnimationFrame(() => {
      this.due = false;
      this.actors.draw(this.world, this.layers);
      this.poseTool.draw();
      this.timeline.draw(this.plan, this.world.path, this.world.truth);
      this.drawn = (this.drawn ?? 0) + 1;
    });
  }
}

/* Appends to a path; `begin`: these are its first points, what came before is forgotten. */
function keep(points, { begin, points: more }, most) {
  if (begin) points.length = 0;
  points.push(...more);
  if (points.length > most) points.splice(0, points.length - most);
}
