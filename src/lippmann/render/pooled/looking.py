"""What the pixels see, with the light of the pool: visibility and textures as exact as the samples that look."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from lippmann.render.pooled.following import Follower
from lippmann.render.pooled.pool import Table
from lippmann.render.pooled.surfaces import split
from lippmann.render.pooled.vertices import Scale, diffuse_key, gloss_key, scaled
from lippmann.render.sampling import SampleStream


@dataclass
class Seen:
    """Of every lane: ``a``, ``b`` its colour by the light of each half."""

    a: Any
    b: Any


class Looker:
    """Looks into one scene, at light told apart as finely as ``scale`` says."""

    # Not a dataclass: Dr.Jit would take it for loop state and write its fields.
    def __init__(self, follower: Follower, scale: Scale) -> None:
        self._follower = follower
        self._path = follower.path
        self._scale = scale

    @dr.syntax
    def look(self, ray: Any, stream: SampleStream, diffuse: Table, gloss: Table | None) -> tuple[Seen, Any, Any]:
        """The colours of every lane; further, rays traced (secondary and shadow)."""
        path, follow = self._path, self._follower
        way = follow.start(ray)
        a, b = mi.Color3f(0), mi.Color3f(0)
        active = mi.Bool(True)
        while dr.hint(active, label="looks"):
            si = way.pi.compute_surface_interaction(way.ray, ray_flags=mi.RayFlags.All)
            bsdf = si.bsdf(way.ray)
            emitted = dr.select(active, follow.emission(way, si), 0)
            s = split(si, bsdf, follow.kinds, active & si.is_valid())
            dimension = way.dimension()
            going_on = active & si.is_valid() & (way.depth < path.depth)
            opaque = stream.next_1d(dimension + 3) < s.opacity
            distance = way.distance + si.t

            shared = going_on & opaque & s.shares_diffuse
            light = self._pooled(diffuse, si, s, distance, stream.next_2d(dimension + 4), shared, None)
            reflected = way.throughput * s.diffuse
            a += emitted + dr.select(shared, reflected * light[0], 0)
            b += emitted + dr.select(shared, reflected * light[1], 0)
            if dr.hint(gloss is not None, mode="scalar"):
                shared = going_on & opaque & s.shares_rest
                light = self._pooled(gloss, si, s, distance, stream.next_2d(dimension + 5), shared, way.ray.d)
                reflected = way.throughput * s.gloss
                a += dr.select(shared, reflected * light[0], 0)
                b += dr.select(shared, reflected * light[1], 0)
            follows = going_on & opaque & s.follows_rest
            lamps = follow.direct(way, si, bsdf, s, stream, follows)
            a += lamps
            b += lamps
            follow.step(way, si, bsdf, s, stream, opaque, going_on, mi.Bool(False))
            active = going_on & way.alive
        return Seen(a, b), way.secondary, way.shadow

    def _pooled(
        self, table: Any, si: Any, s: Any, distance: Any, jitter: Any, active: Any, ray_d: Any
    ) -> tuple[Any, Any]:
        """Pooled light at a point, spread over the region that it stands for so that no cell shows its border."""

        finest, kind = scaled(self._scale, distance)

        def key(p: Any) -> Any:
            return diffuse_key(p, s, finest, kind) if ray_d is None else gloss_key(p, s, ray_d, finest, kind)

        place, found = table.find(key(si.p), active)
        size = table.read_size(place, found)
        frame = mi.Frame3f(s.normal)
        moved = si.p + (frame.s * (jitter.x - 0.5) + frame.t * (jitter.y - 0.5)) * (size * finest)
        other, there = table.find(key(moved), found)
        a, b = table.read(dr.select(there, other, place), active)
        return a, b
