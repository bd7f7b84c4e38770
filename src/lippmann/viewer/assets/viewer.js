/**
 * The viewer: shows a picture as its display does, with controls.
 *
 * `createViewer(root, sources, options)` fills the element `root` and returns the viewer; `sources` is a source or a
 * list of one or two, see source.js. Options: `theme`, "auto" (default), "dark" or "light"; `compact`, which hides the
 * controls at first; `memory`, the limit on graphics memory per picture in bytes: of a larger picture a part is
 * displayed.
 */

import { Controls, focusRange } from "lippmann/controls.js";
import { clampEye, eyeAt, eyeBounds, glideEye, swayStart, swayEye } from "lippmann/eye.js";
import { frameBounds, panFrame, zoomFrame } from "lippmann/frame.js";
import { followTilt, listen } from "lippmann/input.js";
import { halfField } from "lippmann/optics.js";
import { Layout } from "lippmann/layout.js";
import { Picture, checkManifest } from "lippmann/picture.js";
import { Stage } from "lippmann/stage.js";

const MODES = ["single", "side-by-side", "anaglyph"];

/** Default limit on graphics memory per picture in bytes: enough for 128 million pixels. */
const MEMORY = 512e6;

/** Radius of the magnifier as a share of the shorter side of the canvas, and its limit in CSS pixels. */
const GLASS_SHARE = 0.35;
const LARGEST_GLASS = 140;

/** Views added to the focus sum per frame. */
const VIEWS_PER_FRAME = 6;

/** Milliseconds between two updates of the controls while the eye moves. */
const CONTROLS_PAUSE = 100;

/** So many frames in a row that take longer than so many seconds make a moving picture one of single points. */
const SLOW_FRAMES = 3;
const SLOW_SECONDS = 0.05;

export function createViewer(root, sources, options = {}) {
  return new Viewer(root, [sources].flat(), options);
}

class Viewer {
  constructor(root, sources, options) {
    this.sources = sources;
    this.memory = options.memory ?? MEMORY;
    this.zoom = { widest: 1, smallest: 1 };
    this.pictures = sources.map(() => null);
    this.manifests = [];
    this.view = {
      eye: { x: 0, y: 0, z: 1 },
      mode: "single",
      eyeDistance: 63,
      isCrossed: false,
      plane: null,
      frame: { x: 0, y: 0, width: 1, height: 1 },
      glass: null,
      glassScale: 14,
      overlay: null,
      isReal: false,
      divider: 0.5,
      isPlaying: false,
      viewsPerFrame: VIEWS_PER_FRAME,
      wholeFocus: false,
      isCoarse: false,
    };
    this.goal = null;
    this.requested = 0;
    this.lastTime = null;
    this.slowFrames = 0;
    this.controlsShown = 0;
    this.isDestroyed = false;
    this.layout = new Layout(root, options, () => this.#resize());
    this.layout.onDivider = (share) => this.set({ divider: share });
    this.ready = this.#begin();
    // The page displays the error; an unhandled rejection would report it again.
    this.ready.catch(() => {});
  }

  // ---- Public methods ------------------------------------------------------------------------------------------

  /** Sets the eye position (mm, display frame) at once, anywhere in front of the lenses. */
  setEye(x, y, z) {
    if (!(z > 0) || !Number.isFinite(x + y + z)) throw new RangeError("the eye must be in front of the lens plane");
    this.goal = null;
    this.set({ eye: { x, y, z } });
  }

  setMode(mode) {
    if (!MODES.includes(mode)) throw new RangeError(`the modes are ${MODES.join(", ")}`);
    this.view.mode = mode;
    this.layout.fit(this.#aspect());
    this.invalidate();
  }

  /** Changes parts of the state. */
  set(parts) {
    Object.assign(this.view, parts);
    this.invalidate();
  }

  /** Sets coordinates of the eye at once, within its limits. */
  moveEye(parts) {
    this.pause();
    this.goal = null;
    this.set({ eye: clampEye({ ...this.view.eye, ...parts }, this.bounds) });
  }

  /** Glides to the eye position of a point of the pane, -1 to 1 right and up. */
  lookFrom(right, up) {
    if (this.view.isPlaying || !this.optics) return;
    // Each of two panes spans the whole range.
    const across = this.view.mode === "side-by-side" ? 2 * right - Math.sign(right) : right;
    this.#glideTo(eyeAt(this.optics, this.view.eye.z, across, up));
  }

  dragBy(right, up) {
    const panes = this.view.mode === "side-by-side" ? 2 : 1;
    const { x, y, z } = this.goal ?? this.view.eye;
    const moved = eyeAt(this.optics, z, panes * right, up);
    this.#glideTo({ x: x + moved.x, y: y + moved.y, z });
  }

  step(right, up) {
    this.pause();
    const { x, y, z } = this.goal ?? this.view.eye;
    const reach = halfField(this.optics, z);
    this.#glideTo({ x: x + right * reach, y: y + up * reach, z });
  }

  moveAway(factor) {
    const { x, y, z } = this.goal ?? this.view.eye;
    this.#glideTo({ x, y, z: z * factor });
  }

  center() {
    this.pause();
    const [x, y, z] = this.optics.eye;
    this.#glideTo({ x, y, z });
  }

  setPlaying(isPlaying) {
    if (!this.optics) return;
    this.swayBegan = performance.now() / 1000 - swayStart(this.optics, this.view.eye);
    this.goal = null;
    this.set({ isPlaying });
  }

  pause() {
    if (this.view.isPlaying) this.set({ isPlaying: false });
  }

  async setTilting(isOn) {
    this.endTilt?.();
    this.endTilt = isOn ? await followTilt(this) : null;
    this.controls.showTilt(Boolean(this.endTilt));
  }

  /** Focuses on the plane at z mm; null ends it: what one eye sees is sharp everywhere. */
  setPlane(plane) {
    const [near, far] = focusRange(this.optics);
    this.set({ plane: plane === null ? null : Math.min(near, Math.max(far, plane)) });
  }

  stepPlane(steps) {
    const [near, far] = focusRange(this.optics);
    this.setPlane((this.view.plane ?? 0) + (steps * (near - far)) / 80);
  }

  setMagnifier(isOn) {
    this.set({ glass: isOn ? { x: 0, y: 0 } : null });
  }

  moveGlass(x, y) {
    const within = (value) => Math.min(0.999, Math.max(-0.999, value));
    this.set({ glass: { x: within(x), y: within(y) } });
  }

  moveGlassBy(right, up) {
    this.moveGlass(this.view.glass.x + right, this.view.glass.y + up);
  }

  /** Overlays a layer on the picture, or none (null). Resolves once its tiles are loaded. */
  async setOverlay(name) {
    this.set({ overlay: name === null ? null : { name, share: this.view.overlay?.share ?? 0.85 } });
    if (name === null) return;
    try {
      const loads = this.pictures.map((picture) =>
        picture?.loadOverlay(name, this.view.frame, (share) => this.layout.showProgress(share)),
      );
      await Promise.all(loads);
    } catch (error) {
      this.#showError(error);
    }
    this.layout.showProgress(1);
    this.invalidate();
  }

  /** Shows what real lenses show, of displays that have them. Resolves once their light is loaded. */
  async setReal(isReal) {
    if (!this.manifests.some(({ lens }) => lens !== null)) return;
    this.set({ isReal });
    if (!isReal) return;
    try {
      await Promise.all(this.pictures.map((picture) => picture?.loadLight()));
    } catch (error) {
      this.#showError(error);
    }
    this.invalidate();
  }

  setOverlayShare(share) {
    if (this.view.overlay) this.set({ overlay: { ...this.view.overlay, share } });
  }

  nextOverlay() {
    const names = [null, ...this.controls.layers.keys()];
    this.setOverlay(names[(names.indexOf(this.view.overlay?.name ?? null) + 1) % names.length]);
  }

  zoomTo(factor) {
    this.zoomBy(factor * this.view.frame.width, 0, 0);
  }

  /** Zooms about a point of the canvas, -1 to 1 right and up. */
  zoomBy(factor, right, up) {
    this.#showFrame(zoomFrame(this.view.frame, factor, right, up, this.zoom));
  }

  zoomOff() {
    this.zoomTo(1 / this.zoom.widest);
  }

  panBy(right, up) {
    this.#showFrame(panFrame(this.view.frame, right, up));
  }

  /** Pixels of the canvas: {width, height, data}, RGBA, row after row from the top, in base 64. */
  pixels() {
    const { gl, canvas } = this.stage;
    this.#draw({ wholeFocus: true });
    const { width, height } = canvas;
    const data = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, data);
    const rows = Array.from({ length: height }, (_, row) =>
      data.subarray(4 * width * (height - 1 - row)).subarray(0, 4 * width),
    );
    return { width, height, data: btoa(rows.map((row) => String.fromCharCode(...row)).join("")) };
  }

  /** Requests a redraw. */
  invalidate() {
    if (this.requested === 0 && !this.isDestroyed) this.requested = requestAnimationFrame((time) => this.#frame(time));
  }

  destroy() {
    this.isDestroyed = true;
    cancelAnimationFrame(this.requested);
    this.endTilt?.();
    this.stopListening?.();
    for (const picture of this.pictures) picture?.destroy();
    // Browsers limit the number of contexts, which the cells of a notebook would exhaust.
    this.stage?.gl.getExtension("WEBGL_lose_context")?.loseContext();
    this.layout.destroy();
  }

  // ---- Loading, and restoring a lost context ---------------------------------------------------------------------

  async #begin() {
    try {
      this.manifests = await Promise.all(this.sources.map(async (source) => checkManifest(await source.manifest())));
      [this.optics] = this.manifests;
      this.bounds = eyeBounds(this.optics);
      const [x, y, z] = this.optics.eye;
      this.view.eye = { x, y, z };
      this.stage = new Stage(this.layout.canvas);
      this.controls = new Controls(this, this.optics, this.manifests);
      this.layout.begin(this.manifests, this.controls.element);
      this.layout.fit(this.#aspect());
      this.#watchContext();
      this.stopListening = listen(this.layout.canvas, this);
      await this.#load();
    } catch (error) {
      this.#showError(error);
      throw error;
    }
  }

  async #load() {
    const shares = this.manifests.map(() => 0);
    this.pictures = this.manifests.map(
      (manifest, place) => new Picture(this.stage.gl, manifest, this.sources[place], this.memory),
    );
    this.zoom = frameBounds(this.pictures);
    this.controls.boundZoom(this.zoom);
    this.view.frame = zoomFrame(this.view.frame, 1, 0, 0, this.zoom);
    const onTile = (place) => (share) => {
      shares[place] = share;
      this.layout.showProgress(shares.reduce((a, b) => a + b) / shares.length);
    };
    await Promise.all(this.pictures.map((picture, place) => picture.load(this.view.frame, onTile(place))));
    if (this.view.overlay) await this.setOverlay(this.view.overlay.name);
    if (this.view.isReal) await this.setReal(true);
    if (this.isDestroyed) return;
    this.layout.showMessage(null);
    this.#draw();
  }

  #watchContext() {
    const { canvas } = this.layout;
    canvas.addEventListener("webglcontextlost", (event) => {
      if (this.isDestroyed) return;
      event.preventDefault();
      for (const picture of this.pictures) picture?.destroy();
      this.pictures = this.sources.map(() => null);
      this.layout.showMessage("The graphics context was lost; waiting for the browser to restore it.");
    });
    canvas.addEventListener("webglcontextrestored", () => {
      this.stage.restart();
      this.ready = this.#load();
      this.ready.catch((error) => this.#showError(error));
    });
  }

  #showError(error) {
    this.layout.showMessage(error.message);
    this.layout.showProgress(1);
  }

  // ---- Frames ----------------------------------------------------------------------------------------------------

  #frame(time) {
    this.requested = 0;
    const seconds = this.lastTime === null ? 1 / 60 : Math.min(0.1, (time - this.lastTime) / 1000);
    let isMoving = false;
    if (this.view.isPlaying) {
      this.view.eye = swayEye(this.optics, this.view.eye.z, performance.now() / 1000 - this.swayBegan);
      isMoving = true;
    } else if (this.goal) {
      this.view.eye = glideEye(this.view.eye, this.goal, seconds);
      if (this.view.eye === this.goal) this.goal = null;
      isMoving = this.goal !== null;
    }
    // Once coarse, the picture stays so until the eye rests: it would flicker.
    if (this.slowFrames < SLOW_FRAMES) this.slowFrames = seconds > SLOW_SECONDS ? this.slowFrames + 1 : 0;
    if (!isMoving) this.slowFrames = 0;
    const remains = this.#draw({ isCoarse: this.slowFrames === SLOW_FRAMES }, isMoving);
    this.lastTime = isMoving ? time : null;
    if (isMoving || remains) this.invalidate();
  }

  #draw(parts = {}, isMoving = false) {
    if (!this.stage || this.stage.gl.isContextLost()) return false;
    const view = { ...this.view, ...parts };
    this.#showControls(view, isMoving);
    try {
      const remains = this.stage.draw(this.pictures, view);
      if (view.glass) this.stage.drawMagnifier(this.pictures, view, this.#glass(view));
      return remains;
    } catch (error) {
      this.#showError(error);
      return false;
    }
  }

  /** Updates the controls, a few times a second while the eye moves: their layout is expensive. */
  #showControls(view, isMoving) {
    const now = performance.now();
    if (isMoving && now - this.controlsShown < CONTROLS_PAUSE) return;
    this.controlsShown = now;
    this.layout.showDivider(view.divider, view.mode === "side-by-side" ? 2 : 1);
    this.controls.show(view);
  }

  #glass({ glass, glassScale }) {
    const { width, height } = this.stage.canvas;
    const ratio = this.layout.ratio;
    const radius = Math.min(GLASS_SHARE * Math.min(width, height), LARGEST_GLASS * ratio);
    return {
      x: (0.5 + 0.5 * glass.x) * width,
      y: (0.5 + 0.5 * glass.y) * height,
      radius,
      scale: glassScale * ratio,
      color: [1.0, 0.72, 0.2],
    };
  }

  #resize() {
    if (!this.stage) return;
    this.layout.fit(this.#aspect());
    // At once: resizing a canvas clears it.
    this.#draw();
    this.invalidate();
  }

  #aspect() {
    if (!this.optics) return 1;
    const { width, height } = this.optics.panel;
    return ((this.view.mode === "side-by-side" ? 2 : 1) * width) / height;
  }

  #glideTo(goal) {
    if (!this.optics) return;
    this.goal = clampEye(goal, this.bounds);
    this.invalidate();
  }

  #showFrame(frame) {
    this.set({ frame });
    if (this.zoom.widest === 1) return;
    // The pictures exceed the graphics memory: load the tiles of the frame.
    const onTile = (share) => {
      this.layout.showProgress(share);
      this.invalidate();
    };
    const loads = this.pictures.map((picture) => picture?.load(frame, onTile));
    Promise.all(loads).catch((error) => this.#showError(error));
  }
}
