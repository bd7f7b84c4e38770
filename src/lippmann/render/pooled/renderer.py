"""Pooled rendering: light is gathered once, in the scene, and every micro-image takes its own from there.

Samples are kept in two halves that know nothing of each other, and the picture is the mean of what either half makes of
its own. Each half has three groups of unpooled samples. The first of the other half chooses among a half's candidates;
the second and third, b and c, judge what was chosen: the mean of (p - b)(p - c) is the squared error of p, for neither
has anything to do with p or with the other. From the errors of the halves p and q follows that of their mean,
|(p + q)/2 - t|^2 = (|p - t|^2 + |q - t|^2) / 2 - |p - q|^2 / 4.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.errors import UsageError
from lippmann.progress import Progress, ProgressCallback, silent
from lippmann.render.coding import coding_slope
from lippmann.render.full import PIXEL_DIMENSION, RayTotals, divide, lane_total
from lippmann.render.integrators.path import PathIntegrator
from lippmann.render.pixel_errors import CROSS_NOISE, PixelErrors
from lippmann.render.pooled import surfaces
from lippmann.render.pooled.blending import blended, local_mean
from lippmann.render.pooled.following import Follower
from lippmann.render.pooled.gathering import Gatherer
from lippmann.render.pooled.keys import NOWHERE
from lippmann.render.pooled.looking import Looker
from lippmann.render.pooled.pool import Pool
from lippmann.render.pooled.vertices import Scale, diffuse_key, gloss_key, scaled
from lippmann.render.rays import DisplayRays, WindowRays, pixel_number
from lippmann.render.sampling import SampleStream
from lippmann.render.traits import SceneTraits

Picture = NDArray[np.float32]

#: Unpooled estimates that are kept apart; even ones belong to the first half, odd ones to the second. One of each half
#: chooses, two judge.
GROUPS = 6
#: Memory: pictures held, bytes of a lane at its widest moment, and of a cell in sums and tables.
PICTURES, BYTES_PER_LANE, BYTES_PER_CELL = 18, 512, 320
#: Cells of a pool, however little memory there is.
LEAST_CELLS = 1 << 14
#: Lanes of one wavefront.
LANES = 1 << 19
#: Blocks of the picture that are weighed are a lens wide, or so many pixels.
MOST_BLOCK = 16
#: Finest cells along a lens pitch.
FINEST_PER_PITCH = 32
#: Samples that look at a pixel: at least, and for every path spent on it.
LEAST_LOOKS, LOOKS_PER_PATH = 8, 4
#: Looks of one wavefront, per pixel.
MOST_LOOKS = 16


@dataclass(frozen=True)
class _Chosen:
    """A half's picture, and the share of pooled light in it, ``(H, W)``."""

    picture: Picture
    share: Picture


class Pooled:
    """One picture in the making.

    Parameters
    ----------
    scene, traits:
        A ``mi.Scene`` and what of it needs more than the plain path loop.
    depth:
        Surfaces per path, at least 1.
    source:
        The display's rays, or those of a window of it; its pixels or sub-pixels.
    seed:
        Of all random choices.
    box_filter:
        Samples fill the pixel; else they all go through its middle.
    memory:
        Bytes that may be used.
    looks:
        Samples that look at each pixel; None for as many as suit the paths.

    Attributes
    ----------
    samples:
        Paths per pixel so far.
    rays:
        What was traced.
    """

    def __init__(
        self,
        scene: Any,
        traits: SceneTraits,
        depth: int,
        source: DisplayRays | WindowRays,
        *,
        seed: int = 0,
        box_filter: bool = True,
        memory: int = 4 << 30,
        looks: int | None = None,
    ) -> None:
        surfaces.prepare()
        self._source, self._seed, self._box = source, seed, box_filter
        self._follower = Follower(PathIntegrator(scene, traits, depth))
        self._gatherer = Gatherer(self._follower)
        self._has_gloss = self._follower.kinds.glossy
        pictures = 3 * 4 * PICTURES * source.width * source.height
        free = max(0, memory - pictures)
        self._lanes_at_once = max(1, min(LANES, free // (4 * BYTES_PER_LANE)))
        cells = max(LEAST_CELLS, free // (4 * BYTES_PER_CELL))
        self._diffuse, self._gloss = Pool(cells), Pool(cells)
        self.samples = 0
        self.rays = RayTotals()
        self._looks = looks
        self._raw = np.zeros((GROUPS, source.height, source.width, 3), np.float32)
        self._counts = np.zeros(GROUPS, np.int64)
        display = source.display
        unit = float(np.cbrt(abs(np.linalg.det(source.world_from_display[:3, :3]))))
        pitch = display.lens_array.pitch * unit
        spread = display.panel.pixel_pitch / display.gap
        self._scale = Scale(dr.opaque(mi.Float, pitch / FINEST_PER_PITCH), dr.opaque(mi.Float, pitch / spread))
        self._looker = Looker(self._follower, self._scale)
        self._seen: tuple[Picture, Picture] | None = None
        self._best: tuple[_Chosen, _Chosen] | None = None
        self._block = max(4, round(min(MOST_BLOCK, display.pixels_per_lens[0])))
        self._board = np.add.outer(np.arange(source.height), np.arange(source.width))[:, :, None] & 1

    def add(self, samples: int, progress: ProgressCallback = silent) -> None:
        """Gather ``samples`` more paths per pixel, at least 1, and keep all that has been gathered."""
        bands = self._bands(1)
        done, work = 0, samples * self._source.width * self._source.height * self._source.channels
        for index in range(self.samples, self.samples + samples):
            group = index % GROUPS
            for first, rows in bands:
                self._gather_band(first, rows, index // GROUPS, group)
                done += rows * self._source.width * self._source.channels
                progress(Progress("trace", done, work))
            self._counts[group] += 1
        self.samples += samples
        self._seen = self._best = None

    def _bands(self, count: int) -> list[tuple[int, int]]:
        source = self._source
        rows = max(1, min(source.height, self._lanes_at_once // (source.width * source.channels * count)))
        bands = -(-source.height // rows)
        rows = -(-source.height // bands)
        return [(row, min(rows, source.height - row)) for row in range(0, source.height, rows)]

    def _lanes(self, first: int, rows: int, count: int, begin: int, seed: int) -> tuple[Any, Any, Any, Any, Any]:
        source = self._source
        lanes = rows * source.width * source.channels * count
        per_channel, sample = divide(dr.arange(mi.UInt32, lanes), dr.opaque(mi.UInt32, count))
        pixel, channel = divide(per_channel, source.channels)
        row, column = divide(pixel, source.width)
        row += dr.opaque(mi.UInt32, first)
        sample += dr.opaque(mi.UInt32, begin)
        number = pixel_number(source, column, row) * source.channels + channel
        stream = SampleStream.of_pixels(number, sample, dr.opaque(mi.UInt32, seed))
        jitter = stream.next_2d(PIXEL_DIMENSION) if self._box else mi.Point2f(0.5)
        return source.rays(column, row, channel, jitter), stream, row, column, lanes

    def _gather_band(self, first: int, rows: int, sample: int, group: int) -> None:
        ray, stream, row, column, lanes = self._lanes(first, rows, 1, sample, self._seed * 8 + group)
        got, secondary, shadow = self._gatherer.gather(ray, stream)
        finest, octave = scaled(self._scale, got.distance)
        finite = dr.isfinite(dr.sum(got.color)) & dr.isfinite(dr.sum(got.diffuse)) & dr.isfinite(dr.sum(got.gloss))
        color = dr.select(finite, got.color, 0)
        nowhere = mi.UInt64(NOWHERE)
        key = dr.select(
            finite & got.split.shares_diffuse, diffuse_key(got.position, got.split, finest, octave), nowhere
        )
        outputs = [color, got.diffuse, got.weight, key, secondary, shadow, (row + column) & 1, finite]
        if self._has_gloss:
            glossy = gloss_key(got.position, got.split, got.ray_d, finest, octave)
            outputs += [got.gloss, dr.select(finite & got.split.shares_rest, glossy, nowhere)]
        dr.eval(outputs)
        self.rays.primary += lanes
        self.rays.secondary += lane_total(secondary)
        self.rays.shadow += lane_total(shadow)
        self.rays.discarded += lanes - int(dr.count(finite)[0])
        half = (np.array(outputs[6]) + group) % 2 == 1
        self._diffuse.add(np.array(key), np.array(got.weight), _rgb(got.diffuse), half)
        if self._has_gloss:
            self._gloss.add(np.array(outputs[9]), np.ones(lanes, np.float32), _rgb(got.gloss), half)
        self._raw[group, first : first + rows] += self._pixels(_rgb(color), rows)

    def _pixels(self, colors: Picture, rows: int) -> Picture:
        source = self._source
        if source.channels == 1:
            return colors.reshape(rows, source.width, 3)
        return np.ascontiguousarray(np.diagonal(colors.reshape(rows, source.width, 3, 3), axis1=2, axis2=3))

    def _halves(self) -> tuple[Picture, Picture]:
        """Unpooled pictures of the two halves; in a chequerboard the groups of one are the other's."""
        source = self._source
        board = self._board
        sums, counts = (
            np.zeros((2, source.height, source.width, 3), np.float32),
            np.zeros((2, *board.shape), np.float32),
        )
        for group in range(GROUPS):
            for half in (0, 1):
                mine = (board + group) % 2 == half
                sums[half] += np.where(mine, self._raw[group], 0)
                counts[half] += np.where(mine, np.float32(self._counts[group]), 0)
        a, b = sums / np.maximum(counts, 1)
        # A half without any sample here borrows what the other has: with one sample per pixel there is no other.
        return np.where(counts[0] > 0, a, b), np.where(counts[1] > 0, b, a)

    @property
    def notes(self) -> tuple[str, ...]:
        """What limited the work, one line each."""
        given_up = max(self._diffuse.given_up, self._gloss.given_up)
        if not given_up:
            return ()
        return (f"the memory limit made the cells of pooled light {2**given_up} times as large at the finest",)

    def raw(self) -> Picture:
        """The unpooled picture: all samples, each for its own pixel alone."""
        return np.asarray(self._raw.sum(0) / max(1, self.samples), np.float32)

    def see(self) -> tuple[Picture, Picture]:
        """Pictures by the light of each half, each ``(H, W, 3)``."""
        if self._seen is not None:
            return self._seen
        source = self._source
        diffuse = self._diffuse.table()
        gloss = self._gloss.table() if self._has_gloss else None
        looks = self._looks or max(LEAST_LOOKS, LOOKS_PER_PATH * self.samples)
        result = np.zeros((2, source.height, source.width, 3), np.float32)
        for first, rows in self._bands(min(looks, MOST_LOOKS)):
            for begin in range(0, looks, MOST_LOOKS):
                count = min(MOST_LOOKS, looks - begin)
                ray, stream, _, _, _ = self._lanes(first, rows, count, begin, self._seed * 8 + 7)
                seen, secondary, shadow = self._looker.look(ray, stream, diffuse, gloss)
                parts = [seen.a, seen.b]
                finite = dr.isfinite(dr.sum(parts[0] + parts[1]))
                parts = [dr.select(finite, part, 0) for part in parts]
                dr.eval(parts, secondary, shadow)
                for number, part in enumerate(parts):
                    summed = mi.Color3f(*(dr.block_sum(c, count) for c in part))
                    result[number, first : first + rows] += self._pixels(_rgb(summed), rows) / looks
        self._seen = (result[0], result[1])
        return self._seen

    def picture(self) -> Picture:
        """The picture so far, ``(H, W, 3)`` float32 linear."""
        a, b = self._chosen()
        return np.asarray((a.picture + b.picture) / 2, np.float32)

    def pooled_share(self) -> Picture:
        """Share of pooled light in each pixel, ``(H, W)`` float32 in [0, 1]; the rest are its own samples."""
        a, b = self._chosen()
        return np.asarray((a.share + b.share) / 2, np.float32)

    def squared_error(self) -> PixelErrors:
        """The squared error of every pixel's code: right in the mean over regions, pixel by pixel it may be negative.

        Raises
        ------
        UsageError
            Fewer samples than there are groups.
        """
        if self.samples < GROUPS:
            raise UsageError(
                f"{self.samples} sample(s) per pixel do not tell the error", rule=f"at least {GROUPS} are needed"
            )
        a, b = self._chosen()
        picture = (a.picture + b.picture) / 2
        total = -np.square(a.picture - b.picture) / 4
        for half, chosen in enumerate((a, b)):
            one, two = self._groups_of(1 - half)[1:]
            total += (chosen.picture - one) * (chosen.picture - two) / 2
        total *= np.square(coding_slope(picture))
        # Codes end at white, where the slope tells nothing any more: a picture that is white is wrong by what the
        # samples around fall short of it.
        short = np.square(1 - np.minimum(local_mean(self.raw(), 1), 1)) * np.square(coding_slope(np.ones(1)))
        total = np.where(picture > 1, short, total)
        return PixelErrors(np.asarray(total.mean(-1), np.float32), None, CROSS_NOISE)

    def _chosen(self) -> tuple[_Chosen, _Chosen]:
        """The pictures of the two halves, each the best of what can be made of it as the other sees it."""
        if self._best is None:
            a, b = self.see()
            raw = self._halves()
            # With fewer samples nothing is left to judge by, and all of the other half may choose.
            judges = [raw[1], raw[0]] if self.samples < GROUPS else [self._groups_of(1)[0], self._groups_of(0)[0]]
            self._best = (
                self._choose(a, raw[0], judges[0]),
                self._choose(b, raw[1], judges[1]),
            )
        return self._best

    def _choose(self, pooled: Picture, raw: Picture, judge: Picture) -> _Chosen:
        share = np.ones(pooled.shape[:2], np.float32)
        if self.samples < 2:
            return _Chosen(pooled, share)
        # Enough unpooled samples are nearer to the truth than anything else.
        best, weight = blended(pooled, raw, judge, self._block)
        return _Chosen(best, share - weight)

    def _groups_of(self, half: int) -> list[Picture]:
        """Unpooled pictures of one half, group by group."""
        pictures = [self._raw[g] / max(1, self._counts[g]) for g in range(GROUPS)]
        swap = (self._board + half) % 2 == 1
        return [np.where(swap, pictures[g + 1], pictures[g]) for g in range(0, GROUPS, 2)]


def _rgb(color: Any) -> Picture:
    return np.array(dr.ravel(mi.Color3f(color))).reshape(-1, 3)
