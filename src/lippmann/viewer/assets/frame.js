/** The part of the panel's rectangle that fills the pane: x, y, width and height as shares, from the upper left. */

/** The smallest part that is shown, as a share of the panel's width and in pixels. */
const SMALLEST_SHARE = 1 / 16;
const SMALLEST_WIDTH = 256;

/** How wide the part may be: at most what the pictures' memory allows, at least what is still worth looking at. */
export function frameBounds(pictures) {
  const widest = Math.min(...pictures.map((picture) => picture.widest));
  const pixels = Math.max(...pictures.map((picture) => picture.manifest.panel.width));
  return { widest, smallest: Math.min(SMALLEST_SHARE, SMALLEST_WIDTH / pixels, widest) };
}

/** The frame narrowed by a factor about a place of the pane, -1 to 1 right and up. */
export function zoomed({ x, y, width }, factor, right, up, { widest, smallest }) {
  const next = Math.min(widest, Math.max(smallest, width / factor));
  const [u, v] = [(right + 1) / 2, (1 - up) / 2];
  return within(x + u * (width - next), y + v * (width - next), next);
}

/** The frame moved along with the picture that is dragged, in halves of the pane. */
export function panned({ x, y, width }, right, up) {
  return within(x - 0.5 * right * width, y + 0.5 * up * width, width);
}

function within(x, y, width) {
  const inside = (value) => Math.min(1 - width, Math.max(0, value));
  return { x: inside(x), y: inside(y), width, height: width };
}
