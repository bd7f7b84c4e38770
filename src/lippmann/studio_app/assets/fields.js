/** Controls of the side panel: each displays a value of the store and changes it. */

import { h } from "lippmann/dom.js";

let count = 0;
const newId = () => `field-${(count += 1)}`;

/** Creates a slider with a box to type the number into; a double click on the name resets it. */
export function number(label, { min, max, step, unit = "", log = false, digits = 2, fallback, onchange, onhold }) {
  const id = newId();
  const to = log ? Math.log : (value) => value;
  const from = log ? Math.exp : (value) => value;
  const track = h("input", {
    type: "range",
    min: to(min),
    max: to(max),
    step: log ? 0.001 : step,
    "aria-label": label,
    oninput: () => onchange(tidy(from(Number(track.value)))),
    onpointerdown: () => onhold?.(true),
    onpointerup: () => onhold?.(false),
  });
  const box = h("input", {
    id,
    type: "number",
    step: "any",
    inputmode: "decimal",
    onchange: () => {
      if (box.value !== "" && Number.isFinite(Number(box.value))) onchange(Number(box.value));
      else show(shown);
    },
  });
  const name = h("label", { for: id, ondblclick: () => onchange(fallback), title: "Double click: reset" }, label);
  const row = h("div", { class: "number" }, name, track, box, h("span", { class: "unit" }, unit));
  let shown = fallback;
  const tidy = (value) => Number(value.toFixed(digits));
  function show(value, text = null) {
    shown = value;
    track.value = to(value ?? fallback);
    // A value that is being typed is left alone.
    if (document.activeElement !== box) box.value = value === null ? "" : tidy(value);
    box.placeholder = text ?? (value === null ? "auto" : "");
    track.setAttribute("aria-valuetext", value === null ? "automatic" : `${tidy(value)} ${unit}`.trim());
  }
  const setDisabled = (isOff) => {
    track.disabled = isOff;
    box.disabled = isOff;
    row.classList.toggle("off", isOff);
  };
  return { row, show, setDisabled, box, track };
}

/** Creates a value that is chosen by the studio unless its box is ticked off; `null` stands for automatic. */
export function automatic(label, options) {
  const control = number(label, options);
  const id = newId();
  const box = h("input", {
    id,
    type: "checkbox",
    onchange: () => options.onchange(box.checked ? null : (control.automatic ?? options.fallback)),
  });
  const tick = h("label", { class: "check", for: id, title: `${label}: chosen by the studio` }, box, "Auto");
  const row = h("div", { class: "automatic" }, control.row, tick);
  const show = (value, automaticValue = null) => {
    box.checked = value === null;
    control.automatic = automaticValue;
    control.show(value ?? automaticValue ?? options.fallback);
    control.setDisabled(value === null);
  };
  return { row, show };
}

/** Creates a list to choose from; `choices` are pairs of value and text, or `[group, pairs]`. */
export function choice(label, choices, onchange) {
  const id = newId();
  const list = h("select", { id, onchange: () => onchange(list.value) });
  const row = h("div", { class: "choice" }, h("label", { for: id }, label), list);
  const fill = (pairs) => {
    const option = ([value, text]) => h("option", { value }, text);
    list.replaceChildren(
      ...pairs.map(([value, text]) =>
        Array.isArray(text) ? h("optgroup", { label: value }, ...text.map(option)) : option([value, text]),
      ),
    );
  };
  fill(choices);
  return { row, fill, list, show: (value) => (list.value = value) };
}

/** Creates two boxes for a width and a height; `onchange(width, height)` gets both once they are above 0. */
export function size(label, onchange) {
  const box = (side) =>
    h("input", { type: "number", min: 0, step: "any", inputmode: "decimal", "aria-label": side, onchange: change });
  const [width, height] = [`${label}, width`, `${label}, height`].map(box);
  const unit = h("span", { class: "unit" });
  const row = h("div", { class: "size", role: "group", "aria-label": label }, label, width, "×", height, unit);
  let shown = { width: 0, height: 0, unit: "" };
  function change() {
    const sides = [Number(width.value), Number(height.value)];
    if (sides.every((side) => Number.isFinite(side) && side > 0)) onchange(...sides);
    else show(shown);
  }
  function show(next) {
    shown = next;
    width.value = next.width;
    height.value = next.height;
    unit.textContent = next.unit;
  }
  return { row, show };
}

/** Creates a tick box. */
export function check(label, onchange, note = null) {
  const id = newId();
  const box = h("input", { id, type: "checkbox", onchange: () => onchange(box.checked) });
  const row = h("label", { class: "check", for: id }, box, h("span", {}, label, note && h("small", {}, note)));
  return { row, box, show: (value) => (box.checked = value) };
}

/** Creates a colour with a way back to none; `null` stands for the scene's own. */
export function color(label, onchange) {
  const id = newId();
  const well = h("input", { id, type: "color", oninput: () => onchange(well.value) });
  const clear = h("button", { type: "button", class: "quiet", onclick: () => onchange(null) }, "Remove");
  const own = h("span", { class: "note" }, "Scene's own");
  const row = h("div", { class: "color" }, h("label", { for: id }, label), own, clear, well);
  const show = (value) => {
    well.value = value ?? "#000000";
    clear.hidden = value === null;
    own.hidden = value !== null;
  };
  return { row, show };
}

/** Creates a section of the panel that can be folded. */
export function section(title, ...children) {
  return h("details", { class: "section", open: true }, h("summary", {}, title), h("div", { class: "body" }, ...children));
}
