/* Record and stop, in the header of every part: asked of the server, which says what is so. */
class Controls {
  constructor(wire, subject) {
    this.wire = wire;
    this.now = { recording: null, held: false, said: '' };
    $('record').addEventListener('click', () => wire.send({ type: 'record', on: !this.now.recording, ...(this.now.recording ? {} : subject()) }));
    $('hold').addEventListener('click', () => wire.send({ type: 'hold', on: !this.now.held }));
    wire.on('controls', (message) => this.take(message));
  }

  hello(hello) {
    $('record').hidden = !hello.may_record;
    $('hold').hidden = !hello.may_set_pose;
    if (hello.may_record || hello.may_set_pose) this.wire.subscribe('controls', {});
  }

  take(message) {
    this.now = message;
    const { recording, held } = message;
    $('record').textContent = recording ? `■ Stop recording, ${duration(recording.for_s)}` : '● Record';
    $('record').setAttribute('aria-pressed', Boolean(recording));
    $('record').title = recording ? `into ${recording.file}` : 'what is looked at, into a new file';
    $('hold').textContent = held ? '▶ Let it go on' : '■ Stop robot';
    $('hold').setAttribute('aria-pressed', held);
    this.say(recording ? `Recording into ${recording.file}` : message.said);
  }

  /* Whether an error of the server was about these; then it is said here. */
  refused(text) {
    const [kind, why] = text.split(/: (.*)/s);
    if (!['record', 'hold'].includes(kind)) return false;
    this.say(why);
    return true;
  }

  say(text) {
    if ($('controls-said').textContent !== text) $('controls-said').textContent = text;
    $('controls-said').hidden = !text;
  }
}
