/** Functions that create elements and controls of the page. */

/**
 * Creates an element with attributes and children. A function as attribute `onNAME` listens to the event NAME; `true`
 * sets an attribute without a value; `false` and `null` omit it.
 */
export function h(tag, attributes = {}, ...children) {
  const created = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") created.addEventListener(name.slice(2), value);
    else if (value === true) created.setAttribute(name, "");
    else if (value !== false && value !== null) created.setAttribute(name, value);
  }
  created.append(...children.filter((child) => child !== null));
  return created;
}

/** Creates a group of controls with a title. */
export function group(title, ...children) {
  return h("section", { class: "group" }, h("h2", {}, title), ...children);
}

/**
 * Creates a slider with a label and its formatted value.
 *
 * @returns the element `row`, and `show(value)`, which sets the value without calling `onchange`
 */
export function slider(name, { min, max, step, format, onchange, marks = null }) {
  const input = h("input", { type: "range", min, max, step, oninput: () => onchange(Number(input.value)) });
  const output = h("output", {});
  const label = h("span", { class: "slider-name" }, name);
  const ticks = marks === null ? null : h("span", { class: "slider-mark" });
  // The page's policy forbids style attributes.
  ticks?.style.setProperty("--at", marks);
  const row = h("label", { class: "slider" }, label, output, h("span", { class: "slider-track" }, input, ticks));
  const show = (value) => {
    input.value = value;
    output.textContent = format(value);
    input.setAttribute("aria-valuetext", format(value));
  };
  return { row, input, show };
}

/** Creates a toggle button; `show(isOn)` as for the slider. */
export function toggle(name, onchange, attributes = {}) {
  const press = () => onchange(button.getAttribute("aria-pressed") !== "true");
  const button = h(
    "button",
    { type: "button", class: "toggle", "aria-pressed": "false", onclick: press, ...attributes },
    name,
  );
  return { button, show: (isOn) => button.setAttribute("aria-pressed", String(isOn)) };
}

let groups = 0;

/** Creates a row of radio buttons; `choices` are pairs of value and label. */
export function segments(name, choices, onchange) {
  groups += 1;
  const inputs = choices.map(([value]) =>
    h("input", { type: "radio", name: `lippmann-${groups}`, value, onchange: () => onchange(value) }),
  );
  const labels = choices.map(([, text], place) => h("label", {}, inputs[place], h("span", {}, text)));
  const row = h("div", { class: "segments", role: "radiogroup", "aria-label": name }, ...labels);
  return { row, show: (value) => inputs.forEach((input) => (input.checked = input.value === value)) };
}
