/** Where the eye may be, how it glides there, and how it sways. */

import { halfField } from "lippmann/optics.js";

/** How much farther than to the edge of the field the pointer leads, so that the flips beyond are seen. */
const BEYOND_FIELD = 1.3;

/** Share of the field that swaying uses, and seconds of one sway. */
const SWAY_SHARE = 0.85;
const SWAY_SECONDS = 6;

/** Share of the way to its goal that the eye has left after a second of gliding. */
const GLIDE = 1e-6;

/** Bounds of the eye's place, mm, for sliders and for what people do; tests and programs may leave them. */
export function eyeBounds(optics) {
  const [, , z] = optics.eye;
  const [nearest, farthest] = [0.25 * z, 4 * z];
  const aside = 2.5 * halfField(optics, z);
  return { x: aside, y: aside, nearest, farthest };
}

/** The eye for a place in the pane: -1 to 1 from left to right and from bottom to top. */
export function eyeAt(optics, z, right, up) {
  const reach = BEYOND_FIELD * halfField(optics, z);
  return { x: right * reach, y: up * reach, z };
}

export function bounded(eye, bounds) {
  const within = (value, low, high) => Math.min(high, Math.max(low, value));
  return {
    x: within(eye.x, -bounds.x, bounds.x),
    y: within(eye.y, -bounds.y, bounds.y),
    z: within(eye.z, bounds.nearest, bounds.farthest),
  };
}

/** The eye on its way after some seconds; the goal itself once it is as near as a hundredth of a millimetre. */
export function glided(eye, goal, seconds) {
  const left = GLIDE ** seconds;
  const next = {};
  let farthest = 0;
  for (const axis of ["x", "y", "z"]) {
    next[axis] = goal[axis] + (eye[axis] - goal[axis]) * left;
    farthest = Math.max(farthest, Math.abs(next[axis] - goal[axis]));
  }
  return farthest < 0.01 ? goal : next;
}

/** The swaying eye: from side to side; in front of round lenses also up and down, twice as quickly. */
export function swaying(optics, z, seconds) {
  const turn = (2 * Math.PI * seconds) / SWAY_SECONDS;
  const reach = SWAY_SHARE * halfField(optics, z);
  const up = optics.lenses.layout === "lenticular" ? 0 : 0.4 * Math.sin(2 * turn);
  return { x: reach * Math.sin(turn), y: reach * up, z };
}

/** Seconds after which {@link swaying} is where the eye is, so that playing begins without a jump. */
export function swayStart(optics, eye) {
  const share = eye.x / (SWAY_SHARE * halfField(optics, eye.z));
  return (Math.asin(Math.min(1, Math.max(-1, share))) * SWAY_SECONDS) / (2 * Math.PI);
}
