/** The screen that is the display, among those of the computer. */

/** Pixels by which rounding of CSS lengths may miss a whole number. */
const ROUNDING = 1.5;

/**
 * The display's screen: the one at `corner`, as Bridge tells it, or else the only one with the display's pixels.
 *
 * @param screens `{ left, top, width, height, devicePixelRatio }` of each, in CSS pixels
 * @param panel `{ width, height, corner }` in pixels of the display
 * @returns the screen, or null
 */
export function screenOf(screens, { width, height, corner }) {
  const fitting = screens.filter((screen) => {
    const native = pixelsOf(screen);
    return Math.abs(native[0] - width) < ROUNDING && Math.abs(native[1] - height) < ROUNDING;
  });
  const there = corner && fitting.filter(({ left, top }) => left === corner[0] && top === corner[1]);
  if (there?.length === 1) return there[0];
  return fitting.length === 1 ? fitting[0] : null;
}

/** One line about where the display is, for `screenOf` of the same. */
export function placeInWords(screens, panel) {
  const found = screenOf(screens, panel);
  if (found !== null) return `Found on the screen ${found.label || `at ${found.left}, ${found.top}`}.`;
  const named = screens.map((screen) => pixelsOf(screen).map(Math.round).join(" x ")).join(", ");
  return `No single screen has ${panel.width} x ${panel.height} pixels (they have ${named}): put this window on the display yourself.`;
}

/** All screens, where the browser has the Window Management API and it is granted; else null. */
export async function askScreens() {
  if (!("getScreenDetails" in window) || !window.screen.isExtended) return null;
  try {
    return (await window.getScreenDetails()).screens;
  } catch {
    return null; // not granted
  }
}

const pixelsOf = (screen) => [screen.width, screen.height].map((side) => side * screen.devicePixelRatio);
