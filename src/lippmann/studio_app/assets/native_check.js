/** Whether a canvas lies on the pixels of a panel one to one. */

/** Pixels of the screen by which rounding of CSS lengths may miss a whole number. */
const ROUNDING = 1.5;

/**
 * One line that says what is wrong, or null.
 *
 * @param panel width and height in pixels, and its name
 * @param box what the canvas covers in pixels of the screen, where the browser tells
 * @param ratio pixels of the screen per CSS pixel, as the browser tells
 * @param screen size of the screen in CSS pixels
 * @param zoom of the fingers
 * @param inside size of the page in CSS pixels
 * @param isFull whether the page fills the screen
 * @param turn by which the system turns the screen, in degrees
 */
export function complaint({ panel, box, ratio, screen, zoom, inside, isFull, turn }) {
  if (Math.abs(zoom - 1) > 1e-3) return "The page is zoomed by fingers: pinch it back to its own size.";
  if (box !== null && (box[0] !== panel.width || box[1] !== panel.height)) {
    return `The browser scales: ${panel.width} x ${panel.height} pixels become ${box[0]} x ${box[1]}. Set its zoom to 100 % (Ctrl + 0), and the scaling of the system to 100 %.`;
  }
  const native = screen.map((side) => side * ratio);
  const isThere = Math.abs(native[0] - panel.width) < ROUNDING && Math.abs(native[1] - panel.height) < ROUNDING;
  const isTurned = Math.abs(native[0] - panel.height) < ROUNDING && Math.abs(native[1] - panel.width) < ROUNDING;
  if (!isThere && isTurned) {
    return `The system shows this screen turned, ${Math.round(native[0])} x ${Math.round(native[1])} pixels for ${panel.width} x ${panel.height}: set its orientation so that it is not turned.`;
  }
  if (isThere && turn === 180) return "The system shows this screen upside down: turn its orientation back.";
  if (!isThere) {
    return `This screen has ${Math.round(native[0])} x ${Math.round(native[1])} pixels, ${panel.name} has ${panel.width} x ${panel.height}: move the window to the display, and set that to its own resolution.`;
  }
  if (isFull && (inside[0] * ratio < panel.width - ROUNDING || inside[1] * ratio < panel.height - ROUNDING)) {
    return "The browser does not give the whole screen to this page: leave full screen, and enter it again.";
  }
  return null;
}
