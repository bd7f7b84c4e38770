/** Pointer, wheel, touch and keys on the picture. What a drag does depends on the tool. */

/** Tools by key: name, key, and what the pointer does. */
export const TOOLS = [
  { name: "eye", label: "Look", key: "E", hint: "The pointer moves the eye" },
  { name: "orbit", label: "Turn", key: "T", hint: "Drag to turn the model; with Shift to roll it" },
  { name: "pan", label: "Move", key: "M", hint: "Drag to move the model; with Shift in depth" },
  { name: "plane", label: "Lens plane", key: "L", hint: "Click a point to put it into the lens plane" },
];

export const KEYS = [
  ["E T M L", "look, turn, move, lens plane"],
  ["← → ↑ ↓", "as a drag with the tool"],
  ["+ −", "size (wheel, pinch)"],
  ["Page ↑ ↓", "eye nearer, farther (Ctrl + wheel)"],
  ["S", "sway the eye"],
  ["N", "native pixels"],
  ["O", "light of the real lens (optics)"],
  ["Home", "eye to the middle (double click)"],
  ["Ctrl + Z, Y", "undo, redo"],
  ["R", "render"],
  ["?", "this list"],
];

const DEGREES_PER_WIDTH = 180;
const WHEEL_RATE = 0.0012;
const KEY_SHARE = 0.06;

/** Listens on the canvas; `actions` does what is asked. Positions are shares, -1 to 1 right and up. */
export function listen(canvas, actions) {
  const pointers = new Map();
  let pinch = null;
  let moved = 0;

  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return {
      x: (2 * (event.clientX - box.left)) / box.width - 1,
      y: 1 - (2 * (event.clientY - box.top)) / box.height,
    };
  };

  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, place(event));
    moved = 0;
    actions.hold(true);
    pinch = pointers.size === 2 ? spread(pointers) : null;
    if (actions.currentTool() === "eye" && !actions.isNative()) actions.look(place(event));
  });
  canvas.addEventListener("pointermove", (event) => {
    const now = place(event);
    const before = pointers.get(event.pointerId);
    if (before === undefined) {
      if (event.pointerType === "mouse" && actions.currentTool() === "eye" && !actions.isNative()) actions.look(now);
      return;
    }
    pointers.set(event.pointerId, now);
    moved += Math.hypot(now.x - before.x, now.y - before.y);
    if (pointers.size === 2 && pinch !== null) {
      const next = spread(pointers);
      actions.size(next.width / pinch.width);
      actions.move(next.x - pinch.x, next.y - pinch.y);
      pinch = next;
    } else if (pointers.size === 1) drag(actions, now.x - before.x, now.y - before.y, event.shiftKey, now);
  });
  for (const type of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(type, (event) => {
      const isClick = pointers.delete(event.pointerId) && moved < 0.02 && type === "pointerup";
      pinch = null;
      if (pointers.size === 0) actions.hold(false);
      if (isClick && actions.currentTool() === "plane" && !actions.isNative()) actions.pick(place(event));
    });
  }
  canvas.addEventListener("dblclick", () => {
    if (actions.currentTool() === "eye") actions.center();
  });
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const factor = Math.exp(-WHEEL_RATE * event.deltaY * (event.deltaMode === 1 ? 16 : 1));
      if (actions.isNative()) actions.zoom(factor, place(event));
      else if (event.ctrlKey || event.metaKey) actions.approach(1 / factor);
      else actions.size(factor);
    },
    { passive: false },
  );
}

function drag(actions, right, up, isShifted, now) {
  if (actions.isNative()) actions.scroll(right, up);
  else if (actions.currentTool() === "eye") {
    if (now !== null) actions.look(now);
  } else if (actions.currentTool() === "orbit") {
    const degrees = DEGREES_PER_WIDTH / 2;
    if (isShifted) actions.turn(0, 0, degrees * right);
    else actions.turn(degrees * right, -degrees * up, 0);
  } else if (actions.currentTool() === "pan") {
    if (isShifted) actions.moveDeep(up);
    else actions.move(right, up);
  }
}

/** What an arrow key does with the tool; the keys of controls, settings that scroll, and results are their own. */
function arrow(actions, event) {
  const [right, up] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
  if (!event.target.matches("body, .stage canvas, header button, .deck button") || actions.isCovered()) return;
  event.preventDefault();
  if (actions.currentTool() === "eye" && !actions.isNative()) actions.step(KEY_SHARE * right, KEY_SHARE * up);
  else drag(actions, KEY_SHARE * right, KEY_SHARE * up, event.shiftKey, null);
}

/** Keys that work wherever the focus is, but in boxes for text. */
export function listenToKeys(actions) {
  document.addEventListener("keydown", (event) => {
    const key = event.key.toLowerCase();
    if (event.ctrlKey || event.metaKey) {
      if (isTyping(event.target)) return;
      if (key === "z" && !event.shiftKey) actions.undo();
      else if (key === "y" || (key === "z" && event.shiftKey)) actions.redo();
      else return;
      event.preventDefault();
      return;
    }
    if (event.altKey || isTyping(event.target)) return;
    if (key.startsWith("arrow")) return arrow(actions, event);
    const tool = TOOLS.find((each) => each.key.toLowerCase() === key);
    const call = tool
      ? () => actions.setTool(tool.name)
      : {
          s: () => actions.sway(),
          n: () => actions.native(),
          o: () => actions.real(),
          r: () => actions.render(),
          "?": () => actions.help(),
          "+": () => actions.size(1.05),
          "-": () => actions.size(1 / 1.05),
          pageup: () => actions.approach(1 / 1.05),
          pagedown: () => actions.approach(1.05),
          home: () => actions.center(),
        }[key];
    if (call === undefined) return;
    event.preventDefault();
    call();
  });
}

function isTyping(target) {
  return target.matches?.("input:not([type=range], [type=checkbox], [type=radio]), select, textarea, dialog *") ?? false;
}

function spread(pointers) {
  const [a, b] = [...pointers.values()];
  return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, width: Math.hypot(a.x - b.x, a.y - b.y) };
}
