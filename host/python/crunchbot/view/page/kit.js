/* Small things that every part of a page uses: elements, numbers as text, colours. The demo's report uses them too. */
const $ = (id) => document.getElementById(id);

const count = (n) => Math.round(n).toString().replace(/\B(?=(\d{3})+$)/g, '\u202f');
const sum = (list) => list.reduce((a, b) => a + b, 0);
const words = (kind) => kind.replaceAll('_', ' ');

function duration(s) {
  if (s < 10) return `${s.toFixed(1)} s`;
  if (s < 120) return `${Math.round(s)} s`;
  return s < 7200 ? `${Math.round(s / 60)} min` : `${(s / 3600).toFixed(1)} h`;
}

function nanoseconds(ns) {
  return ns < 1e3 ? `${Math.round(ns)} ns` : ns < 1e6 ? `${(ns / 1e3).toFixed(ns < 1e4 ? 1 : 0)} µs` : ns < 1e9 ? `${(ns / 1e6).toFixed(1)} ms` : duration(ns / 1e9);
}

/* An element with text or children; text is never read as HTML. */
function make(tag, content = '', attributes = {}) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...[content].flat());
  return element;
}

/* Text with `commands` between backquotes. */
function rich(text) {
  return text.split('`').map((part, n) => (n % 2 ? make('code', part) : part));
}

/* A CSS colour #rrggbb as the four bytes of a pixel. */
function pixelOf(colour) {
  const value = parseInt(colour.slice(1), 16);
  return (0xff000000 | ((value & 0xff) << 16) | (value & 0xff00) | (value >> 16)) >>> 0;
}
