/**
 * Tiles of a picture or of one of its layers in graphics memory: side by side in one texture, or, if that would exceed
 * the largest texture or the memory limit, the tiles in view as layers of an array texture.
 */

/** Number of simultaneous requests; browsers open six connections to a server. */
const CONCURRENT_REQUESTS = 6;

/** Width in pixels of the black border around the picture in one texture; textures are initially black. */
const EDGE = 1;

/** Least capacity: a frame may lie across the corner of four tiles. */
const FEWEST_TILES = 4;

/** Number of a picture's tiles to keep in `memory` bytes of graphics memory. */
export function capacityOf(gl, tiles, memory) {
  const most = Math.min(gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS), Math.floor(memory / (4 * tiles.size ** 2)));
  return Math.min(tiles.columns * tiles.rows, Math.max(FEWEST_TILES, most));
}

/** Indices (row after row) of the tiles that overlap a box {left, top, right, bottom} in pixels. */
export function tilesOf(tiles, { left, top, right, bottom }) {
  const place = (value, count) => Math.min(count - 1, Math.max(0, Math.floor(value / tiles.size)));
  const places = [];
  for (let row = place(top, tiles.rows); row <= place(bottom, tiles.rows); row += 1) {
    for (let column = place(left, tiles.columns); column <= place(right, tiles.columns); column += 1) {
      places.push(row * tiles.columns + column);
    }
  }
  return places;
}

export class TileTexture {
  /**
   * @param gl WebGL 2
   * @param tiles the manifest's description: width, height, size, columns, rows, format
   * @param capacity number of tiles to keep
   */
  constructor(gl, tiles, capacity) {
    this.gl = gl;
    this.tiles = tiles;
    const largest = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    const count = tiles.columns * tiles.rows;
    this.isTiled = capacity < count || Math.max(tiles.width, tiles.height) + 2 * EDGE > largest;
    this.target = this.isTiled ? gl.TEXTURE_2D_ARRAY : gl.TEXTURE_2D;
    // Layer of each tile, and tile in each layer; -1 for none.
    this.layerOf = new Int16Array(count).fill(-1);
    this.holders = new Int32Array(capacity).fill(-1);
    this.requested = [];
    this.coming = new Set();
    while (gl.getError() !== gl.NO_ERROR);
    this.texture = this.#newTexture(this.target);
    if (this.isTiled) gl.texStorage3D(this.target, 1, gl.RGBA8, tiles.size, tiles.size, capacity);
    else gl.texStorage2D(this.target, 1, gl.RGBA8, tiles.width + 2 * EDGE, tiles.height + 2 * EDGE);
    this.index = this.#newTexture(gl.TEXTURE_2D);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.R16I, tiles.columns, tiles.rows);
    this.#uploadIndex();
    if (gl.getError() !== gl.NO_ERROR && !gl.isContextLost()) {
      throw new Error(`a picture of ${tiles.width} x ${tiles.height} pixels is too large for this browser's graphics`);
    }
  }

  /** Binds the texture and, if it is tiled, the index of its layers to texture units and to the samplers `name...`. */
  bind(program, unit, name) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(this.target, this.texture);
    gl.uniform1i(program.at(name), unit);
    if (!this.isTiled) return;
    gl.activeTexture(gl.TEXTURE0 + unit + 1);
    gl.bindTexture(gl.TEXTURE_2D, this.index);
    gl.uniform1i(program.at(`${name}Layers`), unit + 1);
  }

  /**
   * Fetches tiles, at most `capacity`. They replace tiles that are no longer requested, and the remaining requests of
   * an earlier call are dropped.
   *
   * @param places indices of the tiles, row after row
   * @param onTile called after each tile with the share of tiles fetched
   * @param signal an AbortSignal; after abort the texture is left alone
   */
  async load(source, layer, places, onTile, signal) {
    this.requested = places;
    const waiting = places.filter((place) => this.layerOf[place] < 0 && !this.coming.has(place));
    const total = waiting.length;
    let count = 0;
    const work = async () => {
      while (waiting.length > 0 && this.requested === places && !signal.aborted) {
        const place = waiting.shift();
        await this.#fetch(source, layer, place, signal);
        count += 1;
        onTile(count / total);
      }
    };
    try {
      await Promise.all(Array.from({ length: CONCURRENT_REQUESTS }, work));
    } catch (error) {
      waiting.length = 0;
      throw error;
    }
  }

  destroy() {
    this.gl.deleteTexture(this.texture);
    this.gl.deleteTexture(this.index);
  }

  async #fetch(source, layer, place, signal) {
    const { columns } = this.tiles;
    const [column, row] = [place % columns, Math.floor(place / columns)];
    this.coming.add(place);
    try {
      const decoded = await this.#decode(await source.tile(layer, column, row), column, row);
      if (!signal.aborted && this.requested.includes(place)) this.#put(decoded, place, column, row);
    } finally {
      this.coming.delete(place);
    }
  }

  #newTexture(target) {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(target, texture);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, name, gl.NEAREST);
    return texture;
  }

  #uploadIndex() {
    const { gl } = this;
    const { columns, rows } = this.tiles;
    gl.bindTexture(gl.TEXTURE_2D, this.index);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, columns, rows, gl.RED_INTEGER, gl.SHORT, this.layerOf);
  }

  #sizeOf(column, row) {
    const { size, width, height } = this.tiles;
    return [Math.min(size, width - column * size), Math.min(size, height - row * size)];
  }

  async #decode(bytes, column, row) {
    const [width, height] = this.#sizeOf(column, row);
    const damaged = new Error(`the tile in column ${column}, row ${row} of the picture is damaged`);
    if (this.tiles.format === "rgb") {
      const view = ArrayBuffer.isView(bytes) ? bytes : new Uint8Array(bytes);
      if (view.byteLength !== 3 * width * height) throw damaged;
      return new Uint8Array(view.buffer, view.byteOffset, view.byteLength);
    }
    const options = { colorSpaceConversion: "none", premultiplyAlpha: "none" };
    const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }), options).catch(() => {
      throw damaged;
    });
    if (image.width !== width || image.height !== height) throw damaged;
    return image;
  }

  #put(decoded, place, column, row) {
    const { gl } = this;
    if (gl.isContextLost()) return;
    const [width, height] = this.#sizeOf(column, row);
    const { size } = this.tiles;
    const content = decoded instanceof Uint8Array ? withAlpha(decoded, width * height) : decoded;
    const layer = this.#freeLayer();
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(this.target, this.texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    const kind = [gl.RGBA, gl.UNSIGNED_BYTE, content];
    if (this.isTiled) gl.texSubImage3D(this.target, 0, 0, 0, layer, width, height, 1, ...kind);
    else gl.texSubImage2D(this.target, 0, column * size + EDGE, row * size + EDGE, width, height, ...kind);
    decoded.close?.();
    this.holders[layer] = place;
    this.layerOf[place] = layer;
    if (this.isTiled) this.#uploadIndex();
  }

  /** Layer for another tile: a free one, or that of a tile which is no longer requested. */
  #freeLayer() {
    const free = this.holders.indexOf(-1);
    if (free >= 0) return free;
    const layer = this.holders.findIndex((place) => !this.requested.includes(place));
    this.layerOf[this.holders[layer]] = -1;
    return layer;
  }
}

/** Converts RGB to RGBA: graphics cards store four channels, and drivers convert more slowly. */
function withAlpha(rgb, count) {
  const rgba = new Uint32Array(count);
  for (let to = 0, from = 0; to < count; to += 1, from += 3) {
    rgba[to] = 0xff000000 | (rgb[from + 2] << 16) | (rgb[from + 1] << 8) | rgb[from];
  }
  return new Uint8Array(rgba.buffer);
}
