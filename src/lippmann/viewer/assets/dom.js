/** Elements of the page, made in one line each. */

/**
 * An element with attributes and children; a function as an attribute `onname` listens to the event of that name, true
 * sets an attribute without a value, false and null leave it out.
 */
export function h(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null) made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null));
  return made;
}

/** A titled group of controls. */
export function group(title, ...children) {
  return h("section", { class: "group" }, h("h2", {}, title), ...children);
}

/**
 * A slider with its name and its value in words.
 *
 * @returns an object with the `row` and a function `show(value)` that puts it without telling anybody
 */
export function slider(name, { min, max, step, words, onchange, marks = null }) {
  const input = h("input", { type: "range", min, max, step, oninput: () => onchange(Number(input.value)) });
  const output = h("output", {});
  const label = h("span", { class: "slider-name" }, name);
  const ticks = marks === null ? null : h("span", { class: "slider-mark" });
  // Not as an attribute: the page's policy allows no styles in them.
  ticks?.style.setProperty("--at", marks);
  const row = h("label", { class: "slider" }, label, output, h("span", { class: "slider-track" }, input, ticks));
  const show = (value) => {
    input.value = value;
    output.textContent = words(value);
    input.setAttribute("aria-valuetext", words(value));
  };
  return { row, input, show };
}

/** A switch: a button that is pressed or not; `show(isOn)` as for the slider. */
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

/** One choice of several, as a row of segments; `choices` are pairs of value and text. */
export function segments(name, choices, onchange) {
  groups += 1;
  const inputs = choices.map(([value]) =>
    h("input", { type: "radio", name: `lippmann-${groups}`, value, onchange: () => onchange(value) }),
  );
  const labels = choices.map(([, text], place) => h("label", {}, inputs[place], h("span", {}, text)));
  const row = h("div", { class: "segments", role: "radiogroup", "aria-label": name }, ...labels);
  return { row, show: (value) => inputs.forEach((input) => (input.checked = input.value === value)) };
}
