#!/usr/bin/env bash
# SPZ's own library: four of its sixteen coordinate systems are turned by 180 degrees about x against their names.
#
# Versions: @adobe/spz 0.2.3 (the WebAssembly build of github.com/nianticlabs/spz), Node 18 or newer.
# Believed: the letters of a system tell where its x, y and z point, as the README says: in RBU x points right, y back
#   and z up. So the point that lies 1 to the right, 2 up and 3 back is (1, 2, 3) in RUB and (1, 3, 2) in RBU.
# What happens: loading with to=RBU gives (1, -3, -2), which is its place in RFD; to=RFD gives (1, 3, 2). LBU and LFD are
#   exchanged alike. Of the rotated family RFU, RBD, LFU and LBD are right. The library turns about x and then mirrors y
#   where the letter of z differs, and z where that of y does.
# Who is hurt: whoever asks for one of these z-up systems, or stores files with the extension SPZ_ADOBE_coordinate_system
#   of that name: scenes lie on their head and face away, with nothing reported. Round trips through the library hide it.
# Seen: "RBU: (1, -3, -2), by its name (1, 3, 2)"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund --no-save @adobe/spz@0.2.3
cat > try.mjs <<'JAVASCRIPT'
import createSpz from "./node_modules/@adobe/spz/dist/spz.js";

const spz = await createSpz({ print: () => {}, printErr: () => {} });
const cloud = {
  numPoints: 1, shDegree: 0, antialiased: false, positions: new Float32Array([1, 2, 3]), scales: new Float32Array(3),
  rotations: new Float32Array([0, 0, 0, 1]), alphas: new Float32Array(1), colors: new Float32Array(3),
  sh: new Float32Array(0), extensions: [],
};
const file = spz.saveSpzToBuffer(cloud, { version: 4, from: spz.CoordinateSystem.RUB, sh1Bits: 8, shRestBits: 8 });
const places = { R: 1, L: -1, U: 2, D: -2, B: 3, F: -3 };
let wrong = 0;
for (const name of ["RUB", "RDF", "LUF", "RUF", "RFU", "RBD", "LFU", "LBD", "RBU", "RFD", "LBU", "LFD"]) {
  const found = Array.from(spz.loadSpzFromBuffer(file, { to: spz.CoordinateSystem[name] }).positions);
  const right = Array.from(name).map((letter) => places[letter]);
  wrong += found.join() !== right.join();
  console.log(`${name}: (${found.join(", ")}), by its name (${right.join(", ")})`);
}
process.exit(wrong === 4 ? 0 : 1);
JAVASCRIPT
node --no-warnings try.mjs | grep -v '^\[SPZ'
