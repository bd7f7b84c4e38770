/**
 * Fixed-point coefficients for shaders, where single precision does not suffice.
 *
 * On a panel of 8000 pixels the precision of a float is half a thousandth of a pixel: one point in a thousand would
 * fall on the wrong side of a pixel boundary. Each coefficient of a linear form is therefore sent twice: as a float,
 * and as its fractional part in units of 2^-32. The shader sums the fractions in unsigned integers, which wrap around
 * as fractions do, to a few parts in a million. The float sum only has to select the whole number below. The constant,
 * the last coefficient, is sent as a float plus 1/2, so that rounding down rounds to the nearest.
 */

/** The uniforms of a linear form, the constant last: floats, and fractional parts in units of 2^-32. */
export function fixedPoint(coefficients) {
  const fractions = coefficients.map((value) => Math.round((value - Math.floor(value)) * 2 ** 32) % 2 ** 32);
  const constant = coefficients.length - 1;
  const floats = coefficients.map((value, place) => (place === constant ? value + 0.5 : value));
  return { floats: new Float32Array(floats), fractions: new Uint32Array(fractions) };
}

/** Sets the uniforms `name` (float array) and `nameParts` (uint array) of a program. */
export function setFixedPoint(gl, program, name, { floats, fractions }) {
  gl.uniform1fv(program.at(name), floats);
  gl.uniform1uiv(program.at(`${name}Parts`), fractions);
}
