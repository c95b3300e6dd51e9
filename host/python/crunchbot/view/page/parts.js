/* The parts of the page, of which one is looked at: the robot, or the traces of its whiskers. */
const PARTS = ['robot', 'traces'];

class Parts {
  constructor(onChange) {
    this.onChange = onChange;
    for (const name of PARTS) $(`part-${name}`).addEventListener('click', () => this.choose(name, true));
  }

  /* `chosen`: by a person, or by the address; it is kept then. */
  choose(name, chosen) {
    if (!PARTS.includes(name)) return;
    this.now = name;
    this.chosen = this.chosen || chosen;
    document.body.dataset.part = name;
    for (const part of PARTS) {
      $(`part-${part}`).setAttribute('aria-pressed', part === name);
      $(`${part}-part`).hidden = part !== name;
    }
    for (const element of document.querySelectorAll('[data-of]')) element.hidden = element.dataset.of !== name;
    this.onChange(name);
  }
}
