/**
 * The calibration page: the user adjusts pitch, slope and centre by test patterns, and saves them.
 *
 * It has to fill the monitor that is calibrated, because it draws native pixels. Text is hard to read through lenses,
 * so windows of the page share their state: one can show the pattern on the display, another the controls on a plain
 * screen.
 */

import { createDrawing } from "./drawing.js";
import { LARGEST_LEAN, PITCHES, fieldsOf, steps, withChanges } from "./phases.js";

const find = (name) => document.getElementById(name);
const canvas = find("pattern");

const ADVICE = {
  slope: "One eye closed, at the centre of the view zone: click the field all white or black from top to bottom.",
  pitch: "Click the field all white or black from edge to edge. Then repeat the slope with finer steps.",
  center: "Look from the centre of the view zone. Click the field that is lit.",
  stripes:
    "Move sideways: the whole display changes colour at once. Horizontal stripes: wrong slope; vertical: wrong pitch.",
};

/** Messages between windows of the page: the state, or a request for it. */
const windows = new BroadcastChannel("lippmann-calibration");

/** Steps of a slider to either side. */
const RANGE = 500;

let initial; // the server's description of the display, see calibrate/site.py
let monitor; // { pitch, lean, center }, the present values
let anchor; // the monitor at the centre of the sliders
let panel;
let order = null;
let pattern = "slope";
let drawing;

start().catch((error) => alertOf(error.message));

async function start() {
  initial = await request("calibration.json", {});
  anchor = monitor = { ...initial.monitor };
  document.title = `Calibrate ${initial.title}`;
  find("title").textContent = `Calibrate ${initial.title}`;
  find("save").textContent = `Save ${initial.output}`;
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
  windows.postMessage({ token: initial.token, isAsking: true });
}

function share() {
  const chosen = { pattern, order, fineness: find("fineness").value, views: views() };
  windows.postMessage({ token: initial.token, monitor, anchor, ...chosen });
}

function hear(message) {
  if (message.token !== initial.token) return; // a window of an earlier server
  if (message.isAsking) share();
  else adopt(message);
}

/** Takes over the state of another window. */
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
    find(`${name}-turn`).addEventListener("input", (event) => moveSlider(name, Number(event.target.value)));
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

/** Resizes the canvas to the native pixels of the screen. */
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

/** Displays the state here and in other windows. */
function update() {
  show();
  share();
}

/** Displays the state. */
function show() {
  const fields = fieldsOf(pattern, panel, monitor, fineness());
  drawing.draw(panel, pattern, fields, views());
  label(fields);
  for (const button of document.querySelectorAll("[data-pattern]")) {
    button.setAttribute("aria-checked", String(button.dataset.pattern === pattern));
  }
  find("advice").textContent = ADVICE[pattern];
  find("pitch").value = format("pitch", monitor);
  find("slope").value = format("slope", monitor);
  find("center").value = format("center", monitor);
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
    text.textContent = format(pattern, field.monitor);
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

function format(name, { pitch, lean, center }) {
  if (name === "center") return center.toFixed(4);
  if (name === "pitch") return pitch.toFixed(5);
  return lean === 0 ? "infinite" : (1 / lean).toPrecision(7);
}

function choose(name) {
  pattern = name;
  update();
}

/** Changes a value by `count` steps; `name` is pitch, lean or center. */
function nudge(name, count) {
  monitor = withChanges(panel, monitor, { [name]: monitor[name] + count * steps(panel, monitor)[name] * fineness() });
  keepInRange();
  update();
}

function moveSlider(name, value) {
  if (name === "center") {
    monitor = { ...monitor, center: value % 1 };
  } else {
    const key = name === "slope" ? "lean" : name;
    monitor = withChanges(panel, monitor, { [key]: anchor[key] + value * steps(panel, anchor)[key] * fineness() });
  }
  update();
}

/** Takes over a typed value, or marks it invalid. */
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
  monitor = withChanges(panel, monitor, { [key]: value });
  anchor = monitor;
  update();
}

/** Centres the sliders on the values once these exceed their range. */
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
  const names = Object.keys(initial.orders);
  find("order").replaceChildren(...names.map((name) => new Option(name)));
  find("order").hidden = find("order-label").hidden = names.length === 0;
}

function setOrder(name) {
  order = name;
  find("order").value = name ?? initial.order ?? find("order").value;
  panel = name === null ? initial.panel : { ...initial.panel, cells: [[initial.orders[name]]] };
}

function reset() {
  anchor = monitor = { ...initial.monitor };
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
  const headers = { "Content-Type": "application/json", "X-Lippmann-Token": initial.token };
  try {
    const { saved } = await request("display", { method: "POST", headers, body });
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

/** Requests JSON from the server; throws an Error with the server's line. */
async function request(address, options) {
  const response = await fetch(address, { cache: "no-store", ...options }).catch(() => {
    throw new Error("Lippmann's server does not answer; is `lippmann calibrate page` still running?");
  });
  const values = await response.json().catch(() => ({}));
  if (!response.ok) throw new Error(values.error ?? `the server responded with ${response.status}`);
  return values;
}

globalThis.lippmann = {
  /** For tests: the present values. */
  get monitor() {
    return { ...monitor };
  },
};
