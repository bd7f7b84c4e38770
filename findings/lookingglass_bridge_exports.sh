#!/usr/bin/env bash
# Looking Glass's library for Bridge: the module formats that its package names are exchanged.
#
# Versions: @lookingglass/bridge 0.0.8-alpha.4 (npm, its newest), Node.js 20.19 or later.
# Believed: "import" leads to the file of ES modules (.mjs), "require" to the other one, as "main" and "module" of the same
#   package say; both give one BridgeClient, which is a singleton.
# What happens: "import" gives the UMD file, "require" the ES module. Node.js that cannot require ES modules, before
#   20.19, stops with ERR_REQUIRE_ESM; later ones hide it. A program whose parts import and require the library has two
#   clients, where the library means one.
# Who is hurt: Electron and Node.js programs that cast to displays; bundlers take the file from which nothing unused
#   can be left out.
# Seen: "import: dist/looking-glass-bridge.js, require: dist/looking-glass-bridge.mjs", "require alone: ERR_REQUIRE_ESM",
#   "one client: false".
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
echo '{"private": true}' >package.json
npm install --silent --no-audit --no-fund --ignore-scripts @lookingglass/bridge@0.0.8-alpha.4 >/dev/null
cat >try.mjs <<'NODE'
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import * as imported from "@lookingglass/bridge";

const path = "node_modules/@lookingglass/bridge/";
const { exports } = JSON.parse(readFileSync(path + "package.json", "utf8"));
const files = exports["."];
console.log("import: " + files.import.slice(2) + ", require: " + files.require.slice(2));
const isModule = (file) => /\bexport\s*\{/.test(readFileSync(path + file, "utf8"));
let alone = "works";
try {
  const words = ["--no-experimental-require-module", "-e", "require('@lookingglass/bridge')"];
  execFileSync(process.execPath, words, { stdio: "pipe" });
} catch (error) {
  alone = /ERR_\w+/.exec(String(error.stderr))?.[0] ?? String(error.stderr);
}
console.log("require alone: " + alone);
const required = createRequire(import.meta.url)("@lookingglass/bridge");
const isOne = required.BridgeClient === imported.BridgeClient;
console.log("one client: " + isOne);
const isExchanged = isModule(files.require) && !isModule(files.import);
process.exit(isExchanged && alone === "ERR_REQUIRE_ESM" && !isOne ? 0 : 1);
NODE
node --no-warnings try.mjs
