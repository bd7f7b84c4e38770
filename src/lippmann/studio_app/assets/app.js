/** The studio's page: joins the picture, the controls and the connection. */

import { Connection } from "studio/connection.js";
import { Files } from "studio/files.js";
import { TOOLS, listen, listenToKeys } from "studio/gestures.js";
import { Jobs } from "studio/jobs.js";
import { buildPage } from "studio/layout.js";
import { Panel, turned } from "studio/panel.js";
import { Stage } from "studio/stage.js";
import { Store } from "studio/store.js";

const SIZE_LIMITS = [0.05, 50];
/** Decimals of millimetres that a drag moves by. */
const MOVE_DECIMALS = 100;

const address = new URL("live", location.href);
address.protocol = address.protocol.replace("http", "ws");

class Studio {
  constructor(root) {
    this.tool = "eye";
    this.page = buildPage(root, this);
    this.files = new Files({
      opened: (changes) => this.#open(changes),
      state: (text) => this.connection.send({ type: "open", text }),
      fail: (line) => this.page.fail(line),
      busy: (line) => this.page.busy(line),
    });
    root.append(this.files.input, this.files.shade);
    this.jobs = new Jobs({
      onrender: (kind) => this.#sendState({ type: "render", kind }),
      send: (message) => this.connection.send(message),
      result: this.page.result,
      onpanel: (number) => this.openPanel(`result=${number}`),
    });
    this.page.placeJobs(this.jobs);
    this.stage = new Stage(this.page.stage, this.page.canvas, {
      onview: () => this.#ask(),
      onstatus: (header) => this.page.showFrame(header),
      onmode: () => this.page.showMode(this),
    });
    listen(this.page.canvas, this);
    listenToKeys(this);
    this.connection = new Connection(address, {
      onState: (state) => this.page.showConnection(state),
      onFrame: (header, picture) => this.stage.draw(header, picture),
      onMessage: (message) => this.#take(message),
    });
    this.page.showMode(this);
  }

  // ---- What the studio says -----------------------------------------------------------------------------------------

  #take(message) {
    const take = {
      hello: () => this.#begin(message),
      facts: () => this.#showFacts(message),
      state: () => this.store.replace(message.state),
      saved: () => this.files.save(message.name, message.text),
      picked: () => this.#putIntoPlane(message.depth),
      job: () => this.jobs.showJob(message),
      busy: () => this.page.busy(message.line),
      error: () => this.page.fail(message.line),
    }[message.type];
    take?.();
  }

  #begin(hello) {
    // After a lost connection the page's own state goes on.
    if (this.store === undefined) {
      this.store = new Store(hello.state);
      this.store.listen(() => this.#changed());
      this.panel = new Panel(this.store, hello, { onenvironment: () => this.files.openEnvironment() });
      this.page.begin(this.panel, hello);
    }
    this.stage.setOptics(hello.optics);
    this.panel.show(this.store.state);
    this.page.showHistory(this.store);
    this.#ask();
  }

  #showFacts(facts) {
    if (facts.optics !== null) this.stage.setOptics(facts.optics);
    this.panel.showFacts(facts);
    this.page.showCommand(facts.command, facts.title);
    this.page.showNative(!facts.eye_tracked);
    this.jobs.showSettings(facts.command);
  }

  #changed() {
    this.page.fail(null);
    this.panel.show(this.store.state);
    this.page.showHistory(this.store);
    this.#ask();
  }

  #ask() {
    if (this.store !== undefined && this.stage.optics !== null) {
      this.connection.want({ state: this.store.state, ...this.stage.view() });
    }
  }

  /** Sends a message with the state that this page shows: the studio's last one may be another page's. */
  #sendState(message) {
    if (this.store !== undefined) this.connection.send({ ...message, state: this.store.state });
  }

  #putIntoPlane(depth) {
    if (depth === null) return this.page.fail("There is nothing at this place");
    const [x, y, z] = this.store.state.shift;
    return this.store.set({ shift: [x, y, Math.round(MOVE_DECIMALS * (z - depth)) / MOVE_DECIMALS] });
  }

  /** Shows what was dropped; another model is seen from the front. */
  #open(changes) {
    if ("scene" in changes) this.stage.center();
    this.store?.set(changes);
  }

  // ---- What the user does -------------------------------------------------------------------------------------------

  setTool(name) {
    this.tool = name;
    this.stage.setNative(false);
    this.page.showMode(this);
  }

  isNative = () => this.stage.isNative;
  isCovered = () => this.jobs.isShown;
  currentTool = () => this.tool;
  look = (place) => this.stage.look(place);
  step = (right, up) => this.stage.step(right, up);
  approach = (factor) => this.stage.approach(factor);
  center = () => this.stage.center();
  scroll = (right, up) => this.stage.scroll(right, up);
  zoom = (factor, place) => this.stage.zoom(factor, place);
  hold = (isHeld) => this.store?.hold(isHeld);
  undo = () => this.store?.undo();
  redo = () => this.store?.redo();
  sway = () => this.stage.setSwaying(!this.stage.isSwaying);
  native = () => this.stage.setNative(!this.stage.isNative);
  real = () => this.stage.hasLens && this.stage.setReal(!this.stage.isReal);
  render = () => this.jobs.start();
  help = () => this.page.help.showModal();
  save = () => this.#sendState({ type: "save" });

  turn(right, up, around) {
    this.store?.set({ turn: turned(this.store.state.turn, [right, up, around]) });
  }

  move(right, up) {
    const [width, height] = this.stage.halfSize;
    this.#shift([right * width, up * height, 0]);
  }

  moveDeep(toward) {
    this.#shift([0, 0, toward * this.stage.halfSize[1]]);
  }

  size(factor) {
    if (this.store === undefined) return;
    const scale = this.store.state.scale * factor;
    this.store.set({ scale: Number(Math.max(SIZE_LIMITS[0], Math.min(SIZE_LIMITS[1], scale)).toFixed(4)) });
  }

  pick({ x, y }) {
    this.connection.send({ type: "pick", place: [(x + 1) / 2, (1 - y) / 2] });
  }

  /** Opens the window for the panel itself: live, or with a result. */
  openPanel(what = "live") {
    window.open(`panel?${what}`, "lippmann-panel", "popup");
  }

  #shift(by) {
    if (this.store === undefined) return;
    const shift = this.store.state.shift.map((value, axis) => value + by[axis]);
    this.store.set({ shift: shift.map((value) => Math.round(MOVE_DECIMALS * value) / MOVE_DECIMALS) });
  }
}

window.lippmann = { studio: new Studio(document.querySelector("main")), tools: TOOLS };
