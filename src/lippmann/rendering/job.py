"""A scene with its rays and integrator, and its tracing in one stream of samples, which is all that previews need.

:mod:`.methods` has all recipes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lippmann.progress import ProgressCallback
from lippmann.rendering.denoise.guided_denoiser import GuidedDenoiser
from lippmann.rendering.film.memory_model import cut_wavefronts
from lippmann.rendering.film.wavefront import Frame, trace_frame
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.session import Session
from lippmann.rendering.transport.integrator import Integrator
from lippmann.rendering.transport.ray_source import DisplayRays, OnePicture, QuiltRays, SubpixelRays, WindowRays

if TYPE_CHECKING:
    from lippmann.rendering.estimate.psnr import Estimate, PixelErrors


@dataclass(frozen=True, eq=False)
class Job:
    """A scene, its rays and the integrator to trace them with.

    Attributes
    ----------
    session:
        The scene on the device, the request, and the machine's share.
    integrator, source:
        The integrator, and the rays of the picture.
    display_from_world:
        ``(4, 4)`` affine map to the display's frame (mm).
    is_part:
        Whether the source is a tile of a picture that is assembled and assessed elsewhere.
    """

    session: Session
    integrator: Integrator
    source: OnePicture | QuiltRays
    display_from_world: NDArray[np.float64]
    is_part: bool = False

    @property
    def request(self) -> RenderRequest:
        """The resolved request."""
        return self.session.request

    @property
    def progress(self) -> ProgressCallback:
        """The callback of progress reports."""
        return self.session.watch.progress

    @property
    def traced(self) -> OnePicture | QuiltRays:
        """The source whose samples are summed; for sub-pixels that are denoised, one that keeps all colours."""
        source = self.source
        if not isinstance(source, DisplayRays | WindowRays) or not self.request.keeps_colors(source.display):
            return source
        return SubpixelRays(source)

    @cached_property
    def denoiser(self) -> GuidedDenoiser:
        """The denoiser of the picture, which traces its guides once."""
        return GuidedDenoiser(
            self.session.built,
            self.traced,
            self.display_from_world,
            box_filter=self.request.box_filter,
            memory=self.session.memory,
            threads=self.session.engine.threads,
            kind=self.request.denoise,
            shares=self.request.shares_light,
            progress=self.progress,
        )


@dataclass(frozen=True)
class Traced:
    """The result of a job.

    Attributes
    ----------
    samples:
        Samples per pixel.
    estimate:
        Estimated PSNR; where it is None, ``notes`` say why.
    options, seconds:
        Metadata of the method, and the seconds of its own stages.
    errors:
        Squared errors of the pixels; None where they are unknown.
    """

    frame: Frame
    samples: int
    estimate: Estimate | None = None
    notes: tuple[str, ...] = ()
    options: dict[str, object] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    errors: PixelErrors | None = None


def one_stream(job: Job, *notes: str) -> Traced:
    """All samples in one stream: without half-buffers there is no error estimate."""
    request, source = job.request, job.traced
    plan = cut_wavefronts(
        source.width, source.height, request.samples, channels=source.channels, memory=job.session.memory
    )
    frame = trace_frame(
        job.integrator,
        source,
        plan,
        seed=request.seed,
        box_filter=request.box_filter,
        for_denoiser=request.denoise != "none",
        progress=job.progress,
    )
    return Traced(frame, request.samples, notes=notes)
