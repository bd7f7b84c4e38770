/**
 * Numbers for the graphics card, exact where single precision is not.
 *
 * On a panel of 8000 pixels single precision is half a thousandth of a pixel, and one point in a thousand would fall on
 * the wrong side of a boundary between pixels. So every coefficient is sent twice: as a float, and its fractional part
 * in units of 2^-32. The fractions of sums of products with whole numbers come out of the shader's integers, which wrap
 * around as fractions do, to a part in some millions; the float then only has to say which whole number lies below. The
 * constant, the last coefficient, is sent half too large as a float, so that rounding down rounds to the nearest.
 */

/** The uniforms of a linear form, the constant last: floats, and fractional parts in units of 2^-32. */
export function exact(coefficients) {
  const fractions = coefficients.map((value) => Math.round((value - Math.floor(value)) * 2 ** 32) % 2 ** 32);
  const constant = coefficients.length - 1;
  const floats = coefficients.map((value, place) => (place === constant ? value + 0.5 : value));
  return { floats: new Float32Array(floats), fractions: new Uint32Array(fractions) };
}

/** Sets the uniforms `name` (float array) and `nameParts` (uint array) of a program. */
export function setExact(gl, program, name, { floats, fractions }) {
  gl.uniform1fv(program.at(name), floats);
  gl.uniform1uiv(program.at(`${name}Parts`), fractions);
}
