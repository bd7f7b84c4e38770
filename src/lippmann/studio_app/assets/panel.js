/** The side panel: everything that can be set by hand, in groups. It displays the store and changes it. */

import { h } from "lippmann/dom.js";
import { depthBars } from "studio/depth_bars.js";
import { automatic, choice, color, number, section, size } from "studio/fields.js";
import { lightBall, wrapped } from "studio/light_ball.js";

const QUALITIES = [
  ["", "As the picture's size suggests"],
  ["draft", "Draft, one sample"],
  ["final", "Final, 40 dB"],
  ["46", "Fine, 46 dB"],
];
const SUBPIXELS = [
  ["auto", "Automatic"],
  ["yes", "On"],
  ["no", "Off"],
];

export class Panel {
  #rows = [];

  /** @param facts what the studio says of itself: `displays`, `scenes` */
  constructor(store, facts, { onenvironment }) {
    this.store = store;
    this.element = h("div", { class: "panel-groups" });
    this.element.append(
      this.#model(),
      this.#depth(),
      this.#light(onenvironment),
      this.#picture(),
      this.#display(facts.displays),
    );
  }

  /** Displays a state. */
  show(state) {
    for (const row of this.#rows) row(state);
  }

  /** Displays what the studio found out about a state: depth, automatic values, warnings. */
  showFacts(facts) {
    this.facts = facts;
    this.bars.show(facts.depth, facts.eye_tracked);
    this.warnings.replaceChildren(...facts.warnings.map((line) => h("li", {}, line)));
    this.warnings.hidden = facts.warnings.length === 0;
    this.show(this.store.state);
  }

  #set(path) {
    return (value) => this.store.set({ [path]: value });
  }

  #hold = (isHeld) => this.store.hold(isHeld);

  /** A slider for one value of the store, or for one of a list, as in "turn.0". */
  #slider(label, path, index, options) {
    const { store } = this;
    const read = (state) => (index === null ? state[path] : state[path][index]);
    const write = (value) => {
      if (index === null) return store.set({ [path]: value });
      const list = [...store.state[path]];
      list[index] = value;
      return store.set({ [path]: list });
    };
    const control = number(label, { ...options, onchange: write, onhold: this.#hold });
    this.#rows.push((state) => control.show(read(state)));
    return control.row;
  }

  #model() {
    const angle = { min: -180, max: 180, step: 0.5, unit: "°", digits: 1, fallback: 0 };
    const offset = (axis) => ({ min: -axis, max: axis, step: 0.1, unit: "mm", digits: 2, fallback: 0 });
    const reset = () =>
      this.store.set({ turn: [0, 0, 0], shift: [0, 0, 0], scale: 1, depth_scale: null, pop_out: null });
    return section(
      "Model",
      this.#slider("Turn", "turn", 0, angle),
      this.#slider("Tilt", "turn", 1, { ...angle, min: -90, max: 90 }),
      this.#slider("Roll", "turn", 2, angle),
      this.#slider("Size", "scale", null, { min: 0.1, max: 10, log: true, unit: "×", digits: 3, fallback: 1 }),
      this.#slider("Sideways", "shift", 0, offset(200)),
      this.#slider("Up", "shift", 1, offset(200)),
      h("button", { type: "button", class: "quiet reset", onclick: reset }, "Reset placement"),
    );
  }

  #depth() {
    const { store } = this;
    this.bars = depthBars();
    const scale = automatic("Depth scale", {
      min: 0.01,
      max: 4,
      log: true,
      unit: "×",
      digits: 3,
      fallback: 1,
      onchange: this.#set("depth_scale"),
      onhold: this.#hold,
    });
    const out = automatic("Pop-out", {
      min: 0,
      max: 1,
      step: 0.01,
      fallback: 0.33,
      onchange: this.#set("pop_out"),
      onhold: this.#hold,
    });
    this.#rows.push((state) => {
      scale.show(state.depth_scale, this.facts?.depth_scale ?? null);
      out.show(state.pop_out);
    });
    const near = { min: -200, max: 200, step: 0.1, unit: "mm", digits: 2, fallback: 0 };
    this.warnings = h("ul", { class: "warnings", hidden: true });
    const onclick = () => {
      if (this.facts === undefined) return;
      const [x, y, z] = store.state.shift;
      const { scene, sharp } = this.facts.depth;
      const fitting = fittingScale([scene[0] - z, scene[1] - z], sharp, this.facts.depth_scale);
      store.set({ depth_scale: fitting, shift: [x, y, 0] });
    };
    return section(
      "Depth",
      this.bars.element,
      scale.row,
      out.row,
      this.#slider("Forward", "shift", 2, near),
      h("button", { type: "button", class: "quiet reset", onclick }, "Fit into the sharp range"),
      this.warnings,
    );
  }

  #light(onenvironment) {
    const ball = lightBall((turn) => this.store.set({ light_turn: turn }), this.#hold);
    this.#rows.push((state) => ball.show(state.light_turn));
    const factor = { min: 0.01, max: 100, log: true, unit: "×", digits: 3, fallback: 1 };
    const name = h("output", { class: "file" });
    const none = h(
      "button",
      { type: "button", class: "quiet", onclick: () => this.store.set({ environment: null }) },
      "Remove",
    );
    const pick = h("button", { type: "button", onclick: onenvironment }, "Open…");
    this.#rows.push((state) => {
      const file = state.environment;
      name.textContent = file === null ? "Scene's own, else the built-in studio" : file.split(/[\\/]/).at(-1);
      none.hidden = file === null;
    });
    const beside = h(
      "div",
      { class: "ball-fields" },
      this.#slider("Around", "light_turn", 0, { min: -180, max: 180, step: 1, unit: "°", digits: 1, fallback: 0 }),
      this.#slider("Up", "light_turn", 1, { min: -90, max: 90, step: 1, unit: "°", digits: 1, fallback: 0 }),
    );
    return section(
      "Light",
      h("div", { class: "ball-row" }, ball.element, beside),
      this.#slider("Lights", "light_strength", null, factor),
      this.#slider("Surroundings", "environment_strength", null, factor),
      h("div", { class: "environment" }, h("span", { class: "label" }, "Environment"), name, pick, none),
    );
  }

  #picture() {
    const exposure = automatic("Exposure, EV", {
      min: -8,
      max: 8,
      step: 0.05,
      fallback: 0,
      onchange: (value) => this.store.set({ exposure: value ?? "auto" }),
      onhold: this.#hold,
    });
    const background = color("Background", (value) => this.store.set({ background: value && linear(value) }));
    const quality = choice("Quality of a render", QUALITIES, (value) =>
      this.store.set({
        effort: value === "draft" || value === "final" ? value : "normal",
        quality: Number(value) || null,
      }),
    );
    this.#rows.push((state) => {
      exposure.show(state.exposure === "auto" ? null : state.exposure, this.facts?.exposure ?? null);
      background.show(state.background && coded(state.background));
      quality.show(state.effort !== "normal" ? state.effort : state.quality === null ? "" : String(state.quality));
    });
    return section("Picture", exposure.row, background.row, quality.row);
  }

  #display(displays) {
    const { store } = this;
    const list = choice("Display", displays, (value) => store.set({ display: value }));
    const subpixels = choice("Sub-pixels", SUBPIXELS, (value) =>
      store.set({ subpixels: { auto: null, yes: true, no: false }[value] }),
    );
    const sides = size("Size", (width, height) => {
      const { head, tail } = this.facts.display_size;
      store.set({ display: `${head}${width}x${height}${tail}` });
    });
    const facts = h("dl", { class: "facts" });
    let told = null;
    this.#rows.push((state) => {
      if (![...list.list.options].some(({ value }) => value === state.display)) {
        // One place for a display that the list does not have: a size that is set makes another.
        list.list.querySelector(":scope > option")?.remove();
        list.list.prepend(h("option", { value: state.display }, state.display.split(/[\\/]/).at(-1)));
      }
      list.show(state.display);
      subpixels.show(state.subpixels === null ? "auto" : state.subpixels ? "yes" : "no");
      // What is known is of the last display that was shown; a size that is being set stays as it is typed.
      const known = this.facts?.display_size ?? null;
      sides.row.hidden = known === null || !state.display.startsWith(known.head);
      if (known !== null && known !== told) sides.show({ ...known, width: tidy(known.width), height: tidy(known.height) });
      told = known;
      const rows = this.facts?.display_facts ?? [];
      facts.replaceChildren(...rows.flatMap(([label, text]) => [h("dt", {}, label), h("dd", {}, text)]));
    });
    return section("Display", list.row, sides.row, subpixels.row, facts);
  }
}

/**
 * Scale of depth that brings a scene into the sharp range: never more than it has.
 *
 * @param scene, sharp ends in mm, back and front of the lens plane; `null` where nothing blurs
 * @param scale that the scene has now
 */
export function fittingScale(scene, sharp, scale) {
  const shares = scene.map((end, side) => (sharp[side] === null || end * sharp[side] <= 0 ? 1 : sharp[side] / end));
  return Math.floor(1000 * scale * Math.min(1, ...shares)) / 1000;
}

/** Turns a placement by degrees: yaw, pitch, roll. */
export function turned([yaw, pitch, roll], [right, up, around]) {
  return [wrapped(yaw + right), Math.max(-90, Math.min(90, Math.round(10 * (pitch + up)) / 10)), wrapped(roll + around)];
}

/** A length without the digits that come of inches. */
const tidy = (value) => Number(value.toFixed(3));

const tenThousandth = (value) => Math.round(1e4 * value) / 1e4;

/** Linear colour of "#rrggbb". */
export function linear(text) {
  const codes = [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16) / 255);
  return codes.map((code) => tenThousandth(code <= 0.04045 ? code / 12.92 : ((code + 0.055) / 1.055) ** 2.4));
}

/** "#rrggbb" of a linear colour. */
export function coded(values) {
  const code = (value) => (value <= 0.0031308 ? 12.92 * value : 1.055 * value ** (1 / 2.4) - 0.055);
  const byte = (value) => Math.round(255 * Math.max(0, Math.min(1, code(value))));
  return `#${values.map((value) => byte(value).toString(16).padStart(2, "0")).join("")}`;
}
