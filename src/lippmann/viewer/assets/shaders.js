/** Shader programs: what an eye sees, the focus sum over many eyes, and the magnifier. */

/** One triangle that covers the viewport. */
export const VERTEX = `#version 300 es
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}`;

// The fragment shaders use few operations, because software renderers execute all of them. Such renderers also check
// the bounds of a uniform array at every pixel, which took a fifth of a frame. The coefficients therefore reach the
// fragment shader as flat outputs of the vertex shader, which pass values unchanged.

/** The same triangle, with the flat outputs that the programs of {@link fragmentSource} read. */
export const SIGHT_VERTEX = `#version 300 es
uniform vec2 panel;
uniform vec2 corner;  // middle of the pane's upper left pixel in the canvas
uniform float across[3];  // lens coordinate: per column and row of the pane, and at (0, 0)
uniform uint acrossParts[3];
uniform float down[2];  // per row of the pane
uniform uint downParts[2];
uniform float panelU[4];  // panel coordinate: per lens, column (or shifted row of lenses) and row of the pane
uniform uint panelUParts[4];
uniform float panelV[2];  // per row of the pane; of arrays, per row of lenses
uniform uint panelVParts[2];
uniform float slide;  // what a slanted axis moves v by from one edge of a lens to the other
uniform vec3 channelRight;  // what places the grid of each colour's sub-pixels
uniform vec3 channelDown;

flat out vec2 flatPanel;
flat out vec2 flatCorner;
flat out vec3 flatAcross;
flat out uvec3 flatAcrossParts;
flat out vec2 flatDown;
flat out uvec2 flatDownParts;
flat out vec4 flatPanelU;
flat out uvec4 flatPanelUParts;
flat out vec2 flatPanelV;
flat out uvec2 flatPanelVParts;
flat out float flatSlide;
flat out vec3 flatRight;
flat out vec3 flatDownward;

void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
  flatPanel = panel;
  flatCorner = corner;
  flatAcross = vec3(across[0], across[1], across[2]);
  flatAcrossParts = uvec3(acrossParts[0], acrossParts[1], acrossParts[2]);
  flatDown = vec2(down[0], down[1]);
  flatDownParts = uvec2(downParts[0], downParts[1]);
  flatPanelU = vec4(panelU[0], panelU[1], panelU[2], panelU[3]);
  flatPanelUParts = uvec4(panelUParts[0], panelUParts[1], panelUParts[2], panelUParts[3]);
  flatPanelV = vec2(panelV[0], panelV[1]);
  flatPanelVParts = uvec2(panelVParts[0], panelVParts[1]);
  flatSlide = slide;
  flatRight = channelRight;
  flatDownward = channelDown;
}`;

const HEAD = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
`;

/** The sRGB curve of color/transfer.py in GLSL, for values from 0 to 1; a test compares the two. */
export const SRGB = `
vec3 decodeSrgb(vec3 code) {
  return mix(code / 12.92, pow((code + 0.055) / 1.055, vec3(2.4)), greaterThan(code, vec3(0.04045)));
}

vec3 encodeSrgb(vec3 light) {
  return mix(12.92 * light, 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, greaterThan(light, vec3(0.0031308)));
}
`;

// Sums of fixed-point coefficients, see fixed.js.
const FIXED_POINT = `
struct Fixed {
  float whole;
  float part;  // 0 to 1
};

// The number near \`rough\` - 1/2 whose fraction is \`parts\` / 2^32.
Fixed fixedPoint(float rough, uint parts) {
  float part = float(int(parts >> 8)) * (1.0 / 16777216.0);
  return Fixed(floor(rough - part), part);
}
`;

// Index of the lens that contains a point in units of the pitches; Lattice.lens_at of display/lattice.py. Where the
// nearest centre counts, the coordinates already include half a pitch: lens c contains c <= coordinate < c + 1.
const LENSES = `
#define LENTICULAR 0
#define SQUARE 1
#define HEXAGONAL 2

uniform float rowsPerPitch;  // row pitch over pitch, of a hexagonal array

// 1 for every other row of a hexagonal array, which is shifted by half a pitch.
float shiftOf(float row) {
#if LAYOUT == HEXAGONAL
  return fract(0.5 * row) * 2.0;
#else
  return 0.0;
#endif
}

#if LAYOUT != LENTICULAR
vec2 lensAt(float across, uint acrossParts, float down, uint downParts) {
#if LAYOUT == SQUARE
  return vec2(fixedPoint(across, acrossParts).whole, fixedPoint(down, downParts).whole);
#else
  Fixed row = fixedPoint(down, downParts);
  float shift = shiftOf(row.whole);
  uint shiftParts = uint(shift) << 31;
  Fixed upper = fixedPoint(across - 0.5 * shift, acrossParts - shiftParts);
  Fixed lower = fixedPoint(across - 0.5 + 0.5 * shift, acrossParts - 0x80000000u + shiftParts);
  float besideUpper = upper.part - 0.5, besideLower = lower.part - 0.5;
  float excess = besideLower * besideLower - besideUpper * besideUpper;
  excess += (1.0 - 2.0 * row.part) * rowsPerPitch * rowsPerPitch;
  // Ties go to the lower row; single precision resolves them to 1e-6.
  return excess <= 1e-6 ? vec2(lower.whole, row.whole + 1.0) : vec2(upper.whole, row.whole);
#endif
}
#endif
`;

// A texture of the whole panel has a black border of one pixel, so that points beside the panel need no test. Otherwise
// the tiles are layers of an array texture, found by an index texture; tiles that are not loaded yet are grey.
const TILES = `
flat in vec2 flatPanel;

bool isOnPanel(vec2 pixel) {
  return pixel.x >= 0.0 && pixel.x < flatPanel.x && pixel.y >= 0.0 && pixel.y < flatPanel.y;
}

#if TILED
precision highp isampler2D;
uniform int tileShift;
uniform sampler2DArray picture;
uniform isampler2D pictureLayers;
uniform sampler2DArray overlay;
uniform isampler2D overlayLayers;

vec3 tileCode(sampler2DArray tiles, isampler2D layers, vec2 pixel) {
  if (!isOnPanel(pixel)) return vec3(0.0);
  ivec2 place = ivec2(pixel);
  int layer = texelFetch(layers, place >> tileShift, 0).r;
  if (layer < 0) return vec3(0.25);
  return texelFetch(tiles, ivec3(place & ((1 << tileShift) - 1), layer), 0).rgb;
}

vec3 fetchCode(vec2 pixel) {
  return tileCode(picture, pictureLayers, pixel);
}

vec3 fetchOverlay(vec2 pixel) {
  return tileCode(overlay, overlayLayers, pixel);
}
#else
uniform sampler2D picture;
uniform sampler2D overlay;

ivec2 placeOf(vec2 pixel) {
  return ivec2(clamp(pixel + 1.0, vec2(0.0), flatPanel + 1.0));
}

vec3 fetchCode(vec2 pixel) {
  return texelFetch(picture, placeOf(pixel), 0).rgb;
}

vec3 fetchOverlay(vec2 pixel) {
  return texelFetch(overlay, placeOf(pixel), 0).rgb;
}
#endif
`;

// Distortion of a real lens: Display.panel_offset. `beside` is the offset of a pinhole's point from the lens's centre, see
// bending in optics.js.
const BENDING = `
#if BENT
uniform float factors[BENT];
uniform float perReach;
uniform vec4 beside;
uniform vec2 moves;  // of arrays in pixels per mm

vec2 bent(vec2 lens, float shift) {
  vec2 from = vec2(beside.x * (lens.x + 0.5 * shift) + beside.y, beside.z * lens.y + beside.w);
#if LAYOUT == LENTICULAR
  from = vec2(from.x);
  float at = abs(from.x) * perReach;
#else
  float at = length(from) * perReach;
#endif
  at = min(at, float(BENT - 1));
  int first = min(int(at), BENT - 2);
  return from * (mix(factors[first], factors[first + 1], at - float(first)) - 1.0) * moves;
}
#endif
`;

// The panel point that the eye sees: Display.visible_panel_point and replay.py. Coordinates (u, v) are pixels of the
// panel from its upper left corner.
const SIGHTLINE = `
flat in vec2 flatCorner;
flat in vec3 flatAcross;
flat in uvec3 flatAcrossParts;
flat in vec2 flatDown;
flat in uvec2 flatDownParts;
flat in vec4 flatPanelU;
flat in uvec4 flatPanelUParts;
flat in vec2 flatPanelV;
flat in uvec2 flatPanelVParts;
flat in float flatSlide;
flat in vec3 flatRight;
flat in vec3 flatDownward;

vec2 visibleLens;  // index of the lens

vec2 panePixel() {
  return vec2(gl_FragCoord.x - flatCorner.x, flatCorner.y - gl_FragCoord.y);
}

void visiblePoint(vec2 pane, out Fixed u, out Fixed v) {
  float x = pane.x, y = pane.y;
  uint column = uint(int(x)), row = uint(int(y));
#if LAYOUT == LENTICULAR
#if SLANTED
  float roughLens = flatAcross[0] * x + flatAcross[1] * y + flatAcross[2];
  uint lensParts = flatAcrossParts[0] * column + flatAcrossParts[1] * row + flatAcrossParts[2];
  Fixed lens = fixedPoint(roughLens, lensParts);
  uint i = uint(int(lens.whole));
  float roughU = flatPanelU[0] * lens.whole + flatPanelU[1] * x + flatPanelU[2] * y + flatPanelU[3];
  uint uParts = flatPanelUParts[0] * i + flatPanelUParts[1] * column + flatPanelUParts[2] * row + flatPanelUParts[3];
  u = fixedPoint(roughU, uParts);
  v = fixedPoint(flatPanelV[0] * y + flatPanelV[1], flatPanelVParts[0] * row + flatPanelVParts[1]);
  v.part -= flatSlide * lens.part;
#else
  Fixed lens = fixedPoint(flatAcross[0] * x + flatAcross[2], flatAcrossParts[0] * column + flatAcrossParts[2]);
  uint uParts = flatPanelUParts[0] * uint(int(lens.whole)) + flatPanelUParts[3];
  u = fixedPoint(flatPanelU[0] * lens.whole + flatPanelU[3], uParts);
  v = fixedPoint(flatPanelV[0] * y + flatPanelV[1], flatPanelVParts[0] * row + flatPanelVParts[1]);
#endif
  visibleLens = vec2(lens.whole, 0.0);
#else
  uint acrossAt = flatAcrossParts[0] * column + flatAcrossParts[2], downAt = flatDownParts[0] * row + flatDownParts[1];
  vec2 lens = lensAt(flatAcross[0] * x + flatAcross[2], acrossAt, flatDown[0] * y + flatDown[1], downAt);
  visibleLens = lens;
  float shift = shiftOf(lens.y);
  uvec3 whole = uvec3(ivec3(vec3(lens, shift)));
  float roughU = flatPanelU[0] * lens.x + flatPanelU[1] * shift + flatPanelU[3];
  u = fixedPoint(roughU, flatPanelUParts[0] * whole.x + flatPanelUParts[1] * whole.z + flatPanelUParts[3]);
  v = fixedPoint(flatPanelV[0] * lens.y + flatPanelV[1], flatPanelVParts[0] * whole.y + flatPanelVParts[1]);
#endif
#if BENT
#if LAYOUT == LENTICULAR
  vec2 shifted = bent(visibleLens, 0.0);
#else
  vec2 shifted = bent(lens, shift);
#endif
  u.part += shifted.x;
  v.part += shifted.y;
#endif
}

// The pixel at the green sub-pixel, which stands for all three.
vec2 pixelOf(Fixed u, Fixed v) {
  return vec2(u.whole + floor(u.part + flatRight.y), v.whole + floor(v.part + flatDownward.y));
}

#if CELLS == 0
vec3 sampleCode(Fixed u, Fixed v) {
  return fetchCode(pixelOf(u, v));
}
#elif CELLS == 1
// Sub-pixels in one row: the three lie in at most two adjacent pixels.
vec3 sampleCode(Fixed u, Fixed v) {
  vec3 columns = floor(u.part + flatRight);
  float first = min(columns.x, min(columns.y, columns.z));
  vec2 pixel = vec2(u.whole + first, v.whole + floor(v.part + flatDownward.y));
  return mix(fetchCode(pixel), fetchCode(vec2(pixel.x + 1.0, pixel.y)), greaterThan(columns, vec3(first)));
}
#elif CELLS == 2
vec3 sampleCode(Fixed u, Fixed v) {
  vec3 columns = u.whole + floor(u.part + flatRight), rows = v.whole + floor(v.part + flatDownward);
  vec3 red = fetchCode(vec2(columns.x, rows.x)), green = fetchCode(vec2(columns.y, rows.y));
  return vec3(red.r, green.g, fetchCode(vec2(columns.z, rows.z)).b);
}
#else
uniform ivec2 cellCount;  // columns and rows of the pattern
uniform vec2 cells[192];  // place of R, G, B in each cell, right and down of its centre, row after row

// For each colour the sub-pixel whose centre is nearest to the point.
vec3 sampleCode(Fixed u, Fixed v) {
  vec2 middle = pixelOf(u, v);
  vec2 place = vec2(u.part, v.part) + (vec2(u.whole, v.whole) - middle);
  ivec2 firstCell = ivec2(middle);
  vec3 best = vec3(1e9);
  vec2 nearest[3] = vec2[3](middle, middle, middle);
  for (int row = -REACH; row <= REACH; row += 1) {
    for (int column = -REACH; column <= REACH; column += 1) {
      ivec2 cell = ((firstCell + ivec2(column, row)) % cellCount + cellCount) % cellCount;
      int first = 3 * (cell.y * cellCount.x + cell.x);
      for (int c = 0; c < 3; c += 1) {
        vec2 offset = vec2(column, row) + 0.5 + cells[first + c] - place;
        float distance = dot(offset, offset);
        if (distance < best[c]) {
          best[c] = distance;
          nearest[c] = middle + vec2(column, row);
        }
      }
    }
  }
  return vec3(fetchCode(nearest[0]).r, fetchCode(nearest[1]).g, fetchCode(nearest[2]).b);
}
#endif
`;

// Code of a pixel of the pane: of POINTS x POINTS points their mean in light, see points_of_pixel of visible_pixels.py.
const MEAN_CODE = `
uniform bool isCoded;

vec3 meanCode() {
  vec2 first = panePixel() * float(POINTS);
  Fixed u, v;
#if POINTS == 1
  visiblePoint(first, u, v);
  return sampleCode(u, v);
#else
  vec3 sum = vec3(0.0);
  for (int point = 0; point < POINTS * POINTS; point += 1) {
    visiblePoint(first + vec2(point % POINTS, point / POINTS), u, v);
    vec3 code = sampleCode(u, v);
    sum += isCoded ? decodeSrgb(code) : code;
  }
  vec3 light = sum / float(POINTS * POINTS);
  return isCoded ? encodeSrgb(light) : light;
#endif
}
`;

const EYE = `
out vec4 color;

void main() {
  color = vec4(meanCode(), 1.0);
}`;

// The same with an overlay.
const OVERLAY = `
uniform float overlayShare;
out vec4 color;

void main() {
  vec3 code = meanCode();
  Fixed u, v;
  visiblePoint(panePixel() * float(POINTS) + float(POINTS / 2), u, v);
  vec2 pixel = pixelOf(u, v);
  if (isOnPanel(pixel)) code = mix(code, fetchOverlay(pixel), overlayShare);
  color = vec4(code, 1.0);
}`;

// The light that lenses as they are made send to an eye: viewing/optical_replay.py and its kernel, with the weights of
// lens_light.js. Coordinates in mm are across and along a cylinder, or right and up.
const REAL = `
uniform sampler2D weights;
uniform sampler2D places;  // middle of the light from the lens's centre, mm
uniform vec2 directions;  // columns and rows of slopes
uniform float finerPlaces;  // places between two directions
uniform float largestSlope;
uniform vec2 tile;
uniform vec2 perTexel;
uniform float stepsPerPixel;
uniform vec2 reach;  // pixels beside the middle that may send light
uniform ivec2 lightCellCount;
uniform vec2 lightCells[192];
uniform vec4 centerOf;  // of a lens, per lens and at 0, across and along
uniform vec3 alongOf;  // of a point of a cylinder: per column and row of the pane, and at (0, 0)
uniform vec3 eyeAt;
uniform float pixelPitch;
uniform vec2 axis;  // sine and cosine of the slant
uniform ivec2 finer;  // points of the pane that a pixel is the mean of
uniform float halfRows;  // half of the panel's rows that a point of a cylinder covers
uniform bool isCoded;
uniform float overlayShare;  // 0 without an overlay
out vec4 color;

vec2 placeOfLight(vec2 at) {
  at *= finerPlaces;
  ivec2 low = ivec2(min(at, finerPlaces * (directions - 1.0) - 1.0));
  vec2 part = at - vec2(low);
  vec2 lower = mix(texelFetch(places, low, 0).rg, texelFetch(places, low + ivec2(1, 0), 0).rg, part.x);
  vec2 upper = mix(texelFetch(places, low + ivec2(0, 1), 0).rg, texelFetch(places, low + 1, 0).rg, part.x);
  return mix(lower, upper, part.y);
}

// Weight of a sub-pixel so many steps beside the middle of the light; tiles end in zeros. The corner is that of the
// nearest direction's tile, of a cylinder the place along and across between directions.
float weightAt(vec2 corner, vec2 beside) {
  vec2 place = clamp(beside + 0.5 * (tile - 1.0), vec2(0.0), tile - 1.0) + 0.5;
#if LAYOUT == LENTICULAR
  // Between directions across the texture mixes, between those along this.
  float row = min(floor(corner.x), directions.y - 2.0);
  vec2 first = vec2(row * tile.x + place.x, corner.y + 0.5) * perTexel;
  float lower = texture(weights, first).r, upper = texture(weights, first + vec2(tile.x * perTexel.x, 0.0)).r;
  return mix(lower, upper, corner.x - row);
#else
  return texture(weights, (corner + place) * perTexel).r;
#endif
}

// Weights of a pixel's colours; from is its place beside the middle of the light, in pixels right and up.
vec3 weightsOf(vec2 pixel, vec2 corner, vec2 from) {
#if SPLIT
  ivec2 cell = ivec2(pixel) % lightCellCount;
  int first = 3 * (cell.y * lightCellCount.x + cell.x);
  vec3 found;
  for (int c = 0; c < 3; c += 1) {
    vec2 place = from + vec2(lightCells[first + c].x, -lightCells[first + c].y);
    found[c] = weightAt(corner, vec2(place.x * axis.y - place.y * axis.x, place.y) * stepsPerPixel);
  }
  return found;
#else
  return vec3(weightAt(corner, vec2(from.x * axis.y - from.y * axis.x, from.y) * stepsPerPixel));
#endif
}

bool isDark(vec3 light) {
  return max(light.r, max(light.g, light.b)) < 1e-5;
}

vec3 fetchLight(vec2 pixel) {
  vec3 code = fetchCode(pixel);
  return isCoded ? decodeSrgb(code) : code;
}

vec3 lightAt(vec2 pane) {
  Fixed u, v;
  visiblePoint(pane, u, v);
#if LAYOUT == LENTICULAR
  vec2 center = vec2(centerOf.x * visibleLens.x + centerOf.y, dot(alongOf, vec3(pane, 1.0)));
#else
  float lensX = visibleLens.x + 0.5 * shiftOf(visibleLens.y);
  vec2 center = vec2(centerOf.x * lensX + centerOf.y, centerOf.z * visibleLens.y + centerOf.w);
#endif
  vec2 slope = (eyeAt.xy - center) / eyeAt.z;
  slope = clamp(slope / largestSlope, -1.0, 1.0);
  vec2 at = (0.5 * slope + 0.5) * (directions - 1.0);
#if LAYOUT == LENTICULAR
  at.y = abs(slope.y) * (directions.y - 1.0);  // cylinders are alike both ways along
#endif
  vec2 place = placeOfLight(at);
#if LAYOUT == LENTICULAR
  vec2 corner = at.yx;
  float begin = v.whole + v.part - halfRows, end = v.whole + v.part + halfRows;
  float across = center.x + place.x;
#else
  vec2 corner = floor(at + 0.5) * tile;
  vec2 middle = 0.5 * flatPanel + vec2(1.0, -1.0) * (center + place) / pixelPitch - 0.5;
  float begin = middle.y - reach.y, end = middle.y + reach.y;
#endif
  vec3 light = vec3(0.0);
  float firstRow = max(0.0, floor(begin)), endRow = min(flatPanel.y, ceil(end));
#if ALIKE
  float middle = across / pixelPitch + 0.5 * flatPanel.x - 0.5;
  float last = min(flatPanel.x - 1.0, ceil(middle + reach.x));
  for (float column = max(0.0, floor(middle - reach.x)); column <= last; column += 1.0) {
    vec3 weight = weightsOf(vec2(column, 0.0), corner, vec2(column - middle, 0.0));
    if (isDark(weight)) continue;
    for (float row = firstRow; row < endRow; row += 1.0) {
      float share = (min(end, row + 1.0) - max(begin, row)) / (end - begin);
      light += share * weight * fetchLight(vec2(column, row));
    }
  }
#else
  for (float row = firstRow; row < endRow; row += 1.0) {
#if LAYOUT == LENTICULAR
    float share = (min(end, row + 1.0) - max(begin, row)) / (end - begin);
    float up = (0.5 * flatPanel.y - row - 0.5) * pixelPitch;
    vec2 middle = vec2((across + up * axis.x) / axis.y / pixelPitch + 0.5 * flatPanel.x - 0.5, row);
#else
    float share = 1.0;
#endif
    float last = min(flatPanel.x - 1.0, ceil(middle.x + reach.x));
    for (float column = max(0.0, floor(middle.x - reach.x)); column <= last; column += 1.0) {
      vec2 pixel = vec2(column, row);
      vec3 weight = share * weightsOf(pixel, corner, vec2(column - middle.x, middle.y - row));
      if (!isDark(weight)) light += weight * fetchLight(pixel);
    }
  }
#endif
  return light;
}

void main() {
  vec3 sum = vec3(0.0);
  for (int j = 0; j < finer.y; j += 1) {
    for (int i = 0; i < finer.x; i += 1) sum += lightAt(panePixel() * vec2(finer) + vec2(i, j));
  }
  vec3 light = clamp(sum / float(finer.x * finer.y), 0.0, 1.0);
  vec3 code = isCoded ? encodeSrgb(light) : light;
  if (overlayShare > 0.0) {
    Fixed u, v;
    visiblePoint(panePixel() * vec2(finer) + vec2(finer / 2), u, v);
    vec2 pixel = pixelOf(u, v);
    if (isOnPanel(pixel)) code = mix(code, fetchOverlay(pixel), overlayShare);
  }
  color = vec4(code, 1.0);
}`;

// One view of the focus sum: linear RGB, and alpha 1 to count views.
const SUMMAND = `
uniform bool isCoded;
out vec4 color;

void main() {
  Fixed u, v;
  visiblePoint(panePixel(), u, v);
  vec2 pixel = pixelOf(u, v);
  if (!isOnPanel(pixel)) discard;
#if LAYOUT == HEXAGONAL
  // The views of a hexagonal array fill the bounding box of a micro-image, whose corners belong to neighbours.
  if (lensOfPoint(pixel, vec2(0.5)) != visibleLens) discard;
#endif
  vec3 code = fetchCode(pixel);
  color = vec4(isCoded ? decodeSrgb(code) : code, 1.0);
}`;

/** The mean of the focus sum, as display codes. */
export const MEAN = `${HEAD}${SRGB}
uniform sampler2D sum;
uniform ivec2 corner;
uniform bool isCoded;
out vec4 color;

void main() {
  vec4 total = texelFetch(sum, ivec2(gl_FragCoord.xy) - corner, 0);
  vec3 mean = clamp(total.rgb / max(total.a, 1.0), 0.0, 1.0);
  color = vec4(isCoded ? encodeSrgb(mean) : mean, 1.0);
}`;

// Index of the lens that shows a panel point: Display.lens_of.
const LENS_OF_POINT = `
uniform float acrossOf[3];  // lens coordinate of a panel point: per column and row, and at (0, 0)
uniform uint acrossOfParts[3];
uniform float downOf[3];
uniform uint downOfParts[3];
uniform vec4 gradients;  // of the lens coordinates (across by u, across by v, down by u, down by v)

vec2 lensOfPoint(vec2 pixel, vec2 within) {
  vec2 step = vec2(dot(gradients.xy, within), dot(gradients.zw, within));
  uvec2 k = uvec2(ivec2(pixel)), steps = uvec2(fract(step) * 16777216.0) << 8;
  float a = acrossOf[0] * pixel.x + acrossOf[1] * pixel.y + acrossOf[2] + step.x;
  uint aParts = acrossOfParts[0] * k.x + acrossOfParts[1] * k.y + acrossOfParts[2] + steps.x;
#if LAYOUT == LENTICULAR
  return vec2(fixedPoint(a, aParts).whole, 0.0);
#else
  float d = downOf[0] * pixel.x + downOf[1] * pixel.y + downOf[2] + step.y;
  return lensAt(a, aParts, d, downOfParts[0] * k.x + downOfParts[1] * k.y + downOfParts[2] + steps.y);
#endif
}
`;

// Native pixels in a round magnifier, with outlines of the micro-images and a frame around each visible pixel.
const MAGNIFIER = `
uniform vec2 middle;  // of the magnifier in the canvas
uniform float radius;
uniform float scale;  // canvas pixels per panel pixel
uniform vec2 centerPixel;  // panel pixel in the middle of the magnifier
uniform vec2 centerPart;
uniform float visibleU[3];  // visible column of a lens: per lens and row (or shifted row), and at (0, 0)
uniform uint visibleUParts[3];
uniform float visibleV[2];  // visible row: per row of lenses, and at 0
uniform uint visibleVParts[2];
uniform vec3 rimColor;
out vec4 color;

bool isVisible(vec2 pixel) {
  vec2 lens = lensOfPoint(pixel, vec2(0.5));
#if LAYOUT == LENTICULAR
  float second = pixel.y;
#else
  float second = shiftOf(lens.y);
#endif
#if BENT
  vec2 shifted = bent(lens, second * float(LAYOUT != LENTICULAR));
#if LAYOUT == LENTICULAR
  // Along the slanted axis, back to the middle of the row.
  shifted.x += shifted.y * moves.y / moves.x;
#endif
#else
  vec2 shifted = vec2(0.0);
#endif
#if LAYOUT != LENTICULAR
  float v = visibleV[0] * lens.y + visibleV[1];
  Fixed row = fixedPoint(v, visibleVParts[0] * uint(int(lens.y)) + visibleVParts[1]);
  if (row.whole + floor(row.part + shifted.y) != pixel.y) return false;
#endif
  float u = visibleU[0] * lens.x + visibleU[1] * second + visibleU[2];
  uint uParts = visibleUParts[0] * uint(int(lens.x)) + visibleUParts[1] * uint(int(second)) + visibleUParts[2];
  Fixed column = fixedPoint(u, uParts);
  return column.whole + floor(column.part + shifted.x) == pixel.x;
}

void main() {
  vec2 beside = gl_FragCoord.xy - middle;
  float distance = length(beside);
  if (distance > radius + 2.0) discard;
  vec2 place = centerPart + vec2(beside.x, -beside.y) / scale;
  vec2 pixel = centerPixel + floor(place);
  vec2 within = fract(place);
  vec3 shade = fetchCode(pixel);
  vec2 fromEdge = min(within, 1.0 - within) * scale;
  float edge = min(fromEdge.x, fromEdge.y);
  if (isOnPanel(pixel)) {
    if (scale >= 8.0 && edge < 0.5) shade *= 0.82;
    if (isVisible(pixel)) shade = edge < max(1.5, 0.12 * scale) ? rimColor : shade;
    else shade *= 0.72;
    // An outline lies where a point 1.5 canvas pixels further belongs to another lens.
    vec2 step = vec2(1.5) / scale;
    vec2 here = lensOfPoint(pixel, within);
    bool isOutline = lensOfPoint(pixel, within + vec2(step.x, 0.0)) != here
      || lensOfPoint(pixel, within + vec2(0.0, step.y)) != here;
    if (isOutline) shade = vec3(1.0);
  }
  float rim = smoothstep(radius - 1.5, radius - 0.5, distance);
  color = vec4(mix(shade, vec3(0.95), rim), 1.0 - smoothstep(radius, radius + 1.5, distance));
}`;

/**
 * Source of a fragment shader. Properties of the picture are compiled in: layout and slant of the lenses; the number of
 * factors of their distortion (`bent`: 0 of a pinhole); arrangement
 * of sub-pixels (`cells`: 0 all in the pixel's centre, 1 in a row, 2 any, 3 in cells of several kinds, the nearest
 * within `reach` pixels); whether the picture is one texture or an array of tiles (`tiled`); whether the colours of a
 * pixel shine at places of their own (`split`), and whether all rows of pixels are weighed alike (`alike`). A pixel of
 * the pane is the mean of `points` x `points` points.
 */
export function fragmentSource(kind, points, variant) {
  const { layout, slanted, bent, cells, reach, tiled, split = false, alike = false } = variant;
  const values = {
    POINTS: points,
    LAYOUT: layout,
    SLANTED: slanted,
    BENT: bent,
    CELLS: cells,
    REACH: reach,
    TILED: tiled,
    SPLIT: split,
    ALIKE: alike,
  };
  const defines = Object.entries(values).map(([name, value]) => `#define ${name} ${Number(value)}\n`);
  const bodies = {
    eye: SRGB + BENDING + SIGHTLINE + MEAN_CODE + EYE,
    overlaid: SRGB + BENDING + SIGHTLINE + MEAN_CODE + OVERLAY,
    real: SRGB + BENDING + SIGHTLINE + REAL,
    summand: SRGB + LENS_OF_POINT + BENDING + SIGHTLINE + SUMMAND,
    magnifier: LENS_OF_POINT + BENDING + MAGNIFIER,
  };
  return HEAD + defines.join("") + FIXED_POINT + LENSES + TILES + bodies[kind];
}
