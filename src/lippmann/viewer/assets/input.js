/** Pointer, touch, wheel, keys and tilt: what people do becomes a few calls on the viewer. */

/** What one step of an arrow key moves the eye by, as a share of the field's half width. */
const KEY_STEP = 0.06;
const WHEEL_RATE = 0.0012;

/** Degrees of tilt that lead to the edge of the pane's reach. */
const FULL_TILT = 25;

/**
 * Connects a pane's element with the viewer.
 *
 * @returns a function that takes all listeners off again
 */
export function listen(canvas, viewer) {
  const stop = new AbortController();
  const on = (target, type, call, options = {}) =>
    target.addEventListener(type, call, { ...options, signal: stop.signal });
  const pointers = new Map();
  // After a drag or a key the eye stays where it was put until the pointer comes in anew.
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
    if (pressed(event, viewer)) {
      followsPointer = false;
      event.preventDefault();
    }
  });
  return () => stop.abort();

  /** Place of a pointer in the canvas, from -1 to 1, right and up. */
  function place(event) {
    const box = canvas.getBoundingClientRect();
    return {
      x: (2 * (event.clientX - box.left)) / box.width - 1,
      y: 1 - (2 * (event.clientY - box.top)) / box.height,
    };
  }
}

/** What the keys do, as the page tells it. */
export const KEYS = [
  ["← → ↑ ↓", "move the eye"],
  ["Page ↑ ↓", "nearer, farther (wheel)"],
  ["Home", "eye to the middle (double click)"],
  ["Space", "sway"],
  ["1 2 3", "one eye, side by side, anaglyph"],
  ["F", "refocus; < and > move the plane"],
  ["M", "magnifier; Shift + arrows move it"],
  ["O", "next layer"],
  ["+ − 0", "zoom in, out, off (Ctrl + wheel)"],
  ["Shift + drag", "move what is zoomed"],
];

function pressed(event, viewer) {
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
    "+": () => viewer.zoomBy(1.25, 0, 0),
    "-": () => viewer.zoomBy(0.8, 0, 0),
    0: () => viewer.zoomOff(),
  }[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  call?.();
  return call !== undefined;
}

/** Whether this device may tell how it is tilted. */
export function canTilt() {
  return "DeviceOrientationEvent" in window && window.isSecureContext && matchMedia("(pointer: coarse)").matches;
}

/**
 * Lets the tilt of the device move the eye, from where it is held now.
 *
 * @returns a promise of a function that ends it, or of null if the user refuses
 */
export async function followTilt(viewer) {
  const ask = DeviceOrientationEvent.requestPermission;
  if (ask && (await ask.call(DeviceOrientationEvent)) !== "granted") return null;
  let held = null;
  const turned = ({ beta, gamma }) => {
    if (beta === null || gamma === null) return;
    const angle = ((screen.orientation?.angle ?? 0) * Math.PI) / 180;
    // The device's axes turned into those of the picture on it.
    const right = gamma * Math.cos(angle) + beta * Math.sin(angle);
    const up = beta * Math.cos(angle) - gamma * Math.sin(angle);
    held ??= { right, up };
    // The side that is turned away from the face is seen from further off that side.
    viewer.lookFrom((held.right - right) / FULL_TILT, (up - held.up) / FULL_TILT);
  };
  window.addEventListener("deviceorientation", turned);
  return () => window.removeEventListener("deviceorientation", turned);
}

function spreadOf(pointers) {
  const [a, b] = [...pointers.values()];
  return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, width: Math.hypot(a.x - b.x, a.y - b.y) };
}
