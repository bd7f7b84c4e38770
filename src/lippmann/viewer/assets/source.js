/**
 * Where pictures come from. A source has `manifest()`, a promise of the picture's description, and
 * `tile(layer, column, row)`, a promise of the bytes of a tile in the manifest's format.
 */

/** A picture of the server that serves the page. */
export function serverSource(name) {
  let state = null;
  return {
    async manifest() {
      const answer = await answered(`pictures/${name}/manifest.json`, {});
      state = answer.headers.get("ETag");
      return answer.json();
    },
    async tile(layer, column, row) {
      // The tiles of a file that was written anew meanwhile do not fit those at hand.
      const headers = state === null ? {} : { "If-Match": state };
      const answer = await answered(`pictures/${name}/tiles/${layer}/${column}_${row}`, headers);
      return answer.arrayBuffer();
    },
  };
}

/** A picture inside the page itself: `manifest`, and `tiles[layer]["column_row"]` in base 64. */
export function embeddedSource({ manifest, tiles }) {
  return {
    async manifest() {
      return manifest;
    },
    async tile(layer, column, row) {
      const text = tiles[layer]?.[`${column}_${row}`];
      if (text === undefined) throw new Error(`the tile in column ${column}, row ${row} of the picture is missing`);
      return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    },
  };
}

async function answered(address, headers) {
  const answer = await fetch(address, { headers, cache: "no-store" }).catch(() => {
    throw new Error("Lippmann's server does not answer; is `lippmann view` still running?");
  });
  if (answer.ok) return answer;
  const told = await answer.json().catch(() => ({}));
  throw new Error(told.error ?? `the server answered ${answer.status} to ${address}`);
}
