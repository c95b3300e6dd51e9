/* Plays a recording: where in it, whether it goes on, and how fast. All pages of one whisker-view see the same moment. */
const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16];

class Player {
  constructor(wire) {
    this.wire = wire;
    $('speed').append(...SPEEDS.map((speed) => new Option(`${speed} ×`, speed)));
    $('play').addEventListener('click', () => this.toggle());
    $('speed').addEventListener('change', (event) => this.ask({ speed: Number(event.target.value) }));
    $('seek').addEventListener('input', () => { this.held = true; this.tellTime($('seek').valueAsNumber); this.ask({ at_s: Math.min($('seek').valueAsNumber, this.now.length_s) }); });
    $('seek').addEventListener('change', () => { this.held = false; });
  }

  hello(hello) {
    this.on = Boolean(hello.playback);
    $('player').hidden = !this.on;
    $('parts').hidden = this.on; // a recording of a robot has no rings
  }

  toggle() {
    if (this.now) this.ask({ playing: !this.now.playing });
  }

  ask(what) {
    this.wire.send({ type: 'play', ...what });
  }

  take(playback) {
    this.now = playback;
    $('play').textContent = playback.playing ? 'Pause' : 'Play';
    $('seek').max = Math.ceil(2 * playback.length_s) / 2;
    if (!this.held) {
      $('seek').value = playback.at_s;
      this.tellTime(playback.at_s);
    }
    if (![...$('speed').options].some((option) => Number(option.value) === playback.speed)) $('speed').append(new Option(`${playback.speed} ×`, playback.speed));
    $('speed').value = playback.speed;
  }

  tellTime(s) {
    const text = (of) => `${Math.floor(of / 60)}:${(of % 60).toFixed(1).padStart(4, '0')}`;
    $('played').textContent = `${text(s)} of ${text(this.now.length_s)}`;
    $('seek').setAttribute('aria-valuetext', `${s.toFixed(1)} s`);
  }
}
