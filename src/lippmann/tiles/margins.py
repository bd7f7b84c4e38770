"""Tiles whose pixels hang on those around: how much of the picture is rendered with each, to be cut off again.

Denoised pixels and shared light are made from their neighbours. A tile of such a picture is rendered as the middle of a
larger window, and what lies around it is thrown away. How much that must be follows from how far neighbours reach:

- Light that is shared after denoising comes from some lenses away, see :mod:`lippmann.rendering.sharing.cross_lens`.
  But it is smooth already: with more than ``SHARED_LENSES`` around them tiles come no nearer to the picture rendered
  whole.
- The network of Open Image Denoise sees pixels up to 87 away, and heeds the farther ones less and less: with
  ``DENOISER_REACH`` pixels around them tiles differ from the picture rendered whole by a twentieth of a code of 8 bits.

Windows begin at multiples of ``NETWORK_STEP`` pixels, for the network halves pictures four times: then it sees the same
pixels together in every window, as it does in the whole picture.
"""

from __future__ import annotations

from dataclasses import dataclass

from lippmann.display import Display
from lippmann.display.panel import PixelWindow
from lippmann.rendering.denoise.oidn import NETWORK_STEP
from lippmann.rendering.request.render_request import RenderRequest

#: Whole lenses around a tile whose light is shared after denoising.
SHARED_LENSES = 2
#: Pixels around a tile that is denoised.
DENOISER_REACH = 64


@dataclass(frozen=True)
class Surroundings:
    """``margin``: pixels rendered on each side of a tile, at least; windows begin at multiples of ``step``."""

    margin: int
    step: int

    def longest(self, side: int) -> int:
        """The longest side of the window of a tile with this side, in pixels."""
        return -(-(side + 2 * self.margin + self.step - 1) // self.step) * self.step

    def window(self, tile: PixelWindow, side: int, size: tuple[int, int]) -> PixelWindow:
        """The window rendered for ``tile``: tiles have this ``side``, the panel this ``size`` (width, height).

        All windows that the panel's edges do not cut are equally large, so that they share their kernels.
        """
        width, height = size
        left, columns = self._span(tile.left, side, width)
        top, rows = self._span(tile.top, side, height)
        return PixelWindow(left, top, columns, rows)

    def _span(self, first: int, side: int, count: int) -> tuple[int, int]:
        begin = (first - self.margin) // self.step * self.step
        end = min(count, begin + self.longest(side))
        return max(0, begin), end - max(0, begin)


def surroundings_of(display: Display, request: RenderRequest) -> Surroundings | None:
    """Margin that has to be rendered around tiles of a picture; None where every pixel stands for itself."""
    if not request.denoises:
        return None
    lens = max(1, round(display.pixels_per_lens[0]))
    shared = SHARED_LENSES * lens if request.shares_light else 0
    return Surroundings(max(shared, DENOISER_REACH), NETWORK_STEP)
