"""Pictures and floors painted by code: nothing is read from files.

All functions return ``(height, width, 3)`` uint8, row 0 on top. Noise is hashed from integers, not drawn from a
generator, so that it does not depend on the version of NumPy.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Pixels = NDArray[np.uint8]


def parquet(size: int = 128, planks: int = 4) -> Pixels:
    """Basket-weave parquet, 2 x 2 blocks of ``planks`` planks each; repeats without a seam."""
    y, x = (np.arange(size)[:, None] + 0.5) * 2 / size, (np.arange(size)[None, :] + 0.5) * 2 / size
    block = (np.floor(x) + np.floor(y)) % 2
    across, along = np.where(block == 0, y, x) * planks, np.where(block == 0, x, y)
    plank = np.floor(across) + 40 * np.floor(along) + 400 * block
    tone = 0.78 + 0.22 * _hash(plank, 7 * plank, 1)
    grain = noise(across * 5.0 + 13 * plank, along * 2.2 + 5 * plank, 2)
    to_edge = np.minimum(across % 1, 1 - across % 1) / planks
    to_end = np.minimum(along % 1, 1 - along % 1)
    joint = np.clip(np.minimum(to_edge, to_end) * size / 3.0, 0.35, 1.0)
    shade = tone * (0.84 + 0.30 * grain) * joint
    return _to_bytes(shade[..., None] * np.array([0.62, 0.40, 0.22]))


def moonrise(size: int = 160) -> Pixels:
    """A moon over mountains that mirror themselves in a lake."""
    x, y = _grid(size)
    shore = 0.62
    height = np.where(y > shore, 2 * shore - y, y)  # below the shore: the picture upside down
    ripple = np.where(y > shore, 0.012 * noise(x * 9, y * 60, 11), 0.0)
    sky = _mix(height / shore, (0.02, 0.03, 0.12), (0.42, 0.30, 0.42))
    stars = (_hash(np.floor(x * 70), np.floor(height * 70), 12) > 0.985) * (0.9 - height)
    moon = np.clip((0.085 - np.hypot(x - 0.66, height - 0.20)) * size / 2, 0, 1)
    halo = 0.25 * np.exp(-(((x - 0.66) ** 2 + (height - 0.20) ** 2) / 0.02))
    color = sky + (np.clip(stars, 0, 1) + halo)[..., None]
    color = _over(color, moon, (0.98, 0.95, 0.84))
    for seed, base, rough, dark in ((13, 0.42, 0.20, 1.0), (14, 0.52, 0.14, 0.55)):
        ridge = base + rough * (0.5 - _fractal(x * 3 + ripple * 8, seed))
        color = _over(color, np.clip((height - ridge) * size / 2, 0, 1), (0.30 * dark, 0.20 * dark, 0.26 * dark))
    water = np.clip((y - shore) * size / 2, 0, 1)
    return _to_bytes(color * (1 - 0.35 * water[..., None]))


def planet(size: int = 160) -> Pixels:
    """A banded planet with its ring."""
    x, y = _grid(size)
    u, v = (x - 0.5) * 2.2, (y - 0.5) * 2.2
    u, v = 0.94 * u + 0.34 * v, -0.34 * u + 0.94 * v
    stars = (_hash(np.floor(x * 80), np.floor(y * 80), 21) > 0.988) * 0.8
    color = np.zeros((size, size, 3)) + np.array([0.01, 0.01, 0.03]) + stars[..., None]
    radius = 0.52
    depth = np.sqrt(np.clip(radius**2 - u**2 - v**2, 0, None)) / radius
    bands = 0.5 + 0.5 * np.sin(26 * v + 2.5 * noise(u * 4, v * 9, 22))
    light = np.clip(0.75 * depth - 0.5 * u / radius - 0.2 * v / radius, 0.03, 1.1)
    globe = _mix(bands, (0.86, 0.62, 0.36), (0.95, 0.85, 0.68)) * light[..., None]
    color = _over(color, np.clip((radius - np.hypot(u, v)) * size / 2.2, 0, 1), globe)
    distance = np.hypot(u, v / 0.28)
    ring = np.clip((0.24 - np.abs(distance - 0.82)) * size / 4, 0, 1) * (0.55 + 0.35 * np.sin(60 * distance))
    before = (v > 0) | (np.hypot(u, v) > radius)
    return _to_bytes(_over(color, ring * before, (0.85, 0.78, 0.62)))


def composition(size: int = 160) -> Pixels:
    """Rectangles in primary colours between black bars."""
    x, y = _grid(size)
    color = np.zeros((size, size, 3)) + np.array([0.93, 0.91, 0.85])
    fields = (
        (0.00, 0.34, 0.00, 0.42, (0.78, 0.10, 0.08)),
        (0.72, 1.00, 0.66, 1.00, (0.93, 0.76, 0.10)),
        (0.34, 0.72, 0.66, 1.00, (0.10, 0.20, 0.55)),
        (0.72, 1.00, 0.00, 0.22, (0.12, 0.12, 0.14)),
    )
    for left, right, top, bottom, paint in fields:
        color[((x >= left) & (x < right) & (y >= top) & (y < bottom))] = paint
    bars = [np.abs(x - 0.34), np.abs(x - 0.72), np.abs(y - 0.42), np.abs(y - 0.66)]
    bars.append(np.where(x > 0.72, np.abs(y - 0.22), 1.0))
    ink = np.clip((0.017 - np.min(bars, axis=0)) * size / 1.5 + 0.5, 0, 1)
    return _to_bytes(_over(color, ink, (0.05, 0.05, 0.06)))


def hills(size: int = 160) -> Pixels:
    """Hills behind hills under an evening sun."""
    x, y = _grid(size)
    color = _mix(y / 0.7, (0.18, 0.34, 0.66), (1.0, 0.72, 0.42))
    color = _over(color, np.clip((0.07 - np.hypot(x - 0.34, y - 0.40)) * size / 2, 0, 1), (1.0, 0.93, 0.70))
    for step in range(6):
        ridge = 0.44 + 0.09 * step + 0.10 * (0.5 - _fractal(x * (2.6 - 0.25 * step), 31 + step))
        near = step / 5
        paint = (0.66 - 0.56 * near, 0.50 - 0.22 * near, 0.48 - 0.36 * near)
        color = _over(color, np.clip((y - ridge) * size / 2, 0, 1), paint)
    return _to_bytes(color)


def noise(x: ArrayLike, y: ArrayLike, seed: int) -> Array:
    """Smooth noise in [0, 1] over the plane, one hashed value per whole number."""
    x, y = np.broadcast_arrays(np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64))
    i, j = np.floor(x), np.floor(y)
    s, t = x - i, y - j
    s, t = s * s * (3 - 2 * s), t * t * (3 - 2 * t)
    above = _hash(i, j, seed) * (1 - s) + _hash(i + 1, j, seed) * s
    below = _hash(i, j + 1, seed) * (1 - s) + _hash(i + 1, j + 1, seed) * s
    mixed: Array = above * (1 - t) + below * t
    return mixed


def _fractal(x: Array, seed: int) -> Array:
    total = np.zeros(np.shape(x))
    for octave in range(5):
        total += noise(x * 2**octave, np.full(np.shape(x), 0.5), seed + octave) / 2 ** (octave + 1)
    return total


def _hash(i: Array, j: Array, seed: int) -> Array:
    """Hash whole numbers to [0, 1): multiply and xor-shift rounds on 32 bits."""
    h = np.asarray(i).astype(np.int64).astype(np.uint32) * np.uint32(0x9E3779B1)
    h = h ^ (np.asarray(j).astype(np.int64).astype(np.uint32) * np.uint32(0x85EBCA77))
    h = h + np.uint32(seed * 0x27D4EB2F % 2**32)
    for multiplier in (0x2C1B3C6D, 0x297A2D39):
        h = (h ^ (h >> np.uint32(15))) * np.uint32(multiplier)
    value: Array = (h ^ (h >> np.uint32(15))).astype(np.float64) / 2.0**32
    return value


def _grid(size: int) -> tuple[Array, Array]:
    """x and y in (0, 1), ``(size, size)`` each, y growing downward."""
    middle = (np.arange(size) + 0.5) / size
    x, y = np.meshgrid(middle, middle)
    return x, y


def _mix(t: Array, first: ArrayLike, second: ArrayLike) -> Array:
    t = np.clip(t, 0, 1)[..., None]
    return np.asarray(first) * (1 - t) + np.asarray(second) * t


def _over(color: Array, alpha: Array, paint: ArrayLike) -> Array:
    return color * (1 - alpha[..., None]) + np.asarray(paint) * alpha[..., None]


def _to_bytes(color: Array) -> Pixels:
    return np.round(np.clip(color, 0, 1) * 255).astype(np.uint8)
