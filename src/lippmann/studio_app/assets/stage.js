/** The picture: a canvas of the display's shape, the eye in front of it, and what is asked of the studio. */

import { clampEye, eyeAt, eyeBounds, swayEye, swayStart } from "lippmann/eye.js";

/** Longest side of an eye's picture in pixels: displays resolve less, and each pixel is sent and drawn. */
const LONGEST_SIDE = 1000;

/** Factors of the zoom on native pixels, in pixels of the screen. */
const ZOOMS = [1, 2, 3, 4, 6, 8, 12, 16, 24];

export class Stage {
  #context;
  #picture = null;
  #swayFrom = null;
  #fit = { width: 1, height: 1 };

  /** @param onview called whenever another view has to be asked for; @param onstatus with what the frame is */
  constructor(root, canvas, { onview, onstatus, onmode }) {
    this.root = root;
    this.canvas = canvas;
    this.onview = onview;
    this.onstatus = onstatus;
    this.onmode = onmode;
    this.optics = null;
    this.eye = { x: 0, y: 0, z: 400 };
    this.isNative = false;
    this.isSwaying = false;
    this.isReal = false;
    this.corner = { x: 0, y: 0 };
    this.zoomIndex = 2;
    this.#context = canvas.getContext("2d", { alpha: false, desynchronized: true });
    new ResizeObserver(() => this.#layOut()).observe(root);
  }

  /** Takes over the geometry of a display; the eye goes to its place before it if that is another. */
  setOptics(optics) {
    const isFirst = this.optics === null || String(this.optics.eye) !== String(optics.eye);
    this.optics = optics;
    if (isFirst) this.eye = placeOf(optics);
    this.corner = { x: 0, y: 0 };
    this.#layOut();
    this.onmode();
  }

  /** What the studio is to show. */
  view() {
    const { width, height } = this.#fit;
    if (!this.isNative) return { eye: [this.eye.x, this.eye.y, this.eye.z], size: [width, height], window: null, real: this.isReal };
    const [columns, rows] = this.#nativeSize();
    const { x, y } = this.corner;
    return { eye: null, size: [columns, rows], window: [Math.round(x), Math.round(y), columns, rows] };
  }

  /** Draws a frame, once it has been decoded. */
  draw(header, picture) {
    this.#picture?.close?.();
    this.#picture = picture;
    this.header = header;
    this.#paint();
    this.onstatus(header);
  }

  look({ x, y }) {
    if (this.optics === null) return;
    this.setSwaying(false);
    this.#setEye(eyeAt(this.optics, this.eye.z, x, y));
  }

  step(right, up) {
    if (this.optics === null) return;
    this.setSwaying(false);
    const reach = eyeAt(this.optics, this.eye.z, right, up);
    this.#setEye({ x: this.eye.x + reach.x, y: this.eye.y + reach.y, z: this.eye.z });
  }

  approach(factor) {
    if (this.optics !== null) this.#setEye({ ...this.eye, z: this.eye.z * factor });
  }

  center() {
    if (this.optics === null) return;
    this.setSwaying(false);
    this.#setEye(placeOf(this.optics));
  }

  setSwaying(isOn) {
    if (this.isSwaying === isOn || this.optics === null) return;
    this.isSwaying = isOn;
    if (isOn) {
      this.setNative(false);
      this.#swayFrom = performance.now() - 1000 * swayStart(this.optics, this.eye);
      requestAnimationFrame(() => this.#sway());
    }
    this.onmode();
  }

  /** Shows the light that lenses send as they are made, or as ideal ones; displays without a lens have ideal ones. */
  setReal(isOn) {
    this.isReal = isOn;
    this.setNative(false);
    this.onview();
    this.onmode();
  }

  get hasLens() {
    return (this.optics?.lens ?? null) !== null;
  }

  setNative(isOn) {
    if (this.isNative === isOn || this.optics === null) return;
    if (isOn) {
      this.setSwaying(false);
      const { panel } = this.optics;
      const [columns, rows] = this.#nativeSize();
      this.corner = { x: (panel.width - columns) / 2, y: (panel.height - rows) / 2 };
    }
    this.isNative = isOn;
    this.#layOut();
    this.onmode();
  }

  /** Scrolls the native pixels by shares of half of the canvas, right and up. */
  scroll(right, up) {
    const [columns, rows] = this.#nativeSize();
    this.corner.x -= (right * columns) / 2;
    this.corner.y += (up * rows) / 2;
    this.#clampCorner();
    this.onview();
  }

  /** Shows the native pixels in another size, about a point of the canvas. */
  zoom(factor, { x, y }) {
    const before = this.#nativeSize();
    const index = this.zoomIndex + (factor > 1 ? 1 : -1);
    this.zoomIndex = Math.max(0, Math.min(ZOOMS.length - 1, index));
    const after = this.#nativeSize();
    this.corner.x += ((x + 1) / 2) * (before[0] - after[0]);
    this.corner.y += ((1 - y) / 2) * (before[1] - after[1]);
    this.#clampCorner();
    this.#layOut();
    this.onmode();
  }

  /** Millimetres of the display per half of the canvas, across and up. */
  get halfSize() {
    const { panel } = this.optics;
    return [(panel.width * panel.pixel_pitch) / 2, (panel.height * panel.pixel_pitch) / 2];
  }

  get nativeZoom() {
    return ZOOMS[this.zoomIndex];
  }

  #setEye(eye) {
    this.eye = clampEye(eye, eyeBounds(this.optics));
    this.onview();
  }

  #sway() {
    if (!this.isSwaying) return;
    this.eye = swayEye(this.optics, this.eye.z, (performance.now() - this.#swayFrom) / 1000);
    this.onview();
    requestAnimationFrame(() => this.#sway());
  }

  #nativeSize() {
    const { panel } = this.optics;
    const box = this.#available();
    const pixel = this.nativeZoom / devicePixelRatio;
    return [
      Math.max(1, Math.min(panel.width, Math.floor(box.width / pixel))),
      Math.max(1, Math.min(panel.height, Math.floor(box.height / pixel))),
    ];
  }

  #clampCorner() {
    const { panel } = this.optics;
    const [columns, rows] = this.#nativeSize();
    this.corner.x = Math.max(0, Math.min(panel.width - columns, this.corner.x));
    this.corner.y = Math.max(0, Math.min(panel.height - rows, this.corner.y));
  }

  #available() {
    const style = getComputedStyle(this.root);
    const inner = (side, before, after) => Math.max(40, side - parseFloat(before) - parseFloat(after));
    return {
      width: inner(this.root.clientWidth, style.paddingLeft, style.paddingRight),
      height: inner(this.root.clientHeight, style.paddingTop, style.paddingBottom),
    };
  }

  #layOut() {
    if (this.optics === null) return;
    const { panel } = this.optics;
    const box = this.#available();
    const canvas = this.canvas;
    if (this.isNative) {
      this.#clampCorner();
      const [columns, rows] = this.#nativeSize();
      const pixel = this.nativeZoom / devicePixelRatio;
      canvas.style.width = `${columns * pixel}px`;
      canvas.style.height = `${rows * pixel}px`;
      canvas.width = columns * this.nativeZoom;
      canvas.height = rows * this.nativeZoom;
    } else {
      const scale = Math.min(box.width / panel.width, box.height / panel.height);
      const [width, height] = [panel.width * scale, panel.height * scale];
      canvas.style.width = `${width}px`;
      canvas.style.height = `${height}px`;
      const dense = Math.min(devicePixelRatio, LONGEST_SIDE / Math.max(width, height));
      canvas.width = Math.max(1, Math.round(width * devicePixelRatio));
      canvas.height = Math.max(1, Math.round(height * devicePixelRatio));
      this.#fit = { width: Math.max(1, Math.round(width * dense)), height: Math.max(1, Math.round(height * dense)) };
    }
    this.#paint();
    this.onview();
  }

  #paint() {
    if (this.#picture === null) return;
    const { width, height } = this.canvas;
    this.#context.imageSmoothingEnabled = !this.isNative;
    this.#context.imageSmoothingQuality = "high";
    if (this.#picture instanceof ImageData) {
      createImageBitmap(this.#picture).then((bitmap) => this.#context.drawImage(bitmap, 0, 0, width, height));
    } else this.#context.drawImage(this.#picture, 0, 0, width, height);
  }
}

/** Where the eye is at first: the middle of the viewing zone; of an eye-tracked monitor, whose two views meet there, the left eye. */
function placeOf({ eye: [x, y, z] }) {
  return { x, y, z };
}
