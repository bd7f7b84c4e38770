/** Layout of the page: title, canvas, progress, messages, divider, and the side panel for the controls. */

import { h } from "lippmann/dom.js";

const THEMES = ["auto", "light", "dark"];

export class Layout {
  /** @param onResize called when the space for the canvas changes */
  constructor(root, { theme = "auto", compact = false }, onResize) {
    this.root = root;
    root.classList.add("lippmann");
    root.classList.toggle("compact", compact);
    this.onDivider = () => {};
    this.panes = 1;
    this.canvas = h("canvas", { tabindex: 0, role: "img", "aria-label": "The picture as the eye sees it" });
    this.progress = h("progress", { max: 1, value: 0, "aria-label": "Loading" });
    this.message = h("div", { class: "message", role: "alert", hidden: true });
    this.divider = this.#makeDivider();
    this.names = h("div", { class: "names", hidden: true });
    this.pane = h("div", { class: "pane" }, this.canvas, this.divider, this.names);
    this.stage = h("div", { class: "stage" }, this.progress, this.pane, this.message);
    this.title = h("h1", {}, "Lippmann");
    this.subtitle = h("p", { class: "subtitle" });
    this.themeButton = h("button", { type: "button", class: "quiet", onclick: () => this.#nextTheme() });
    const more = h(
      "button",
      { type: "button", class: "quiet more", onclick: () => root.classList.toggle("compact") },
      "Controls",
    );
    const head = h(
      "header",
      {},
      h("div", {}, this.title, this.subtitle),
      h("div", { class: "buttons" }, more, this.themeButton),
    );
    this.side = h("aside", { "aria-label": "Controls" });
    root.replaceChildren(h("div", { class: "page" }, head, this.stage, this.side));
    this.#setTheme(theme);
    this.watch = new ResizeObserver(onResize);
    this.watch.observe(this.stage);
  }

  /** Device pixels per CSS pixel. */
  get ratio() {
    return window.devicePixelRatio || 1;
  }

  begin(manifests, controls) {
    const [first] = manifests;
    this.title.textContent = manifests.map(({ name }) => name).join("  |  ");
    this.subtitle.textContent = first.display;
    this.canvas.setAttribute("aria-label", `${first.name} as the eye sees it; the arrow keys move the eye`);
    this.side.replaceChildren(controls);
    this.divider.hidden = this.names.hidden = manifests.length < 2;
    this.names.replaceChildren(...manifests.map(({ name }) => h("span", {}, name)));
  }

  /** Resizes the canvas to the largest size of this aspect (width / height) that fits the stage. */
  fit(aspect) {
    const box = this.stage.getBoundingClientRect();
    const style = getComputedStyle(this.stage);
    const room = box.width - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight);
    const high = box.height - parseFloat(style.paddingTop) - parseFloat(style.paddingBottom);
    const width = Math.max(1, Math.floor(Math.min(room, high * aspect) * this.ratio));
    const height = Math.max(1, Math.round(width / aspect));
    this.pane.style.width = `${width / this.ratio}px`;
    this.pane.style.height = `${height / this.ratio}px`;
    if (this.canvas.width === width && this.canvas.height === height) return;
    this.canvas.width = width;
    this.canvas.height = height;
  }

  showProgress(share) {
    this.progress.value = share;
    this.progress.hidden = share >= 1;
  }

  /** Displays a message in the middle of the page, or none (null). */
  showMessage(text) {
    this.message.hidden = text === null;
    this.message.textContent = text ?? "";
  }

  /** Places the divider at a share of the first of `panes` panes. */
  showDivider(share, panes) {
    this.panes = panes;
    this.divider.style.left = `${(100 * share) / panes}%`;
    this.divider.setAttribute("aria-valuenow", Math.round(100 * share));
  }

  destroy() {
    this.watch.disconnect();
    this.root.replaceChildren();
  }

  #makeDivider() {
    const move = (event) => {
      if (event.buttons === 0) return;
      const box = this.pane.getBoundingClientRect();
      this.onDivider(Math.min(1, Math.max(0, (this.panes * (event.clientX - box.left)) / box.width)));
    };
    const begin = (event) => {
      divider.setPointerCapture(event.pointerId);
      event.stopPropagation();
    };
    const step = (event) => {
      const by = { ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1 }[event.key];
      if (by === undefined) return;
      event.preventDefault();
      const now = Number(divider.getAttribute("aria-valuenow")) / 100;
      this.onDivider(Math.min(1, Math.max(0, now + by)));
    };
    const kind = {
      class: "divider",
      role: "slider",
      tabindex: 0,
      hidden: true,
      "aria-label": "Divider between the two pictures",
    };
    const range = { "aria-valuemin": 0, "aria-valuemax": 100, "aria-valuenow": 50 };
    const divider = h("div", { ...kind, ...range, onpointerdown: begin, onpointermove: move, onkeydown: step });
    return divider;
  }

  #nextTheme() {
    this.#setTheme(THEMES[(THEMES.indexOf(this.root.dataset.theme) + 1) % THEMES.length]);
  }

  #setTheme(theme) {
    this.root.dataset.theme = theme;
    this.themeButton.textContent = { auto: "Colours: auto", light: "Light", dark: "Dark" }[theme];
    this.themeButton.setAttribute("aria-label", `Colours: ${theme}`);
  }
}
