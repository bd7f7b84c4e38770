/** A pattern that shows whether native pixels reach the panel: any scaling turns it into moire and grey lines. */

/**
 * Colour of a pixel of the pattern: a frame of one pixel, white on two sides and red and blue on the others; rulers of
 * every tenth pixel; else a checkerboard of single pixels.
 */
export function patternAt(x, y, { width, height }) {
  if (y === 0) return [255, 255, 255];
  if (x === 0) return [255, 255, 255];
  if (y === height - 1) return [255, 0, 0];
  if (x === width - 1) return [0, 0, 255];
  if (x % 100 === 0 || y % 100 === 0) return [0, 255, 0];
  return (x + y) % 2 === 0 ? [255, 255, 255] : [0, 0, 0];
}

/** Draws the pattern onto a canvas of the panel's size. */
export function drawPattern(context, panel) {
  const image = new ImageData(panel.width, panel.height);
  for (let y = 0, at = 0; y < panel.height; y += 1) {
    for (let x = 0; x < panel.width; x += 1, at += 4) {
      const [r, g, b] = patternAt(x, y, panel);
      image.data[at] = r;
      image.data[at + 1] = g;
      image.data[at + 2] = b;
      image.data[at + 3] = 255;
    }
  }
  context.putImageData(image, 0, 0);
}
