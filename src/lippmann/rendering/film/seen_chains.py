"""How many chains of sharp events each path of a picture comes with: one number, or none.

Where photons divide light anyway, each path comes with them, unless a search (:mod:`.image_search`) finds that the
picture shows no emitter so small that paths miss its image; where a quality is asked for, then too.

Without photons, chains cost a quarter of a path each. They pay beside a denoiser alone, and where seen light is an
image that a few of them, spread evenly over the pixel, show well: a sky in smooth gloss. Light that one chain in many
meets is noisy even with hundreds, and a denoiser makes as much of the samples that the same time brings.

The more samples, the fewer chains each comes with (docs/research/seen-light.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.rendering.film.image_search import search_images
from lippmann.rendering.film.seen_look import SeenLook
from lippmann.rendering.request.choices import REUSING
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.ray_source import RaySource
from lippmann.runtime import engine, machine

#: Variance of a path's light, seen light apart, in codes; and where a denoiser takes most of it away: those of usual
#: scenes.
REST_VARIANCE, CLEAN_REST_VARIANCE = 0.01, 0.001
#: Chains of a pixel, spread evenly, whose mean is to show an image where there are no photons; and its variance times
#: their number, in codes: below the first a denoiser shows it as well without chains, above the second it does better
#: (0.0006 to 0.001 for a sky in smooth gloss, 0.008 to 0.02 for spots of light in beads, metal and varnish).
SPREAD, LEAST_SPREAD, MOST_SPREAD = 4, 1.5e-4, 3e-3
#: Chains of each path where it is the only one of its pixel, or where a quality is asked for and there are photons;
#: otherwise their number goes with one over the root of the samples'.
OF_ONE_SAMPLE = 8
#: Chains of a path by which what single ones meet is held to be too bright or not.
USUAL = 2
#: dB that a whole picture has after its first few samples beside a denoiser, with chains or without.
REACHED_BY_FEW = 38.0
#: Samples that a picture is taken to need at most, and at least, of which it is not known.
OPEN_ENDED, FEWEST_OPEN_ENDED = 128, 8
#: Seconds of a processor core that a path without chains takes where there are photons, in the bundled scenes; and of a
#: GPU.
PATH_SECONDS, PATH_SECONDS_ON_GPU = 4e-6, 1e-7
#: Samples that a picture whose time is limited must be able to have for a search and chains to be worth theirs: few
#: samples come with so many chains that each takes twice as long.
FEWEST_IN_TIME = 8


@dataclass(frozen=True)
class GivenChains:
    """Chains that each path comes with; ``without_images``: a search found no small image."""

    number: int = 0
    without_images: bool = False


def give_chains(integrator: PathIntegrator, request: RenderRequest, source: RaySource, memory: int) -> GivenChains:
    """Give the integrator the chains for the picture of ``source``.

    They are aimed at the images of small emitters that a search finds.

    Parameters
    ----------
    integrator:
        Ready for the picture.
    request:
        How the picture is to be made.
    source:
        Rays of the whole picture: parts of one picture must be told the same.
    memory:
        Bytes that the search for images may take.
    """
    # Where all rays of a pixel are one, or its points are taken from others, further ones show nothing.
    if not request.box_filter or request.method in REUSING:
        return GivenChains()
    samples, is_clean = expected_samples(request), request.denoise != "none"
    if request.max_time is not None:
        in_time = samples_in(request.max_time, source.width * source.height * source.channels, request.threads)
        if in_time < FEWEST_IN_TIME:
            return GivenChains()
        samples = min(samples, in_time)
    has_photons = integrator.photons is not None
    if not has_photons:
        if not is_clean or _is_reached_by_few(request):
            return GivenChains()
        look = SeenLook(integrator, source, samples, request.transfer, request.seed)
        if not shows_image(SPREAD * look.variance_of_means(SPREAD, samples * USUAL)):
            return GivenChains()
    search = search_images(integrator.scene, source, samples, memory)
    # By its first samples a picture tells how far it is from its quality: they must know what few paths meet.
    is_judged = has_photons and request.has_quality
    without_images = has_photons and search.none_small
    if without_images and not is_judged:
        return GivenChains(without_images=True)
    number = OF_ONE_SAMPLE if is_judged else chains_of(samples)
    integrator.seen_chains = dr.opaque(mi.UInt32, number)
    integrator.mirror_images = search.images
    return GivenChains(number, without_images)


def shows_image(variance: float) -> bool:
    """Whether seen light is an image that a few chains show better than a denoiser makes it of none.

    By the variance in codes of the mean of :data:`SPREAD` chains times their number.
    """
    return LEAST_SPREAD < variance < MOST_SPREAD


def chains_of(samples: int) -> int:
    """Chains of each path of so many in a pixel: a power of two, 2 at least, as one brings no more than the path."""
    return 1 << max(1, round(math.log2(OF_ONE_SAMPLE / math.sqrt(samples))))


def _is_reached_by_few(request: RenderRequest) -> bool:
    """Whether a quality is asked for, of the whole picture, to which chains without photons are only in the way."""
    return request.quality is not None and request.quality_worst is None and request.quality < REACHED_BY_FEW


def samples_in(seconds: float, pixels: int, threads: int | None) -> int:
    """Samples of each of so many pixels, channels apart, that a time allows, by the usual cost of a path."""
    spent = PATH_SECONDS_ON_GPU if engine.runs_on_gpu() else PATH_SECONDS / (threads or machine.usable_cores())
    return int(min(seconds / (pixels * spent), OPEN_ENDED))


def expected_samples(request: RenderRequest) -> int:
    """Samples of a pixel that the picture will take, about.

    The worst micro-image is that of a rare highlight, as a rule: where it is to be good, no few samples are counted on.
    """
    if not request.is_open_ended:
        return request.samples
    if request.quality is None or request.quality_worst is not None:
        return OPEN_ENDED
    rest = REST_VARIANCE if request.denoise == "none" else CLEAN_REST_VARIANCE
    return int(np.clip(rest * 10 ** (request.quality / 10), FEWEST_OPEN_ENDED, OPEN_ENDED))
