"""The viewer as a Jupyter widget.

The widget sends all data to the browser when it is made, and receives nothing. So it works on without a kernel, and in
a notebook that was saved with its widgets.
"""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import anywidget
import traitlets

from lippmann.runtime.machine import usable_cores
from lippmann.viewer import page
from lippmann.viewer.lens_light import lens_light
from lippmann.viewer.manifest import manifest, tile_size
from lippmann.viewer.tiles import Tiles

if TYPE_CHECKING:
    from lippmann.image import IntegralImage

#: Loads the page's modules and joins the viewer to the widget's model. A notebook's page has no import map of ours,
#: but can import blob URLs: anywidget loads this very script from one. Each module therefore becomes a blob, in which
#: the blob URLs of the modules that it imports take the place of their names.
_LOADER = """
const addresses = new Map();

function addressOf(name) {
  if (!addresses.has(name)) {
    let text = MODULES[name];
    for (const other of Object.keys(MODULES)) {
      if (text.includes(`"${other}"`)) text = text.replaceAll(`"${other}"`, `"${addressOf(other)}"`);
    }
    addresses.set(name, URL.createObjectURL(new Blob([text], { type: "text/javascript" })));
  }
  return addresses.get(name);
}

const { createViewer } = await import(addressOf("lippmann/viewer.js"));
for (const address of addresses.values()) URL.revokeObjectURL(address);

export default {
  render({ model, el }) {
    const tiles = model.get("tiles");
    const source = {
      manifest: async () => model.get("description"),
      tile: async (layer, column, row) => tiles[`${layer}/${column}_${row}`],
      light: async () => model.get("light"),
    };
    el.classList.add("lippmann-cell");
    const viewer = createViewer(el, source, { compact: true });
    return () => viewer.destroy();
  },
};
"""

#: A cell gets a height that the user can change, and a button for the controls, which are hidden at first.
_CELL = """
.lippmann-cell { height: 34rem; min-height: 12rem; resize: vertical; overflow: hidden; }
.lippmann-cell .more { display: inline-block; }
"""


class PictureWidget(anywidget.AnyWidget):
    """Jupyter widget that shows a picture as its display would show it.

    Parameters
    ----------
    image:
        The picture. Its tiles are compressed here, about ten million pixels per second.
    """

    _esm = f"const MODULES = {json.dumps(page.modules())};\n{_LOADER}"
    _css = page.style() + _CELL

    description = traitlets.Dict().tag(sync=True)
    tiles = traitlets.Dict().tag(sync=True)
    light = traitlets.Dict(allow_none=True).tag(sync=True)

    def __init__(self, image: IntegralImage) -> None:
        image_tiles = Tiles(image, tile_size(image.display))
        name = image.provenance.scene or "picture"
        description = manifest(image, image_tiles, name=name, tile_format="png")
        places = [
            (layer, c, r)
            for layer in image_tiles.layers
            for r in range(image_tiles.rows)
            for c in range(image_tiles.columns)
        ]
        with ThreadPoolExecutor(usable_cores()) as pool:
            files = list(pool.map(lambda place: image_tiles.png(*place), places))
        keys = [f"{layer}/{column}_{row}" for layer, column, row in places]
        tiles = dict(zip(keys, files, strict=True))
        super().__init__(description=description, tiles=tiles, light=lens_light(image.display))
