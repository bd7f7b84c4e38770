"""The page as a notebook's widget.

Everything travels to the browser when the widget is made; nothing comes back, so that the view goes on working when
the kernel is gone, in a notebook that was saved with its widgets too.
"""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import anywidget
import traitlets

from lippmann.runtime.machine import usable_cores
from lippmann.viewer import page
from lippmann.viewer.manifest import manifest, tile_size
from lippmann.viewer.tiles import Tiles

if TYPE_CHECKING:
    from lippmann.image import IntegralImage

#: Loads the page's modules and joins the viewer to the widget's model. A notebook's page may have no import map of ours,
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
    };
    el.classList.add("lippmann-cell");
    const viewer = createViewer(el, source, { compact: true });
    return () => viewer.destroy();
  },
};
"""

#: A cell has no height of its own, and people may want another one; its controls come when they are called.
_CELL = """
.lippmann-cell { height: 34rem; min-height: 12rem; resize: vertical; overflow: hidden; }
.lippmann-cell .more { display: inline-block; }
"""


class PictureWidget(anywidget.AnyWidget):
    """A picture as its display would show it.

    Parameters
    ----------
    image:
        What the panel shows. Its tiles are packed here, which takes a second for some ten million pixels.
    """

    _esm = f"const MODULES = {json.dumps(page.modules())};\n{_LOADER}"
    _css = page.style() + _CELL

    description = traitlets.Dict().tag(sync=True)
    tiles = traitlets.Dict().tag(sync=True)

    def __init__(self, image: IntegralImage) -> None:
        cut = Tiles(image, tile_size(image.display))
        name = image.provenance.scene or "picture"
        described = manifest(image, cut, name=name, tile_format="png")
        layers = [layer["name"] for layer in described["tiles"]["layers"]]
        places = [(layer, c, r) for layer in layers for r in range(cut.rows) for c in range(cut.columns)]
        with ThreadPoolExecutor(usable_cores()) as pool:
            packed = list(pool.map(lambda place: cut.png(*place), places))
        keys = [f"{layer}/{column}_{row}" for layer, column, row in places]
        super().__init__(description=described, tiles=dict(zip(keys, packed, strict=True)))
