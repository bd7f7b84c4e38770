"""Sample points that fill a pixel evenly and differ from pixel to pixel.

Every random number is a pure function of (pixel, channel, sample index, dimension, seed): the picture does not depend
on how it was cut into tiles, nor on the number of threads. Points are the (0, 2)-sequence of Sobol', shuffled and
Owen-scrambled by hashing, independently for every pair of dimensions (Burley, "Practical Hash-based Owen Scrambling",
JCGT 2020; the hash of Laine and Karras with the constants of Vegdahl). Any power-of-two run of samples is stratified in
every elementary interval, and each single point is uniform in [0, 1)^2.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from lippmann.device.types import Float, Point2f, UInt32

#: Sample dimension that places a sample in its pixel; integrators use those above.
PIXEL_DIMENSION = 0
#: Seeds of streams that know nothing of each other differ by multiples of this: the golden ratio in 32 bits, odd.
SEED_STEP = 0x9E3779B9
#: Its fraction; multiples of it fill a circle evenly, however many there are.
GOLDEN_RATIO = (5**0.5 - 1) / 2


def hash32(x: UInt32) -> UInt32:
    """A bijective mixing of 32 bits (the "lowbias32" finaliser found by Wellons)."""
    x = x ^ (x >> 16)
    x = x * 0x21F0AAAD
    x = x ^ (x >> 15)
    x = x * 0x735A2D97
    return x ^ (x >> 15)


def named_seed(*names: str | int) -> int:
    """A seed for what has these names, such as a purpose, the picture's seed and a number."""
    return zlib.crc32(repr(names).encode())


def _permute_low_to_high(x: UInt32, seed: UInt32) -> UInt32:
    """Owen-scramble bit-reversed values: each bit is flipped by a hash of the bits below it."""
    x = x ^ (x * 0x3D20ADEA)
    x = x + seed
    x = x * ((seed >> 16) | 1)
    x = x ^ (x * 0x05526C56)
    return x ^ (x * 0x53A22864)


def _second_dimension(index: UInt32) -> UInt32:
    """Bit-reversed second Sobol' coordinate of ``index``: the Pascal matrix mod 2, one Kronecker factor at a time."""
    for shift, mask in ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF), (16, 0x0000FFFF)):
        index = index ^ ((index >> shift) & mask)
    return index


def _unit_float(bits: UInt32) -> Float:
    return mi.Float(bits >> 8) * 2.0**-24


def lattice_point(number: UInt32, samples: UInt32) -> Point2f:
    """Point ``number`` of ``samples`` evenly spaced ones in [0, 1)^2, the same for every pixel.

    Equal steps in the first dimension, Kronecker's sequence of the golden ratio in the second; symmetric about the
    middle, where a single one lies. Even and odd ones are evenly spaced, too.
    """
    from_middle = mi.Float(number) - (mi.Float(samples) - 1) / 2
    second = 0.5 + from_middle * GOLDEN_RATIO
    return mi.Point2f(0.5 + from_middle / mi.Float(samples), second - dr.floor(second))


@dataclass
class SampleStream:
    """The samples of one wavefront: lane-wise pixel ``key`` (hashed with the seed) and sample ``index``.

    ``half``, 0 or 1, says for which half of a picture they are, where its samples are kept in two that know nothing of
    each other.
    """

    key: UInt32
    index: UInt32
    half: UInt32 | int = 0

    @staticmethod
    def of_pixels(pixel: UInt32, index: UInt32, seed: UInt32, half: UInt32 | int = 0) -> SampleStream:
        """Streams for linear pixel numbers ``pixel`` and sample numbers ``index`` (UInt32), under one ``seed``.

        Samples of the same number in either ``half`` are independent.
        """
        own_seed = seed + half * SEED_STEP
        return SampleStream(hash32(pixel ^ hash32(own_seed ^ mi.UInt32(0x9E3779B9))), mi.UInt32(index), half)

    def at(self, index: UInt32) -> SampleStream:
        """The same pixels' points of the samples with the numbers ``index`` (UInt32)."""
        return SampleStream(self.key, index, self.half)

    def _shuffle(self, dimension: UInt32) -> tuple[UInt32, UInt32]:
        seed = hash32(self.key + mi.UInt32(dimension) * 0x9E3779B9)
        return dr.brev(_permute_low_to_high(dr.brev(self.index), seed)), seed

    def next_1d(self, dimension: UInt32) -> Float:
        """A number in [0, 1) for ``dimension``."""
        index, seed = self._shuffle(dimension)
        return _unit_float(dr.brev(_permute_low_to_high(index, hash32(seed ^ 0x68BC21EB))))

    def next_2d(self, dimension: UInt32) -> Point2f:
        """A point in [0, 1)^2 for ``dimension``."""
        index, seed = self._shuffle(dimension)
        return mi.Point2f(
            _unit_float(dr.brev(_permute_low_to_high(index, hash32(seed ^ 0x68BC21EB)))),
            _unit_float(dr.brev(_permute_low_to_high(_second_dimension(index), hash32(seed ^ 0x02E5BE93)))),
        )
