/** Files: models and environments dropped onto the page or opened, states saved and opened. */

import { h } from "lippmann/dom.js";

const MODELS = [".glb", ".obj", ".stl", ".ply"];
const ENVIRONMENTS = [".hdr", ".exr"];
const STATE = ".toml";

/** Largest file of a state in bytes. */
const MOST_STATE = 50_000;

export class Files {
  /** @param actions `scene(path)`, `environment(path)`, `state(text)`, `fail(line)`, `busy(line or null)` */
  constructor(actions) {
    this.actions = actions;
    this.input = h("input", { type: "file", hidden: true, onchange: () => this.#chosen() });
    this.shade = h("div", { class: "drop-shade", hidden: true }, h("p", {}, "Drop a model: GLB, OBJ, STL or PLY"));
    this.#listen();
  }

  open(kinds = [...MODELS, STATE]) {
    this.input.accept = kinds.join(",");
    this.input.value = "";
    this.input.click();
  }

  openEnvironment() {
    this.open(ENVIRONMENTS);
  }

  /** Saves text as a file of the browser's user. */
  save(name, text) {
    const address = URL.createObjectURL(new Blob([text], { type: "application/toml" }));
    h("a", { href: address, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(address), 1000);
  }

  async take(file) {
    const name = file.name.toLowerCase();
    const is = (endings) => endings.some((ending) => name.endsWith(ending));
    if (is([STATE])) {
      if (file.size > MOST_STATE) this.actions.fail(`${file.name}: this is too long for a state`);
      else this.actions.state(await file.text());
    } else if (is(MODELS) || is(ENVIRONMENTS)) await this.#upload(file, is(MODELS) ? "scene" : "environment");
    else this.actions.fail(`${file.name}: this cannot be opened; GLB, OBJ, STL, PLY, HDR, EXR and TOML can`);
  }

  async #upload(file, kind) {
    this.actions.busy(`Opening ${file.name}`);
    try {
      const response = await fetch(`files/${encodeURIComponent(file.name)}`, {
        method: "POST",
        headers: { "Content-Type": "application/octet-stream" },
        body: file,
      });
      const answer = await response.json();
      if (response.ok) this.actions[kind](answer.path);
      else this.actions.fail(answer.error);
    } catch {
      this.actions.fail("The studio does not answer; is `lippmann studio` still running?");
    } finally {
      this.actions.busy(null);
    }
  }

  #chosen() {
    const [file] = this.input.files;
    if (file) this.take(file);
  }

  #listen() {
    let depth = 0;
    const hasFiles = (event) => event.dataTransfer?.types.includes("Files");
    document.addEventListener("dragenter", (event) => {
      if (!hasFiles(event)) return;
      depth += 1;
      this.shade.hidden = false;
    });
    document.addEventListener("dragleave", () => {
      depth = Math.max(0, depth - 1);
      this.shade.hidden = depth === 0;
    });
    document.addEventListener("dragover", (event) => {
      if (hasFiles(event)) event.preventDefault();
    });
    document.addEventListener("drop", (event) => {
      event.preventDefault();
      depth = 0;
      this.shade.hidden = true;
      const [file] = event.dataTransfer.files;
      if (file) this.take(file);
    });
  }
}
