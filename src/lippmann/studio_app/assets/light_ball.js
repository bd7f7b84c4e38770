/** A ball whose highlight is dragged: the direction that the light is turned to. */

import { h } from "lippmann/dom.js";

const SVG = "http://www.w3.org/2000/svg";
const RADIUS = 42;

/** Degrees that an arrow key turns the light by. */
const KEY_STEP = 5;

/** @param onchange called with `[azimuth, elevation]` in degrees: to the right, up; @param onhold while dragged */
export function lightBall(onchange, onhold) {
  const spot = shape("circle", { r: 7, class: "ball-spot" });
  const ray = shape("line", { x1: 0, y1: 0, class: "ball-ray" });
  const svg = shape("svg", { viewBox: "-50 -50 100 100", class: "ball", "aria-hidden": "true" });
  svg.append(
    shape("circle", { r: RADIUS, class: "ball-ground" }),
    shape("ellipse", { rx: RADIUS, ry: RADIUS / 3, class: "ball-line" }),
    shape("ellipse", { rx: RADIUS / 3, ry: RADIUS, class: "ball-line" }),
    ray,
    spot,
  );
  const element = h("div", { class: "ball-pad", role: "group", "aria-label": "Direction of the light", tabindex: 0 }, svg);
  let turn = [0, 0];

  const move = (event) => {
    const box = svg.getBoundingClientRect();
    let x = (100 * (event.clientX - box.left)) / box.width - 50;
    let y = (100 * (event.clientY - box.top)) / box.height - 50;
    const length = Math.hypot(x, y) / RADIUS;
    if (length > 0.985) [x, y] = [(x * 0.985) / length, (y * 0.985) / length];
    onchange(turnAt(x / RADIUS, -y / RADIUS, Math.abs(turn[0]) > 90));
  };
  element.addEventListener("pointerdown", (event) => {
    element.setPointerCapture(event.pointerId);
    onhold(true);
    move(event);
  });
  element.addEventListener("pointermove", (event) => {
    if (element.hasPointerCapture(event.pointerId)) move(event);
  });
  element.addEventListener("pointerup", () => onhold(false));
  element.addEventListener("pointercancel", () => onhold(false));
  element.addEventListener("dblclick", () => onchange([0, 0]));
  element.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    const elevation = Math.max(-90, Math.min(90, turn[1] + KEY_STEP * step[1]));
    onchange([wrapped(turn[0] + KEY_STEP * step[0]), elevation]);
  });

  function show([azimuth, elevation]) {
    turn = [azimuth, elevation];
    const [a, e] = [(azimuth * Math.PI) / 180, (elevation * Math.PI) / 180];
    const [x, y, z] = [Math.sin(a) * Math.cos(e), Math.sin(e), Math.cos(a) * Math.cos(e)];
    spot.setAttribute("cx", RADIUS * x);
    spot.setAttribute("cy", -RADIUS * y);
    ray.setAttribute("x2", RADIUS * x);
    ray.setAttribute("y2", -RADIUS * y);
    svg.classList.toggle("behind", z < 0);
    element.setAttribute(
      "aria-label",
      `Direction of the light: ${Math.round(azimuth)} degrees to the right, ${Math.round(elevation)} up`,
    );
  }
  show(turn);
  return { element, show };
}

/** Azimuth and elevation in degrees of a point of the ball, -1 to 1 right and up, on its front or its back. */
export function turnAt(x, y, isBehind) {
  const z = Math.sqrt(Math.max(0, 1 - x * x - y * y)) * (isBehind ? -1 : 1);
  const degrees = (radians) => Math.round((1800 * radians) / Math.PI) / 10;
  return [degrees(Math.atan2(x, z)), degrees(Math.asin(Math.max(-1, Math.min(1, y))))];
}

/** An angle between -180 and 180 degrees. */
export function wrapped(angle) {
  return Math.round(10 * (((((angle + 180) % 360) + 360) % 360) - 180)) / 10;
}

function shape(name, attributes) {
  const created = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) created.setAttribute(key, value);
  return created;
}
