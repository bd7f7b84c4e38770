/**
 * Sources of pictures. A source has `manifest()`, a promise of the picture's description,
 * `tile(layer, column, row)`, a promise of the bytes of a tile in the manifest's format, and `light()`, a promise of
 * the light of a display with a lens, see lens_light.py.
 */

/** Source of a picture on the page's server. */
export function serverSource(name) {
  let version = null;
  // Tiles of a newer version of the file would not match the tiles loaded before.
  const same = () => (version === null ? {} : { "If-Match": version });
  return {
    async manifest() {
      const response = await request(`pictures/${name}/manifest.json`, {});
      version = response.headers.get("ETag");
      return response.json();
    },
    async tile(layer, column, row) {
      const response = await request(`pictures/${name}/tiles/${layer}/${column}_${row}`, same());
      return response.arrayBuffer();
    },
    async light() {
      return (await request(`pictures/${name}/light.json`, same())).json();
    },
  };
}

/** Source of a picture inside the page: `manifest`, `light`, and `tiles[layer]["column_row"]` in base 64. */
export function embeddedSource({ manifest, tiles, light }) {
  return {
    async manifest() {
      return manifest;
    },
    async tile(layer, column, row) {
      const text = tiles[layer]?.[`${column}_${row}`];
      if (text === undefined) throw new Error(`the tile in column ${column}, row ${row} of the picture is missing`);
      return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    },
    async light() {
      return light;
    },
  };
}

async function request(address, headers) {
  const response = await fetch(address, { headers, cache: "no-store" }).catch(() => {
    throw new Error("Lippmann's server does not answer; is `lippmann view` still running?");
  });
  if (response.ok) return response;
  const { error } = await response.json().catch(() => ({}));
  throw new Error(error ?? `the server responded with ${response.status} to ${address}`);
}
