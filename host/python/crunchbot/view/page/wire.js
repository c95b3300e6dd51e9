/* The connection to whisker-view: subscriptions that survive it, and a word after every message dealt with. */
const RETRY_MS = [250, 500, 1000, 2000];

class Wire {
  constructor(onLink) {
    this.onLink = onLink; // called with true when connected, false when not
    this.handlers = new Map(); // topic -> function(message)
    this.wanted = new Map(); // topic -> options
    this.topicOf = new Map(); // first byte of a binary message -> topic
    this.failures = 0;
  }

  on(topic, handler) {
    this.handlers.set(topic, handler);
  }

  subscribe(topic, options) {
    this.wanted.set(topic, options);
    this.send({ type: 'subscribe', topic, ...options });
  }

  unsubscribe(topic) {
    if (this.wanted.delete(topic)) this.send({ type: 'unsubscribe', topic });
  }

  connect() {
    this.ready = false;
    this.count = 0;
    const socket = new WebSocket(`ws://${location.host}/ws`);
    socket.binaryType = 'arraybuffer';
    socket.onmessage = (event) => this.receive(event.data);
    socket.onclose = () => this.lost();
    this.socket = socket;
  }

  send(request) {
    if (this.ready) this.socket.send(JSON.stringify(request));
  }

  receive(data) {
    const message = typeof data === 'string' ? JSON.parse(data) : data;
    const topic = typeof data === 'string' ? message.topic : this.topicOf.get(new Uint8Array(data, 0, 1)[0]);
    if (topic === 'hello') this.welcome(message);
    this.handlers.get(topic)?.(message);
    this.count += 1;
    this.send({ type: 'ack', count: this.count });
  }

  welcome(hello) {
    for (const [name, topic] of Object.entries(hello.topics)) this.topicOf.set(topic.id, name);
    this.ready = true;
    this.failures = 0;
    this.onLink(true);
    for (const [topic, options] of this.wanted) this.send({ type: 'subscribe', topic, ...options });
  }

  lost() {
    this.ready = false;
    this.onLink(false);
    const wait = RETRY_MS[Math.min(this.failures++, RETRY_MS.length - 1)];
    setTimeout(() => this.connect(), wait);
  }
}
