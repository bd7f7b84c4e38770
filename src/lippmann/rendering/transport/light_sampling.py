"""How often each lamp of a scene is drawn: by the light that it sheds on what the picture shows.

Mitsuba draws all emitters alike unless told otherwise, those that light nothing, too: a sky outside a closed room takes
half of all shadow rays there. Here a few thousand paths from all over the picture find out what comes from each. A lamp
whose light f reaches a path with second moment E[f^2] is best drawn in proportion to its root: then the variance of
f over its probability is least (importance sampling; Veach 1997, chapter 2.5.2). A share goes to all alike, for what
was not found.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.device.sobol import PIXEL_DIMENSION, SampleStream
from lippmann.rendering.transport.path import DIMENSIONS_PER_VERTEX, PathIntegrator
from lippmann.rendering.transport.ray_source import RaySource

#: Paths that look, and the fewest for each lamp; scenes of more lamps than ``MOST_LAMPS`` draw them all alike.
PATHS, LEAST_PATHS, MOST_LAMPS = 1 << 14, 1 << 8, 1 << 10
#: Surfaces along a path that are looked at.
SURFACES = 3
#: Share of the draws that all lamps have alike.
EVEN_SHARE = 0.2
#: Their own seed: the picture's would make lamps' shares depend on it.
_SEED = 0x6C616D70
_WEIGHT = "sampling_weight"


def weigh_lamps(integrator: PathIntegrator, source: RaySource) -> NDArray[np.float64]:
    """Set how often the lamps of the integrator's scene are drawn, by what reaches the pixels of ``source``.

    The weights, which add up to 1, in the order of ``mi.Scene.emitters()``. They depend on scene and rays alone;
    whatever weights the scene had before are forgotten.
    """
    lamps = len(integrator.scene.emitters())
    weights = np.full(lamps, 1 / max(lamps, 1))
    if 1 < lamps <= MOST_LAMPS:
        _draw_by(integrator.scene, np.ones(lamps))
        found = np.sqrt(_second_moments(integrator, source, lamps))
        if found.sum() > 0:
            weights = EVEN_SHARE / lamps + (1 - EVEN_SHARE) * found / found.sum()
            _draw_by(integrator.scene, weights)
    return weights


def _draw_by(scene: Any, weights: NDArray[np.float64]) -> None:
    values = mi.traverse(scene)
    # In the order of the emitters: either follows the scene's objects. Shapes have weights of their silhouettes, too.
    names = [name for name in values.keys() if name.rpartition(".")[2] == _WEIGHT]  # noqa: SIM118 - no mapping
    for name, weight in zip(names, weights, strict=True):
        values[name] = float(weight)
    values.update()


def _second_moments(integrator: PathIntegrator, source: RaySource, lamps: int) -> NDArray[np.float64]:
    """Mean squares of the light that paths find by drawing each lamp, ``(lamps,)``; white, 1, is the most that counts.

    All lamps are looked at along the same paths, so that they differ by nothing else.
    """
    paths = max(PATHS // lamps, LEAST_PATHS)
    lane = dr.arange(mi.UInt32, paths * lamps)
    lamp = lane // dr.opaque(mi.UInt32, paths)
    path = lane - lamp * dr.opaque(mi.UInt32, paths)
    stream = SampleStream.of_pixels(mi.UInt32(0), path, dr.opaque(mi.UInt32, _SEED))
    place = stream.next_2d(PIXEL_DIMENSION)
    x, y = place.x * dr.opaque(mi.Float, source.width), place.y * dr.opaque(mi.Float, source.height)
    column, row = mi.UInt32(x), mi.UInt32(y)
    jitter = mi.Point2f(x - mi.Float(column), y - mi.Float(row))
    ray = source.rays(column, row, mi.UInt32(0), jitter)
    found = _squares_along(integrator, ray, stream, lamp, dr.opaque(mi.Float, lamps))
    # A path may meet what has no value, such as a normal of no length: there it has found nothing.
    squares = np.nan_to_num(np.array(found, dtype=np.float64), nan=0.0)
    means: NDArray[np.float64] = squares.reshape(lamps, paths).mean(axis=1)
    return means


@dr.syntax
def _squares_along(integrator: PathIntegrator, ray: Any, stream: SampleStream, lamp: Any, lamps: Any) -> Any:
    """Per path the squares of what ``lamp`` sheds on its surfaces, added up."""
    scene = integrator.scene
    context = mi.BSDFContext()
    ray = mi.Ray3f(ray)
    throughput = mi.Spectrum(1)
    squares = mi.Float(0)
    surface = mi.UInt32(0)
    active = mi.Bool(True)
    while dr.hint(active, label="lit surfaces"):
        si = scene.ray_intersect(ray, mi.RayFlags.All, False, active)
        active &= si.is_valid()
        bsdf = si.bsdf(ray)
        dimension = surface * DIMENSIONS_PER_VERTEX + 1
        # Drawn evenly, lamps hold equal parts of the unit interval.
        point = stream.next_2d(dimension)
        point.x = (mi.Float(lamp) + point.x) / lamps
        lit = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        light, _ = integrator.drawn_light(si, bsdf, point, lit)
        squares += dr.square(dr.minimum(dr.mean(throughput * light / lamps), 1))

        bs, weight = bsdf.sample(context, si, stream.next_1d(dimension + 1), stream.next_2d(dimension + 2), active)
        throughput *= weight
        ray = si.spawn_ray(si.to_world(bs.wo))
        surface += 1
        active &= (dr.max(throughput) > 0) & (surface < min(integrator.depth, SURFACES))
    return squares
