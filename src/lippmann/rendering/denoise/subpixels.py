"""Sub-pixels whose rays keep all three colours, for a picture that shows one of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.rendering.denoise.dual_buffer import Denoised
from lippmann.rendering.film.sample_batches import FullInBatches

if TYPE_CHECKING:
    from lippmann.rendering.transport.ray_source import SubpixelRays

Floats = NDArray[np.float32]


class SubpixelBatches(FullInBatches):
    """:class:`~lippmann.rendering.film.sample_batches.FullInBatches` over
    :class:`~lippmann.rendering.transport.ray_source.SubpixelRays`.

    Picture, halves and errors are ``(H, W)`` pixels of sub-pixels that show their own colour.
    """

    _source: SubpixelRays

    def picture(self) -> Floats:
        """``(H, W, 3)`` float32: the mean of all samples, linear."""
        return self.own_colors(super().picture())

    def halves(self) -> tuple[Floats, Floats]:
        """The means of either stream's samples, ``(H, W, 3)`` each."""
        first, second = super().halves()
        return self.own_colors(first), self.own_colors(second)

    def picture_of_all(self) -> Floats:
        """``(H, 3 W, 3)``: :meth:`picture` with all colours of all sub-pixels."""
        return super().picture()

    def halves_of_all(self) -> tuple[Floats, Floats]:
        """``(H, 3 W, 3)`` each: :meth:`halves` with all colours of all sub-pixels."""
        return super().halves()

    def own_colors(self, values: Floats) -> Floats:
        """Of all colours, see :meth:`halves_of_all`, those that the sub-pixels show."""
        return self._source.own_colors(values)

    def shown(self, values: Floats) -> Floats:
        return self.own_colors(values)


class DenoisedSubpixels(Denoised):
    """:class:`~lippmann.rendering.denoise.dual_buffer.Denoised` where the denoiser takes and gives all colours of all
    sub-pixels."""

    _renderer: SubpixelBatches

    def _clean_picture(self) -> Floats:
        return self._cleaned_and_shared(self._renderer.picture_of_all(), self._renderer.seen())[-1]

    def _versions(self, noisy: tuple[Floats, Floats]) -> tuple[list[Floats], list[Floats]]:
        return super()._versions(self._renderer.halves_of_all())

    def _cleaned_and_shared(self, noisy: Floats, seen: Floats | None, turned: bool = False) -> list[Floats]:
        return [self._renderer.own_colors(version) for version in super()._cleaned_and_shared(noisy, seen, turned)]
