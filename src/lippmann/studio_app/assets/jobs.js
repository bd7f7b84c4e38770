/** Full renders: what to make, how far it is, and the picture in this page when it is done. */

import { h } from "lippmann/dom.js";
import { serverSource } from "lippmann/source.js";
import { createViewer } from "lippmann/viewer.js";

const KINDS = [
  ["picture", "Picture", "The display's native pixels"],
  ["quilt", "Quilt", "All views beside each other"],
  ["turntable", "Turntable", "A film of the model turning"],
  ["print", "Print", "TIFF of true size, with marks"],
];

export class Jobs {
  #viewer = null;
  #job = null;
  #settings = "";

  /**
   * @param onrender called with the kind to render
   * @param send sends a message to the studio
   * @param result the element that results are displayed in
   * @param onpanel called with the number of a result to show on the display
   */
  constructor({ onrender, send, result, onpanel }) {
    this.onrender = onrender;
    this.result = result;
    this.onpanel = onpanel;
    this.kind = "picture";
    this.button = h("button", { type: "button", class: "primary", onclick: () => this.start() }, "Render");
    this.menu = h(
      "select",
      { class: "kind", "aria-label": "What to render", onchange: () => (this.kind = this.menu.value) },
      ...KINDS.map(([value, label, title]) => h("option", { value, title }, label)),
    );
    this.stage = h("span", { class: "job-stage" });
    this.bar = h("progress", { max: 1, value: 0, "aria-label": "Progress of the render" });
    this.cancel = h("button", { type: "button", onclick: () => send({ type: "cancel" }) }, "Cancel");
    this.resume = h("button", { type: "button", onclick: () => send({ type: "resume" }) }, "Resume");
    this.open = h("button", { type: "button", onclick: () => this.#show() }, "Show");
    this.dismiss = h(
      "button",
      { type: "button", class: "quiet icon", "aria-label": "Dismiss", onclick: () => (this.element.hidden = true) },
      "×",
    );
    this.element = h(
      "div",
      { class: "job", role: "status", hidden: true },
      this.stage,
      this.bar,
      this.cancel,
      this.resume,
      this.open,
      this.dismiss,
    );
  }

  start() {
    this.onrender(this.kind);
  }

  /** Displays what the studio says of the render. */
  showJob(job) {
    const isNews = this.#job?.phase !== job.phase || this.#job?.number !== job.number;
    this.#job = job;
    this.element.hidden = false;
    this.element.dataset.phase = job.phase;
    const isRunning = job.phase === "running";
    this.bar.hidden = !isRunning;
    if (job.share === null) this.bar.removeAttribute("value");
    else this.bar.value = job.share;
    this.cancel.hidden = !isRunning;
    this.showSettings(this.#settings);
    this.open.hidden = job.phase !== "done";
    this.dismiss.hidden = isRunning;
    this.button.disabled = isRunning;
    this.stage.textContent = words(job);
    if (isNews && job.phase === "done") this.#show();
  }

  /** Takes the command line of the page: a picture of other settings is not gone on with. */
  showSettings(command) {
    this.#settings = command;
    this.resume.hidden = !this.#job?.can_resume || this.#job.settings !== command;
  }

  /** Shows a finished picture with the viewer, a film as a film. */
  #show() {
    const job = this.#job;
    this.#viewer?.destroy();
    this.#viewer = null;
    const frame = h("div", { class: "result-frame" });
    const close = h("button", { type: "button", onclick: () => this.close() }, "Back to the live view");
    const address = `results/${job.number}/${encodeURIComponent(job.name)}`;
    const save = h("a", { class: "button", href: address, download: job.name }, "Download");
    const onpanel = h("button", { type: "button", onclick: () => this.onpanel(job.number) }, "Show on the display");
    const title = h("h2", { tabindex: -1 }, job.name);
    const isPicture = job.shows === "picture";
    const isForPanel = job.kind === "picture";
    this.result.replaceChildren(
      h("header", {}, title, h("span", { class: "quiet-text" }, job.line), save, isForPanel ? onpanel : null, close),
      frame,
    );
    this.result.hidden = false;
    title.focus();
    if (isPicture) {
      const view = h("div");
      frame.append(view);
      this.#viewer = createViewer(view, serverSource(job.number), { theme: "dark" });
      this.#viewer.ready.catch(() => {}); // the viewer displays its errors itself
    } else if (job.shows === "film") {
      frame.append(h("video", { src: address, controls: true, loop: true, autoplay: true }));
    } else frame.append(h("img", { src: address, alt: "All views of the quilt" }));
  }

  get isShown() {
    return !this.result.hidden;
  }

  close() {
    this.#viewer?.destroy();
    this.#viewer = null;
    this.result.hidden = true;
    this.result.replaceChildren();
  }
}

function words(job) {
  if (job.phase === "running") {
    const share = job.share === null ? null : `${Math.round(100 * job.share)} %`;
    const left = job.seconds_left === null ? null : `${duration(job.seconds_left)} left`;
    return [job.stage || "Starting", share, left].filter((part) => part !== null).join(" · ");
  }
  if (job.phase === "done") return `${job.name} is ready`;
  if (job.phase === "cancelled") return job.can_resume ? "Cancelled; what is finished is kept" : "Cancelled";
  return job.line;
}

/** A time as people say it: none is known to the second. */
function duration(seconds) {
  if (seconds < 8) return "a few seconds";
  if (seconds < 90) return `about ${5 * Math.round(seconds / 5)} seconds`;
  if (seconds < 5400) return `about ${Math.round(seconds / 60)} minutes`;
  return `about ${Math.round(seconds / 3600)} hours`;
}
