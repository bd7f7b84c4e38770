/**
 * The window for the display itself: native pixels, one to one. `?live` shows what the studio shows, `?result=N` the
 * Nth render. It complains wherever the browser scales, since lenses then no longer fit their pixels.
 */

import { h } from "lippmann/dom.js";
import { serverSource } from "lippmann/source.js";
import { Connection } from "studio/connection.js";
import { drawPattern } from "studio/pattern.js";
import { complaint } from "studio/native_check.js";
import { askScreens, placeInWords, screenOf } from "studio/screens.js";

/** Longest side of a photograph that is sent, in pixels. */
const LONGEST = 1200;

const asked = new URLSearchParams(location.search);
const main = document.querySelector("main");
const canvas = h("canvas", { "aria-label": "Native pixels of the display", role: "img" });
const alertLine = h("p", { role: "alert", class: "complaint", hidden: true });
const state = h("output", { class: "state" });
const full = h("button", { type: "button", class: "primary", onclick: () => goFull() }, "Full screen");
const pattern = h("button", { type: "button", "aria-pressed": "false", onclick: () => togglePattern() }, "Test pattern");
const check = h("button", { type: "button", "aria-pressed": "false", onclick: () => toggleCheck() }, "Check by photograph");
const photograph = h("input", {
  type: "file",
  accept: "image/*",
  capture: "environment",
  "aria-label": "Photograph of the panel",
  hidden: true,
  onchange: () => sendPhotograph(),
});
const hide = h("button", { type: "button", onclick: () => setBar(false) }, "Hide this bar");
const hint = h("p", { class: "hint" }, "Put this window on the display, then go full screen. Keys: F, P, H.");
const bar = h("div", { class: "bar" }, full, pattern, check, hide, photograph, state, hint, alertLine);
main.append(canvas, bar);

let panel = null;
let picture = null;
/** What is shown in place of the picture: "pattern", "check", or nothing. */
let instead = null;
let checkPattern = null;
let box = null;

async function start() {
  const response = await fetch("panel.json");
  panel = await response.json();
  document.title = `${panel.name} - Lippmann`;
  canvas.width = panel.width;
  canvas.height = panel.height;
  check.hidden = panel.camera === null;
  fit();
  const observer = new ResizeObserver(([entry]) => {
    box = entry.devicePixelContentBoxSize?.[0] ?? null;
    fit();
  });
  try {
    observer.observe(canvas, { box: "device-pixel-content-box" });
  } catch {
    observer.observe(canvas); // Safari, which has no such box
  }
  for (const name of ["resize", "fullscreenchange"]) addEventListener(name, fit);
  visualViewport?.addEventListener("resize", fit);
  if (asked.has("result")) await showPicture(asked.get("result"));
  else if (panel.live) follow(panel.live);
  else await showPicture(0);
}

/** Gives the canvas as many pixels of the screen as it has of its own, and says whether that is so. */
function fit() {
  canvas.style.width = `${panel.width / devicePixelRatio}px`;
  canvas.style.height = `${panel.height / devicePixelRatio}px`;
  const line = complaint({
    panel,
    box: box && [box.inlineSize, box.blockSize],
    ratio: devicePixelRatio,
    screen: [screen.width, screen.height],
    zoom: visualViewport?.scale ?? 1,
    inside: [innerWidth, innerHeight],
    turn: screen.orientation?.angle ?? 0,
    isFull: document.fullscreenElement !== null,
  });
  alertLine.textContent = line ?? "";
  alertLine.hidden = line === null;
  document.body.dataset.mapping = line === null ? "exact" : "wrong";
  if (line !== null) bar.hidden = false;
  full.hidden = document.fullscreenElement !== null;
}

function draw() {
  const context = canvas.getContext("2d", { alpha: false });
  if (instead === "pattern") drawPattern(context, panel);
  else if (instead === "check") context.drawImage(checkPattern, 0, 0);
  else if (picture !== null) context.drawImage(picture, 0, 0);
  document.body.dataset.drawn = String(Number(document.body.dataset.drawn ?? 0) + 1);
}

function follow(path) {
  const address = new URL(path, location.href);
  address.protocol = address.protocol.replace("http", "ws");
  new Connection(address, {
    onState: (now) => (state.textContent = now === "lost" ? "The studio does not answer" : ""),
    onMessage: ({ type, line }) => {
      if (type === "error" || type === "busy") state.textContent = line ?? "";
    },
    onFrame: async (header, frame) => {
      if (header.width !== panel.width || header.height !== panel.height) return location.reload();
      picture = frame instanceof ImageData ? await createImageBitmap(frame) : frame;
      if (instead !== "check") state.textContent = `${header.samples} sample${header.samples === 1 ? "" : "s"} per pixel`;
      return draw();
    },
  });
}

async function showPicture(number) {
  const source = serverSource(number);
  const { tiles } = await source.manifest();
  if (tiles.width !== panel.width || tiles.height !== panel.height) {
    panel = { ...panel, width: tiles.width, height: tiles.height };
    canvas.width = panel.width;
    canvas.height = panel.height;
    fit();
  }
  const whole = new OffscreenCanvas(tiles.width, tiles.height);
  const context = whole.getContext("2d", { alpha: false });
  for (let row = 0; row < tiles.rows; row += 1) {
    for (let column = 0; column < tiles.columns; column += 1) {
      const data = await source.tile("picture", column, row);
      await drawTile(context, tiles, data, column * tiles.size, row * tiles.size);
    }
  }
  picture = whole;
  draw();
}

async function drawTile(context, tiles, data, left, top) {
  const width = Math.min(tiles.size, tiles.width - left);
  const height = Math.min(tiles.size, tiles.height - top);
  if (tiles.format === "png") {
    const options = { colorSpaceConversion: "none", premultiplyAlpha: "none" };
    context.drawImage(await createImageBitmap(new Blob([data], { type: "image/png" }), options), left, top);
    return;
  }
  const bytes = new Uint8Array(data);
  const pixels = new ImageData(width, height);
  for (let from = 0, to = 0; from < bytes.length; from += 3, to += 4) {
    pixels.data.set(bytes.subarray(from, from + 3), to);
    pixels.data[to + 3] = 255;
  }
  context.putImageData(pixels, left, top);
}

/** Goes full screen on the display itself, where the browser may find it among the screens; else on this one. */
async function goFull() {
  const screens = await askScreens();
  const found = screens && screenOf(screens, panel);
  if (screens !== null) state.textContent = placeInWords(screens, panel);
  try {
    await document.documentElement.requestFullscreen({ navigationUI: "hide", ...(found && { screen: found }) });
    setBar(false);
  } catch {
    state.textContent = "The browser did not go full screen: press F once more.";
  }
}

function togglePattern() {
  show(instead === "pattern" ? null : "pattern");
}

function show(what) {
  instead = what;
  pattern.setAttribute("aria-pressed", String(what === "pattern"));
  check.setAttribute("aria-pressed", String(what === "check"));
  photograph.hidden = what !== "check";
  draw();
}

async function toggleCheck() {
  if (instead === "check") return show(null);
  state.textContent = "The pattern is being drawn.";
  const response = await fetch("check.png");
  const options = { colorSpaceConversion: "none", premultiplyAlpha: "none" };
  checkPattern = await createImageBitmap(await response.blob(), options);
  state.textContent = `Hide this bar, photograph the whole panel in the dark from straight before it, ${Math.round(panel.camera)} mm away, and open the photograph here.`;
  return show("check");
}

/** Sends a photograph, small and upright as the browser shows it, and shows the answer. */
async function sendPhotograph() {
  const [file] = photograph.files;
  if (file === undefined) return;
  state.textContent = "The photograph is being read.";
  try {
    const whole = await createImageBitmap(file);
    const scale = Math.min(1, LONGEST / Math.max(whole.width, whole.height));
    const small = new OffscreenCanvas(Math.round(whole.width * scale), Math.round(whole.height * scale));
    const context = small.getContext("2d", { alpha: false });
    context.imageSmoothingQuality = "high";
    context.drawImage(whole, 0, 0, small.width, small.height);
    const bytes = new Uint8Array(await (await small.convertToBlob({ type: "image/jpeg", quality: 0.9 })).arrayBuffer());
    const text = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
    const headers = { "Content-Type": "application/json" };
    const response = await fetch("check", { method: "POST", headers, body: JSON.stringify({ photograph: text }) });
    const { line, error } = await response.json();
    state.textContent = line ?? error;
  } catch ({ message }) {
    state.textContent = `The photograph cannot be read: ${message}`;
  }
  photograph.value = "";
}

function setBar(isShown) {
  bar.hidden = !isShown && document.body.dataset.mapping === "exact";
}

document.addEventListener("keydown", ({ key, ctrlKey, metaKey, altKey }) => {
  if (ctrlKey || metaKey || altKey) return;
  const call = { f: () => (document.fullscreenElement ? document.exitFullscreen() : goFull()), p: togglePattern };
  if (key.toLowerCase() === "h") setBar(bar.hidden);
  else call[key.toLowerCase()]?.();
});
canvas.addEventListener("click", () => setBar(bar.hidden));

start().catch(({ message }) => {
  alertLine.textContent = message;
  alertLine.hidden = false;
});
