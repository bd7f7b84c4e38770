/** Position of the eye: its limits, gliding to a goal, and swaying. */

import { halfField } from "lippmann/optics.js";

/** Reach of the pointer in half widths of the view zone: a little more than 1, to show the flip at its edge. */
const POINTER_REACH = 1.3;

/** Amplitude of swaying in half widths of the view zone, and its period in seconds. */
const SWAY_SHARE = 0.85;
const SWAY_SECONDS = 6;

/** Share of the distance to the goal that remains after a second of gliding. */
const GLIDE = 1e-6;

/** Limits of the eye's position in mm, for controls and input; `setEye` is not limited. */
export function eyeBounds(optics) {
  const [, , z] = optics.eye;
  const [nearest, farthest] = [0.25 * z, 4 * z];
  const aside = 2.5 * halfField(optics, z);
  return { x: aside, y: aside, nearest, farthest };
}

/** Eye position at distance `z` for a point of the pane, -1 to 1 right and up. */
export function eyeAt(optics, z, right, up) {
  const reach = POINTER_REACH * halfField(optics, z);
  return { x: right * reach, y: up * reach, z };
}

/** The eye position clamped to `bounds`. */
export function clampEye(eye, bounds) {
  const within = (value, low, high) => Math.min(high, Math.max(low, value));
  return {
    x: within(eye.x, -bounds.x, bounds.x),
    y: within(eye.y, -bounds.y, bounds.y),
    z: within(eye.z, bounds.nearest, bounds.farthest),
  };
}

/** Eye position after some seconds of gliding; the goal itself once it is within a hundredth of a millimetre. */
export function glideEye(eye, goal, seconds) {
  const left = GLIDE ** seconds;
  const next = {};
  let farthest = 0;
  for (const axis of ["x", "y", "z"]) {
    next[axis] = goal[axis] + (eye[axis] - goal[axis]) * left;
    farthest = Math.max(farthest, Math.abs(next[axis] - goal[axis]));
  }
  return farthest < 0.01 ? goal : next;
}

/** Eye position while swaying: sideways; in front of a lens array also vertically, at twice the frequency. */
export function swayEye(optics, z, seconds) {
  const turn = (2 * Math.PI * seconds) / SWAY_SECONDS;
  const reach = SWAY_SHARE * halfField(optics, z);
  const up = optics.lenses.layout === "lenticular" ? 0 : 0.4 * Math.sin(2 * turn);
  return { x: reach * Math.sin(turn), y: reach * up, z };
}

/** Time in seconds at which {@link swayEye} is nearest to the eye, so that swaying starts without a jump. */
export function swayStart(optics, eye) {
  const share = eye.x / (SWAY_SHARE * halfField(optics, eye.z));
  return (Math.asin(Math.min(1, Math.max(-1, share))) * SWAY_SECONDS) / (2 * Math.PI);
}
