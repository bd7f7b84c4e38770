"""Newton's method along chains of sharp events, in one kernel: from points of pixels to images of small emitters."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from lippmann.device.syntax import syntax
from lippmann.device.types import Bool, Float, MitsubaScene, Point2f, Point3f, Ray3f, UInt32, Vector3f
from lippmann.rendering.transport.ray_source import RaySource
from lippmann.rendering.transport.sharp_events import follows_sharply, sharp_lobe

#: Steps of Newton's method; how far one goes, and how far all of them may, in pixels.
STEPS, LONGEST_STEP, FARTHEST = 6, 0.5, 3.0
#: Boxes are so many times as wide as the image, but no narrower than this, in pixels.
MARGIN, NARROWEST = 1.5, 1e-4
#: Width of the differences by which derivatives are taken, in pixels.
_DIFFERENCE = 1 / 64
#: Squared sine between both derivatives below which they tell no point.
_ALIKE = 1e-12
#: Chains of one step: from the point, and from those beside and below it.
_POINT, _BESIDE, _BELOW = range(3)


@dataclass
class Lanes:
    """Points of pixels, and the emitters and events by which their chains are to meet them.

    ``lobe`` chooses between a surface's lobes, alike at all surfaces.
    """

    column: UInt32
    row: UInt32
    channel: UInt32
    point: Point2f
    emitter: UInt32
    events: UInt32
    lobe: Float

    def __len__(self) -> int:
        return int(dr.width(self.column))

    def chosen(self, kept: Bool) -> Lanes:
        """Those that are kept."""
        every = [self.column, self.row, self.channel, self.point, self.emitter, self.events, self.lobe]
        dr.eval(kept, every)
        place = dr.compress(kept)
        column, row, channel, emitter, events = (
            dr.gather(mi.UInt32, each, place)
            for each in (self.column, self.row, self.channel, self.emitter, self.events)
        )
        x, y, lobe = (dr.gather(mi.Float, each, place) for each in (self.point.x, self.point.y, self.lobe))
        return Lanes(column, row, channel, mi.Point2f(x, y), emitter, events, lobe)


@syntax
def begins(scene: MitsubaScene, source: RaySource, lanes: Lanes) -> Bool:
    """Whether the chain from each point gets as far as its last event."""
    begun = source.rays(lanes.column, lanes.row, lanes.channel, lanes.point)
    o, d = mi.Point3f(begun.o), mi.Vector3f(begun.d)
    left, lobe = mi.UInt32(lanes.events), mi.Float(lanes.lobe)
    active, arrived = left > 0, mi.Bool(True)
    # What does not change is no state: else Dr.Jit would record the loop a second time, without it.
    while dr.hint(active, label="sharp chain", exclude=[scene, lobe]):
        o, d, counts, goes_on = _event(scene, o, d, lobe, active)
        arrived &= goes_on | ~active
        left -= dr.select(counts, mi.UInt32(1), mi.UInt32(0))
        active &= goes_on & (left > 0)
    return arrived


@syntax
def approached(
    scene: MitsubaScene, source: RaySource, lanes: Lanes, middle: Point3f, radius: Float
) -> tuple[Point2f, Point2f, Ray3f, Bool]:
    """Where the chain from a point of each pixel comes to meet its emitter.

    Each turn of the loop is one event of one chain: so all chains of all steps are one kernel, and lanes whose chains
    are short do not wait for others.

    Parameters
    ----------
    scene, source:
        What chains meet, and the rays that they begin with.
    lanes:
        Their points, emitters and events.
    middle, radius:
        Of each lane's emitter, in world units.

    Returns
    -------
    tuple
        The points that the last step leads to, in pixels from the corners of the lanes' own; half sides of the boxes
        about the images, 0 where the chain passes by the emitter; the chain's last ray before that step; and whether
        it came so far.
    """
    column, row, channel = mi.UInt32(lanes.column), mi.UInt32(lanes.row), mi.UInt32(lanes.channel)
    events, lobe, point = mi.UInt32(lanes.events), mi.Float(lanes.lobe), mi.Point2f(lanes.point)
    begun = source.rays(column, row, channel, point)
    o, d = mi.Point3f(begun.o), mi.Vector3f(begun.d)
    last_o, last_d = mi.Point3f(o), mi.Vector3f(d)
    left, side, step = mi.UInt32(events), mi.UInt32(0), mi.UInt32(0)
    miss, right = mi.Vector3f(0), mi.Vector3f(0)
    half = mi.Point2f(0)
    active, found = mi.Bool(True), mi.Bool(False)
    while dr.hint(
        active, label="image approach", exclude=[scene, source, column, row, channel, events, lobe, middle, radius]
    ):
        on_way = active & (left > 0)
        next_o, next_d, counts, goes_on = _event(scene, o, d, lobe, on_way)
        o, d = dr.select(on_way, next_o, o), dr.select(on_way, next_d, d)
        left -= dr.select(counts, mi.UInt32(1), mi.UInt32(0))
        active &= goes_on | ~on_way
        along = dr.dot(middle - o, d)
        is_end = active & (left == 0)
        active &= ~is_end | (along > 0)
        is_end &= active
        by = mi.Vector3f(o + along * d - middle)
        is_first, is_last = is_end & (side == _POINT), is_end & (side == _BELOW)
        last_o, last_d = dr.select(is_first, o, last_o), dr.select(is_first, d, last_d)
        miss = dr.select(is_first, by, miss)
        right = dr.select(is_end & (side == _BESIDE), by, right)
        move, box, is_solved = _solved(miss, right, by, radius)
        active &= ~is_last | is_solved
        is_last &= is_solved
        point = dr.select(is_last, point + move, point)
        half = dr.select(is_last, box, half)
        step += dr.select(is_last, mi.UInt32(1), mi.UInt32(0))
        found |= is_last & (step == STEPS)
        active &= ~is_last | ((step < STEPS) & (dr.max(dr.abs(point - 0.5)) < FARTHEST))
        side = dr.select(is_end, dr.select(side == _BELOW, mi.UInt32(_POINT), side + 1), side)
        # The next chain, from this or another point.
        beside = mi.Point2f(dr.select(side == _BESIDE, _DIFFERENCE, 0.0), dr.select(side == _BELOW, _DIFFERENCE, 0.0))
        again = source.rays(column, row, channel, point + beside)
        o, d = dr.select(is_end, again.o, o), dr.select(is_end, again.d, d)
        left = dr.select(is_end, events, left)
    return point, half, mi.Ray3f(last_o, last_d), found


def _solved(miss: Vector3f, right: Vector3f, below: Vector3f, radius: Float) -> tuple[Point2f, Point2f, Bool]:
    """The step to the image, half the sides of its box, 0 where the emitter is not met yet, and whether it is known.

    Parameters
    ----------
    miss, right, below:
        The ways from the middle of the emitter to the chains from the point and from those beside and below it.
    radius:
        Of the emitter.
    """
    a, b = (right - miss) / _DIFFERENCE, (below - miss) / _DIFFERENCE
    # Least squares: the way past a middle is at right angles to the ray, in a plane of its own for each.
    aa, ab, bb, am, bm = dr.dot(a, a), dr.dot(a, b), dr.dot(b, b), dr.dot(a, miss), dr.dot(b, miss)
    determinant = aa * bb - ab * ab
    step = mi.Point2f(ab * bm - bb * am, ab * am - aa * bm) / determinant
    step *= dr.minimum(1, LONGEST_STEP / dr.maximum(dr.norm(mi.Vector2f(step)), 1e-9))
    half = MARGIN * radius * mi.Point2f(dr.safe_sqrt(bb / determinant), dr.safe_sqrt(aa / determinant))
    half = dr.select(dr.norm(miss) < radius, dr.maximum(half, NARROWEST), 0)
    return step, half, determinant > _ALIKE * aa * bb


def _event(
    scene: MitsubaScene, o: Point3f, d: Vector3f, lobe: Float, active: Bool
) -> tuple[Point3f, Vector3f, Bool, Bool]:
    """The ray after one sharp event, whether that counts as one, and whether there is one at all."""
    ray = mi.Ray3f(o, d)
    si = scene.ray_intersect(ray, mi.RayFlags.All, False, active)
    bsdf = si.bsdf(ray)
    is_met = active & si.is_valid()
    narrow = sharp_lobe(si, bsdf, is_met)
    bs, weight = bsdf.sample(mi.BSDFContext(), si, lobe, mi.Point2f(0.5), is_met)
    # Of a lobe of some width the middle, so that the way follows from the point alone.
    is_mirrored = (dr.squared_norm(narrow) > 0) & (bs.wo.z * si.wi.z > 0)
    bs.wo = dr.select(is_mirrored, 2 * dr.dot(si.wi, narrow) * narrow - si.wi, bs.wo)
    goes_on = is_met & follows_sharply(si, narrow, bs) & (dr.max(weight) > 0)
    onward = si.spawn_ray(si.to_world(bs.wo))
    return onward.o, onward.d, goes_on & ~mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null), goes_on
