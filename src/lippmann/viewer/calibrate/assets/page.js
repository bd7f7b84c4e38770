/**
 * The page on which a person turns pitch, slope and centre until the test pattern stands still, and saves them.
 *
 * It has to fill the monitor that is calibrated, pixel for pixel: what it draws are native pixels. Text is hard to read
 * through lenses, so that windows of the page share what is turned: one can show the pattern there, another the
 * controls on a plain screen.
 */

import { createDrawing } from "./drawing.js";
import { LARGEST_LEAN, PITCHES, fieldsOf, steps, turned } from "./phases.js";

const find = (name) => document.getElementById(name);
const canvas = find("pattern");

const ADVICE = {
  slope: "One eye shut, in the middle of the viewing place: click the field that is white, or black, from top to bottom.",
  pitch: "Click the field that is white, or black, from end to end. Then look at the slope again, with finer steps.",
  center: "With the eye in the middle of the viewing place: click the field that is lit.",
  stripes: "Move sideways: the whole display changes its colour at once. Stripes that lie tell of the slope, upright ones of the pitch.",
};

/** What windows tell each other: all that is turned and chosen, or that they want to know it. */
const windows = new BroadcastChannel("lippmann-calibration");

/** How many steps a range may be turned to either side. */
const RANGE = 500;

let told; // what the server told of the display
let monitor; // { pitch, lean, center } as turned so far
let anchor; // the monitor at the middle of the ranges
let panel;
let order = null;
let pattern = "slope";
let drawing;

start().catch((error) => alertOf(error.message));

async function start() {
  told = await asked("calibration.json", {});
  anchor = monitor = { ...told.monitor };
  document.title = `Calibrate ${told.title}`;
  find("title").textContent = `Calibrate ${told.title}`;
  find("save").textContent = `Save ${told.output}`;
  offerOrders();
  setOrder(null);
  drawing = createDrawing(canvas);
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => {
    drawing = createDrawing(canvas);
    show();
  });
  listen();
  find("controls").hidden = location.hash === "#pattern";
  fit();
  windows.addEventListener("message", ({ data }) => hear(data));
  windows.postMessage({ token: told.token, isAsking: true });
}

function share() {
  const chosen = { pattern, order, fineness: find("fineness").value, views: views() };
  windows.postMessage({ token: told.token, monitor, anchor, ...chosen });
}

function hear(message) {
  if (message.token !== told.token) return; // a window of an earlier server
  if (message.isAsking) share();
  else adopt(message);
}

/** Takes over what was turned in another window. */
function adopt(state) {
  ({ monitor, anchor, pattern } = state);
  find("fineness").value = state.fineness;
  find("views").value = state.views;
  setOrder(state.order);
  show();
}

function listen() {
  const observer = new ResizeObserver(fit);
  try {
    observer.observe(canvas, { box: "device-pixel-content-box" });
  } catch {
    observer.observe(canvas); // Safari, which has no such box
  }
  for (const button of document.querySelectorAll("[data-pattern]")) {
    button.addEventListener("click", () => choose(button.dataset.pattern));
  }
  for (const name of ["pitch", "slope", "center"]) {
    find(`${name}-turn`).addEventListener("input", (event) => turnRange(name, Number(event.target.value)));
    find(name).addEventListener("change", (event) => type(name, event.target));
  }
  find("fineness").addEventListener("change", () => {
    anchor = monitor;
    update();
  });
  find("views").addEventListener("input", update);
  find("order").addEventListener("change", (event) => {
    setOrder(event.target.value);
    update();
  });
  find("window").addEventListener("click", () => open("#pattern", "", "popup"));
  find("full").addEventListener("click", toggleFull);
  find("hide").addEventListener("click", toggleControls);
  find("reset").addEventListener("click", reset);
  find("save").addEventListener("click", save);
  canvas.addEventListener("click", takeField);
  document.addEventListener("keydown", press);
  document.addEventListener("fullscreenchange", show);
}

/** Gives the canvas as many pixels as the screen has behind it. */
function fit(entries) {
  const box = entries?.[0]?.devicePixelContentBoxSize?.[0];
  const width = box ? box.inlineSize : Math.round(canvas.clientWidth * devicePixelRatio);
  const height = box ? box.blockSize : Math.round(canvas.clientHeight * devicePixelRatio);
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  show();
}

/** Shows what was turned, here and in other windows. */
function update() {
  show();
  share();
}

/** Draws everything from the state above. */
function show() {
  const fields = fieldsOf(pattern, panel, monitor, fineness());
  drawing.draw(panel, pattern, fields, views());
  label(fields);
  for (const button of document.querySelectorAll("[data-pattern]")) {
    button.setAttribute("aria-checked", String(button.dataset.pattern === pattern));
  }
  find("advice").textContent = ADVICE[pattern];
  find("pitch").value = written("pitch", monitor);
  find("slope").value = written("slope", monitor);
  find("center").value = written("center", monitor);
  const step = steps(panel, anchor);
  find("pitch-turn").value = (monitor.pitch - anchor.pitch) / (step.pitch * fineness());
  find("slope-turn").value = (monitor.lean - anchor.lean) / (step.lean * fineness());
  find("center-turn").value = monitor.center;
  find("size").textContent = sizeNote();
}

function label(fields) {
  const here = find("labels");
  here.replaceChildren();
  if (pattern === "stripes") return;
  const [x, y] = [innerWidth / canvas.width, innerHeight / canvas.height];
  fields.forEach((field, number) => {
    const text = document.createElement("span");
    const middle = (field.first + field.last) / 2;
    text.textContent = written(pattern, field.monitor);
    text.className = number === (fields.length - 1) / 2 ? "own" : "";
    text.style.left = `${pattern === "slope" ? middle * x : Math.min(innerWidth, panel.width * x) / 8}px`;
    text.style.top = `${pattern === "slope" ? Math.min(innerHeight, panel.height * y) / 8 : middle * y}px`;
    here.append(text);
  });
}

function sizeNote() {
  if (canvas.width === panel.width && canvas.height === panel.height) return "";
  const [have, need] = [`${canvas.width} × ${canvas.height}`, `${panel.width} × ${panel.height}`];
  if (!document.fullscreenElement) return `This window shows ${have} of ${need} pixels: F on the display itself.`;
  return `This screen shows ${have} pixels, the display has ${need}: another screen, or one that is scaled or zoomed.`;
}

const fineness = () => Number(find("fineness").value);
const views = () => Math.min(Math.max(Math.round(Number(find("views").value)) || 2, 2), 100);

function written(name, { pitch, lean, center }) {
  if (name === "center") return center.toFixed(4);
  if (name === "pitch") return pitch.toFixed(5);
  return lean === 0 ? "infinite" : (1 / lean).toPrecision(7);
}

function choose(name) {
  pattern = name;
  update();
}

/** Moves a value by so many of its steps; `name` is pitch, lean or center. */
function nudge(name, count) {
  monitor = turned(panel, monitor, { [name]: monitor[name] + count * steps(panel, monitor)[name] * fineness() });
  keepInRange();
  update();
}

function turnRange(name, value) {
  if (name === "center") {
    monitor = { ...monitor, center: value % 1 };
  } else {
    const key = name === "slope" ? "lean" : name;
    monitor = turned(panel, monitor, { [key]: anchor[key] + value * steps(panel, anchor)[key] * fineness() });
  }
  update();
}

/** Takes a value that was typed, if it is one. */
function type(name, input) {
  const text = input.value.trim().toLowerCase();
  const number = text === "infinite" ? Infinity : Number(text);
  const [key, value] = name === "slope" ? ["lean", 1 / number] : [name, number];
  const isPossible =
    text !== "" &&
    Number.isFinite(value) &&
    !(key === "pitch" && (value < PITCHES[0] || value > PITCHES[1])) &&
    !(key === "lean" && Math.abs(value) > LARGEST_LEAN);
  input.setAttribute("aria-invalid", String(!isPossible));
  if (!isPossible) return;
  monitor = turned(panel, monitor, { [key]: value });
  anchor = monitor;
  update();
}

/** Moves the middle of the ranges to the value, once it is beyond their ends. */
function keepInRange() {
  const step = steps(panel, anchor);
  const isBeyond = (key) => Math.abs(monitor[key] - anchor[key]) > RANGE * step[key] * fineness();
  if (isBeyond("pitch") || isBeyond("lean")) anchor = monitor;
}

function takeField(event) {
  if (pattern === "stripes") return;
  const column = (event.clientX * canvas.width) / innerWidth;
  const row = (event.clientY * canvas.height) / innerHeight;
  const along = pattern === "slope" ? column : row;
  const field = fieldsOf(pattern, panel, monitor, fineness()).find(({ first, last }) => along >= first && along < last);
  if (field === undefined) return;
  anchor = monitor = field.monitor;
  update();
}

function offerOrders() {
  const names = Object.keys(told.orders);
  find("order").replaceChildren(...names.map((name) => new Option(name)));
  find("order").hidden = find("order-label").hidden = names.length === 0;
}

function setOrder(name) {
  order = name;
  find("order").value = name ?? told.order ?? find("order").value;
  panel = name === null ? told.panel : { ...told.panel, cells: [[told.orders[name]]] };
}

function reset() {
  anchor = monitor = { ...told.monitor };
  setOrder(null);
  update();
}

function toggleControls() {
  find("controls").hidden = !find("controls").hidden;
}

function toggleFull() {
  if (document.fullscreenElement) document.exitFullscreen();
  else document.documentElement.requestFullscreen().catch((error) => alertOf(`no full screen: ${error.message}`));
}

const KEYS = {
  ArrowLeft: (count) => nudge("pitch", -count),
  ArrowRight: (count) => nudge("pitch", count),
  ArrowDown: (count) => nudge("lean", -count),
  ArrowUp: (count) => nudge("lean", count),
  Comma: (count) => nudge("center", -count),
  Period: (count) => nudge("center", count),
  Digit1: () => choose("slope"),
  Digit2: () => choose("pitch"),
  Digit3: () => choose("center"),
  Digit4: () => choose("stripes"),
  KeyF: toggleFull,
  KeyH: toggleControls,
  KeyS: save,
};

function press(event) {
  const isTyping = event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement;
  const action = KEYS[event.code];
  if (isTyping || action === undefined || event.ctrlKey || event.metaKey) return;
  event.preventDefault();
  const count = event.shiftKey ? 10 : event.altKey ? 0.1 : 1;
  action(count);
}

async function save() {
  const { pitch, lean, center } = monitor;
  const body = JSON.stringify({ pitch, slope: lean === 0 ? null : 1 / lean, center, order });
  const headers = { "Content-Type": "application/json", "X-Lippmann-Token": told.token };
  try {
    const { saved } = await asked("display", { method: "POST", headers, body });
    find("alert").hidden = true;
    find("status").textContent = `Saved ${saved}.`;
  } catch (error) {
    find("status").textContent = "";
    alertOf(error.message);
  }
}

function alertOf(text) {
  find("alert").textContent = text;
  find("alert").hidden = false;
}

/** The JSON that the server answers. */
async function asked(address, options) {
  const answer = await fetch(address, { cache: "no-store", ...options }).catch(() => {
    throw new Error("Lippmann's server does not answer; is `lippmann calibrate page` still running?");
  });
  const values = await answer.json().catch(() => ({}));
  if (!answer.ok) throw new Error(values.error ?? `the server answered ${answer.status}`);
  return values;
}

globalThis.lippmann = {
  /** For tests: the monitor as turned so far. */
  get monitor() {
    return { ...monitor };
  },
};
