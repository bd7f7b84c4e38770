/** Plan of display and eye from above: panel, view zones, sight lines, focus plane. */

import { halfField } from "lippmann/optics.js";

const SVG = "http://www.w3.org/2000/svg";
const [WIDTH, HEIGHT] = [300, 190];
/** Margin above the display, in units of the drawing. */
const TOP = 16;

export class Plan {
  /** @param onEye called with {x, z} in mm when the eye is dragged */
  constructor(onEye) {
    this.svg = element("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "plan", "aria-hidden": "true" });
    this.neighbours = element("g", { class: "plan-neighbour" });
    this.field = element("polygon", { class: "plan-field" });
    this.focus = element("line", { class: "plan-focus" });
    this.panel = element("rect", { class: "plan-panel", rx: 1.5 });
    this.sight = element("path", { class: "plan-sight" });
    this.eyes = element("g", { class: "plan-eyes" });
    this.svg.append(this.neighbours, this.field, this.focus, this.sight, this.panel, this.eyes);
    this.optics = null;
    const onDrag = (event) => {
      if (event.buttons === 0 || this.optics === null) return;
      const box = this.svg.getBoundingClientRect();
      const scale = WIDTH / box.width;
      const [left, top] = [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
      onEye({ x: (left - WIDTH / 2) / this.scale, z: (top - TOP) / this.scale });
    };
    this.svg.addEventListener("pointerdown", (event) => {
      this.svg.setPointerCapture(event.pointerId);
      onDrag(event);
    });
    this.svg.addEventListener("pointermove", onDrag);
  }

  /** @param eyes positions {x, z} of the eyes in mm; @param plane z of the focus plane in mm, or null */
  draw(optics, eyes, plane) {
    if (optics !== this.optics) this.#drawDisplay(optics);
    this.eyes.replaceChildren(
      ...eyes.map((eye) => element("circle", { cx: this.#x(eye.x), cy: this.#y(eye.z), r: 4.5 })),
    );
    const half = (optics.panel.width * optics.panel.pixel_pitch) / 2;
    const path = eyes.map(
      (eye) => `M${this.#x(-half)} ${TOP}L${this.#x(eye.x)} ${this.#y(eye.z)}L${this.#x(half)} ${TOP}`,
    );
    this.sight.setAttribute("d", path.join(""));
    this.focus.classList.toggle("hidden", plane === null);
    const at = this.#y(plane ?? 0);
    set(this.focus, { x1: this.#x(-half) - 6, x2: this.#x(half) + 6, y1: at, y2: at });
  }

  #drawDisplay(optics) {
    this.optics = optics;
    const half = (optics.panel.width * optics.panel.pixel_pitch) / 2;
    const [, , distance] = optics.eye;
    const far = 1.45 * distance;
    this.scale = Math.min((HEIGHT - TOP - 6) / far, (0.86 * WIDTH) / (2 * half));
    set(this.panel, { x: this.#x(-half), width: 2 * half * this.scale, y: TOP - 3, height: 4 });
    const end = (HEIGHT - TOP) / this.scale;
    this.field.setAttribute("points", this.#zone(optics, half, 0, end));
    const beside = [-2, -1, 1, 2].map((order) => element("polygon", { points: this.#zone(optics, half, order, end) }));
    this.neighbours.replaceChildren(...beside);
  }

  /** Outline of the view zone in which all lenses show the micro-image `order` places beside their own. */
  #zone(optics, half, order, end) {
    const converge = optics.viewing_distance === null ? 0 : 1 / optics.viewing_distance;
    const rightEdge = (z) =>
      2 * order * halfField(optics, z) + halfField(optics, z) - half * Math.abs(1 - z * converge);
    const leftEdge = (z) => 2 * order * halfField(optics, z) - halfField(optics, z) + half * Math.abs(1 - z * converge);
    const heights = Array.from({ length: 65 }, (_, step) => (end * step) / 64).filter(
      (z) => rightEdge(z) > leftEdge(z),
    );
    const right = heights.map((z) => `${this.#x(rightEdge(z))},${this.#y(z)}`);
    const left = heights.map((z) => `${this.#x(leftEdge(z))},${this.#y(z)}`);
    return [...right, ...left.reverse()].join(" ");
  }

  #x(x) {
    return (WIDTH / 2 + x * this.scale).toFixed(2);
  }

  #y(z) {
    return (TOP + z * this.scale).toFixed(2);
  }
}

function element(name, attributes) {
  const created = document.createElementNS(SVG, name);
  set(created, attributes);
  return created;
}

function set(target, attributes) {
  for (const [name, value] of Object.entries(attributes)) target.setAttribute(name, value);
}
