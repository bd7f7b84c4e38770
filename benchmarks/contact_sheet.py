"""A contact sheet of scene files, each as its plain picture: to look at many models at once.

Time on two cores: about two seconds a file.

python benchmarks/contact_sheet.py SHEET.png FILE...
"""

from __future__ import annotations

import sys
from pathlib import Path

from PIL import Image, ImageDraw

from lippmann import api
from lippmann.color.transfer import quantize
from lippmann.errors import LippmannError

SIZE, LABEL, COLUMNS, SPP = 200, 18, 6, 64


def cell(path: Path) -> Image.Image:
    """The picture of a file with its name below; black with the reason where it is refused."""
    sheet = Image.new("RGB", (SIZE, SIZE + LABEL))
    words = path.stem
    try:
        scene = api.load_scene(path)
        if not scene.has_lights:
            scene = api.load_scene(path, environment="studio")
        pixels = api.preview(scene, size=(SIZE, SIZE), spp=SPP).pixels
        sheet.paste(Image.fromarray(quantize(pixels, 8, "srgb")), (0, 0))
    except LippmannError as error:
        words = str(error)
    ImageDraw.Draw(sheet).text((3, SIZE + 3), words[:32], fill=(255, 255, 255))
    return sheet


def main(output: Path, files: list[Path]) -> None:
    rows = -(-len(files) // COLUMNS)
    sheet = Image.new("RGB", (SIZE * COLUMNS, (SIZE + LABEL) * rows))
    for number, path in enumerate(files):
        row, column = divmod(number, COLUMNS)
        sheet.paste(cell(path), (SIZE * column, (SIZE + LABEL) * row))
    sheet.save(output, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), [Path(name) for name in sys.argv[2:]])
