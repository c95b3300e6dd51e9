/* What topic status holds, as words and numbers: banner, tiles, health, lanes, kinds of bad records, events. */
const STATES = { live: '● live', stalled: '▲ no frames', waiting: '○ no ring', ended: '■ ended', refused: '■ refused', gone: '■ not connected' };
const EVEN = 0.9; // of real time: what is slower is said (bridge/flow.py)
const EMPTY = ['absent', 'lane_off']; // no loss: there is no node, or the lane is off

/* What a person can do next: [grave, headline, line, steps], or null when all is well. */
function advice(s, others) {
  const other = others.length ? [`Or look at another ring, above: ${others.map((name) => `\`${name}\``).join(', ')}.`] : [];
  const goesOn = 'This page goes on by itself.';
  switch (s.state) {
    case 'gone':
      return [true, 'whisker-view does not answer', `Nothing new is shown. ${goesOn}`, ['Start it again: `whisker-view`']];
    case 'waiting':
      return [false, `There is no ring named “${s.ring}” yet`, goesOn, [
        `With a bridge plugged in, start the daemon: \`whiskerd --ring ${s.ring}\``,
        'Something is wrong? `whisker doctor` finds out what.',
        `Without hardware: \`whisker bridge-sim --ring ${s.ring}\` simulates a bridge with whiskers on it.`, ...other]];
    case 'refused':
      return [true, 'This ring cannot be read', s.trouble.text, other];
    case 'ended': {
      const closed = s.trouble.name === 'CLOSED';
      const why = closed ? 'Its writer has closed it' : s.trouble.text;
      return [!closed, 'The ring has ended', `${why}. What was received is still shown. ${goesOn}`, [
        `To start the daemon again: \`whiskerd --ring ${s.ring}\``, ...other]];
    }
    case 'stalled':
      return [true, s.age_s === null ? 'No frame yet' : `No frame for ${duration(s.age_s)}`, `${s.daemon?.trouble ?? 'The daemon runs, but no frames come'}. ${goesOn}`, [
        'Check the cable and the power of the bridge.', '`whisker doctor` finds out why.']];
  }
  return flowSaid(s)?.advice ?? null;
}

/* Of a live ring: the pill's state and text where samples are lost or come slower than life, and advice; null: all is well. */
function flowSaid(s) {
  if (s?.state !== 'live') return null;
  if (s.loss) {
    const [share, why, remedy] = s.loss;
    const lost = `${(100 * share).toPrecision(2)} % of the samples lost`;
    return { state: 'stalled', pill: `▲ ${lost}`, advice: [true, lost, `In the last seconds: ${why}.`, [remedy]] };
  }
  const pace = s.frames_per_s * s.tick_s;
  return pace < EVEN ? { state: 'live', pill: `● live, ${pace.toFixed(2)} × real time` } : null;
}

class Panels {
  constructor(onLanes) {
    this.onLanes = onLanes; // called with the list of lanes when a person changes it
    this.kinds = {};
    this.tiles = {};
    for (const [id, name] of [['frames', 'Frames'], ['missing', 'Missing'], ['dropped', 'Dropped by the bridge'], ['bad', 'Bad records'], ['overruns', 'Overruns of this view'], ['reconnects', 'Reconnects']]) {
      const parts = { tile: make('div', [], { class: 'tile', id: `tile-${id}` }), value: make('b', '–'), note: make('small') };
      parts.tile.append(make('span', name, { class: 'name' }), parts.value, parts.note);
      $('tiles').append(parts.tile);
      this.tiles[id] = parts;
    }
  }

  hello(hello) {
    this.kinds = hello.kinds;
    this.wireVersion = hello.wire_version;
    if (this.rows) return;
    this.rows = Array.from({ length: hello.lanes }, (_, lane) => this.makeLane(lane, hello.lane_names[lane]));
    $('lanes').tBodies[0].append(...this.rows.map((row) => row.line));
    $('rest').addEventListener('click', () => { $('lanes').dataset.rest = $('lanes').dataset.rest === 'shown' ? 'hidden' : 'shown'; this.showRest(); });
  }

  /* Lanes without a node: one line, until they are asked for, or one of them is ticked. */
  showRest() {
    const rest = this.rows.filter((row) => row.line.dataset.state === 'empty').length;
    const shown = $('lanes').dataset.rest === 'shown';
    $('rest').hidden = !rest;
    $('rest').setAttribute('aria-expanded', shown);
    $('rest').textContent = shown ? 'Hide lanes without a node' : `Show ${rest} lanes without a node`;
  }

  makeLane(lane, name) {
    const box = make('input', [], { type: 'checkbox', id: `lane-${lane}` });
    box.addEventListener('change', () => this.onLanes(this.rows.flatMap((row, n) => (row.box.checked ? [n] : []))));
    const cells = [make('td'), make('td'), make('td'), make('td')];
    const line = make('tr', [make('th', make('label', [box, String(lane), ...(name ? [make('small', ` ${words(name)}`)] : [])]), { scope: 'row' }), ...cells]);
    return { box, cells, line };
  }

  select(lanes) {
    this.rows?.forEach((row, lane) => { row.box.checked = lanes.includes(lane); });
  }

  status(s, others, toDegrees) {
    $('state').textContent = flowSaid(s)?.pill ?? STATES[s.state];
    $('state').dataset.state = flowSaid(s)?.state ?? s.state;
    $('banner').dataset.state = s.state;
    this.banner(advice(s, others));
    if (s.state === 'gone') return;
    this.showTiles(s);
    this.showHealth(s);
    this.showLanes(s, toDegrees);
    this.showKinds(s.bad);
    this.showEvents(s.events);
  }

  banner(reported) {
    const key = JSON.stringify(reported && [reported[0], reported[1].replace(/[\d.]+ (s|min|h)$/, ''), reported[2], reported[3]]);
    const [headline, line, steps] = $('banner').children;
    if (reported) headline.textContent = reported[1];
    if (key === this.reported) return;
    this.reported = key;
    $('banner').hidden = !reported;
    if (!reported) return;
    $('banner').dataset.grave = reported[0] ? 'yes' : 'no';
    line.replaceChildren(...rich(reported[2] ?? ''));
    steps.replaceChildren(...reported[3].map((step) => make('li', rich(step))));
  }

  tile(id, value, note, loss) {
    const parts = this.tiles[id];
    parts.value.textContent = value;
    parts.note.textContent = note;
    parts.tile.dataset.loss = loss ? 'yes' : 'no';
  }

  showTiles(s) {
    const pace = s.frames_per_s * s.tick_s;
    this.tile('frames', count(s.frames), `${count(s.frames_per_s)}/s, ${pace.toFixed(2)} × real time`, false);
    const missing = s.reader?.frames_missing ?? 0;
    this.tile('missing', count(missing), 'gaps in the sequence', missing > 0);
    this.tile('dropped', count(s.dropped), 'its buffer was full', s.dropped > 0);
    const lost = s.lanes ? sum(s.lanes.lost) : 0;
    const all = lost + (s.lanes ? sum(s.lanes.good) : 0);
    this.tile('bad', count(lost), lost ? `${((100 * lost) / all).toPrecision(2)} % of lanes with a node` : 'of lanes with a node', lost > 0);
    const overruns = s.reader?.overruns ?? 0;
    this.tile('overruns', count(overruns), `${count(s.reader?.frames_overrun ?? 0)} frames not shown here`, overruns > 0);
    const reconnects = s.daemon?.reconnects ?? 0;
    this.tile('reconnects', count(reconnects + s.restarts), `bridge ${reconnects}, daemon ${s.restarts}`, false);
  }

  showHealth(s) {
    const d = s.daemon;
    const none = 'not reported';
    const pairs = [
      ['Last frame', s.age_s === null ? 'none yet' : s.age_s < 0.1 ? 'less than 0.1 s ago' : `${duration(s.age_s)} ago`],
      ['Device', d ? [d.connected ? '' : 'not connected', d.serial && `serial ${d.serial}`, d.firmware].filter(Boolean).join(', ') || 'connected' : none],
      ['Wire version', d?.wire_version ? `${d.wire_version} (bridge), ${this.wireVersion} (host)` : `${this.wireVersion} (host)`],
      ['Daemon', [s.reader && `process ${s.reader.writer_pid}`, d && `up ${duration(Date.now() / 1e3 - d.started_ns / 1e9)}`].filter(Boolean).join(', ') || none],
      ['Daemon’s loss', d ? `${count(d.frames_missing)} frames missing, ${count(d.records_crc + d.records_tick + d.records_usb + d.records_sensor)} records bad, ${count(d.usb_errors)} USB errors` : none],
      ['Clock', s.clock ? `to ± ${nanoseconds(s.clock.uncertainty_ns)}` : none],
      ['Tick', `${Number((s.tick_s * 1e6).toPrecision(6))} µs`],
      ['Ring', s.reader ? `${count(s.reader.capacity)} frames, ${duration(s.reader.capacity * s.tick_s)}; ${count(s.reader.published)} written; of user ${s.reader.owner}` : 'none'],
      ['Counted for', s.attached_s === null ? 'not attached' : duration(s.attached_s)],
      ['This page', `${count(this.skipped?.() ?? 0)} columns skipped`],
    ];
    $('health').replaceChildren(...pairs.flatMap(([name, value]) => [make('dt', name), make('dd', value)]));
  }

  showLanes(s, toDegrees) {
    this.rows?.forEach((row, lane) => {
      const state = s.lanes?.state[lane] ?? '–';
      const good = state === 'good';
      row.line.dataset.state = good ? 'good' : EMPTY.includes(state) || !s.lanes ? 'empty' : 'bad';
      row.line.title = this.kinds[state] && !good ? `${this.kinds[state].cause}: ${this.kinds[state].remedy}` : '';
      const lost = s.lanes?.lost[lane] ?? 0;
      const degrees = (counts) => (good ? degreesText(toDegrees(counts), 0) : '');
      const texts = [words(state), degrees(s.lanes?.alpha[lane]), degrees(s.lanes?.beta[lane]), lost ? `${count(lost)} !` : s.lanes?.good[lane] ? '0' : ''];
      row.cells.forEach((cell, n) => { if (cell.textContent !== texts[n]) cell.textContent = texts[n]; });
      row.cells[3].className = lost ? 'loss' : '';
    });
    this.showRest();
  }

  showKinds(bad) {
    const lines = Object.entries(bad).filter(([kind]) => !EMPTY.includes(kind)).map(([kind, lanes]) => {
      const where = lanes.flatMap((n, lane) => (n ? [`${lane}: ${count(n)}`] : [])).join(', ');
      const help = this.kinds[kind] ? `${this.kinds[kind].cause}; ${this.kinds[kind].remedy}` : 'unknown to this release';
      return make('tr', [make('td', [words(kind), make('small', help), make('small', `lane ${where}`)]), make('td', count(sum(lanes)))]);
    });
    $('kinds').tBodies[0].replaceChildren(...(lines.length ? lines : [make('tr', make('td', 'none'))]));
  }

  showEvents(events) {
    const key = JSON.stringify(events);
    if (key === this.events) return;
    this.events = key;
    const clock = (time) => new Date(time * 1e3).toTimeString().slice(0, 8);
    $('events').replaceChildren(...events.toReversed().map(([time, text]) => make('li', [make('time', clock(time)), make('span', text)])));
  }
}
