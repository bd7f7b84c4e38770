"""Colours of vertices, as programs write them, and the materials of surfaces that have no others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lippmann.color.transfer import decode_srgb, encode_srgb
from lippmann.scene.values.description import Material, Mesh

#: Colours in [0, 1] overshoot it by less; real numbers beyond it count to 255.
_MOST_OVERSHOOT = 2.0

GREY = Material("grey", base_color=(0.7, 0.7, 0.7), roughness=0.6, double_sided=True)
#: sRGB-coded colour in [0, 1] of what has none among vertices or faces that have one.
GREY_CODES = encode_srgb(np.array(GREY.base_color))
COLORED = Material("vertex colours", roughness=0.6, double_sided=True)
_TRANSLUCENT = replace(COLORED, alpha_mode="blend")


def full_brightness(colors: NDArray[np.floating]) -> float:
    """Value of full brightness of colours that are real numbers: 1, or 255 where one of them exceeds it by far."""
    return 255.0 if np.nanmax(colors, initial=0.0) > _MOST_OVERSHOOT else 1.0


def linear_colors(colors: ArrayLike) -> NDArray[np.float32]:
    """Linear RGBA of sRGB-coded bytes ``(n, 3 or 4)``."""
    fraction = np.asarray(colors, np.float64) / 255.0
    return np.concatenate([decode_srgb(fraction[:, :3]), fraction[:, 3:]], axis=1).astype(np.float32)


def material_of(colors: ArrayLike | None) -> Material:
    """The material of a surface with colours ``(n, 3 or 4)`` of bytes, or without."""
    if colors is None:
        return GREY
    return _TRANSLUCENT if (np.asarray(colors)[:, 3:] < 255).any() else COLORED


def without_doubled_colors(mesh: Mesh, material: Material, notes: list[str]) -> Mesh:
    """A mesh whose vertices have no colour but their opacity, with a note, where a texture has the colour.

    Scans hold the colour of their surface twice, in vertices and in textures made of these, and are not meant to be
    shown by the product.
    """
    if mesh.colors is None or not mesh.uvs or material.base_color_texture is None:
        return mesh
    note = "colours of vertices are not shown where a texture has the colour"
    notes += [] if note in notes else [note]
    colors = np.array(mesh.colors)
    colors[:, :3] = 1.0
    return replace(mesh, colors=colors if colors.shape[1] == 4 else None)
