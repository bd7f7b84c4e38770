/** The frame: the part of the panel that fills the pane; x, y, width and height in shares, from the upper left. */

/** Limits on the width of the frame: as a share of the panel's width, and in pixels. */
const SMALLEST_SHARE = 1 / 16;
const SMALLEST_WIDTH = 256;

/** Limits on the width of the frame, as shares: `widest` by graphics memory, `smallest` by magnification. */
export function frameBounds(pictures) {
  const widest = Math.min(...pictures.map((picture) => picture.widest));
  const pixels = Math.max(...pictures.map((picture) => picture.manifest.panel.width));
  return { widest, smallest: Math.min(SMALLEST_SHARE, SMALLEST_WIDTH / pixels, widest) };
}

/** The frame magnified by a factor about a point of the pane, -1 to 1 right and up. */
export function zoomFrame({ x, y, width }, factor, right, up, { widest, smallest }) {
  const next = Math.min(widest, Math.max(smallest, width / factor));
  const [u, v] = [(right + 1) / 2, (1 - up) / 2];
  return frameWithin(x + u * (width - next), y + v * (width - next), next);
}

/** The frame after the picture is dragged right and up, in halves of the pane. */
export function panFrame({ x, y, width }, right, up) {
  return frameWithin(x - 0.5 * right * width, y + 0.5 * up * width, width);
}

function frameWithin(x, y, width) {
  const inside = (value) => Math.min(1 - width, Math.max(0, value));
  return { x: inside(x), y: inside(y), width, height: width };
}
