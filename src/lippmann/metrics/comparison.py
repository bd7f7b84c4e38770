"""All metrics of a picture against a reference of the same display."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lippmann.display import Display
from lippmann.errors import PictureError
from lippmann.image import Picture
from lippmann.json_values import JsonObject, JsonValue
from lippmann.metrics.flicker import Flicker
from lippmann.metrics.mse_psnr import LOW_PERCENTILE, MicroImage, low_percentile, psnr, squared_errors
from lippmann.metrics.panel_sums import PanelSums
from lippmann.metrics.paper import PaperFigures
from lippmann.metrics.silhouettes import SilhouetteShare, depth_of, source_of
from lippmann.metrics.structural_similarity import ViewSimilarity
from lippmann.metrics.view_metrics import ViewSums
from lippmann.options.option import checked
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.runtime.engine_lock import cached_property

Real = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Metrics of ``test`` against ``reference``, as :func:`compare` computes them.

    Parameters
    ----------
    reference, test:
        The pictures.
    mean_squared_error:
        Mean squared error of all pixels and channels, coded values.
    off_silhouettes_error:
        The same over the pixels that lie on no silhouette; None if there are none.
    micro_image_errors, micro_image_pixels:
        ``(lens_rows, lens_cols)``: mean squared error of each micro-image (NaN where a lens has no pixel), and its
        pixels.
    micro_image_similarity:
        ``(lens_rows, lens_cols)``: SSIM of each micro-image (NaN where a lens has no pixel), see
        :mod:`~lippmann.metrics.micro_image_similarity`.
    silhouettes:
        Share of the reference's pixels that lie on outlines.
    views:
        SSIM of the views.
    flicker:
        Change of the errors from view to view; None if there is one view only.
    paper:
        The figures of the 2014 paper.

    Examples
    --------
    >>> import numpy as np
    >>> from lippmann.metrics.comparison import compare
    >>> white = lippmann.IntegralImage(np.ones((8, 16, 3)), lippmann.load_display("seed-lenticular").resized(16, 8))
    >>> compare(white, white.with_pixels(np.zeros((8, 16, 3)))).micro_image_errors.shape
    (1, 2)
    """

    reference: Picture
    test: Picture
    mean_squared_error: float
    off_silhouettes_error: float | None
    micro_image_errors: Real
    micro_image_pixels: NDArray[np.intp]
    micro_image_similarity: Real
    silhouettes: SilhouetteShare
    views: ViewSimilarity
    flicker: Flicker | None
    paper: PaperFigures

    @cached_property
    def errors(self) -> Real:
        """``(H, W)``: squared difference of the coded values of each pixel, averaged over its channels.

        Computed when it is first asked for: all other figures take little memory, however large the panel.
        """
        return squared_errors(self.reference, self.test)

    @property
    def psnr(self) -> float:
        """In dB, from :attr:`mean_squared_error`; infinite for pictures that show the same."""
        return psnr(self.mean_squared_error)

    @property
    def identical(self) -> bool:
        """Whether both pictures show exactly the same on the display."""
        return self.mean_squared_error == 0

    @property
    def worst(self) -> MicroImage:
        """The micro-image with the least PSNR."""
        return low_percentile(self.micro_image_errors, self.micro_image_pixels, 0.0)

    @property
    def percentile_1(self) -> MicroImage:
        """The micro-image at the 1st percentile of PSNR, see :func:`~lippmann.metrics.low_percentile`."""
        return low_percentile(self.micro_image_errors, self.micro_image_pixels, LOW_PERCENTILE)

    @property
    def mean_similarity(self) -> float:
        """Mean SSIM of the micro-images."""
        return float(np.nanmean(self.micro_image_similarity))

    @property
    def least_similar(self) -> tuple[int, int, float]:
        """Column and row of the micro-image with the least SSIM, and that SSIM."""
        row, column = divmod(int(np.nanargmin(self.micro_image_similarity)), self.micro_image_similarity.shape[1])
        return column, row, float(self.micro_image_similarity[row, column])

    @property
    def psnr_off_silhouettes(self) -> float | None:
        """PSNR in dB over the pixels that lie on no silhouette; None if there are none."""
        return None if self.off_silhouettes_error is None else psnr(self.off_silhouettes_error)

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what may mislead a reader of the metrics."""
        return tuple(_notes(self.reference, self.test))

    def to_dict(self) -> JsonObject:
        """All metrics but those of single micro-images, as values for JSON; an infinite PSNR is None."""
        worst_view = self.views.worst
        lenses = int(np.count_nonzero(self.micro_image_pixels))
        return {
            "identical": self.identical,
            "mean_squared_error": self.mean_squared_error,
            "psnr": _finite(self.psnr),
            "psnr_off_silhouettes": _finite(self.psnr_off_silhouettes),
            "silhouettes": {"from": self.silhouettes.source, "share": self.silhouettes.share},
            "micro_images": {
                "count": lenses,
                "worst": _lens(self.worst),
                "percentile_1": _lens(self.percentile_1),
                "ssim": {
                    "mean": self.mean_similarity,
                    "worst": self.least_similar[2],
                    "worst_lens": list(self.least_similar[:2]),
                },
            },
            "ssim": {
                "mean": _finite(self.views.mean),
                "worst": _finite(float(self.views.values[worst_view])),
                "worst_view": [worst_view[1], worst_view[0]],
                "views": [[_finite(value) for value in row] for row in self.views.values.tolist()],
                "views_are_exact": self.views.exact,
            },
            "flicker": None
            if self.flicker is None
            else {"psnr": _finite(self.flicker.psnr), "share": self.flicker.share},
            "paper": {
                "paper_mean_psnr": _finite(self.paper.mean_psnr),
                "paper_mean_rmse": self.paper.mean_rmse,
                "unchanged_micro_images": self.paper.unchanged,
            },
            "notes": list(self.notes),
        }

    def rows(self) -> Iterator[dict[str, float]]:
        """Metrics of every micro-image, lens row by lens row, as a CSV file holds them; PSNR in dB may be infinite."""
        paper_psnr = self.paper.psnr
        for row, column in zip(*np.nonzero(self.micro_image_pixels), strict=True):
            error = float(self.micro_image_errors[row, column])
            yield {
                "column": int(column),
                "row": int(row),
                "pixels": int(self.micro_image_pixels[row, column]),
                "mean_squared_error": error,
                "psnr": psnr(error),
                "ssim": float(self.micro_image_similarity[row, column]),
                "paper_rmse": float(self.paper.rmse[row, column]),
                "paper_psnr": float(paper_psnr[row, column]),
            }


@checked
def compare(reference: Picture, test: Picture, progress: ProgressCallback = silent) -> Comparison:
    """Compare two pictures of the same display, in memory or read piece by piece.

    Coded values are compared (see :mod:`lippmann.metrics.mse_psnr`), all channels; silhouettes are the reference's.

    Parameters
    ----------
    reference, test:
        The pictures; some rows of each are read at a time.
    progress:
        Called after every block of rows.

    Raises
    ------
    PictureError
        If the pictures have different sizes or displays, or the file of one is damaged.

    Examples
    --------
    >>> import numpy as np
    >>> from lippmann.metrics.comparison import compare
    >>> white = lippmann.IntegralImage(np.ones((8, 16, 3)), lippmann.load_display("seed-lenticular").resized(16, 8))
    >>> compare(white, white).mean_squared_error
    0.0
    """
    check_comparable(reference, test)
    panel = reference.display.panel
    sums, views = PanelSums(reference, test), ViewSums(reference, test)
    for rows in _in_step(sums.work(), views.work()):
        progress(Progress("compare", rows, 2 * panel.height))
    pixels = panel.width * panel.height
    return Comparison(
        reference,
        test,
        mean_squared_error=float(sums.errors.sum()) / pixels,
        off_silhouettes_error=sums.off_error / sums.off_pixels if sums.off_pixels else None,
        micro_image_errors=sums.means(sums.errors),
        micro_image_pixels=sums.pixels,
        micro_image_similarity=sums.similarity.values(),
        silhouettes=SilhouetteShare(1 - sums.off_pixels / pixels, source_of(depth_of(reference))),
        views=views.similarity,
        flicker=views.flicker,
        paper=PaperFigures(sums.means(sums.paper_errors)),
    )


def _in_step(*parts: Iterator[int]) -> Iterator[int]:
    """Advance the part that has done the fewest rows, so that a piece of a file that all parts need is decoded once.

    Parts yield the number of rows done; so does this, the sum over all parts.
    """
    done = dict.fromkeys(parts, 0)
    running = set(parts)
    while running:
        part = min(running, key=lambda one: done[one])
        rows = next(part, None)
        if rows is None:
            running.remove(part)
        else:
            done[part] = rows
            yield sum(done.values())


def check_comparable(reference: Picture, test: Picture) -> None:
    """Raise :class:`PictureError` if two pictures have different sizes or displays; a display's name does not count."""
    a, b = (picture.display.panel for picture in (reference, test))
    if (a.width, a.height) != (b.width, b.height):
        raise PictureError(
            f"the pictures have {a.width} x {a.height} and {b.width} x {b.height} pixels",
            rule="only pictures of one display can be compared",
        )
    if _optics(reference.display) != _optics(test.display):
        raise PictureError(
            f"the pictures are for different displays: {_difference(reference.display, test.display)}",
            rule="only pictures of one display can be compared",
        )


def _optics(display: Display) -> Display:
    return replace(display, name="display", title="", sheet=None)


def _difference(a: Display, b: Display) -> str:
    """The first value in which two displays differ, for an error message."""
    if a.name != b.name:
        return f"{a.name} and {b.name}"
    first, second = _flatten(a.to_dict()), _flatten(b.to_dict())
    key = next(key for key in first if key != "title" and first[key] != second.get(key))
    return f"{key} is {first[key]} in one and {second.get(key)} in the other"


def _flatten(values: Mapping[str, JsonValue], prefix: str = "") -> JsonObject:
    """Nested objects as one, with dotted keys."""
    flat: JsonObject = {}
    for key, value in values.items():
        flat |= _flatten(value, f"{prefix}{key}.") if isinstance(value, Mapping) else {prefix + key: value}
    return flat


def _notes(reference: Picture, test: Picture) -> Iterator[str]:
    first, second = reference.provenance, test.provenance
    if first.transfer != second.transfer:
        yield f"the codes of the pictures are compared, though one is {first.transfer} and the other {second.transfer}"
    maps = [each.options.get("tone_map", "none") for each in (first, second)]
    if maps[0] != maps[1]:
        yield f"the pictures are tone-mapped differently: {maps[0]} and {maps[1]}"
    if first.scene and second.scene and first.scene != second.scene:
        yield f"the pictures show different scenes: {first.scene} and {second.scene}"
    elif first.method and second.method and not np.allclose(reference.world_from_display, test.world_from_display):
        yield "the display stands at a different place in the scene"


def _lens(micro_image: MicroImage) -> JsonObject:
    place = [micro_image.column, micro_image.row]
    return {"psnr": _finite(micro_image.psnr), "lens": place, "pixels": micro_image.pixels}


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
