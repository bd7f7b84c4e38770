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
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import Transfer, coding_slope
from lippmann.device.kernel_ops import divide
from lippmann.device.sobol import SampleStream
from lippmann.device.types import MitsubaScene
from lippmann.rendering.film.image_search import search_images
from lippmann.rendering.film.scattered_rays import ScatteredRays
from lippmann.rendering.film.wavefront import shown_colors
from lippmann.rendering.request.choices import REUSING
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.rendering.transport.path import PathIntegrator
from lippmann.rendering.transport.ray_source import PixelRays, RaySource
from lippmann.rendering.transport.seen_light import seen_light

#: Chains of a path, at most.
MOST = 32
#: Share of a picture's time that the look takes, about: where there are caustics, and elsewhere. Its chains within
#: limits, and those of one pixel, at least.
LOOK_COST, PLAIN_LOOK_COST = 0.02, 0.005
FEWEST_LOOKS, MOST_LOOKS, LOOKS_OF_PIXEL = 1 << 13, 1 << 20, 8
#: Variance of a path's light, seen light apart, in codes; and where a denoiser takes most of it away: those of usual
#: scenes.
REST_VARIANCE, CLEAN_REST_VARIANCE = 0.01, 0.001
#: What a chain costs of a path that looks up photons, and of one that does not.
CHAIN_COST, PLAIN_CHAIN_COST = 0.05, 0.25
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
OPEN_ENDED, FEWEST_OPEN_ENDED = 128, 16
#: Linear radiance at which the slope of the codes is taken where seen light brings less: mid-grey.
_GREY = 0.18
#: Pixels whose variance is worked out at once.
_AT_ONCE = 1 << 12
#: Points from which emitters are looked at.
_POINTS = 1 << 10


@dataclass(frozen=True)
class GivenChains:
    """How many chains each path comes with, 0 for none; whether a search found no small image."""

    number: int
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
        return GivenChains(0)
    samples, is_clean = _expected_samples(request), request.denoise != "none"
    if integrator.photons is None and (not is_clean or _is_reached_by_few(request)):
        return GivenChains(0)
    found_none = none_small = False
    if integrator.photons is not None:
        search = search_images(integrator.scene, source, samples, memory)
        integrator.mirror_images, found_none, none_small = search.images, search.found_none, search.none_small
    chains = seen_chains(integrator, source, samples, request.transfer, request.seed, is_clean, found_none)
    if not chains:
        integrator.mirror_images = None
        return GivenChains(0, none_small)
    integrator.seen_chains = dr.opaque(mi.UInt32, chains)
    if integrator.photons is None:
        integrator.mirror_images = search_images(integrator.scene, source, samples, memory).images
    return GivenChains(chains, none_small)


def seen_chains(
    integrator: PathIntegrator,
    source: RaySource,
    samples: int,
    transfer: Transfer,
    seed: int,
    is_clean: bool,
    found_none: bool = False,
) -> int:
    """Chains of each path: 0, or a power of two from 2 to :data:`MOST`, as one brings no more than the path itself.

    Parameters
    ----------
    integrator:
        Ready for the picture.
    source:
        Rays of the whole picture: parts of one picture must be told the same.
    samples:
        Of each pixel, about.
    transfer:
        How values become codes.
    seed:
        Of the picture.
    is_clean:
        A denoiser takes the noise out of all but seen light.
    found_none:
        A search has found no image of an emitter that has a place: none may have been missed but the environment's.
    """
    looks = _looks(integrator, source, samples, seed)
    together = samples * USUAL

    def mean_variance(met: NDArray[np.float32]) -> float:
        return sum(variance_of(part, together, transfer) * len(part) for part in _parts(met)) / len(met)

    if integrator.photons is None:
        return chains_of_image(SPREAD * mean_variance(_means_of(SPREAD, looks)), samples)
    brightest = min(_brightest(integrator, source, seed, of_environment=found_none), together)
    slope = float(coding_slope(np.array(_GREY), transfer))
    missed = MISSED * (slope * brightest) ** 2 / (looks.size / 3)
    return chains_for(mean_variance(looks) + missed, samples, is_clean)


def chains_of_image(variance: float, samples: int) -> int:
    """As :func:`seen_chains`, of a denoised picture without photons, by the variance in codes of :data:`SPREAD` chains
    times their number."""
    if not LEAST_SPREAD < variance < MOST_SPREAD:
        return 0
    return 1 << max(1, round(math.log2(OF_ONE_SAMPLE / math.sqrt(samples))))


def chains_for(variance: float, samples: int, is_clean: bool) -> int:
    """As :func:`seen_chains`, beside photons, by the variance of a chain in codes."""
    rest = CLEAN_REST_VARIANCE if is_clean else REST_VARIANCE
    wanted = math.sqrt(variance * (1 - CHAIN_COST) / (rest * CHAIN_COST))
    fewest = min(max(2.0, CLEAN / samples), MOST_FOR_CLEAN) if is_clean else 2.0
    if wanted < (max(2.0, fewest / 4) if is_clean else math.sqrt(2)):
        return 0
    return 1 << min(MOST.bit_length() - 1, round(math.log2(max(wanted, fewest))))


def _is_reached_by_few(request: RenderRequest) -> bool:
    """Whether a quality is asked for, of the whole picture, to which chains without photons are only in the way."""
    return request.quality is not None and request.quality_worst is None and request.quality < REACHED_BY_FEW


def _expected_samples(request: RenderRequest) -> int:
    """Samples of a pixel that the picture will take, about.

    The worst micro-image is that of a rare highlight, as a rule: where it is to be good, no few samples are counted on.
    """
    if not request.is_open_ended:
        return request.samples
    if request.quality is None or request.quality_worst is not None:
        return OPEN_ENDED
    return int(np.clip(REST_VARIANCE * 10 ** (request.quality / 10), FEWEST_OPEN_ENDED, OPEN_ENDED))


def variance_of(looks: NDArray[np.floating], together: int, transfer: Transfer) -> float:
    """Mean variance of one chain in codes, as far as the others of its pixel leave the code a slope.

    Parameters
    ----------
    looks:
        ``(pixels, looks, 3)`` linear radiance of single chains, two or more of each pixel.
    together:
        Chains whose mean a pixel shows: what one of them meets does not count beyond what makes that white.
    transfer:
        How values become codes.
    """
    number = looks.shape[1]
    others = (looks.sum(axis=1, keepdims=True) - looks) / (number - 1)
    slope = coding_slope(np.maximum(others, _GREY), transfer)
    apart = np.minimum(np.abs(looks - others), together)
    # The mean of the others varies, too.
    variance: float = np.square(slope * apart).mean() * (number - 1) / number
    return variance


def _looks(integrator: PathIntegrator, source: RaySource, samples: int, seed: int) -> NDArray[np.float32]:
    """``(pixels, looks, 3)``: what single chains meet, the gain included."""
    paths = source.width * source.height * source.channels * samples
    share = LOOK_COST / CHAIN_COST if integrator.photons is not None else PLAIN_LOOK_COST / PLAIN_CHAIN_COST
    wanted = int(np.clip(paths * share, FEWEST_LOOKS, MOST_LOOKS))
    few = ScatteredRays(source, max(1, math.isqrt(wanted // (LOOKS_OF_PIXEL * source.channels))))
    count = max(LOOKS_OF_PIXEL, wanted // (few.width * few.height * few.channels))
    rest, look = divide(
        dr.arange(mi.UInt32, few.width * few.height * few.channels * count), dr.opaque(mi.UInt32, count)
    )
    pixel, channel = divide(rest, few.channels)
    row, column = divide(pixel, dr.opaque(mi.UInt32, few.width))
    stream = SampleStream.of_pixels(rest, look, dr.opaque(mi.UInt32, seed))
    pixels = PixelRays(source, *few.in_picture(column, row), channel)
    light, _, _ = seen_light(integrator, pixels, stream, dr.opaque(mi.UInt32, 1), mi.Bool(True))
    if integrator.gain is not None:
        light *= integrator.gain
    values = np.array(dr.ravel(mi.Color3f(light)), dtype=np.float32)
    return shown_colors(values.reshape(-1, few.channels, count, 3))


def _means_of(number: int, looks: NDArray[np.float32]) -> NDArray[np.float32]:
    """``(pixels, looks / number, 3)``: means of so many chains of a pixel that follow each other."""
    pixels, count, _ = looks.shape
    groups = count // number
    return np.asarray(looks[:, : groups * number].reshape(pixels, groups, number, 3).mean(axis=2))


def _parts(looks: NDArray[np.float32]) -> Iterator[NDArray[np.floating]]:
    """Some pixels at a time: what is worked out of them takes several times their memory."""
    for first in range(0, len(looks), _AT_ONCE):
        yield looks[first : first + _AT_ONCE].astype(np.float64)


def _brightest(integrator: PathIntegrator, source: RaySource, seed: int, of_environment: bool) -> float:
    """Greatest radiance of an emitter of some size, the gain included, by samples from what the picture shows."""
    few = ScatteredRays(source, math.isqrt(_POINTS))
    place = dr.arange(mi.UInt32, few.width * few.height)
    row, column = divide(place, few.width)
    scene: MitsubaScene = integrator.scene
    si = scene.ray_intersect(few.rays(column, row, mi.UInt32(0), mi.Point2f(0.5)))
    point = SampleStream.of_pixels(mi.UInt32(0), place, dr.opaque(mi.UInt32, seed)).next_2d(1)
    ds, weight = scene.sample_emitter_direction(si, point, False, si.is_valid())
    counts = si.is_valid() & ~ds.delta
    if of_environment:
        counts &= mi.has_flag(ds.emitter.flags(), mi.EmitterFlags.Infinite)
    radiance = dr.select(counts, dr.max(weight) * ds.pdf, 0)
    if integrator.gain is not None:
        radiance *= integrator.gain
    return float(np.max(np.array(radiance)))
