/* A guided tour of a recording: six marks, one after the other, each with a sentence and a frame around what it is about. */
const TOUR = [
  ['#plan', 'The robot from above', 'It has no camera and no lidar: only whiskers. The solid path is where it thinks it went. The dashed path is the truth, which the simulation knows.'],
  ['#plan', 'The belief', 'The purple cloud is every place where the robot may be: stronger is likelier, arrows are headings. Wide: it is not sure. A point: it is.'],
  ['[aria-label="Contacts"]', 'Contacts', 'A whisker that bends has met something. The table tells which whisker, where along it, and on what.'],
  ['[aria-label="What it feels"]', 'Textures', 'The other whiskers drag over the floor. Each texture gets a likelihood; the letters on the plan are what was read.'],
  ['[aria-label="Confidence over time"]', 'How sure it is', 'The share of the belief near the estimate. Compare it with the error below: a robot that is wrong must not be sure.'],
  ['#player', 'Play', 'Drag the time, or change the speed. Your own robot looks like this: `whisker robot --simulated --desktop` runs one.'],
];

class Tour {
  constructor() {
    this.at = -1;
    $('tour-back').addEventListener('click', () => this.show(this.at - 1));
    $('tour-next').addEventListener('click', () => this.show(this.at + 1));
    $('tour-end').addEventListener('click', () => this.show(-1));
    $('tour-start').addEventListener('click', () => this.show(0));
  }

  /* A recording can be toured; `begun`: the address asks for it. */
  hello(hello, begun) {
    $('tour-start').hidden = !hello.playback;
    if (hello.playback && begun && this.at < 0) this.show(0);
  }

  /* The mark of this number; none outside the six. */
  show(at) {
    document.querySelector('.toured')?.classList.remove('toured');
    this.at = at >= 0 && at < TOUR.length ? at : -1;
    $('tour').hidden = this.at < 0;
    if (this.at < 0) return;
    const [selector, title, text] = TOUR[this.at];
    $('tour-title').textContent = `${this.at + 1} of ${TOUR.length}: ${title}`;
    $('tour-text').replaceChildren(...rich(text));
    $('tour-back').disabled = this.at === 0;
    $('tour-next').textContent = this.at === TOUR.length - 1 ? 'End' : 'Next';
    const marked = document.querySelector(selector).closest('.card');
    marked.classList.add('toured');
    marked.scrollIntoView({ block: 'center' });
  }
}
