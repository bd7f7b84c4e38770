/** Files: models and environments dropped onto the page or opened, states saved and opened. */

import { h } from "lippmann/dom.js";

const ENVIRONMENTS = [".hdr", ".exr"];
const STATE = ".toml";

/** Largest file of a state in bytes. */
const MOST_STATE = 50_000;

export class Files {
  /** @param actions `opened(changes)`, `state(text)`, `fail(line)`, `busy(line or null)` */
  constructor(actions) {
    this.actions = actions;
    this.input = h("input", { type: "file", multiple: true, hidden: true, onchange: () => this.#chosen() });
    this.shade = h("div", { class: "drop-shade", hidden: true }, h("p", {}, "Drop a model, with the files it needs"));
    this.#listen();
  }

  /** Opens the dialog; the studio itself says which files it cannot read. */
  open(kinds = []) {
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

  /** Takes what was dropped or chosen together: pairs of a path, from the dropped folder on, and its file. */
  async take(found) {
    const shown = found.filter(([path]) => !path.split("/").some((part) => part.startsWith(".")));
    const [[path, file] = []] = shown;
    if (file === undefined) return;
    const isState = shown.length === 1 && file.name.toLowerCase().endsWith(STATE);
    if (!isState) await this.#upload(path.split("/")[0], withList(shown));
    else if (file.size > MOST_STATE) this.actions.fail(`${file.name}: this is too long for a state`);
    else this.actions.state(await file.text());
  }

  async #upload(name, body) {
    this.actions.busy(`Opening ${name}`);
    try {
      const headers = { "Content-Type": "application/octet-stream" };
      const response = await fetch("files", { method: "POST", headers, body });
      const answer = await response.json();
      if (answer.changes) this.actions.opened(answer.changes);
      else this.actions.fail(answer.error);
    } catch {
      this.actions.fail("The studio does not answer; is `lippmann studio` still running?");
    } finally {
      this.actions.busy(null);
    }
  }

  #chosen() {
    this.take([...this.input.files].map((file) => [file.name, file]));
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
      // Both lists are emptied once this listener returns.
      const files = [...event.dataTransfer.files];
      const entries = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
      const isFlat = !entries.some((entry) => entry.isDirectory);
      if (isFlat) this.take(files.map((file) => [file.name, file]));
      else Promise.all(entries.map(filesOf)).then((found) => this.take(found.flat()));
    });
  }
}

/** Creates a body of one or several files: a line that lists their names and sizes, and then the files. */
function withList(found) {
  const list = JSON.stringify(found.map(([path, file]) => [path, file.size]));
  return new Blob([`${list}\n`, ...found.map(([, file]) => file)]);
}

/** Finds the files of a dropped entry, with their paths from it on. */
async function filesOf(entry) {
  const path = entry.fullPath.replace(/^\//, "");
  if (entry.isFile) return [[path, await new Promise((resolve, reject) => entry.file(resolve, reject))]];
  const reader = entry.createReader();
  const found = [];
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) return found;
    for (const each of some) found.push(...(await filesOf(each)));
  }
}
