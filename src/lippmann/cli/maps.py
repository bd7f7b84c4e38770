"""``--maps``: where the pixels of a picture came from, as a folder of PNGs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lippmann.atomic import replacing_folder
from lippmann.errors import UsageError

if TYPE_CHECKING:
    from lippmann.image import IntegralImage


def check_maps(method: str) -> None:
    """Refuse maps that could not be written, before anything is rendered.

    Raises
    ------
    UsageError
        If the method keeps no record of where pixels came from.
    """
    from lippmann.render.settings import REUSING

    if method not in REUSING:
        raise UsageError(
            f"{method} traces every pixel",
            where="--maps",
            rule=f"maps are for --method {' and '.join(REUSING)}",
            fix="leave it out",
        )


def write_maps(image: IntegralImage, folder: Path) -> None:
    """Write ``missed.png``, ``reprojected.png``, ``traced.png`` and, where any were, ``interpolated.png``.

    The first shows what became of each pixel: dark ones were reprojected, light ones missed and traced, orange ones
    missed and interpolated. The others show the pixels of one origin alone, the rest in violet.

    Raises
    ------
    OutputError
        If the folder cannot be written.
    """
    from lippmann.image.png import encode_png
    from lippmann.render.reuse.points import INTERPOLATED, REPROJECTED, TRACED
    from lippmann.report.pictures import missed_codes, part_codes, pixel_status

    status, missed = pixel_status(image), missed_codes(image)
    # check_maps has let through only methods that have both.
    assert status is not None
    assert missed is not None
    pictures = {"missed": missed}
    for name, value in (("reprojected", REPROJECTED), ("traced", TRACED), ("interpolated", INTERPOLATED)):
        if name != "interpolated" or (status == value).any():
            pictures[name] = part_codes(image, status == value)
    with replacing_folder(folder) as temporary:
        for name, codes in pictures.items():
            png = encode_png(codes, text={}, pixel_pitch=image.display.panel.pixel_pitch)
            (temporary / f"{name}.png").write_bytes(png)
