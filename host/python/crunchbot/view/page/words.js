/* What topic robot says, in words: pose, behaviour, observation row, contacts, processes. What is not known is said so. */
const AGED_S = 2; // what is older is no longer how it is
const NATS = 10; // log-likelihoods so far below the best have no bar

const ago = (s) => (typeof s !== 'number' ? 'never' : s < 0.1 ? 'just now' : `${duration(s)} ago`);
const degreesOf = (rad, places = 0) => signed(typeof rad === 'number' ? (rad * 180) / Math.PI : null, places, '°');
const none = (text) => make('span', text, { class: 'none' });

/* Changes an element's children only if the content has changed: a table that is read or selected stands still. */
function retell(element, key, children) {
  const text = JSON.stringify(key);
  if (element.reported === text) return;
  element.reported = text;
  element.replaceChildren(...children());
}

function pairsOf(element, pairs) {
  retell(element, pairs, () => pairs.flatMap(([name, value]) => [make('dt', name), make('dd', value.startsWith('not known') || value.startsWith('never') ? none(value) : value)]));
}

function tellPose(word, belief) {
  const { pose, truth, ages } = word;
  const spread = pose && typeof pose.sigma_m === 'number' ? `± ${signed(pose.sigma_m, 2)} m, ± ${degreesOf(pose.sigma_rad)}` : 'not known';
  const error = pose && truth ? `${signed(Math.hypot(pose.x - truth.x, pose.y - truth.y), 2)} m, ${degreesOf(Math.abs(Math.atan2(Math.sin(pose.theta - truth.theta), Math.cos(pose.theta - truth.theta))))}` : 'not known';
  pairsOf($('pose'), [
    ['Estimate', pose ? `x ${signed(pose.x, 2)} m, y ${signed(pose.y, 2)} m, ${degreesOf(pose.theta)}` : 'not known: no pose has come'],
    ['Spread (1 σ)', spread],
    ['Confidence', pose ? signed(pose.confidence, 2) : 'not known'],
    ['Truth', truth ? `x ${signed(truth.x, 2)} m, y ${signed(truth.y, 2)} m, ${degreesOf(truth.theta)}` : 'not known: only a simulation reports it'],
    ['Error', error],
    ['Belief', belief.said()],
    ['Filter', pose ? `${pose.filter}, from row ${count(pose.first_seq)}, prior ${pose.prior || 'not reported'}` : 'not known'],
    ['Pose came', ago(ages.pose)],
  ]);
}

/* Each filter's answer beside the others'; the first is the robot's. */
function tellFilters({ filters, truth }) {
  $('filters-card').hidden = $('others-legend').hidden = filters.length < 2;
  retell($('filters'), [filters, truth], () => filters.map((f, nth) => {
    const off = truth ? signed(Math.hypot(f.x - truth.x, f.y - truth.y), 2) : 'not known';
    const cells = [signed(f.confidence, 2), signed(f.sigma_m, 2), off];
    return make('tr', [make('th', nth ? f.name : `${f.name}, the robot’s`, { scope: 'row' }), ...cells.map((cell) => make('td', cell))]);
  }));
}

function tellMap(map) {
  const { faces, tiles, area, corners } = mapSaid(map);
  pairsOf($('map'), [['Faces', faces], ['Corners', corners], ['Floor', tiles], ['Ground', area], ['As of row', count(map.seq)], ['Part of the run', map.part ? `${map.part + 1}, after ${map.part === 1 ? 'a kidnap' : `${map.part} kidnaps`}` : 'the first']]);
}

function tellBehaviour(word) {
  const doing = word.behaviour;
  const expects = word.processes.find((process) => process.name === 'pilot')?.counters.expects; // of one that plans
  pairsOf($('behaviour'), [
    ['State', doing ? words(doing.state.toLowerCase()) : 'not known: no word has come'],
    ['For', doing && word.now_s !== null ? duration(Math.max(0, word.now_s - doing.since_s)) : 'not known'],
    ['Because', doing ? doing.reason || 'no reason reported' : 'not known'],
    ...(expects ? [['Expects', expects]] : []),
  ]);
}

function tellRow(word) {
  const { row, rows } = word;
  pairsOf($('rows'), [
    ['Row', row ? `${count(row.seq)}, ${row.kind}` : 'not known: no row has come'],
    ['Came', ago(word.ages.observation)],
    ['Missed by the navigator', rows.missed === null ? 'not known' : count(rows.missed)],
    ['Missed by this view', count(rows.unseen)],
  ]);
  retell($('cells'), row && [row.tips, row.rays], () => [...(row?.tips ?? []).map(tipBars), ...(row?.rays ?? []).map(rayLine)]);
}

/* A texture whisker: a bar for each texture, longest for the likeliest. */
function tipBars(tip) {
  const best = Math.max(...tip.loglik.map(([, value]) => value ?? -Infinity));
  const lines = tip.loglik.map(([texture, value]) => {
    const bar = make('i', [], { class: value === best ? 'bar best' : 'bar' });
    bar.style.width = value === null ? '0' : `${Math.max(0, 100 * (1 + (value - best) / NATS))}%`;
    return make('li', [make('span', texture, { class: 'what' }), make('span', bar, { class: 'room' }), make('span', value === null ? '' : signed(value - best, 1), { class: 'value' })]);
  });
  return make('li', [make('b', words(tip.name)), best === -Infinity ? none(' not read') : make('ul', lines)], { class: 'tip' });
}

function rayLine(ray) {
  const reported = { contact: `${signed(ray.mm, 0)} mm from its base`, none: 'no contact' }[ray.state];
  return make('li', [make('b', words(ray.name)), reported ? make('span', ` ${reported}`) : none(' not read')]);
}

function tellContacts(word, contacts) {
  retell($('contacts'), [word.touching, contacts.slice(-6)], () => {
    if (!contacts.length) return [make('tr', make('td', none('none has come')))];
    return contacts.slice(-6).toReversed().map((c) => {
      const where = typeof c.radius_m === 'number' ? signed(1e3 * c.radius_m, 0) : 'not known';
      const how = typeof c.sigma_m === 'number' ? ` ± ${signed(1e3 * c.sigma_m, 1)}` : '';
      const cells = [words(c.whisker), c.part ?? 'not known', c.surface ?? 'not known', where + how, c.release_s === null ? 'touching' : `${duration(Math.max(0, c.release_s - c.onset_s))}`];
      return make('tr', cells.map((cell) => make('td', cell)));
    });
  });
}

/* A line each; what is opened stays open. */
function tellProcesses(word, ring) {
  const reported = ring && ring.state !== 'waiting' ? [...word.processes, ringProcess(ring)] : word.processes;
  const list = $('processes');
  const names = reported.map((process) => process.name);
  retell(list, names, () => (names.length ? names.map(() => make('li', [make('details', [make('summary'), make('div')]), make('div', '', { class: 'fault' })])) : [make('li', none('no process has reported of itself'))]));
  reported.forEach((process, nth) => tellProcess(list.children[nth], process));
}

/* The daemon behind the ring that the other part shows, if that ring is on this machine, in the words of topic robot. */
function ringProcess(s) {
  const counters = { frames: count(s.frames), missing: count(s.reader?.frames_missing ?? 0), dropped: count(s.dropped), 'bad records': count(sum(s.lanes?.lost ?? [])) };
  return { name: `ring ${s.ring}`, pid: s.reader?.writer_pid, state: words(s.state), age_s: s.age_s === null ? null : Math.floor(s.age_s), silent: s.state === 'stalled', ended: s.state === 'ended', restarts: s.restarts, counters, error: s.trouble?.text ?? '' };
}

function tellProcess(line, p) {
  const never = p.age_s === null;
  const [summary, details] = line.firstChild.children;
  const state = p.ended ? `■ ${p.state}` : never ? '○ never heard' : p.silent ? `▲ silent for ${duration(p.age_s)}` : `● ${p.state || 'state not reported'}`;
  line.dataset.state = never || p.ended ? 'never' : p.silent ? 'silent' : 'heard';
  retell(summary, [p.name, state], () => [make('b', p.name), make('span', state, { class: 'condition' })]);
  const facts = [p.pid ? `process ${p.pid}` : '', p.restarts ? `restarted ${p.restarts} ×` : '', never ? '' : `last word ${ago(p.age_s)}`].filter(Boolean).join(', ');
  retell(line.lastChild, p.error, () => (p.error ? [`! last error: ${p.error}`] : []));
  retell(details, [facts, p.counters], () => [
    make('small', facts),
    make('dl', Object.entries(p.counters).flatMap(([key, value]) => [make('dt', words(key)), make('dd', value)]), { class: 'pairs' }),
  ]);
}

/* [grave, headline, line, steps] for the note above the plan; null when all is heard. */
function robotAdvice(word) {
  const goesOn = 'This page goes on by itself.';
  const start = 'For a demonstration without hardware: `make demo`';
  if (!word) return [false, 'Nothing is known of the robot yet', goesOn, []];
  if (word.link.state === 'off') return [false, 'whisker-view does not listen to a robot', 'It was started for rings only.', ['Start it with `whisker-view --robot NAME --scene SCENE`']];
  if (word.playback) return null;
  if (word.heard_s === null) return [false, `Nothing has been heard of the robot “${word.name}” yet`, `${word.link.text}. ${goesOn}`, ['Start the pilot on the robot, the navigator here; `--connect tcp/HOST:PORT` if it is in another place.', start]];
  if (word.heard_s > AGED_S) return [true, `Nothing heard of the robot for ${duration(word.heard_s)}`, `What is shown is how it last was. ${goesOn}`, ['Is the pilot running? Is the network there?']];
  return null;
}
