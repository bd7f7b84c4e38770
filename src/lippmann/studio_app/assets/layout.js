/** The elements of the page around the picture: header, tools, status, command line, messages. */

import { h, segments, toggle } from "lippmann/dom.js";
import { KEYS, TOOLS } from "studio/gestures.js";

/** Milliseconds that a failure stays before it may be forgotten. */
const FAILURE_PAUSE = 9000;
/** Milliseconds without a frame after which nothing moves. */
const REST = 400;
/** Frames over which the rate is averaged. */
const RATE_FRAMES = 12;

export function buildPage(root, actions) {
  const button = (text, onclick, attributes = {}) => h("button", { type: "button", onclick, ...attributes }, text);
  const title = h("span", { class: "title" }, "");
  const undo = button("↶", actions.undo, { class: "icon", "aria-label": "Undo", title: "Undo (Ctrl + Z)" });
  const redo = button("↷", actions.redo, { class: "icon", "aria-label": "Redo", title: "Redo (Ctrl + Y)" });
  const onDisplay = button("On the display…", () => actions.openPanel(), {
    title: "A window to put full screen on the display itself",
  });
  const jobPlace = h("div", { class: "job-place" });
  const header = h(
    "header",
    { class: "bar" },
    h("h1", {}, h("span", { class: "brand" }, "Lippmann"), " Studio"),
    title,
    button("Open…", () => actions.files.open(), { title: "A model or a state; or drop a file onto the page" }),
    button("Save state", actions.save),
    h("span", { class: "pair" }, undo, redo),
    h("span", { class: "space" }),
    onDisplay,
    jobPlace,
  );
  const canvas = h("canvas", { tabindex: 0, role: "img", "aria-label": "What the display shows to the eye" });
  const wait = h("div", { class: "wait", role: "status" }, h("span", { class: "spinner" }), h("span", {}, "Starting"));
  const failure = h("div", { class: "failure", role: "alert", hidden: true });
  const stage = h("div", { class: "stage" }, canvas, wait, failure);
  const tools = segments(
    "What the pointer does",
    TOOLS.map(({ name, label }) => [name, label]),
    (name) => actions.setTool(name),
  );
  // A tool that was chosen by the pointer leaves the arrow keys to the picture.
  let isPointed = false;
  tools.row.addEventListener("pointerdown", () => (isPointed = true));
  tools.row.addEventListener("click", ({ target }) => {
    if (!isPointed || target.type !== "radio") return;
    isPointed = false;
    canvas.focus({ preventScroll: true });
  });
  const sway = toggle("Sway", actions.sway, { class: "toggle", title: "Move the eye by itself (S)" });
  const native = toggle("Native pixels", actions.native, { class: "toggle", title: "The panel's own pixels (N)" });
  const real = toggle("Real lens", actions.real, {
    class: "toggle",
    title: "With crosstalk, blur and strips of the lenses as they are made (O)",
  });
  const hint = h("span", { class: "hint" });
  const status = h("output", { class: "status", "aria-label": "State of the picture" });
  const help = helpDialog();
  const deck = h(
    "div",
    { class: "deck" },
    tools.row,
    sway.button,
    native.button,
    real.button,
    hint,
    h("span", { class: "space" }),
    status,
    button("?", () => help.showModal(), { class: "icon quiet", "aria-label": "Keys" }),
  );
  const command = h("code", { tabindex: 0, "aria-label": "Command line that renders this" });
  const copied = h("span", { class: "copied", role: "status" });
  const copy = button("Copy", async () => {
    await navigator.clipboard.writeText(command.textContent);
    copied.textContent = "Copied";
    setTimeout(() => (copied.textContent = ""), 1500);
  });
  const foot = h("footer", { class: "bar" }, h("span", { class: "prompt" }, "$"), command, copied, copy);
  const aside = h("aside", { "aria-label": "Settings" });
  const result = h("section", { class: "result", "aria-label": "Rendered picture", hidden: true });
  root.append(header, h("div", { class: "work" }, stage, deck, result), aside, foot, help);

  let forget = 0;
  const times = [];
  return {
    canvas,
    stage,
    result,
    help,
    begin(panel) {
      aside.append(panel.element);
    },
    placeJobs(jobs) {
      jobPlace.append(jobs.menu, jobs.button);
      deck.before(jobs.element);
    },
    showHistory(store) {
      undo.disabled = !store.canUndo;
      redo.disabled = !store.canRedo;
    },
    showMode({ tool, stage: shown }) {
      tools.show(tool);
      sway.show(shown?.isSwaying ?? false);
      native.show(shown?.isNative ?? false);
      real.show(shown?.isReal ?? false);
      real.button.hidden = !(shown?.hasLens ?? false);
      canvas.dataset.tool = shown?.isNative ? "pan" : tool;
      hint.textContent = shown?.isNative
        ? `${shown.nativeZoom} : 1; drag to move, wheel to zoom`
        : TOOLS.find(({ name }) => name === tool).hint;
    },
    showFrame(frame) {
      wait.hidden = true;
      const now = performance.now();
      if (now - (times.at(-1) ?? now) > REST) times.length = 0;
      times.push(now);
      if (times.length > RATE_FRAMES) times.shift();
      const isMoving = frame.samples === 1 && times.length > 2;
      const rate = (1000 * (times.length - 1)) / (now - times[0]);
      const samples = `${frame.samples} sample${frame.samples === 1 ? "" : "s"}${frame.isDenoised ? ", denoised" : ""}`;
      status.textContent = isMoving ? `${Math.min(999, rate).toFixed(0)} frames/s` : samples;
    },
    showCommand(text, name) {
      command.textContent = text;
      title.textContent = name;
      document.title = `${name} - Lippmann Studio`;
    },
    /** Offers the window of native pixels, but for displays that take none. */
    showNative(isTaken) {
      onDisplay.hidden = !isTaken;
    },
    showConnection(state) {
      document.body.dataset.connection = state;
      if (state === "lost") this.fail("The studio does not answer; is `lippmann studio` still running?");
      else this.fail(null);
    },
    busy(line) {
      wait.hidden = line === null;
      if (line !== null) wait.lastChild.textContent = line;
    },
    /** Shows one line that says what went wrong; null takes it away. */
    fail(line) {
      clearTimeout(forget);
      failure.hidden = line === null;
      failure.textContent = line ?? "";
      if (line === null) return;
      wait.hidden = true;
      if (document.body.dataset.connection !== "lost") forget = setTimeout(() => (failure.hidden = true), FAILURE_PAUSE);
    },
  };
}

function helpDialog() {
  const rows = KEYS.flatMap(([key, text]) => [h("dt", {}, h("kbd", {}, key)), h("dd", {}, text)]);
  const close = h("button", { type: "button", onclick: () => dialog.close() }, "Close");
  const dialog = h("dialog", { class: "help", "aria-label": "Keys" }, h("h2", {}, "Keys"), h("dl", {}, ...rows), close);
  return dialog;
}
