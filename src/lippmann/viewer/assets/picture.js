/** A picture in graphics memory: its tiles, its layers, and the shader programs that draw it. */

import { eyeBounds } from "lippmann/eye.js";
import { setFixedPoint } from "lippmann/fixed.js";
import { LensLight } from "lippmann/lens_light.js";
import { LAYOUTS, bending, channelPlaces, lensPlaces, microImages, sightline } from "lippmann/optics.js";
import { SIGHT_VERTEX, fragmentSource } from "lippmann/shaders.js";
import { TileTexture, capacityOf, tilesOf } from "lippmann/tiles.js";

export class Picture {
  /**
   * @param manifest the picture's description, see `checkManifest`
   * @param memory limit on the graphics memory of the picture, and of each of its layers, in bytes
   */
  constructor(gl, manifest, source, memory) {
    this.gl = gl;
    this.manifest = manifest;
    this.source = source;
    this.stopped = new AbortController();
    this.programs = new Map();
    this.capacity = capacityOf(gl, manifest.tiles, memory);
    this.tiles = new TileTexture(gl, manifest.tiles, this.capacity);
    this.overlays = new Map();
    this.light = null;
    this.variant = { ...variantOf(manifest.panel), ...lensesOf(manifest), tiled: this.tiles.isTiled };
    this.isReady = false;
  }

  /** Fetches the tiles behind a frame, of the picture and of its loaded layers. */
  async load(frame, onTile) {
    const places = this.#behind(frame);
    const textures = [["picture", this.tiles], ...this.overlays];
    const { signal } = this.stopped;
    await Promise.all(textures.map(([name, texture]) => texture.load(this.source, name, places, onTile, signal)));
    this.isReady = !signal.aborted;
  }

  /** Fetches the tiles of a layer behind a frame, unless the layer is loaded. */
  async loadOverlay(name, frame, onTile) {
    const { layers } = this.manifest.tiles;
    if (this.overlays.has(name) || !layers.some((layer) => layer.name === name)) return;
    const texture = new TileTexture(this.gl, this.manifest.tiles, this.capacity);
    this.overlays.set(name, texture);
    await texture.load(this.source, name, this.#behind(frame), onTile, this.stopped.signal);
  }

  /** Fetches the light of the display's lenses, unless it is loaded or the display has none. */
  async loadLight() {
    if (this.light !== null || this.manifest.lens === null) return;
    const light = await this.source.light();
    if (this.light !== null || this.stopped.signal.aborted) return;
    this.light = new LensLight(this.gl, this.manifest, light, eyeBounds(this.manifest).nearest);
    this.variant = { ...this.variant, ...this.light.variant };
  }

  /** Largest width of a frame, 0 to 1, whose tiles fit the graphics memory. */
  get widest() {
    const { size, columns, rows, width, height } = this.manifest.tiles;
    if (this.capacity >= columns * rows) return 1;
    const margin = 2 * this.#margin();
    const fits = (share) => {
      const across = Math.min(columns, Math.floor((share * width + margin) / size) + 2);
      return across * Math.min(rows, Math.floor((share * height + margin) / size) + 2) <= this.capacity;
    };
    let [low, high] = [0, 1];
    for (let step = 0; step < 20; step += 1) {
      const middle = (low + high) / 2;
      if (fits(middle)) low = middle;
      else high = middle;
    }
    return Math.max(low, size / (4 * Math.max(width, height)));
  }

  #behind(frame) {
    const { width, height } = this.manifest.panel;
    const margin = this.capacity < this.tiles.layerOf.length ? this.#margin() : Infinity;
    return tilesOf(this.manifest.tiles, {
      left: frame.x * width - margin,
      top: frame.y * height - margin,
      right: (frame.x + frame.width) * width + margin,
      bottom: (frame.y + frame.height) * height + margin,
    });
  }

  /** Largest usual distance in pixels between a lens and the pixel that it shows. */
  #margin() {
    const { panel, micro_image_pitch: pitch, gap, eye } = this.manifest;
    return (12 * pitch) / panel.pixel_pitch + (2 * Math.max(panel.width, panel.height) * gap) / eye[2];
  }

  /**
   * Draws what an eye sees into the viewport.
   *
   * @param pane {x, y, width, height} in canvas pixels, y from below
   * @param view `overlay` {name, share} or null, `isReal`: whether through the real lenses, where the display has them,
   *   and `isCoarse`: whether each pixel is a single point, however small the pane
   */
  drawEye(eye, frame, pane, { overlay, isReal, isCoarse }) {
    const { gl } = this;
    const layer = overlay && this.overlays.get(overlay.name);
    const light = isReal ? this.light : null;
    const isSmaller = pane.width < frame.width || pane.height < frame.height;
    const points = isSmaller && !isCoarse ? 2 : 1;
    const program = light ? this.#use("real") : this.#use(layer ? "overlaid" : "eye", points);
    const finer = light ? this.#finer(frame, pane) : [points, points];
    const size = [finer[0] * pane.width, finer[1] * pane.height];
    this.#setSightline(program, sightline(this.manifest, eye, 0, frame, ...size), pane);
    this.#setBending(program, bending(this.manifest, eye));
    gl.uniform1i(program.at("isCoded"), this.isCoded);
    if (light) this.#setLight(program, eye, frame, size, finer);
    if (layer) {
      gl.uniform1f(program.at("overlayShare"), overlay.share);
      layer.bind(program, 2, "overlay");
    }
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** Draws one view of a focus sum: linear RGB of what an eye sees through a plane, and 1 as alpha to count views. */
  drawSummand(eye, plane, frame, pane) {
    const { gl } = this;
    const program = this.#use("summand");
    this.#setSightline(program, sightline(this.manifest, eye, plane, frame, pane.width, pane.height), pane);
    this.#setLensOfPoint(program, microImages(this.manifest, eye));
    this.#setBending(program, bending(this.manifest, eye));
    gl.uniform1i(program.at("isCoded"), this.isCoded);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** Draws the native pixels in a round magnifier; see the program for the parameters. */
  drawMagnifier(eye, glass) {
    const { gl } = this;
    const program = this.#use("magnifier");
    const parts = microImages(this.manifest, eye);
    this.#setLensOfPoint(program, parts);
    this.#setBending(program, bending(this.manifest, eye));
    for (const name of ["visibleU", "visibleV"]) setFixedPoint(gl, program, name, parts[name]);
    gl.uniform2f(program.at("middle"), glass.x, glass.y);
    gl.uniform1f(program.at("radius"), glass.radius);
    gl.uniform1f(program.at("scale"), glass.scale);
    const [column, row] = [Math.floor(glass.u), Math.floor(glass.v)];
    gl.uniform2f(program.at("centerPixel"), column, row);
    gl.uniform2f(program.at("centerPart"), glass.u - column, glass.v - row);
    gl.uniform3fv(program.at("rimColor"), glass.color);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** Whether display codes follow the sRGB curve. */
  get isCoded() {
    return this.manifest.transfer === "srgb";
  }

  /** Stops loading and frees the graphics memory. */
  destroy() {
    this.stopped.abort();
    this.tiles.destroy();
    this.light?.destroy();
    for (const texture of this.overlays.values()) texture.destroy();
    for (const program of this.programs.values()) this.gl.deleteProgram(program.handle);
  }

  #use(kind, points = 1) {
    const { gl } = this;
    const key = `${kind} ${points}`;
    if (!this.programs.has(key)) {
      this.programs.set(key, new Program(gl, fragmentSource(kind, points, this.variant), SIGHT_VERTEX));
    }
    const program = this.programs.get(key);
    gl.useProgram(program.handle);
    const { panel, lenses, tiles } = this.manifest;
    gl.uniform2f(program.at("panel"), panel.width, panel.height);
    gl.uniform1i(program.at("tileShift"), Math.log2(tiles.size));
    gl.uniform1f(program.at("rowsPerPitch"), (lenses.row_pitch ?? 0) / lenses.pitch);
    this.tiles.bind(program, 0, "picture");
    return program;
  }

  #setLensOfPoint(program, parts) {
    for (const name of ["acrossOf", "downOf"]) setFixedPoint(this.gl, program, name, parts[name]);
    this.gl.uniform4fv(program.at("gradients"), parts.gradients);
  }

  /** Points of the pane that are seen in each pixel, right and down, such that each lens has one. */
  #finer(frame, pane) {
    const { panel, lenses } = this.manifest;
    const count = (pixels, shown, pitch) => Math.max(1, Math.ceil((pixels * panel.pixel_pitch) / shown / pitch - 1e-9));
    const down = lenses.layout === "lenticular" ? 1 : count(frame.height, pane.height, lenses.row_pitch);
    return [count(frame.width, pane.width, lenses.pitch), down];
  }

  #setLight(program, eye, frame, [width, height], finer) {
    const { gl, manifest } = this;
    const { centerOf, alongOf, eyeAt, axis } = lensPlaces(manifest, eye, frame, width, height);
    this.light.bind(program, eye.z);
    gl.uniform4fv(program.at("centerOf"), centerOf);
    gl.uniform3fv(program.at("alongOf"), alongOf);
    gl.uniform3fv(program.at("eyeAt"), eyeAt);
    gl.uniform2fv(program.at("axis"), axis);
    gl.uniform1f(program.at("pixelPitch"), manifest.panel.pixel_pitch);
    gl.uniform2iv(program.at("finer"), finer);
    gl.uniform1f(program.at("halfRows"), 0.5 * Math.max(1, frame.height / height));
    gl.uniform1f(program.at("overlayShare"), 0);
  }

  #setBending(program, parts) {
    if (parts === null) return;
    const { gl } = this;
    gl.uniform1fv(program.at("factors"), parts.factors);
    gl.uniform1f(program.at("perReach"), parts.perReach);
    gl.uniform4fv(program.at("beside"), parts.beside);
    gl.uniform2fv(program.at("moves"), parts.moves);
  }

  #setSightline(program, coefficients, pane) {
    const { gl } = this;
    const { panel } = this.manifest;
    const { slide, ...forms } = coefficients;
    for (const [name, form] of Object.entries(forms)) setFixedPoint(gl, program, name, form);
    gl.uniform1f(program.at("slide"), slide);
    for (const [name, places] of Object.entries(channelPlaces(this.manifest))) gl.uniform3fv(program.at(name), places);
    gl.uniform2f(program.at("corner"), pane.x + 0.5, pane.y + pane.height - 0.5);
    if (!panel.uneven) return;
    gl.uniform2i(program.at("cellCount"), panel.cells[0].length, panel.cells.length);
    gl.uniform2fv(program.at("cells"), panel.cells.flat(3));
  }
}

/** A linked shader program; the locations of its uniforms are cached. */
export class Program {
  constructor(gl, fragment, vertex) {
    this.gl = gl;
    this.places = new Map();
    this.handle = gl.createProgram();
    const shaders = [
      [gl.VERTEX_SHADER, vertex],
      [gl.FRAGMENT_SHADER, fragment],
    ].map(([type, text]) => {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(this.handle, shader);
      return shader;
    });
    gl.linkProgram(this.handle);
    const isLinked = gl.getProgramParameter(this.handle, gl.LINK_STATUS);
    const reasons = shaders.map((shader) => gl.getShaderInfoLog(shader)).join(" ");
    for (const shader of shaders) gl.deleteShader(shader);
    // A lost context links nothing; the picture is loaded again when it is restored.
    if (!isLinked && !gl.isContextLost())
      throw new Error(`the browser cannot compile the viewer's shaders: ${reasons}`);
  }

  at(name) {
    if (!this.places.has(name)) this.places.set(name, this.gl.getUniformLocation(this.handle, name));
    return this.places.get(name);
  }
}

/** Returns the manifest; throws an Error if its version is not that of this viewer. */
export function checkManifest(manifest) {
  if (manifest?.lippmann !== 1) throw new Error("the picture's description is of another version than this page");
  return manifest;
}

function lensesOf({ lenses, distortion }) {
  const bent = distortion === null ? 0 : distortion.place.factors.length;
  return { layout: LAYOUTS[lenses.layout], slanted: lenses.slant !== 0, bent };
}

/** Arrangement of the panel's sub-pixels: parameters of `fragmentSource`. */
function variantOf(panel) {
  if (!panel.subpixels) return { cells: 0, reach: 0 };
  if (panel.uneven) {
    const farthest = Math.max(...panel.cells.flat(3).map(Math.abs));
    return { cells: 3, reach: farthest <= 0.5 ? 1 : 2 };
  }
  const offsets = panel.cells[0][0];
  const right = offsets.map(([amount]) => amount);
  const isRow = offsets.every(([, below]) => below === offsets[0][1]);
  return { cells: isRow && Math.max(...right) - Math.min(...right) < 1 ? 1 : 2, reach: 0 };
}
