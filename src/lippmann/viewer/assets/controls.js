/** The panel of controls beside the picture. It displays the viewer's state and calls the viewer; it has no state. */

import { group, h, segments, slider, toggle } from "lippmann/dom.js";
import { eyeBounds } from "lippmann/eye.js";
import { KEYS, canTilt } from "lippmann/input.js";
import { flips } from "lippmann/optics.js";
import { Plan } from "lippmann/plan.js";
import { eyeOf } from "lippmann/stage.js";

const millimetres = (value) => `${Number(value).toFixed(0)} mm`;

export class Controls {
  /** @param optics the first picture's manifest; @param manifests of all pictures */
  constructor(viewer, optics, manifests) {
    this.viewer = viewer;
    this.optics = optics;
    this.element = h(
      "div",
      { class: "controls" },
      this.#eyeGroup(),
      this.#sightGroup(),
      this.#lensGroup(manifests),
      this.#focusGroup(),
      this.#closerGroup(),
      this.#layerGroup(manifests),
      ...manifests.map((manifest) => facts(manifest, manifests.length > 1)),
      keys(),
    );
  }

  /** Displays the viewer's state. */
  show(view) {
    this.x.show(view.eye.x);
    this.y.show(view.eye.y);
    this.z.show(view.eye.z);
    const sides = view.mode === "single" ? [0] : [-1, 1];
    this.plan.draw(
      this.optics,
      sides.map((side) => eyeOf(view, side)),
      view.plane,
    );
    this.place.textContent = zoneText(flips(this.optics, view.eye));
    this.sway.show(view.isPlaying);
    this.sway.button.textContent = view.isPlaying ? "Stop" : "Sway";
    this.mode.show(view.mode);
    this.eyeDistance.row.hidden = view.mode === "single";
    this.eyeDistance.show(view.eyeDistance);
    this.crossed.button.hidden = view.mode !== "side-by-side";
    this.crossed.show(view.isCrossed);
    this.real?.show(view.isReal);
    this.refocus.show(view.plane !== null);
    this.plane.show(view.plane ?? 0);
    this.plane.input.disabled = view.plane === null;
    this.magnifier.show(view.glass !== null);
    this.glassScale.show(view.glassScale);
    this.glassScale.row.hidden = view.glass === null;
    this.zoom.show(1 / view.frame.width);
    this.#showLayer(view.overlay);
  }

  /** Displays whether the tilt of the device moves the eye. */
  showTilt(isOn) {
    this.tilt?.show(isOn);
  }

  /** Sets the limits of the zoom, and says whether only a part of the picture fits the graphics memory. */
  boundZoom({ widest, smallest }) {
    this.zoom.input.min = 1 / widest;
    this.zoom.input.max = 1 / smallest;
    this.part.hidden = widest === 1;
  }

  #eyeGroup() {
    const { viewer, optics } = this;
    const bounds = eyeBounds(optics);
    this.plan = new Plan(({ x, z }) => viewer.moveEye({ x, z }));
    const move = (axis) => (value) => viewer.moveEye({ [axis]: value });
    const range = (reach) => ({ min: -reach, max: reach, step: "any", format: millimetres });
    this.x = slider("Sideways", { ...range(bounds.x), onchange: move("x"), marks: 0.5 });
    this.y = slider("Height", { ...range(bounds.y), onchange: move("y"), marks: 0.5 });
    const [min, max] = [bounds.nearest, bounds.farthest];
    this.z = slider("Distance", { min, max, step: "any", format: millimetres, onchange: move("z") });
    this.sway = toggle("Sway", (isOn) => viewer.setPlaying(isOn), { class: "toggle main" });
    const middle = h("button", { type: "button", onclick: () => viewer.center() }, "Centre");
    this.tilt = canTilt() ? toggle("Tilt", (isOn) => viewer.setTilting(isOn)) : null;
    const buttons = h("div", { class: "buttons" }, this.sway.button, middle, this.tilt?.button ?? null);
    this.place = h("p", { class: "note place" });
    return group("Eye", this.plan.svg, this.place, buttons, this.x.row, this.y.row, this.z.row);
  }

  #sightGroup() {
    const { viewer } = this;
    const choices = [
      ["single", "One eye"],
      ["side-by-side", "Side by side"],
      ["anaglyph", "Anaglyph"],
    ];
    this.mode = segments("Eyes", choices, (mode) => viewer.setMode(mode));
    this.eyeDistance = slider("Eye separation", {
      min: 0,
      max: 120,
      step: 1,
      format: millimetres,
      onchange: (value) => viewer.set({ eyeDistance: value }),
    });
    this.crossed = toggle("Cross-eyed", (isOn) => viewer.set({ isCrossed: isOn }));
    return group("Viewing mode", this.mode.row, this.eyeDistance.row, this.crossed.button);
  }

  #lensGroup(manifests) {
    if (manifests.every(({ lens }) => lens === null)) return "";
    this.real = toggle("Real lens", (isOn) => this.viewer.setReal(isOn));
    const text =
      "With the light of neighbouring strips, blur, moire and the edges of the view zone, for a pupil of 4 mm. " +
      "Off: ideal lenses. Refocusing shows those always.";
    return group("Lens", this.real.button, h("p", { class: "note" }, text));
  }

  #focusGroup() {
    const { viewer, optics } = this;
    const [near, far] = focusRange(optics);
    this.refocus = toggle("Refocus", (isOn) => viewer.setPlane(isOn ? 0 : null));
    this.plane = slider("Plane", {
      min: far,
      max: near,
      step: (near - far) / 400,
      format: planeText,
      onchange: (value) => viewer.setPlane(value),
      marks: -far / (near - far),
    });
    const note = h(
      "p",
      { class: "note" },
      "Mean of all views: a synthetic aperture as wide as the view zone, sharp in one plane.",
    );
    return group("Focus", this.refocus.button, this.plane.row, note);
  }

  #closerGroup() {
    const { viewer } = this;
    this.magnifier = toggle("Magnifier", (isOn) => viewer.setMagnifier(isOn));
    this.glassScale = slider("Magnification", {
      min: 4,
      max: 40,
      step: 1,
      format: (value) => `${Number(value).toFixed(0)} x`,
      onchange: (value) => viewer.set({ glassScale: value }),
    });
    this.zoom = slider("Zoom", {
      min: 1,
      max: 16,
      step: "any",
      format: (value) => `${Number(value).toFixed(1)} x`,
      onchange: (value) => viewer.zoomTo(value),
    });
    const text = "Native pixels in their micro-images (elemental images). The eye sees the framed pixel of each.";
    const note = h("p", { class: "note" }, text);
    const larger = "The picture exceeds the page's graphics memory, so a part is displayed. Shift and drag moves it.";
    this.part = h("p", { class: "note", hidden: true }, larger);
    return group("Magnify", this.magnifier.button, this.glassScale.row, this.zoom.row, this.part, note);
  }

  #layerGroup(manifests) {
    const { viewer } = this;
    this.layers = new Map(manifests.flatMap(({ tiles }) => tiles.layers.slice(1)).map((layer) => [layer.name, layer]));
    if (this.layers.size === 0) return "";
    const options = [...this.layers.values()].map(({ name, title }) => h("option", { value: name }, title));
    const chosen = () => viewer.setOverlay(this.layer.value || null);
    this.layer = h(
      "select",
      { onchange: chosen, "aria-label": "Layer" },
      h("option", { value: "" }, "None"),
      ...options,
    );
    this.share = slider("Opacity", {
      min: 0.1,
      max: 1,
      step: 0.05,
      format: (value) => `${Math.round(100 * value)} %`,
      onchange: (value) => viewer.setOverlayShare(value),
    });
    this.legend = h("div", { class: "legend" });
    return group("Layer", this.layer, this.share.row, this.legend);
  }

  #showLayer(overlay) {
    if (!this.layer) return;
    this.share.row.hidden = overlay === null;
    this.share.show(overlay?.share ?? 1);
    if (this.layer.value === (overlay?.name ?? "") && this.legend.dataset.of === this.layer.value) return;
    this.layer.value = overlay?.name ?? "";
    this.legend.dataset.of = this.layer.value;
    this.legend.replaceChildren(...(overlay ? legend(this.layers.get(overlay.name)) : []));
  }
}

/** Range of the focus plane in mm, [near, far]: the display's resolvable depth, in front of the viewer. */
export function focusRange(optics) {
  const [near, far] = optics.resolvable_depth;
  return [Math.min(near, 0.9 * (optics.viewing_distance ?? Infinity)), far];
}

function zoneText([fewest, most]) {
  if (most === 0) return "In the central view zone";
  if (fewest === most) return "In a neighbouring view zone";
  return "Between view zones: a part of the picture has flipped";
}

function planeText(value) {
  const place = Number(value);
  if (Math.abs(place) < 0.05) return "lens plane";
  return `${Math.abs(place).toFixed(1)} mm ${place > 0 ? "in front" : "behind"}`;
}

function legend({ classes, range, unit, colors }) {
  const css = (color) => `rgb(${color.join(" ")})`;
  if (classes) {
    return classes.map(({ label, color }) =>
      h("div", { class: "legend-class" }, withBackground(h("span", { class: "swatch" }), css(color)), label),
    );
  }
  const ends = range.map((value) => `${Number(value.toPrecision(3))}`);
  const bar = withBackground(h("div", { class: "scale" }), `linear-gradient(90deg, ${colors.map(css).join(", ")})`);
  return [bar, h("div", { class: "scale-ends" }, h("span", {}, ends[0]), h("span", {}, `${ends[1]} ${unit}`.trim()))];
}

/** Sets the background from the script: the page's policy forbids style attributes. */
function withBackground(target, background) {
  target.style.background = background;
  return target;
}

function facts({ name, display, facts: rows }, isNamed) {
  const table = h(
    "dl",
    { class: "facts" },
    ...rows.flatMap(([label, text]) => [h("dt", {}, label), h("dd", {}, text)]),
  );
  return h(
    "details",
    { class: "group" },
    h("summary", {}, isNamed ? name : "About this picture"),
    h("p", {}, display),
    table,
  );
}

function keys() {
  const rows = KEYS.flatMap(([key, text]) => [h("dt", {}, h("kbd", {}, key)), h("dd", {}, text)]);
  return h("details", { class: "group" }, h("summary", {}, "Keys"), h("dl", { class: "facts keys" }, ...rows));
}
