/** The WebSocket to the studio: views and messages out, frames and messages in. The newest frame wins, both ways. */

const HEADER_BYTES = 24;
const CODINGS = ["image/jpeg", "image/png", "rgb"];

/** Milliseconds until a lost connection is tried again, at first and at most. */
const FIRST_PAUSE = 300;
const LONGEST_PAUSE = 5000;

/** Reads the header of a frame; the layout is that of wire.py. */
export function readHeader(buffer) {
  const data = new DataView(buffer);
  if (data.byteLength < HEADER_BYTES || data.getUint8(0) !== 1) throw new Error("this frame is none");
  const flags = data.getUint8(2);
  return {
    coding: CODINGS[data.getUint8(1)],
    isFinal: (flags & 1) !== 0,
    isDenoised: (flags & 2) !== 0,
    number: data.getUint32(4, true),
    view: data.getUint32(8, true),
    width: data.getUint16(12, true),
    height: data.getUint16(14, true),
    samples: data.getUint32(16, true),
    seconds: data.getFloat32(20, true),
  };
}

/** Decodes the picture of a frame to something that a canvas can draw, without a change of its colours. */
export async function decodeFrame(buffer, header) {
  const body = new Uint8Array(buffer, HEADER_BYTES);
  if (header.coding === "rgb") {
    const data = new Uint8ClampedArray(4 * header.width * header.height);
    for (let from = 0, to = 0; from < body.length; from += 3, to += 4) {
      data[to] = body[from];
      data[to + 1] = body[from + 1];
      data[to + 2] = body[from + 2];
      data[to + 3] = 255;
    }
    return new ImageData(data, header.width, header.height);
  }
  const options = { colorSpaceConversion: "none", premultiplyAlpha: "none" };
  return createImageBitmap(new Blob([body], { type: header.coding }), options);
}

export class Connection {
  #socket = null;
  #pause = FIRST_PAUSE;
  #wanted = null;
  #isFlushing = false;
  #views = 0;
  #isEnded = false;

  /** @param handlers `onMessage(message)`, `onFrame(header, picture)`, `onState("open" | "lost")` */
  constructor(address, handlers) {
    this.address = address;
    this.handlers = handlers;
    this.#connect();
  }

  get isOpen() {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  /** Sends a message; false if the connection is lost. */
  send(message) {
    if (!this.isOpen) return false;
    this.#socket.send(JSON.stringify(message));
    return true;
  }

  /** Asks for frames of a view, instead of any asked for before; at most once per frame of the screen. */
  want(view) {
    this.#wanted = { ...view, asked: performance.now() };
    if (this.#isFlushing) return;
    this.#isFlushing = true;
    requestAnimationFrame(() => {
      this.#isFlushing = false;
      this.#flush();
    });
  }

  end() {
    this.#isEnded = true;
    this.#socket?.close();
  }

  #flush() {
    if (this.#wanted === null || !this.isOpen) return;
    const { asked, ...view } = this.#wanted;
    this.#views += 1;
    this.sent = { number: this.#views, asked };
    this.send({ type: "view", number: this.#views, ...view });
  }

  #connect() {
    const socket = new WebSocket(this.address);
    socket.binaryType = "arraybuffer";
    this.#socket = socket;
    socket.addEventListener("open", () => {
      this.#pause = FIRST_PAUSE;
      this.handlers.onState("open");
      this.#flush();
    });
    socket.addEventListener("message", ({ data }) => {
      if (typeof data === "string") this.handlers.onMessage(JSON.parse(data));
      else this.#takeFrame(data);
    });
    socket.addEventListener("close", () => {
      if (this.#isEnded) return;
      this.handlers.onState("lost");
      setTimeout(() => this.#connect(), this.#pause);
      this.#pause = Math.min(2 * this.#pause, LONGEST_PAUSE);
    });
  }

  async #takeFrame(buffer) {
    const header = readHeader(buffer);
    const picture = await decodeFrame(buffer, header);
    this.send({ type: "shown", frame: header.number });
    // A frame decoded later than one that was sent after it is out of date.
    if (header.number < (this.newest ?? 0)) return;
    this.newest = header.number;
    if (header.view === this.sent?.number) header.delay = performance.now() - this.sent.asked;
    this.handlers.onFrame(header, picture);
  }
}
