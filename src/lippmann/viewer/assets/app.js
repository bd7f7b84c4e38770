/**
 * Starts the viewer of a page. The pictures are inside the page, if it is a single file, or come from its server.
 * `?memory=MB` limits the graphics memory of a picture.
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
  const setTitle = () => {
    document.title = viewer.manifests.map(({ name }) => name).join(" | ");
  };
  // The viewer itself displays errors.
  viewer.ready.then(setTitle, () => {});
}
