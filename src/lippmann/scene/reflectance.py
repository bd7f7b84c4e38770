"""How bright a scene's surfaces are of themselves: :func:`mean_reflectance`, :func:`emitted_luminance`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.color.transfer import decode_srgb
from lippmann.scene.values.description import Material, Mesh, SceneDescription, Texture

# Rec. 709 luminance of linear RGB.
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

# Texels looked at along each side of a texture: its mean is wanted, not its detail.
_TEXELS = 128


def mean_reflectance(scene: SceneDescription) -> float | None:
    """Mean luminance of the base colours of a scene's surfaces, by area, with what they emit; 0 is black, 1 is white.

    Textures count as a whole, whichever of their parts are used, and hidden surfaces as seen ones: it tells a dark
    scene from a bright one, the same from wherever it is looked at. None where there are no surfaces.
    """
    total = area = 0.0
    colors: dict[int, float] = {}
    for index, places in scene.placements.items():
        mesh = scene.meshes[index]
        if not len(mesh.faces):
            continue
        if mesh.material not in colors:
            colors[mesh.material] = _luminance(scene.materials[mesh.material])
        own = _placed_area(mesh, places)
        total += own * colors[mesh.material] * _average_paint(mesh)
        area += own
    return total / area if area > 0.0 and np.isfinite(total) else None


def emitted_luminance(scene: SceneDescription) -> float:
    """Luminance of a scene's surfaces as emitters, times their areas, in all.

    Over four times the squared radius of a sphere around the scene it is the mean irradiance on that sphere, in units
    of pi: the luminance of even surroundings that would light the scene as much.
    """
    total = 0.0
    for index, places in scene.placements.items():
        mesh = scene.meshes[index]
        material = scene.materials[mesh.material]
        if len(mesh.faces) and max(material.emission) > 0.0:
            total += _placed_area(mesh, places) * float(_emission(material) @ _LUMINANCE)
    return total


def _placed_area(mesh: Mesh, places: NDArray[np.float64]) -> float:
    """The area of all of a mesh's copies, as if they were scaled evenly."""
    area = surface_area(mesh.positions, mesh.faces)
    return area * float((np.abs(np.linalg.det(places[:, :3, :3])) ** (2.0 / 3.0)).sum())


def surface_area(positions: NDArray[np.floating], faces: NDArray[np.integer]) -> float:
    """The area of triangles ``faces`` ``(m, 3)`` of ``positions`` ``(n, 3)``."""
    corners = np.asarray(positions, np.float64)[faces]
    sides = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return float(np.linalg.norm(np.cross(*sides), axis=-1).sum() / 2.0)


def _average_paint(mesh: Mesh) -> float:
    """The factor that colours of vertices bring."""
    return 1.0 if mesh.colors is None else float((mesh.colors[:, :3].astype(np.float64) @ _LUMINANCE).mean())


def _luminance(material: Material) -> float:
    base = np.array(material.base_color) * _mean(material.base_color_texture)
    return float((base + _emission(material)) @ _LUMINANCE)


def _emission(material: Material) -> NDArray[np.float64]:
    """Mean linear RGB ``(3,)`` of what a material emits."""
    return np.array(material.emission) * _mean(material.emission_texture)


def _mean(texture: Texture | None) -> NDArray[np.float64]:
    """Mean linear RGB ``(3,)`` of a texture; white without one."""
    if texture is None:
        return np.ones(3)
    pixels = texture.image.pixels
    rows, columns = (max(1, size // _TEXELS) for size in pixels.shape[:2])
    few = pixels[::rows, ::columns, :3]
    values = few.astype(np.float64) / (255.0 if few.dtype == np.uint8 else 1.0)
    return np.broadcast_to((decode_srgb(values) if texture.srgb else values).mean(axis=(0, 1)), 3)
