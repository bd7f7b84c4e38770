/** The light of a real lens in graphics memory: weights of sub-pixels by the direction in which the eye stands. */

/** Zeros around a tile of weights, so that places beside it weigh nothing. */
const BORDER = 1;

/** Share by which the pupil's image changes before weights are blurred anew. */
const LEAST_CHANGE = 0.02;

/** Texture units beside those of a picture and its overlay. */
const WEIGHTS_UNIT = 4;
const PLACES_UNIT = 5;

export class LensLight {
  /**
   * @param gl WebGL 2
   * @param optics the manifest
   * @param light description of the light, see lens_light.py
   * @param nearest the least distance of an eye in mm
   */
  constructor(gl, optics, light, nearest) {
    this.gl = gl;
    this.optics = optics;
    this.light = light;
    this.isRound = optics.lenses.layout !== "lenticular";
    const codes = new Uint16Array(bytesOf(light.weights).buffer);
    this.weights = Float32Array.from(codes, (code) => (code * light.largest) / 65535);
    const pupil = discShares(this.#pupil(nearest)).length >> 1;
    this.margin = { x: BORDER + pupil, y: this.isRound ? BORDER + pupil : 0 };
    this.tile = { width: light.width + 2 * this.margin.x, height: light.height + 2 * this.margin.y };
    this.size = this.isRound
      ? { width: light.columns * this.tile.width, height: light.rows * this.tile.height }
      : { width: light.rows * this.tile.width, height: light.columns };
    const [wide, high] = [light.columns, light.rows].map((count) => light.finer * (count - 1) + 1);
    this.places = this.#newTexture(gl.RG32F, wide, high, gl.NEAREST);
    const places = new Float32Array(bytesOf(light.places).buffer);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, wide, high, gl.RG, gl.FLOAT, places);
    this.texture = this.#newTexture(gl.R16F, this.size.width, this.size.height, gl.LINEAR);
    this.blur = null;
  }

  /** Parameters of the shader that depend on the properties of the light alone. */
  get variant() {
    const { cells } = this.light;
    const isUpright = !this.isRound && this.optics.lenses.slant === 0;
    return { split: cells.flat(3).some((offset) => offset !== 0), alike: isUpright && cells.length === 1 };
  }

  /** Binds the light that reaches an eye at a distance, and sets the program's uniforms of it. */
  bind(program, distance) {
    const { gl, light, tile, size } = this;
    this.#blurBy(this.#pupil(distance));
    for (const [unit, name, texture] of [
      [WEIGHTS_UNIT, "weights", this.texture],
      [PLACES_UNIT, "places", this.places],
    ]) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(program.at(name), unit);
    }
    const { panel, lenses } = this.optics;
    const cos = this.isRound ? 1 : Math.cos((lenses.slant * Math.PI) / 180);
    gl.uniform2f(program.at("directions"), light.columns, light.rows);
    gl.uniform1f(program.at("finerPlaces"), light.finer);
    gl.uniform1f(program.at("largestSlope"), light.slope);
    gl.uniform2f(program.at("tile"), tile.width, tile.height);
    gl.uniform2f(program.at("perTexel"), 1 / size.width, 1 / size.height);
    gl.uniform1f(program.at("stepsPerPixel"), panel.pixel_pitch / light.step);
    const reach = (side) => ((0.5 * (side + this.blur) + 1) * light.step) / panel.pixel_pitch;
    gl.uniform2f(program.at("reach"), reach(light.width) / cos, reach(light.height));
    gl.uniform2i(program.at("lightCellCount"), light.cells[0].length, light.cells.length);
    gl.uniform2fv(program.at("lightCells"), light.cells.flat(3));
  }

  destroy() {
    this.gl.deleteTexture(this.texture);
    this.gl.deleteTexture(this.places);
  }

  /** Width of the pupil's image on the panel, in steps. */
  #pupil(distance) {
    return (this.light.pupil * this.optics.gap) / distance / this.light.step;
  }

  /** Uploads the weights as a pupil blurs them that is `width` steps wide on the panel. */
  #blurBy(width) {
    if (this.blur !== null && Math.abs(width - this.blur) < LEAST_CHANGE * width) return;
    this.blur = width;
    const { gl, light, tile, size } = this;
    const shares = discShares(width);
    const atlas = new Float32Array(size.width * size.height);
    const length = light.width * light.height;
    for (let row = 0; row < light.rows; row += 1) {
      for (let column = 0; column < light.columns; column += 1) {
        const first = (row * light.columns + column) * length;
        const [right, down] = this.isRound ? [column * tile.width, row * tile.height] : [row * tile.width, column];
        const blurred = this.#blurred(this.weights.subarray(first, first + length), shares);
        for (let line = 0; line < tile.height; line += 1) {
          const part = blurred.subarray(line * tile.width, (line + 1) * tile.width);
          atlas.set(part, (down + line) * size.width + right);
        }
      }
    }
    gl.activeTexture(gl.TEXTURE0 + WEIGHTS_UNIT);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, size.width, size.height, gl.RED, gl.FLOAT, atlas);
  }

  /** A tile of weights with its margin, convolved with shares across, of round lenses also along. */
  #blurred(weights, shares) {
    const { light, tile, margin } = this;
    const half = shares.length >> 1;
    const across = new Float32Array(tile.width * tile.height);
    for (let j = 0; j < light.height; j += 1) {
      for (let i = 0; i < light.width; i += 1) {
        const to = (j + margin.y) * tile.width + i + margin.x - half;
        const weight = weights[j * light.width + i];
        for (let k = 0; k < shares.length; k += 1) across[to + k] += weight * shares[k];
      }
    }
    if (!this.isRound) return across;
    const both = new Float32Array(across.length);
    for (let from = margin.y * tile.width; from < across.length - margin.y * tile.width; from += 1) {
      const to = from - half * tile.width;
      for (let k = 0; k < shares.length; k += 1) both[to + k * tile.width] += across[from] * shares[k];
    }
    return both;
  }

  #newTexture(format, width, height, filter) {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, filter);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) {
      gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    }
    return texture;
  }
}

/** Shares of a disc `width` steps wide on lines one step wide around its middle: an odd number; see eye_light.py. */
export function discShares(width) {
  const radius = 0.5 * width;
  const half = Math.max(0, Math.ceil(radius - 0.5));
  const below = (line) => {
    const at = Math.max(-1, Math.min(1, (line - half - 0.5) / radius));
    return (at * Math.sqrt(1 - at * at) + Math.asin(at)) / Math.PI;
  };
  return Array.from({ length: 2 * half + 1 }, (_, line) => below(line + 1) - below(line));
}

function bytesOf(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}
