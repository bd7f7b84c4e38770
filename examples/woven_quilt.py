"""A quilt of 24 views of the tree, and what an eye sees once it is woven for a panel; woven_quilt.png."""

import sys
from pathlib import Path

import numpy as np

import lippmann
from lippmann.image.write import write_plain_picture
from lippmann.quilts.weave import weave


def main(path: Path, width: int = 900) -> None:
    display = lippmann.load_display(f"monitor:size={width}x{width * 4 // 3},dpi=200,pitch=8.6,slope=7.1,center=0.4")
    quilt = lippmann.render_quilt("tree", display, views=(6, 4), size=(1440, 1280), spp=1)
    seen = weave(quilt, display).replay(size=(360, 466), filter="linear")[20:-20, 20:-20]
    write_plain_picture(np.hstack([np.float32(quilt.values[::3, ::3][:426]), seen]), path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
