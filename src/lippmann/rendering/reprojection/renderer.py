"""Rendering by reprojection: the choice of order and method, and the frame."""

from __future__ import annotations

import time
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Transfer
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.rendering.film.memory_model import PICTURE, POINT_IMAGE, fit_lanes
from lippmann.rendering.film.wavefront import Frame
from lippmann.rendering.reprojection.default_order import DefaultOrder
from lippmann.rendering.reprojection.paper_order import PaperOrder
from lippmann.rendering.reprojection.pixel_tracer import PixelTracer
from lippmann.rendering.reprojection.point_image import (
    INTERPOLATED,
    REPROJECTED,
    STATUS_LAYER,
    TRACED,
    PointImage,
)
from lippmann.rendering.reprojection.rules import choose_rules
from lippmann.rendering.transport.integrator import ReusableIntegrator
from lippmann.rendering.transport.ray_source import DisplayRays
from lippmann.runtime.row_threads import Bands

ReuseMethod = Literal["lens-view", "interpolated"]
ReuseOrder = Literal["default", "paper"]


def trace_reused(
    integrator: ReusableIntegrator,
    source: DisplayRays,
    *,
    method: ReuseMethod,
    order: ReuseOrder,
    careful: bool,
    samples: int,
    seed: int,
    box_filter: bool,
    transfer: Transfer,
    memory: int,
    display_from_world: NDArray[np.float64],
    threads: int,
    progress: ProgressCallback = silent,
) -> Frame:
    """Trace some pixels of a display's picture and reproject them to the others.

    Parameters
    ----------
    method, order:
        As in :class:`~lippmann.rendering.request.render_request.RenderRequest`.
    careful:
        Trace pixels that reprojection would falsify; ignored in the paper's order.
    samples, seed, box_filter:
        Those of the traced pixels, which have the same samples as in a full rendering.
    transfer:
        Transfer curve of the picture, by which colours are compared.
    memory:
        Bytes that may be taken.
    threads:
        CPU threads of reprojection; the result does not depend on them.

    Returns
    -------
    Frame
        With the layer ``status`` ((H, W) int8: :data:`~lippmann.rendering.reprojection.point_image.TRACED`,
        ``REPROJECTED`` or ``INTERPOLATED``), and the shares of pixels that were ``traced``, ``reprojected`` and
        ``interpolated``.

    Raises
    ------
    MemoryLimitError
        If picture, points and the smallest wavefront do not fit into ``memory``.
    """
    from numba.core import event

    most_lanes = wavefront_lanes(memory, source.width, source.height, samples)
    started = time.perf_counter()
    points = PointImage.empty(source.height, source.width)
    compiling = cast("Any", event).TimingListener()
    bands = Bands(threads)
    with event.install_listener("numba:compile", compiling):
        tracer = PixelTracer(
            integrator,
            source,
            samples=samples,
            seed=seed,
            box_filter=box_filter,
            most_lanes=most_lanes,
            display_from_world=display_from_world,
            bands=bands,
            progress=progress,
        )
        arguments = source.display, points, tracer, bands
        rules = choose_rules(careful=careful, coded=transfer == "srgb")
        is_paper = order == "paper"
        maker = PaperOrder(*arguments) if is_paper else DefaultOrder(*arguments, rules)
        if method == "lens-view":
            maker.lens_view()
        else:
            maker.interpolated()
        if careful and isinstance(maker, DefaultOrder):
            maker.correct()
    progress(Progress("trace", 1, 1))
    seconds_compile = tracer.seconds_compile + (compiling.duration if compiling.done else 0.0)
    return Frame(
        points.color,
        tracer.rays,
        seconds_compile=seconds_compile,
        seconds_trace=tracer.seconds_trace,
        seconds_reuse=max(0.0, time.perf_counter() - started - tracer.seconds_trace - seconds_compile),
        maps={STATUS_LAYER: points.status},
        shares={
            "traced": points.share(TRACED),
            "reprojected": points.share(REPROJECTED),
            "interpolated": points.share(INTERPOLATED),
        },
    )


def wavefront_lanes(memory: int, width: int, height: int, samples: int) -> int:
    """Lanes of the largest wavefront beside a picture with its points.

    Raises
    ------
    MemoryLimitError
        If ``memory`` bytes do not hold even a small one.
    """
    kept = width * height * (PICTURE + POINT_IMAGE)
    return max(samples, fit_lanes(memory, kept, samples, f"{width}x{height} pixels and their points"))
