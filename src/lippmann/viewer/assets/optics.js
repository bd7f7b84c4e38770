/**
 * Geometry of the display as coefficients for the shaders. Visible points depend linearly on integers (pixel of the
 * pane, lens), so a few coefficients in double precision describe them. Formulas of display/display.py,
 * display/lattice.py and viewing/replay.py; millimetres, x to the right, y up, z toward the viewer.
 */

import { fixedPoint } from "lippmann/fixed.js";

export const LAYOUTS = { lenticular: 0, square: 1, hexagonal: 2 };

/** Tolerance in pixels within which a point lies on a pixel boundary, as in replay.py. */
const ON_BOUNDARY = 1e-6;

/** Tolerance in lenses within which a point lies on a lens boundary; exceeds the rounding error of the shader. */
const ON_LENS_BOUNDARY = 5e-7;

/** Distance in mm that stands for infinity, as in replay.py. */
const FAR = 1e12;

/**
 * Coefficients of the panel point that an eye sees behind each pixel of a pane.
 *
 * @param optics the manifest
 * @param eye {x, y, z}, z > 0
 * @param plane z of the focus plane (0: the lens plane), below the eye's
 * @param frame the part of the panel's rectangle that fills the pane, in panel pixels
 * @param width, height pixels of the pane
 */
export function sightline(optics, eye, plane, frame, width, height) {
  const { panel, lenses, gap } = optics;
  const d = panel.pixel_pitch;
  // Points of the plane at the pane's pixels, then along the line of sight to the lens plane.
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
      across: fixedPoint([stepX / pitch, 0, (left - originX) / pitch + middle]),
      down: fixedPoint([-stepY / rowPitch, (originY - top) / rowPitch + (isSquare ? middle : ON_LENS_BOUNDARY)]),
      panelU: fixedPoint([pitch * beyond, isSquare ? 0 : 0.5 * pitch * beyond, 0, originX * beyond + shiftU]),
      panelV: fixedPoint([rowPitch * beyond, shiftV - originY * beyond]),
      slide: 0,
    };
  }
  const [sin, cos] = axis(lenses);
  const along = [stepX * sin, stepY * cos, left * sin + top * cos];
  // Shift along v between the two edges of a slanted lens, whose axis the eye looks through.
  const slide = pitch * sin * beyond;
  const center = (left * cos - top * sin - originX) / pitch + middle;
  return {
    across: fixedPoint([(stepX * cos) / pitch, (-stepY * sin) / pitch, center]),
    down: fixedPoint([0, 0]),
    panelU: fixedPoint([
      pitch * cos * beyond,
      along[0] * sin * beyond,
      along[1] * sin * beyond,
      (originX * cos + along[2] * sin) * beyond + shiftU,
    ]),
    panelV: fixedPoint([-stepY * beyond, shiftV - top * beyond + 0.5 * slide]),
    slide,
  };
}

/**
 * Offsets of the red, green and blue sub-pixel grids: added to panel coordinates they make integers the grid's
 * boundaries. With uneven cells they are the tolerance alone.
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

/** Coefficients of the lens of a panel point, and of the pixel that the eye sees in each micro-image. */
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
      acrossOf: fixedPoint([toLens / pitch, 0, (left - originX) / pitch + middle]),
      downOf: fixedPoint([0, toLens / rowPitch, (originY - top) / rowPitch + (isSquare ? middle : ON_LENS_BOUNDARY)]),
      gradients: [toLens / pitch, 0, 0, toLens / rowPitch],
      visibleU: fixedPoint([pitch * beyond, isSquare ? 0 : 0.5 * pitch * beyond, originX * beyond + shiftU]),
      visibleV: fixedPoint([rowPitch * beyond, shiftV - originY * beyond]),
    };
  }
  const [sin, cos] = axis(lenses);
  const [perColumn, perRow] = [(toLens * cos) / pitch, (toLens * sin) / pitch];
  // The eye sees the middle of a pixel row through the height c_y = (y + e_y share) / (1 + share) of the lens plane.
  const slope = sin / cos;
  const firstY = (panel.height / 2 - 0.5) * d;
  return {
    acrossOf: fixedPoint([perColumn, perRow, (left * cos - top * sin - originX) / pitch + middle]),
    downOf: fixedPoint([0, 0, 0]),
    gradients: [perColumn, perRow, 0, 0],
    visibleU: fixedPoint([
      (pitch / cos) * beyond,
      -slope,
      (originX / cos) * beyond + (slope * (firstY + eye.y * share)) / d + shiftU,
    ]),
    visibleV: fixedPoint([0, 0]),
  };
}

/**
 * What a real lens does to the visible point: its offset from the lens's centre, per lens and at 0, across and down in
 * mm behind a pinhole; pixels by which a millimetre across moves the point to the right and down. Null of a pinhole.
 */
export function bending(optics, eye) {
  const { panel, lenses, gap, distortion } = optics;
  if (distortion === null) return null;
  const share = gap / eye.z;
  const { reach, factors } = distortion.place;
  const table = { factors, perReach: (factors.length - 1) / reach };
  const [originX, originY] = lenses.origin;
  if (lenses.layout !== "lenticular") {
    const across = [lenses.pitch * share, (originX - eye.x) * share];
    const perMillimetre = 1 / panel.pixel_pitch;
    const beside = [...across, lenses.row_pitch * share, (eye.y - originY) * share];
    return { ...table, beside, moves: [perMillimetre, perMillimetre] };
  }
  const [sin, cos] = axis(lenses);
  const across = [lenses.pitch * share, (originX - eye.x * cos + eye.y * sin) * share];
  return { ...table, beside: [...across, 0, 0], moves: [cos / panel.pixel_pitch, sin / panel.pixel_pitch] };
}

/** Places of lenses and eye in mm, across and along cylinders or right and up: what the light of real lenses needs. */
export function lensPlaces(optics, eye, frame, width, height) {
  const { panel, lenses } = optics;
  const [originX, originY] = lenses.origin;
  if (lenses.layout !== "lenticular") {
    const centerOf = [lenses.pitch, originX, -lenses.row_pitch, originY];
    return { centerOf, alongOf: [0, 0, 0], eyeAt: [eye.x, eye.y, eye.z], axis: [0, 1] };
  }
  const [sin, cos] = axis(lenses);
  const d = panel.pixel_pitch;
  const [stepX, stepY] = [(frame.width / width) * d, (-frame.height / height) * d];
  const left = (frame.x + (0.5 * frame.width) / width - panel.width / 2) * d;
  const top = (panel.height / 2 - frame.y - (0.5 * frame.height) / height) * d;
  return {
    centerOf: [lenses.pitch, originX, 0, 0],
    alongOf: [stepX * sin, stepY * cos, left * sin + top * cos],
    eyeAt: [eye.x * cos - eye.y * sin, eye.x * sin + eye.y * cos, eye.z],
    axis: [sin, cos],
  };
}

/** Display.pinhole_offset: pixels right and down of a lens's centre at which a pinhole has the same direction. */
function pinholeOffset(optics, right, below) {
  const { panel, lenses, distortion } = optics;
  if (distortion === null) return [right, below];
  const { reach, factors } = distortion.pinhole;
  const [sin, cos] = lenses.layout === "lenticular" ? axis(lenses) : [0, 1];
  const isRound = lenses.layout !== "lenticular";
  const across = right * cos + below * sin;
  const distance = isRound ? Math.hypot(right, below) : Math.abs(across);
  const at = Math.min((distance * panel.pixel_pitch) / reach, 1) * (factors.length - 1);
  const first = Math.min(Math.floor(at), factors.length - 2);
  const factor = factors[first] + (factors[first + 1] - factors[first]) * (at - first);
  if (isRound) return [right * factor, below * factor];
  return [right + across * (factor - 1) * cos, below + across * (factor - 1) * sin];
}

/** Eye positions of the views: each sees one view through all lenses; eye_of_offset of replay.py. */
export function eyesOfViews(optics) {
  const { panel, lenses, gap, viewing_distance: distance, views } = optics;
  const z = distance ?? FAR;
  const scale = (-panel.pixel_pitch * z) / gap;
  return views.down.flatMap((below) =>
    views.right.map((column) => {
      const [right, down] = pinholeOffset(optics, column, below);
      if (lenses.layout !== "lenticular") return { x: right * scale, y: -down * scale, z };
      const [sin, cos] = axis(lenses);
      const across = right * scale * cos + down * scale * sin;
      return { x: across * cos, y: -across * sin, z };
    }),
  );
}

/** Half width in mm, at a distance, of the view zone in which the central lens shows its own micro-image. */
export function halfField(optics, distance) {
  return (0.5 * distance * optics.micro_image_pitch * optics.edge_factor) / optics.gap;
}

/**
 * View zone of an eye: least and largest offset [fewest, most], in micro-images, between a lens and the micro-image
 * that it shows, at the panel's edges. [0, 0]: the central zone. [k, k]: the k-th neighbour. Otherwise between zones.
 */
export function flips(optics, eye) {
  const { panel, lenses, gap, viewing_distance: distance } = optics;
  const pitch = optics.micro_image_pitch * optics.edge_factor;
  const [sin, cos] = lenses.layout === "lenticular" ? axis(lenses) : [0, 1];
  const convergence = distance === null ? 0 : 1 / distance;
  const beside = (place, from) => Math.round((gap * (place * (1 / eye.z - convergence) - from / eye.z)) / pitch);
  const [halfWidth, halfHeight] = [panel.width, panel.height].map((count) => 0.5 * count * panel.pixel_pitch);
  const edge = halfWidth * cos + halfHeight * Math.abs(sin);
  const counts = [-edge, edge].map((place) => beside(place, eye.x * cos - eye.y * sin));
  if (lenses.layout !== "lenticular") counts.push(...[-halfHeight, halfHeight].map((place) => beside(place, eye.y)));
  // Horizontal and vertical offsets count alike.
  return counts.every((count) => count === 0) ? [0, 0] : range(counts.map(Math.abs));
}

function range(values) {
  return [Math.min(...values), Math.max(...values)];
}

function axis(lenses) {
  const angle = (lenses.slant * Math.PI) / 180;
  return [Math.sin(angle), Math.cos(angle)];
}
