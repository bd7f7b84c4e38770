/** The state that the page edits, with undo and redo. Values are addressed by dotted paths, such as "light.strength". */

/** Milliseconds within which changes of one path count as one step of undo. */
const SAME_STEP = 700;
const MOST_STEPS = 200;

export class Store {
  #past = [];
  #future = [];
  #last = { path: null, time: 0 };
  #isHeld = false;
  #listeners = new Set();

  constructor(state) {
    this.state = state;
  }

  get(path) {
    return path.split(".").reduce((value, name) => value?.[name], this.state);
  }

  /** Sets values by path as one step of undo. */
  set(changes) {
    const paths = Object.keys(changes).join(" ");
    const now = performance.now();
    const isSame = paths === this.#last.path && (this.#isHeld || now - this.#last.time < SAME_STEP);
    if (!isSame) this.#push(this.#past, this.state);
    this.#future = [];
    this.#last = { path: paths, time: now };
    let next = this.state;
    for (const [path, value] of Object.entries(changes)) next = withValue(next, path.split("."), value);
    this.state = next;
    this.#tell();
  }

  /** While a drag is held its changes are one step, however long it takes. */
  hold(isHeld) {
    this.#isHeld = isHeld;
    if (isHeld) this.#last.path = null;
  }

  /** Takes over a state as a step of undo. */
  replace(state) {
    this.#push(this.#past, this.state);
    this.#future = [];
    this.#last.path = null;
    this.state = state;
    this.#tell();
  }

  /** Takes over a state that the studio has corrected, without a step of undo. */
  adopt(state) {
    this.state = state;
    this.#tell(false);
  }

  undo() {
    this.#step(this.#past, this.#future);
  }

  redo() {
    this.#step(this.#future, this.#past);
  }

  get canUndo() {
    return this.#past.length > 0;
  }

  get canRedo() {
    return this.#future.length > 0;
  }

  /** Calls `listener(state, isOwn)` after every change; `isOwn` is false for what the studio itself sent. */
  listen(listener) {
    this.#listeners.add(listener);
  }

  #step(from, to) {
    if (from.length === 0) return;
    this.#push(to, this.state);
    this.state = from.pop();
    this.#last.path = null;
    this.#tell();
  }

  #push(steps, state) {
    steps.push(state);
    if (steps.length > MOST_STEPS) steps.shift();
  }

  #tell(isOwn = true) {
    for (const listener of this.#listeners) listener(this.state, isOwn);
  }
}

function withValue(object, [name, ...rest], value) {
  return { ...object, [name]: rest.length === 0 ? value : withValue(object?.[name] ?? {}, rest, value) };
}
