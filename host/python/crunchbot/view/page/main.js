/* Ties the page together: what is looked at is in the address (after #), so that a page can be kept and shared. */
const wanted = new URLSearchParams(location.hash.slice(1));
const view = {
  ring: wanted.get('ring'),
  lanes: (wanted.get('lanes') ?? '').split(',').filter((part) => /^\d+$/.test(part)).map(Number),
  chosen: wanted.has('lanes'), // false: the lanes with a node, whatever they are
  width: Number(wanted.get('ticks')) || 16,
  range: wanted.get('range') ?? 'auto',
  axes: wanted.get('axes') === 'alpha' ? [0] : wanted.get('axes') === 'beta' ? [1] : [0, 1],
  tickS: 5e-4,
  stateOf: (lane) => words(last?.lanes?.state[lane] ?? 'no data'),
  toDegrees: (counts) => (counts - view.rest) * view.degreesPerCount,
};
let history, traces, last, rings = [], owners = {}, widths = [], paused = false, due = false, linked = false;

const panels = new Panels((lanes) => chooseLanes(lanes));
panels.skipped = () => history?.skipped;
const wire = new Wire((up) => {
  linked = up;
  robotPart.linked(up);
  if (!up) panels.status({ state: 'gone', ring: view.ring }, []);
});
const robotPart = new RobotPart(wire);
const tour = new Tour();
const controls = new Controls(wire, () => (parts.now === 'traces' ? { ring: view.ring } : {}));
const parts = new Parts((part) => {
  robotPart.look(part === 'robot');
  if (traces) look();
});

function remember() {
  const hash = new URLSearchParams({ ...(view.ring && { ring: view.ring }), ticks: view.width, range: view.range });
  if (view.chosen) hash.set('lanes', view.lanes.join(','));
  if (view.axes.length === 1) hash.set('axes', view.axes[0] ? 'beta' : 'alpha');
  if (parts.chosen) hash.set('part', parts.now);
  if (document.documentElement.dataset.chosen) hash.set('theme', document.documentElement.dataset.theme);
  globalThis.history.replaceState(null, '', `#${hash}`);
}

function look() {
  remember();
  $('span').textContent = duration(traces.columns * view.width * view.tickS);
  $('longer').disabled = paused || view.width >= widths[widths.length - 1];
  $('shorter').disabled = paused || view.width <= widths[0];
  const mask = view.lanes.reduce((bits, lane) => bits + 2 ** lane, 0);
  $('empty').textContent = view.lanes.length ? '' : last?.lanes ? 'No lane is selected: tick some in the table of lanes.' : 'Traces appear here as soon as frames come.';
  if (!mask || paused || parts.now !== 'traces') return wire.unsubscribe('traces');
  history.subscription = (history.subscription + 1) % 2 ** 32;
  const bins = Math.min(KEEP, traces.columns);
  wire.subscribe('traces', { ring: view.ring, ticks_per_bin: view.width, bins, lanes: mask, subscription: history.subscription });
}

function chooseRing(name) {
  view.ring = name;
  last = undefined;
  history.clear();
  wire.subscribe('status', { ring: name });
  if (!view.chosen) view.lanes = [];
  changeLanes();
}

function changeLanes() {
  panels.select(view.lanes);
  traces.layOut();
  look();
}

function chooseLanes(lanes) {
  view.chosen = true;
  view.lanes = lanes;
  changeLanes();
}

/* Unless a person has chosen: the lanes that have ever delivered a good record. */
function followNodes(lanes) {
  if (view.chosen || !lanes) return;
  const noded = lanes.good.flatMap((good, lane) => (good ? [lane] : []));
  if (noded.join() === view.lanes.join()) return;
  view.lanes = noded;
  changeLanes();
}

function pause(on) {
  paused = on;
  $('pause').setAttribute('aria-pressed', on);
  $('pause').textContent = on ? 'Paused: go on' : 'Pause';
  look();
}

function scale(step) {
  const next = widths[widths.indexOf(view.width) + step];
  if (!next || paused) return;
  view.width = next;
  look();
}

/* Of the part that is looked at: the plan, or the time of the traces. */
function nearer(is) {
  if (parts.now === 'robot') $(is ? 'closer' : 'farther').click();
  else scale(is ? -1 : 1);
}

function theme(name, chosen) {
  document.documentElement.dataset.theme = name;
  if (chosen) document.documentElement.dataset.chosen = 'yes';
  $('theme').textContent = name === 'dark' ? 'Light' : 'Dark';
  traces?.readColours();
  redraw();
  robotPart.themed();
}

function redraw() {
  if (due || !traces) return;
  due = true;
  requestAnimationFrame(() => {
    due = false;
    traces.draw();
  });
}

wire.on('hello', (hello) => {
  widths = hello.widths;
  if (!widths.includes(view.width)) view.width = 16;
  view.degreesPerCount = hello.degrees_per_count;
  view.rest = hello.rest_count;
  panels.hello(hello);
  robotPart.poseTool.hello(hello);
  robotPart.player.hello(hello);
  controls.hello(hello);
  view.names = hello.lane_names;
  tour.hello(hello, wanted.has('tour'));
  if (hello.playback) parts.choose('robot', false);
  else if (!parts.chosen) parts.choose(hello.robot ? 'robot' : 'traces', false);
  if (!traces) {
    history = new History(hello.lanes);
    traces = new Traces(history, view);
    traces.onColumns = () => { if (linked) look(); };
    traces.onRead = readOut;
    view.lanes = view.lanes.filter((lane) => lane < hello.lanes);
  }
  if (hello.playback) return; // no ring belongs to it
  wire.subscribe('rings', {});
  chooseRing(hello.rings.includes(view.ring) ? view.ring : hello.rings[0]);
});

wire.on('rings', (message) => {
  ({ rings, owners } = message);
  listRings();
});

/* The ring looked at stays in the list when it has gone. */
function listRings() {
  const names = rings.includes(view.ring) ? rings : [...rings, view.ring];
  $('ring').replaceChildren(...names.map((name) => new Option(owners[name] ? `${name} of ${owners[name]}` : name, name, false, name === view.ring)));
}

wire.on('status', (status) => {
  if (status.ring !== view.ring) return;
  last = status;
  const span = view.tickS !== status.tick_s;
  view.tickS = status.tick_s;
  panels.status(status, rings.filter((name) => name !== view.ring), view.toDegrees);
  followNodes(status.lanes);
  robotPart.takeRing(status);
  if (span) $('span').textContent = duration(traces.columns * view.width * view.tickS);
});

wire.on('traces', (block) => {
  if (history.take(block)) redraw();
});

wire.on('error', (error) => { if (!robotPart.poseTool.refused(error.text) && !controls.refused(error.text)) console.error(`whisker-view: ${error.text}`); });

/* What the bin under the cursor holds; `pointed`: the strip under the pointer, if any. */
function readOut(bin, ago, pointed) {
  const at = ((bin % KEEP) + KEEP) % KEEP;
  const value = ({ lane, axis }) => {
    const plane = history.planes[lane];
    const [low, high] = [plane.low[axis][at], plane.high[axis][at]];
    const range = low <= high ? `${degreesText(view.toDegrees(low), 0)} to ${degreesText(view.toDegrees(high), 0)}` : 'no data';
    return `${lane}${GLYPH[axis]} ${range}${plane.bad[at] ? ` (${plane.bad[at]} bad)` : ''}`;
  };
  const held = bin >= history.begin && bin < history.end;
  const strips = pointed ? traces.strips.filter((strip) => strip.lane === pointed.lane) : traces.strips.slice(0, 4);
  $('readout').textContent = held ? `−${ago.toFixed(3)} s: ${strips.map(value).join(', ')}` : `−${ago.toFixed(3)} s: no data`;
}

$('ring').addEventListener('change', (event) => chooseRing(event.target.value));
$('pause').addEventListener('click', () => pause(!paused));
$('longer').addEventListener('click', () => scale(1));
$('shorter').addEventListener('click', () => scale(-1));
$('theme').addEventListener('click', () => { theme(document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark', true); if (linked) remember(); });
$('help').addEventListener('click', () => { $('keys').hidden = !$('keys').hidden; $('help').setAttribute('aria-expanded', !$('keys').hidden); });
$('all').addEventListener('click', () => chooseLanes(panels.rows.map((_, lane) => lane)));
$('noded').addEventListener('click', () => { view.chosen = false; view.lanes = []; followNodes(last?.lanes); changeLanes(); });
$('range').append(new Option('automatic', 'auto'), new Option('alike', 'alike'), ...SPANS.map((span) => new Option(`${span}°`, span)));
$('range').value = view.range;
if (!$('range').value) $('range').value = view.range = 'auto';
$('range').addEventListener('change', (event) => { view.range = event.target.value; remember(); redraw(); });
$('axes').value = view.axes.length === 2 ? 'both' : view.axes[0] ? 'beta' : 'alpha';
$('axes').addEventListener('change', (event) => { view.axes = { both: [0, 1], alpha: [0], beta: [1] }[event.target.value]; changeLanes(); });
$('plot').addEventListener('pointermove', (event) => { const box = $('plot').getBoundingClientRect(); traces?.point(event.clientX - box.left, event.clientY - box.top); });
$('plot').addEventListener('pointerleave', () => { if (traces) { traces.point(-1, -1); $('readout').textContent = ''; } });

const KEYS = { r: () => parts.choose('robot', true), w: () => { if (!robotPart.player.on) parts.choose('traces', true); }, ' ': () => (robotPart.player.on ? robotPart.player.toggle() : pause(!paused)), '+': () => nearer(true), '=': () => nearer(true), '-': () => nearer(false), 0: () => $('whole').click(), c: () => $('record').click(), s: () => $('hold').click(), a: () => $('all').click(), n: () => $('noded').click(), p: () => $('set-pose').click(), d: () => $('theme').click(), '?': () => $('help').click() };
addEventListener('keydown', (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || !traces) return;
  const inPlot = event.target === $('plot');
  if (inPlot && event.key.startsWith('Arrow')) {
    const columns = { ArrowLeft: 1, ArrowRight: -1 }[event.key] ?? 0;
    if (columns) { traces.step(columns * (event.shiftKey ? 20 : 1)); event.preventDefault(); }
    return;
  }
  const typing = event.target.matches('select, input[type=number]') || (event.key === ' ' && event.target.matches('button, input'));
  if (typing || !KEYS[event.key]) return;
  event.preventDefault();
  KEYS[event.key]();
});

const dark = matchMedia('(prefers-color-scheme: dark)');
dark.addEventListener('change', () => { if (!document.documentElement.dataset.chosen) theme(dark.matches ? 'dark' : 'light'); });
theme(wanted.get('theme') ?? (dark.matches ? 'dark' : 'light'), wanted.has('theme'));
parts.choose(wanted.get('part') ?? 'traces', wanted.has('part'));
wire.connect();
