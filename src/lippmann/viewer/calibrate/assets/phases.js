/**
 * Phases of a slanted monitor and the fields of its test patterns, after lippmann/calibration/patterns.py.
 *
 * A monitor here is `{ pitch, lean, center }`: lenses per inch as seen, 1 / slope, lenses. A panel is `{ width, height,
 * pixel_pitch, cells }`: pixels, millimetres, and rows of cells of three [right, down] in pixels.
 */

const INCH = 25.4;

/** The patterns, and the half width of the lit part of a lens, in lenses; stripes display views instead. */
export const PATTERNS = ["stripes", "pitch", "slope", "center"];
export const LIT = { pitch: 1 / 4, slope: 1 / 4, center: 1 / 12 };
export const FIELDS = 11;

/** Limits on a monitor's values, which the server checks too. */
export const PITCHES = [1, 1000];
export const LARGEST_LEAN = 1 / 0.18;

const fraction = (value) => value - Math.floor(value);

/** Lenses per pixel to the right and upwards. */
export function lensesPerPixel(panel, { pitch, lean }) {
  const right = (panel.pixel_pitch / INCH) * pitch * Math.cos(Math.atan(lean));
  return { right, up: right * lean };
}

/** The monitor with changed values and the same phase at the centre of the panel. */
export function withChanges(panel, monitor, changes) {
  const pitch = Math.min(Math.max(changes.pitch ?? monitor.pitch, PITCHES[0]), PITCHES[1]);
  const lean = Math.min(Math.max(changes.lean ?? monitor.lean, -LARGEST_LEAN), LARGEST_LEAN);
  const before = lensesPerPixel(panel, monitor);
  const after = lensesPerPixel(panel, { pitch, lean });
  const shift = (panel.width / 2) * (after.right - before.right) + (panel.height / 2) * (after.up - before.up);
  return { pitch, lean, center: fraction((changes.center ?? monitor.center) + shift) };
}

/** Step of each value, the least visible change: a tenth of a lens from one edge of the panel to the other. */
export function steps(panel, monitor) {
  const { right } = lensesPerPixel(panel, monitor);
  const tenth = { pitch: monitor.pitch / (10 * panel.width * right), lean: 1 / (10 * panel.height * right) };
  return { ...tenth, center: 0.01 };
}

/**
 * Fields of a pattern. Each has the `monitor` whose values it displays, its extent from pixel `first` to `last` (from
 * the top; for `slope` from the left), and its phase in lenses: `right` and `up` per pixel, and `constant`.
 */
export function fieldsOf(pattern, panel, monitor, scale) {
  const own = lensesPerPixel(panel, monitor);
  if (pattern === "stripes") {
    return [{ monitor, first: 0, last: panel.height, ...own, constant: -monitor.center }];
  }
  const isHorizontal = pattern !== "slope";
  const extent = isHorizontal ? panel.height : panel.width;
  const count = Math.min(FIELDS, extent);
  const step = fieldStep(pattern, panel, monitor, count) * scale;
  return Array.from({ length: count }, (_, number) => {
    const first = Math.floor((number * extent) / count);
    const last = Math.floor(((number + 1) * extent) / count);
    const change = (number - (count - 1) / 2) * step;
    if (pattern === "center") {
      const center = fraction(monitor.center + change);
      return { monitor: { ...monitor, center }, first, last, ...own, constant: -center };
    }
    const changed = pattern === "pitch" ? { pitch: monitor.pitch + change } : { lean: monitor.lean + change };
    const values = { ...monitor, ...changed };
    const { right, up } = lensesPerPixel(panel, values);
    const middle = (first + last) / 2;
    const [across, above] = isHorizontal ? [panel.width / 2, panel.height - middle] : [middle, panel.height / 2];
    const constant = across * (own.right - right) + above * (own.up - up) - monitor.center;
    return { monitor: withChanges(panel, monitor, changed), first, last, right, up, constant };
  });
}

/** Step from field to field: half a lens from one edge of the panel to the other; for `center` an even share of one. */
function fieldStep(pattern, panel, monitor, count) {
  const { right } = lensesPerPixel(panel, monitor);
  if (pattern === "center") return 1 / count;
  return pattern === "pitch" ? (0.5 * monitor.pitch) / (panel.width * right) : 0.5 / (panel.height * right);
}

/**
 * Phases of columns and rows, for each field: `columns` is width x fields, `rows` height x fields. Whole lenses are
 * subtracted here in double precision, because single precision resolves a hundredth of a lens in small numbers only.
 */
export function phaseTables(panel, fields) {
  const columns = new Float32Array(panel.width * fields.length);
  const rows = new Float32Array(panel.height * fields.length);
  fields.forEach((field, number) => {
    for (let column = 0; column < panel.width; column++) {
      columns[number * panel.width + column] = fraction((column + 0.5) * field.right);
    }
    for (let row = 0; row < panel.height; row++) {
      const above = panel.height - row - 0.5;
      rows[number * panel.height + row] = fraction(above * field.up + field.constant);
    }
  });
  return { columns, rows };
}
