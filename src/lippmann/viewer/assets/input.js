/** Input by pointer, touch, wheel, keys and tilt, translated to calls of the viewer. */

/** Step of an arrow key in half widths of the view zone. */
const KEY_STEP = 0.06;
const WHEEL_RATE = 0.0012;

/** Tilt in degrees that corresponds to the edge of the pane. */
const FULL_TILT = 25;

/**
 * Listens to input on the canvas.
 *
 * @returns a function that removes all listeners
 */
export function listen(canvas, viewer) {
  const stop = new AbortController();
  const on = (target, type, call, options = {}) =>
    target.addEventListener(type, call, { ...options, signal: stop.signal });
  const pointers = new Map();
  // After a drag or a key the eye ignores the pointer until it enters the canvas again.
  let followsPointer = true;
  let pinch = null;

  on(canvas, "pointerdown", (event) => {
    if (event.button !== 0) return;
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, place(event));
    followsPointer = false;
    pinch = pointers.size === 2 ? spreadOf(pointers) : null;
    viewer.pause();
  });
  on(canvas, "pointermove", (event) => {
    const now = place(event);
    const before = pointers.get(event.pointerId);
    if (before === undefined) {
      if (event.pointerType !== "mouse") return;
      if (viewer.view.glass) viewer.moveGlass(now.x, now.y);
      else if (followsPointer) viewer.lookFrom(now.x, now.y);
      return;
    }
    pointers.set(event.pointerId, now);
    if (pointers.size === 2 && pinch !== null) {
      const next = spreadOf(pointers);
      viewer.zoomBy(next.width / pinch.width, next.x, next.y);
      viewer.panBy(next.x - pinch.x, next.y - pinch.y);
      pinch = next;
    } else if (viewer.view.glass && event.pointerType !== "mouse") viewer.moveGlass(now.x, now.y);
    else if (event.shiftKey) viewer.panBy(now.x - before.x, now.y - before.y);
    else viewer.dragBy(now.x - before.x, now.y - before.y);
  });
  for (const type of ["pointerup", "pointercancel"]) {
    on(canvas, type, (event) => {
      pointers.delete(event.pointerId);
      pinch = null;
    });
  }
  on(canvas, "pointerenter", () => {
    if (pointers.size === 0) followsPointer = true;
  });
  on(canvas, "dblclick", () => viewer.center());
  on(
    canvas,
    "wheel",
    (event) => {
      event.preventDefault();
      const { x, y } = place(event);
      const amount = event.deltaY * (event.deltaMode === 1 ? 16 : 1);
      if (event.ctrlKey || event.metaKey) viewer.zoomBy(Math.exp(-4 * WHEEL_RATE * amount), x, y);
      else viewer.moveAway(Math.exp(WHEEL_RATE * amount));
    },
    { passive: false },
  );
  on(canvas, "keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (handleKey(event, viewer)) {
      followsPointer = false;
      event.preventDefault();
    }
  });
  return () => stop.abort();

  /** Position of a pointer in the canvas, from -1 to 1, right and up. */
  function place(event) {
    const box = canvas.getBoundingClientRect();
    return {
      x: (2 * (event.clientX - box.left)) / box.width - 1,
      y: 1 - (2 * (event.clientY - box.top)) / box.height,
    };
  }
}

/** Keys and what they do, for the page's table. */
export const KEYS = [
  ["← → ↑ ↓", "move the eye"],
  ["Page ↑ ↓", "nearer, farther (wheel)"],
  ["Home", "centre the eye (double click)"],
  ["Space", "sway"],
  ["1 2 3", "one eye, side by side, anaglyph"],
  ["F", "refocus; < and > move the plane"],
  ["M", "magnifier; Shift + arrows move it"],
  ["O", "next layer"],
  ["R", "real or ideal lenses, of displays that have a lens"],
  ["+ − 0", "zoom in, out, off (Ctrl + wheel)"],
  ["Shift + drag", "pan"],
];

function handleKey(event, viewer) {
  const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
  if (arrow) {
    if (event.shiftKey && viewer.view.glass) viewer.moveGlassBy(0.04 * arrow[0], 0.04 * arrow[1]);
    else if (event.shiftKey) viewer.panBy(-0.1 * arrow[0], -0.1 * arrow[1]);
    else viewer.step(KEY_STEP * arrow[0], KEY_STEP * arrow[1]);
    return true;
  }
  const call = {
    PageUp: () => viewer.moveAway(1 / 1.05),
    PageDown: () => viewer.moveAway(1.05),
    Home: () => viewer.center(),
    " ": () => viewer.setPlaying(!viewer.view.isPlaying),
    1: () => viewer.setMode("single"),
    2: () => viewer.setMode("side-by-side"),
    3: () => viewer.setMode("anaglyph"),
    f: () => viewer.setPlane(viewer.view.plane === null ? 0 : null),
    "<": () => viewer.stepPlane(-1),
    ">": () => viewer.stepPlane(1),
    m: () => viewer.setMagnifier(!viewer.view.glass),
    o: () => viewer.nextOverlay(),
    r: () => viewer.setReal(!viewer.view.isReal),
    "+": () => viewer.zoomBy(1.25, 0, 0),
    "-": () => viewer.zoomBy(0.8, 0, 0),
    0: () => viewer.zoomOff(),
  }[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  call?.();
  return call !== undefined;
}

/** Whether the device can report its tilt. */
export function canTilt() {
  return "DeviceOrientationEvent" in window && window.isSecureContext && matchMedia("(pointer: coarse)").matches;
}

/**
 * Moves the eye by the tilt of the device, relative to its present orientation.
 *
 * @returns a promise of a function that stops it, or of null if the user refuses permission
 */
export async function followTilt(viewer) {
  const ask = DeviceOrientationEvent.requestPermission;
  if (ask && (await ask.call(DeviceOrientationEvent)) !== "granted") return null;
  let start = null;
  const onTilt = ({ beta, gamma }) => {
    if (beta === null || gamma === null) return;
    const angle = ((screen.orientation?.angle ?? 0) * Math.PI) / 180;
    // Device axes rotated to the axes of the screen.
    const right = gamma * Math.cos(angle) + beta * Math.sin(angle);
    const up = beta * Math.cos(angle) - gamma * Math.sin(angle);
    start ??= { right, up };
    // Turning the right edge away moves the eye to the left of the display.
    viewer.lookFrom((start.right - right) / FULL_TILT, (up - start.up) / FULL_TILT);
  };
  window.addEventListener("deviceorientation", onTilt);
  return () => window.removeEventListener("deviceorientation", onTilt);
}

function spreadOf(pointers) {
  const [a, b] = [...pointers.values()];
  return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, width: Math.hypot(a.x - b.x, a.y - b.y) };
}
