/**
 * The display's geometry as numbers for the shaders: all that is seen depends linearly on whole numbers (the pixel of
 * the pane, the lens), so a few coefficients in double precision describe it. Formulas of display/display.py,
 * display/lattice.py and replay.py; millimetres, x to the right, y up, z toward the viewer.
 */

import { exact } from "lippmann/fixed.js";

export const LAYOUTS = { lenticular: 0, square: 1, hexagonal: 2 };

/** Parts of a pixel by which a point may miss a boundary and still count as lying on it, as in replay.py. */
const ON_BOUNDARY = 1e-6;

/** Parts of a lens by which a point may miss a boundary between lenses: above what the shader rounds off. */
const ON_LENS_BOUNDARY = 5e-7;

/** An eye so far away (mm) counts as infinitely far, as in replay.py. */
const FAR = 1e12;

/**
 * Coefficients of what an eye sees.
 *
 * @param optics the manifest
 * @param eye {x, y, z}, z > 0
 * @param plane z of the plane whose points are looked at (0: the lens plane), below the eye
 * @param frame the part of the panel's rectangle that fills the pane, in panel pixels
 * @param width, height pixels of the pane
 */
export function sightline(optics, eye, plane, frame, width, height) {
  const { panel, lenses, gap } = optics;
  const d = panel.pixel_pitch;
  // Points of the plane behind the pane's pixels, then on along the line of sight to the lens plane.
  const stretch = plane / (eye.z - plane);
  const stepX = (frame.width / width) * d * (1 + stretch);
  const stepY = (-frame.height / height) * d * (1 + stretch);
  const left = (frame.x + (0.5 * frame.width) / width - panel.width / 2) * d * (1 + stretch) - eye.x * stretch;
  const top = (panel.height / 2 - frame.y - (0.5 * frame.height) / height) * d * (1 + stretch) - eye.y * stretch;
  const share = gap / eye.z;
  const beyond = (1 + share) / d;
  const { pitch, row_pitch: rowPitch } = lenses;
  const middle = 0.5 + ON_LENS_BOUNDARY;
  const [originX, originY] = lenses.origin;
  const shiftU = panel.width / 2 - (eye.x * share) / d;
  const shiftV = panel.height / 2 + (eye.y * share) / d;
  if (lenses.layout !== "lenticular") {
    const isSquare = lenses.layout === "square";
    return {
      across: exact([stepX / pitch, 0, (left - originX) / pitch + middle]),
      down: exact([-stepY / rowPitch, (originY - top) / rowPitch + (isSquare ? middle : ON_LENS_BOUNDARY)]),
      panelU: exact([pitch * beyond, isSquare ? 0 : 0.5 * pitch * beyond, 0, originX * beyond + shiftU]),
      panelV: exact([rowPitch * beyond, shiftV - originY * beyond]),
      slide: 0,
    };
  }
  const [sin, cos] = axis(lenses);
  const along = [stepX * sin, stepY * cos, left * sin + top * cos];
  // What is seen through the axis lies beside what lies behind the point itself, by the point's place across the lens.
  const slide = pitch * sin * beyond;
  const center = (left * cos - top * sin - originX) / pitch + middle;
  return {
    across: exact([(stepX * cos) / pitch, (-stepY * sin) / pitch, center]),
    down: exact([0, 0]),
    panelU: exact([
      pitch * cos * beyond,
      along[0] * sin * beyond,
      along[1] * sin * beyond,
      (originX * cos + along[2] * sin) * beyond + shiftU,
    ]),
    panelV: exact([-stepY * beyond, shiftV - top * beyond + 0.5 * slide]),
    slide,
  };
}

/**
 * Where the grid of each colour lies: what to add to panel coordinates for red, green and blue, so that whole numbers
 * are its boundaries. With uneven cells only the boundary's tolerance.
 */
export function channelPlaces(optics) {
  const { cells, uneven } = optics.panel;
  const offsets = uneven
    ? [
        [0, 0],
        [0, 0],
        [0, 0],
      ]
    : cells[0][0];
  return {
    channelRight: offsets.map(([right]) => ON_BOUNDARY - right),
    channelDown: offsets.map(([, below]) => ON_BOUNDARY - below),
  };
}

/** Which lens a panel point belongs to, and which pixel of each micro-image the eye sees: for the magnifier. */
export function microImages(optics, eye) {
  const { panel, lenses, gap, magnification } = optics;
  const d = panel.pixel_pitch;
  const { pitch, row_pitch: rowPitch } = lenses;
  const middle = 0.5 + ON_LENS_BOUNDARY;
  const [originX, originY] = lenses.origin;
  const toLens = d / magnification;
  const left = (-panel.width / 2) * toLens;
  const top = (panel.height / 2) * toLens;
  const share = gap / eye.z;
  const shiftU = panel.width / 2 - (eye.x * share) / d + ON_BOUNDARY;
  const shiftV = panel.height / 2 + (eye.y * share) / d + ON_BOUNDARY;
  const beyond = (1 + share) / d;
  if (lenses.layout !== "lenticular") {
    const isSquare = lenses.layout === "square";
    return {
      acrossOf: exact([toLens / pitch, 0, (left - originX) / pitch + middle]),
      downOf: exact([0, toLens / rowPitch, (originY - top) / rowPitch + (isSquare ? middle : ON_LENS_BOUNDARY)]),
      gradients: [toLens / pitch, 0, 0, toLens / rowPitch],
      seenU: exact([pitch * beyond, isSquare ? 0 : 0.5 * pitch * beyond, originX * beyond + shiftU]),
      seenV: exact([rowPitch * beyond, shiftV - originY * beyond]),
    };
  }
  const [sin, cos] = axis(lenses);
  const [perColumn, perRow] = [(toLens * cos) / pitch, (toLens * sin) / pitch];
  // The eye sees the middle of a pixel row through the height c_y = (y + e_y share) / (1 + share) of the lens plane.
  const slope = sin / cos;
  const firstY = (panel.height / 2 - 0.5) * d;
  return {
    acrossOf: exact([perColumn, perRow, (left * cos - top * sin - originX) / pitch + middle]),
    downOf: exact([0, 0, 0]),
    gradients: [perColumn, perRow, 0, 0],
    seenU: exact([
      (pitch / cos) * beyond,
      -slope,
      (originX / cos) * beyond + (slope * (firstY + eye.y * share)) / d + shiftU,
    ]),
    seenV: exact([0, 0]),
  };
}

/** The eyes that see one view each through all lenses at once; eye_of_offset of replay.py. */
export function eyesOfViews(optics) {
  const { panel, lenses, gap, viewing_distance: distance, views } = optics;
  const z = distance ?? FAR;
  const scale = (-panel.pixel_pitch * z) / gap;
  return views.down.flatMap((below) =>
    views.right.map((right) => {
      if (lenses.layout !== "lenticular") return { x: right * scale, y: -below * scale, z };
      const [sin, cos] = axis(lenses);
      const across = right * scale * cos;
      return { x: across * cos, y: -across * sin, z };
    }),
  );
}

/** Half the width (mm) of the field in which the middle lens shows its own micro-image, at a distance. */
export function halfField(optics, distance) {
  return (0.5 * distance * optics.micro_image_pitch) / optics.gap;
}

/**
 * How many micro-images beside its own the lenses at the panel's edges show to an eye: [fewest, most]. Both 0: every
 * lens shows its own, the eye is in the field. Both k: the picture has flipped k times. Else part of it has.
 */
export function flips(optics, eye) {
  const { panel, lenses, gap, micro_image_pitch: pitch, viewing_distance: distance } = optics;
  const [sin, cos] = lenses.layout === "lenticular" ? axis(lenses) : [0, 1];
  const convergence = distance === null ? 0 : 1 / distance;
  const beside = (place, from) => Math.round((gap * (place * (1 / eye.z - convergence) - from / eye.z)) / pitch);
  const [halfWidth, halfHeight] = [panel.width, panel.height].map((count) => 0.5 * count * panel.pixel_pitch);
  const edge = halfWidth * cos + halfHeight * Math.abs(sin);
  const counts = [-edge, edge].map((place) => beside(place, eye.x * cos - eye.y * sin));
  if (lenses.layout !== "lenticular") counts.push(...[-halfHeight, halfHeight].map((place) => beside(place, eye.y)));
  // In front of an array a flip sideways and one up or down are flips alike.
  return counts.every((count) => count === 0) ? [0, 0] : range(counts.map(Math.abs));
}

function range(values) {
  return [Math.min(...values), Math.max(...values)];
}

function axis(lenses) {
  const angle = (lenses.slant * Math.PI) / 180;
  return [Math.sin(angle), Math.cos(angle)];
}
