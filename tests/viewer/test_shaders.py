"""The shaders' sRGB curve is that of the library."""

from __future__ import annotations

import base64

import numpy as np
import pytest
from pages import DISPLAYS, noise, opened, page_of

from lippmann.color.transfer import decode_srgb, linear_levels, quantize

#: Runs a fragment shader on a texture of one row, and returns the row's red channel as bytes (RGBA8) or floats.
RUN = """async ([kind, values]) => {
  const { MEAN, SRGB, VERTEX } = await import("lippmann/shaders.js");
  const { Program } = await import("lippmann/picture.js");
  const DECODED = `#version 300 es
precision highp float;
precision highp sampler2D;
${SRGB}
uniform sampler2D sum;
out vec4 color;
void main() {
  color = vec4(decodeSrgb(texelFetch(sum, ivec2(gl_FragCoord.xy), 0).rgb), 1.0);
}`;
  const gl = document.createElement("canvas").getContext("webgl2", { alpha: false });
  if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("no float targets");
  const bytes = Uint8Array.from(atob(values), (letter) => letter.charCodeAt(0));
  const light = new Float32Array(bytes.buffer);
  const width = light.length;
  const texture = (format, content) => {
    const made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, 1);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    if (content) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, 1, gl.RGBA, gl.FLOAT, content);
    return made;
  };
  // Four summands: the mean divides by their count.
  const count = kind === "encode" ? 4 : 1;
  const total = (place) => (place % 4 === 3 ? count : count * light[place >> 2]);
  const sum = texture(gl.RGBA32F, Float32Array.from({ length: 4 * width }, (_, place) => total(place)));
  const target = texture(kind === "encode" ? gl.RGBA8 : gl.RGBA32F, null);
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
  gl.viewport(0, 0, width, 1);
  const program = new Program(gl, kind === "encode" ? MEAN : DECODED, VERTEX);
  gl.useProgram(program.handle);
  gl.bindTexture(gl.TEXTURE_2D, sum);
  gl.uniform1i(program.at("sum"), 0);
  if (kind === "encode") {
    gl.uniform2i(program.at("corner"), 0, 0);
    gl.uniform1i(program.at("isCoded"), 1);
  }
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  const [type, result] =
    kind === "encode" ? [gl.UNSIGNED_BYTE, new Uint8Array(4 * width)] : [gl.FLOAT, new Float32Array(4 * width)];
  gl.readPixels(0, 0, width, 1, gl.RGBA, type, result);
  return Array.from({ length: width }, (_, place) => result[4 * place]);
}"""


@pytest.fixture
def run(open_tab, tmp_path):
    """``run(kind, values)``: float32 values through the shader's curve, ``encode`` (codes) or ``decode`` (light)."""
    tab = opened(open_tab, page_of(tmp_path / "page.html", noise(DISPLAYS["square"])))

    def go(kind, values):
        packed = base64.b64encode(np.asarray(values, np.float32).tobytes()).decode("ascii")
        result = np.array(tab.evaluate(RUN, [kind, packed]))
        tab.assert_clean()
        return result

    return go


@pytest.mark.slow
def test_codes_of_light_are_exactly_those_of_the_library(run):
    # Codes themselves, and values close to either side of the boundary between two.
    coded = (np.arange(256)[:, None] + np.array([-0.49, 0.0, 0.49])).ravel().clip(0, 255) / 255
    light = decode_srgb(coded).astype(np.float32)
    np.testing.assert_array_equal(run("encode", light), quantize(light, 8, "srgb"))


@pytest.mark.slow
def test_light_of_codes_is_that_of_the_library(run):
    codes = np.arange(256, dtype=np.float32) / 255
    expected = linear_levels(np.dtype(np.uint8), "srgb")
    # What single precision leaves of a power.
    np.testing.assert_allclose(run("decode", codes), expected, rtol=3e-6)
