"""How many chains of sharp events each path of a picture comes with: by a look at how seen light varies.

What samples of each kind cost is best as the root of the variance that they take away times their cost (Neyman
allocation). The variance of seen light within pixels is measured, that of the rest and the cost of a chain are those of
usual scenes. Where there are caustics, a look may miss emitters that are seen so small that one chain in a million
meets one; a part of what that would bring is added, unless a search (:mod:`.image_search`) finds no such image.

Where a picture is denoised, hardly anything is left of the rest's variance, and all of that of seen light, which goes
past the denoiser: more chains are worth their time then, and too few of them are worse than none.

Without photons, chains cost a quarter of a path each. They pay beside a denoiser alone, and where seen light is an
image that a few of them, spread evenly over the pixel, show well: a sky in smooth gloss. Light that one chain in many
meets is noisy even with hundreds, and a denoiser makes as much of the samples that the same time brings. The more
samples, the fewer chains each comes with (docs/research/seen-light.md).

The more samples a pixel has, the brighter may one chain be without making the pixel white, and the more chains are
worth their time. Where a quality is asked for, and it is not known how many samples a picture will take, the first few
come with as many chains as suit a picture of few, and later ones with more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

import drjit as dr
import mitsuba as mi
import numpy as np

from lippmann.rendering.film.image_search import search_images
from lippmann.rendering.film.seen_look import CHAIN_COST, SeenLook
from lippmann.rendering.request.choices import REUSING
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.transport.chain_passes import ChainPasses
from lippmann.rendering.transport.pass_schedule import PassSchedule
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.ray_source import RaySource
from lippmann.runtime import engine, machine

#: Chains of a path, at most.
MOST = 32
#: Variance of a path's light, seen light apart, in codes; and where a denoiser takes most of it away: those of usual
#: scenes.
REST_VARIANCE, CLEAN_REST_VARIANCE = 0.01, 0.001
#: Chains of a pixel, spread evenly, whose mean is to show an image where there are no photons; and its variance times
#: their number, in codes: below the first a denoiser shows it as well without chains, above the second it does better
#: (0.0006 to 0.001 for a sky in smooth gloss, 0.008 to 0.02 for spots of light in beads, metal and varnish).
SPREAD, LEAST_SPREAD, MOST_SPREAD = 4, 1.5e-4, 3e-3
#: Chains of each path then where it is the only one of its pixel; their number goes with one over the root of the
#: samples'.
OF_ONE_SAMPLE = 8
#: Chains of a path by which what single ones meet is held to be too bright or not.
USUAL = 2
#: Chains of a pixel whose mean is as clean as a denoiser would have made of its paths; and of one path, at most that
#: many at least.
CLEAN, MOST_FOR_CLEAN = 32, 16
#: dB that a whole picture has after its first few samples beside a denoiser, with chains or without.
REACHED_BY_FEW = 38.0
#: Meetings with the brightest emitter that count beside those of the look: as many as may well have been missed.
MISSED = 0.25
#: Samples that a picture is taken to need at most, and at least, of which it is not known.
OPEN_ENDED, FEWEST_OPEN_ENDED = 128, 8
#: Seconds of a processor core that a path without chains takes where there are photons, in the bundled scenes; and of a
#: GPU.
PATH_SECONDS, PATH_SECONDS_ON_GPU = 4e-6, 1e-7
#: Samples that a picture whose time is limited must be able to have for a search and chains to be worth theirs: few
#: samples come with so many chains that each takes twice as long.
FEWEST_IN_TIME = 8
#: Its samples up to each of these come with the chains of a picture of so many; further ones with those of the last.
_SCHEDULE = PassSchedule(first=8, most=64)
STAGES = tuple(accumulate(_SCHEDULE.samples(number) for number in range(5)))


@dataclass(frozen=True)
class GivenChains:
    """Chains that each path comes with, of all samples or of those of each of the :data:`STAGES`; none if empty.

    ``without_images``: a search found no small image.
    """

    numbers: tuple[int, ...] = ()
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
    samples, is_clean = _expected_samples(request), request.denoise != "none"
    if request.max_time is not None:
        in_time = samples_in(request.max_time, source.width * source.height * source.channels, request.threads)
        if in_time < FEWEST_IN_TIME:
            return GivenChains()
        samples = min(samples, in_time)
    if integrator.photons is None and (not is_clean or _is_reached_by_few(request)):
        return GivenChains()
    found_none = none_small = False
    if integrator.photons is not None:
        search = search_images(integrator.scene, source, samples, memory)
        integrator.mirror_images, found_none, none_small = search.images, search.found_none, search.none_small
    look = SeenLook(integrator, source, samples, request.transfer, request.seed)
    totals = STAGES if _has_stages(request) else (samples,)
    numbers: tuple[int, ...]
    if integrator.photons is None:
        numbers = (chains_of_image(SPREAD * look.variance_of_means(SPREAD, samples * USUAL), samples),)
    else:
        numbers = chains_beside_photons(look, samples, totals, is_clean, found_none)
    if not any(numbers):
        integrator.mirror_images = None
        return GivenChains((), none_small)
    integrator.seen_chains = dr.opaque(mi.UInt32, numbers[0])
    if len(set(numbers)) > 1:
        integrator.chain_passes = ChainPasses(_SCHEDULE, numbers)
    if integrator.photons is None:
        integrator.mirror_images = search_images(integrator.scene, source, samples, memory).images
    return GivenChains(numbers if integrator.chain_passes is not None else numbers[:1], none_small)


def chains_beside_photons(
    look: SeenLook, samples: int, totals: Sequence[int], is_clean: bool, found_none: bool = False
) -> tuple[int, ...]:
    """Chains of each path: 0, or a power of two from 2 to :data:`MOST`, as one brings no more than the path itself.

    Parameters
    ----------
    look:
        At how seen light varies.
    samples:
        Of each pixel, about; they tell whether there are any chains.
    totals:
        Samples of each pixel for which the numbers are asked.
    is_clean:
        A denoiser takes the noise out of all but seen light.
    found_none:
        A search has found no image of an emitter that has a place: none may have been missed but the environment's.
    """
    brightest = look.brightest(of_environment=found_none)
    asked = (samples, *totals)
    numbers = []
    for total, variance in zip(asked, look.variances([each * USUAL for each in asked]), strict=True):
        missed = MISSED * look.code_of(min(brightest, total * USUAL)) ** 2 / look.chains
        numbers.append(chains_for(variance + missed, total, is_clean))
    # Seen light is either told apart in all samples or in none.
    return tuple(max(2, each) for each in numbers[1:]) if numbers[0] else (0,) * len(totals)


def chains_of_image(variance: float, samples: int) -> int:
    """As :func:`chains_beside_photons`, where a picture is denoised and has none, by the variance in codes of
    :data:`SPREAD` chains times their number."""
    if not LEAST_SPREAD < variance < MOST_SPREAD:
        return 0
    return 1 << max(1, round(math.log2(OF_ONE_SAMPLE / math.sqrt(samples))))


def chains_for(variance: float, samples: int, is_clean: bool) -> int:
    """As :func:`chains_beside_photons`, by the variance of a chain in codes."""
    rest = CLEAN_REST_VARIANCE if is_clean else REST_VARIANCE
    wanted = math.sqrt(variance * (1 - CHAIN_COST) / (rest * CHAIN_COST))
    fewest = min(max(2.0, CLEAN / samples), MOST_FOR_CLEAN) if is_clean else 2.0
    if wanted < (max(2.0, fewest / 4) if is_clean else math.sqrt(2)):
        return 0
    return 1 << min(MOST.bit_length() - 1, round(math.log2(max(wanted, fewest))))


def _is_reached_by_few(request: RenderRequest) -> bool:
    """Whether a quality is asked for, of the whole picture, to which chains without photons are only in the way."""
    return request.quality is not None and request.quality_worst is None and request.quality < REACHED_BY_FEW


def samples_in(seconds: float, pixels: int, threads: int | None) -> int:
    """Samples of each of so many pixels, channels apart, that a time allows, by the usual cost of a path."""
    spent = PATH_SECONDS_ON_GPU if engine.runs_on_gpu() else PATH_SECONDS / (threads or machine.usable_cores())
    return int(min(seconds / (pixels * spent), OPEN_ENDED))


def _has_stages(request: RenderRequest) -> bool:
    """Whether the chains of a picture grow with its samples.

    All samples of a micro-image that is to be good come with the chains of a picture of many; and where time is
    limited, each must take as long as the last.
    """
    return request.quality is not None and request.quality_worst is None and request.max_time is None


def _expected_samples(request: RenderRequest) -> int:
    """Samples of a pixel that the picture will take, about.

    The worst micro-image is that of a rare highlight, as a rule: where it is to be good, no few samples are counted on.
    """
    if not request.is_open_ended:
        return request.samples
    if request.quality is None or request.quality_worst is not None:
        return OPEN_ENDED
    rest = REST_VARIANCE if request.denoise == "none" else CLEAN_REST_VARIANCE
    return int(np.clip(rest * 10 ** (request.quality / 10), FEWEST_OPEN_ENDED, OPEN_ENDED))
