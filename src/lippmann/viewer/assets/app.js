/**
 * Starts the page that the script is in: its pictures are inside it, if it is one file, or come from its server.
 * `?memory=MB` says how much of the graphics card's memory a picture may take.
 */

import { embeddedSource, serverSource } from "lippmann/source.js";
import { createViewer } from "lippmann/viewer.js";

const root = document.querySelector("main[data-lippmann-pictures]");
if (root) {
  const data = document.getElementById("lippmann-data");
  const count = Number(root.dataset.lippmannPictures);
  const sources = data
    ? JSON.parse(data.textContent).map(embeddedSource)
    : Array.from({ length: count }, (_, number) => serverSource(number));
  const memory = Number(new URLSearchParams(location.search).get("memory")) * 1e6;
  const viewer = createViewer(root, sources, memory > 0 ? { memory } : {});
  window.lippmann = { viewer };
  const named = () => {
    document.title = viewer.manifests.map(({ name }) => name).join(" | ");
  };
  // What failed is said on the page.
  viewer.ready.then(named, () => {});
}
