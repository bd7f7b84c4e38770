/** Draws test patterns in the native pixels of a canvas. */

import { LIT, phaseTables } from "./phases.js";

const VERTEX = `#version 300 es
void main() {
  gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
uniform highp sampler2D columns; // phases of columns, a row per field
uniform highp sampler2D rows;    // phases of rows, a row per field
uniform highp sampler2D turns;   // lenses per pixel to the right and upwards, by field
uniform highp sampler2D places;  // [right, down] of sub-pixels, three columns per cell
uniform ivec2 panel;
uniform ivec2 cells;
uniform int count;     // of fields
uniform int direction; // 0: fields from top to bottom, 1: from left to right
uniform int views;     // of stripes; 0 for fields
uniform float lit;
uniform int canvasHeight;
out vec4 color;

const vec3 COLORS[6] = vec3[6](vec3(1, 0, 0), vec3(0, 1, 0), vec3(0, 0, 1), vec3(0, 1, 1), vec3(1, 0, 1), vec3(1, 1, 0));

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  pixel.y = canvasHeight - 1 - pixel.y;
  color = vec4(0, 0, 0, 1);
  if (pixel.x >= panel.x || pixel.y >= panel.y) return;
  int along = direction == 0 ? pixel.y : pixel.x;
  int extent = direction == 0 ? panel.y : panel.x;
  int field = ((along + 1) * count - 1) / extent;
  float phase = texelFetch(columns, ivec2(pixel.x, field), 0).r + texelFetch(rows, ivec2(pixel.y, field), 0).r;
  vec2 turn = texelFetch(turns, ivec2(field, 0), 0).rg;
  ivec2 cell = pixel % cells;
  vec3 light = vec3(0);
  for (int channel = 0; channel < 3; channel++) {
    vec2 place = texelFetch(places, ivec2(cell.x * 3 + channel, cell.y), 0).rg;
    float under = fract(phase + place.x * turn.x - place.y * turn.y);
    if (views == 0) {
      light[channel] = abs(under - 0.5) < lit ? 1.0 : 0.0;
    } else {
      int view = min(int((1.0 - under) * float(views)), views - 1);
      light[channel] = COLORS[view % 6][channel];
    }
  }
  color = vec4(light, 1);
}`;

/** Creates a drawing on `canvas`: `draw(panel, pattern, fields, views)` fills it; throws an Error without WebGL 2. */
export function createDrawing(canvas) {
  const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, preserveDrawingBuffer: true });
  if (gl === null) throw new Error("this browser has no WebGL 2, which the patterns need; try another one");
  const program = linkProgram(gl);
  const place = (name) => gl.getUniformLocation(program, name);
  const textures = Object.fromEntries(["columns", "rows", "turns", "places"].map((name) => [name, gl.createTexture()]));
  gl.useProgram(program);
  Object.keys(textures).forEach((name, unit) => gl.uniform1i(place(name), unit));

  function upload(name, width, height, channels, values) {
    const [inside, format] = channels === 1 ? [gl.R32F, gl.RED] : [gl.RG32F, gl.RG];
    gl.activeTexture(gl.TEXTURE0 + Object.keys(textures).indexOf(name));
    gl.bindTexture(gl.TEXTURE_2D, textures[name]);
    gl.texImage2D(gl.TEXTURE_2D, 0, inside, width, height, 0, format, gl.FLOAT, values);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  }

  return {
    draw(panel, pattern, fields, views) {
      const tables = phaseTables(panel, fields);
      upload("columns", panel.width, fields.length, 1, tables.columns);
      upload("rows", panel.height, fields.length, 1, tables.rows);
      upload("turns", fields.length, 1, 2, Float32Array.from(fields.flatMap(({ right, up }) => [right, up])));
      const [cellColumns, cellRows] = [panel.cells[0].length, panel.cells.length];
      upload("places", 3 * cellColumns, cellRows, 2, Float32Array.from(panel.cells.flat(3)));
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.uniform2i(place("panel"), panel.width, panel.height);
      gl.uniform2i(place("cells"), cellColumns, cellRows);
      gl.uniform1i(place("count"), fields.length);
      gl.uniform1i(place("direction"), pattern === "slope" ? 1 : 0);
      gl.uniform1i(place("views"), pattern === "stripes" ? views : 0);
      gl.uniform1f(place("lit"), LIT[pattern] ?? 0);
      gl.uniform1i(place("canvasHeight"), canvas.height);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    },
  };
}

function linkProgram(gl) {
  const program = gl.createProgram();
  const kinds = { [gl.VERTEX_SHADER]: VERTEX, [gl.FRAGMENT_SHADER]: FRAGMENT };
  const shaders = Object.entries(kinds).map(([kind, text]) => {
    const shader = gl.createShader(Number(kind));
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    return shader;
  });
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const logs = [...shaders.map((shader) => gl.getShaderInfoLog(shader)), gl.getProgramInfoLog(program)];
    throw new Error(`the patterns cannot be drawn here: ${logs.join(" ")}`);
  }
  return program;
}
