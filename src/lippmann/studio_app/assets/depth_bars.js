/** Depth bars: how far the scene reaches out of the display and behind it, beside what is sharp, or comfortable. */

import { h } from "lippmann/dom.js";

const SVG = "http://www.w3.org/2000/svg";
const [WIDTH, HEIGHT] = [300, 86];
/** Half of the drawing's margin, and the share of it that the larger of both ranges takes. */
const MARGIN = 14;

export function depthBars() {
  const svg = node("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, class: "depth", role: "img" });
  const note = h("p", { class: "note", "aria-live": "polite" });
  const element = h("div", { class: "depth-bars" }, svg, note);

  /**
   * @param depth `{ scene: [back, front], sharp: [back, front] }` in mm toward the viewer; an end may be null
   * @param isEyeTracked whether each eye has a picture of its own: all depths are sharp then, and those beyond `sharp`
   *   strain the eyes
   */
  function show({ scene, sharp }, isEyeTracked) {
    const ends = [...scene, ...sharp].filter((value) => value !== null);
    const reach = 1.08 * Math.max(1e-3, ...ends.map(Math.abs));
    const at = (z) => WIDTH / 2 + (Math.max(-reach, Math.min(reach, z ?? Infinity)) / reach) * (WIDTH / 2 - MARGIN);
    const [back, front] = scene;
    const [sharpBack, sharpFront] = [sharp[0] ?? -reach, sharp[1] ?? reach];
    const parts = [
      [back, Math.min(front, sharpBack), "blurred"],
      [Math.max(back, sharpBack), Math.min(front, sharpFront), "clear"],
      [Math.max(back, sharpFront), front, "blurred"],
    ].filter(([from, to]) => to > from);
    svg.replaceChildren(
      bar(at(sharpBack), at(sharpFront), 30, 26, "depth-zone"),
      ...parts.map(([from, to, kind]) => bar(at(from), at(to), 37, 12, `depth-${kind}`)),
      node("line", { x1: WIDTH / 2, x2: WIDTH / 2, y1: 20, y2: 66, class: "depth-plane" }),
      text(WIDTH / 2, 13, "lens plane", "middle"),
      text(MARGIN, 13, "behind", "start"),
      text(WIDTH - MARGIN, 13, "in front", "end"),
      text(at(back), 80, `${Math.abs(back).toFixed(0)} mm`, back < -0.55 * reach ? "start" : "middle"),
      text(at(front), 80, `${Math.abs(front).toFixed(0)} mm`, front > 0.55 * reach ? "end" : "middle"),
    );
    const words = sentence(scene, [sharpBack, sharpFront], isEyeTracked);
    note.textContent = words;
    svg.setAttribute("aria-label", `${words} The scene reaches from ${back.toFixed(1)} to ${front.toFixed(1)} mm.`);
  }
  return { element, show };
}

/** One sentence that says which parts blur, or strain the eyes. */
export function sentence([back, front], [sharpBack, sharpFront], isEyeTracked) {
  const isBlurredBehind = back < sharpBack - 0.05;
  const isBlurredBefore = front > sharpFront + 0.05;
  const [good, bad] = isEyeTracked ? ["comfortable", "strain the eyes"] : ["sharp", "blur"];
  const range = `from ${-sharpBack.toFixed(0)} mm behind to ${sharpFront.toFixed(0)} mm in front.`;
  const sharp = `${good[0].toUpperCase()}${good.slice(1)} ${range}`;
  if (isBlurredBehind && isBlurredBefore) return `${sharp} The nearest and the farthest parts ${bad}.`;
  if (isBlurredBehind) return `${sharp} The farthest parts ${bad}.`;
  if (isBlurredBefore) return `${sharp} The nearest parts ${bad}.`;
  return `All of the scene is ${good} on this display.`;
}

const bar = (from, to, y, height, name) =>
  node("rect", { x: Math.min(from, to), width: Math.max(1, Math.abs(to - from)), y, height, rx: 3, class: name });

function text(x, y, words, anchor) {
  const created = node("text", { x, y, "text-anchor": anchor, class: "depth-text" });
  created.textContent = words;
  return created;
}

function node(name, attributes) {
  const created = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) created.setAttribute(key, value);
  return created;
}
