/** The canvas: its panes, what each displays, and the focus sum (mean of all views focused on a plane). */

import { eyesOfViews } from "lippmann/optics.js";
import { Program } from "lippmann/picture.js";
import { MEAN, VERTEX } from "lippmann/shaders.js";

/** Width of the line between two panes, in canvas pixels. */
const SEAM = 2;

export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    const options = { alpha: false, antialias: false, depth: false, powerPreference: "high-performance" };
    this.gl = canvas.getContext("webgl2", options);
    if (this.gl === null) throw new Error("this browser has no WebGL 2, or it is switched off");
    this.restart();
  }

  /** Creates what depends on the context; called again when a lost context is restored. */
  restart() {
    const { gl } = this;
    this.mean = null;
    this.focus = null;
    // Sums of hundreds of views need single precision; half precision where the card cannot blend single.
    const canAddSingle = gl.getExtension("EXT_color_buffer_float") && gl.getExtension("EXT_float_blend");
    this.sumFormat = canAddSingle ? gl.RGBA32F : gl.RGBA16F;
    this.canSum = Boolean(canAddSingle || gl.getExtension("EXT_color_buffer_half_float"));
  }

  /** Panes of a mode, each with its eye (`side` -1 left, 0 centre, 1 right); y from below. */
  panes(mode) {
    const { width, height } = this.canvas;
    if (mode !== "side-by-side") return [{ x: 0, y: 0, width, height, side: 0 }];
    const half = Math.floor((width - SEAM) / 2);
    return [
      { x: 0, y: 0, width: half, height, side: -1 },
      { x: width - half, y: 0, width: half, height, side: 1 },
    ];
  }

  /**
   * Draws all panes.
   *
   * @param pictures one or two; the second right of the divider
   * @param view the state of the viewer, see viewer.js
   * @returns whether more remains to be drawn in the next frame
   */
  draw(pictures, view) {
    const { gl, canvas } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.BLEND);
    gl.disable(gl.SCISSOR_TEST);
    gl.colorMask(true, true, true, true);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    const loaded = pictures.filter((picture) => picture !== null);
    let remains = false;
    for (const pane of this.panes(view.mode)) {
      for (const [part, picture] of this.#parts(pane, loaded, view.divider)) {
        gl.enable(gl.SCISSOR_TEST);
        gl.scissor(part.x, part.y, part.width, part.height);
        remains = this.#drawPart(picture, pane, part, view) || remains;
      }
    }
    gl.disable(gl.SCISSOR_TEST);
    gl.colorMask(true, true, true, true);
    return remains;
  }

  /** Draws the magnifier in its pane, over the first picture left of the divider, over the second right of it. */
  drawMagnifier(pictures, view, glass) {
    const { gl, canvas } = this;
    const pane = this.panes(view.mode).find((each) => glass.x >= each.x && glass.x < each.x + each.width);
    if (!pane) return;
    const parts = this.#parts(
      pane,
      pictures.filter((picture) => picture !== null),
      view.divider,
    );
    const [, picture] = parts.find(([part]) => glass.x < part.x + part.width) ?? [];
    if (!picture) return;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    const { x, y, width, height } = view.frame;
    const u = (x + ((glass.x - pane.x) / pane.width) * width) * picture.manifest.panel.width;
    const v = (y + (1 - (glass.y - pane.y) / pane.height) * height) * picture.manifest.panel.height;
    picture.drawMagnifier(eyeOf(view, pane.side), { ...glass, u, v });
    gl.disable(gl.BLEND);
  }

  #parts(pane, pictures, divider) {
    if (pictures.length < 2) return pictures.map((picture) => [pane, picture]);
    const first = Math.round(pane.width * divider);
    return [
      [{ ...pane, width: first }, pictures[0]],
      [{ ...pane, x: pane.x + first, width: pane.width - first }, pictures[1]],
    ].filter(([part]) => part.width > 0);
  }

  #drawPart(picture, pane, part, view) {
    const { gl } = this;
    if (!picture.isReady) return false;
    const { panel } = picture.manifest;
    const { x, y, width, height } = view.frame;
    const frame = {
      x: x * panel.width,
      y: y * panel.height,
      width: width * panel.width,
      height: height * panel.height,
    };
    if (view.plane !== null && this.canSum) return this.#drawFocused(picture, pane, part, frame, view);
    gl.viewport(pane.x, pane.y, pane.width, pane.height);
    if (view.mode !== "anaglyph") {
      picture.drawEye(eyeOf(view, pane.side), frame, pane, view);
      return false;
    }
    gl.colorMask(true, false, false, true);
    picture.drawEye(eyeOf(view, -1), frame, pane, view);
    gl.colorMask(false, true, true, true);
    picture.drawEye(eyeOf(view, 1), frame, pane, view);
    gl.colorMask(true, true, true, true);
    return false;
  }

  /** Draws the mean of all views, adding a few with every frame; returns whether views remain. */
  #drawFocused(picture, pane, part, frame, view) {
    const { gl } = this;
    const sum = this.#sumFor(picture, pane, frame, view.plane);
    const end = view.wholeFocus ? sum.eyes.length : Math.min(sum.eyes.length, sum.count + view.viewsPerFrame);
    gl.disable(gl.SCISSOR_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, sum.framebuffer);
    gl.viewport(0, 0, pane.width, pane.height);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    for (; sum.count < end; sum.count += 1) {
      picture.drawSummand(sum.eyes[sum.count], view.plane, frame, { ...pane, x: 0, y: 0 });
    }
    gl.disable(gl.BLEND);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.enable(gl.SCISSOR_TEST);
    gl.viewport(pane.x, pane.y, pane.width, pane.height);
    this.mean ??= new Program(gl, MEAN, VERTEX);
    gl.useProgram(this.mean.handle);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, sum.texture);
    gl.uniform1i(this.mean.at("sum"), 0);
    gl.uniform2i(this.mean.at("corner"), pane.x, pane.y);
    gl.uniform1i(this.mean.at("isCoded"), picture.isCoded);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    return sum.count < sum.eyes.length;
  }

  /** The focus sum of this picture and plane so far, or a new one. */
  #sumFor(picture, pane, frame, plane) {
    const { gl } = this;
    const key = JSON.stringify([plane, frame, pane.width, pane.height]);
    this.focus ??= new Map();
    const known = this.focus.get(picture);
    if (known?.key === key) return known;
    const isSameSize = known && known.width === pane.width && known.height === pane.height;
    const { texture, framebuffer } = isSameSize ? known : this.#newSum(known, pane);
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    const { width, height } = pane;
    const eyes = lowDiscrepancyOrder(eyesOfViews(picture.manifest));
    const sum = { key, texture, framebuffer, width, height, count: 0, eyes };
    this.focus.set(picture, sum);
    return sum;
  }

  #newSum(old, pane) {
    const { gl } = this;
    if (old) {
      gl.deleteTexture(old.texture);
      gl.deleteFramebuffer(old.framebuffer);
    }
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, this.sumFormat, pane.width, pane.height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    const framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    return { texture, framebuffer };
  }
}

/** Position of the left (-1), central (0) or right (1) eye; cross-eyed viewing exchanges left and right. */
export function eyeOf(view, side) {
  const sign = view.isCrossed && view.mode === "side-by-side" ? -side : side;
  return { ...view.eye, x: view.eye.x + 0.5 * sign * view.eyeDistance };
}

/** The eyes in an order of low discrepancy (golden ratio), so that partial sums cover the aperture evenly. */
function lowDiscrepancyOrder(eyes) {
  const order = eyes.map((eye, place) => [(place * 0.6180339887498949) % 1, eye]);
  return order.sort(([a], [b]) => a - b).map(([, eye]) => eye);
}
