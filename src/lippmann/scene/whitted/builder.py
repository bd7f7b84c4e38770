"""Builder of a :class:`ClassicScene`: append primitives in any order, get whole batches out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from lippmann.errors import SceneError
from lippmann.scene.parsing.normals import unit_face_normals
from lippmann.scene.values.whitted_scene import ClassicCamera, ClassicScene, Handedness, Rules
from lippmann.scene.values.whitted_shapes import (
    Batch,
    Boxes,
    Cylinders,
    Numbers,
    Planes,
    Rings,
    Spheres,
    Triangles,
    Tubes,
)
from lippmann.scene.values.whitted_surfaces import (
    AmbientOcclusion,
    Background,
    ClassicImage,
    ClassicLight,
    ClassicMaterial,
    Fog,
    Shading,
)

B = TypeVar("B", bound=Batch)


def unit(vectors: ArrayLike, what: str) -> Numbers:
    """The vectors ``(..., 3)`` at length 1.

    Raises
    ------
    SceneError
        If one of them has no length or is not finite; ``what`` names it.
    """
    array = np.asarray(vectors, dtype=np.float64)
    largest = np.abs(array).max(axis=-1, keepdims=True, initial=0.0)
    if not np.isfinite(largest).all() or (largest == 0.0).any():
        raise SceneError(f"{what} has no length or is not finite", rule="a direction needs a length")
    scaled = array / largest  # so that squares of very small or large components stay in range
    result: Numbers = scaled / np.linalg.norm(scaled, axis=-1, keepdims=True)
    return result


class ClassicSceneBuilder:
    """Collects primitives, materials, images, lights and clip groups.

    The methods named after the kinds take one primitive or many: arrays with one row per primitive, single values
    standing for all rows. ``material`` is what :meth:`material` returned. ``notes`` is a plain list to append to.

    Example
    -------
    >>> from lippmann.scene.values.whitted_surfaces import ClassicMaterial
    >>> builder = ClassicSceneBuilder("two balls")
    >>> red = builder.material(ClassicMaterial(color=(1.0, 0.0, 0.0)))
    >>> builder.spheres([[0, 0, 0], [3, 0, 0]], 1.0, red)
    >>> builder.build().counts()["sphere"]
    2
    """

    def __init__(self, name: str, *, rules: Rules = "tachyon", handedness: Handedness = "left") -> None:
        self.name = name
        self.rules: Rules = rules
        self.handedness: Handedness = handedness
        self.notes: list[str] = []
        self.lights: list[ClassicLight] = []
        self._materials: dict[ClassicMaterial, int] = {}
        self._images: list[ClassicImage] = []
        self._clip_groups: list[Numbers] = []
        self._parts: dict[type[Batch], list[Batch]] = {}

    def material(self, material: ClassicMaterial) -> int:
        """The material's index; equal materials share one."""
        return self._materials.setdefault(material, len(self._materials))

    def image(self, image: ClassicImage) -> int:
        """The image's index, for ``ClassicTexture.image``."""
        self._images.append(image)
        return len(self._images) - 1

    def clip_group(self, planes: ArrayLike) -> int:
        """Index of a clip group: rows (a, b, c, d) that keep points with a x + b y + c z <= d."""
        self._clip_groups.append(np.array(planes, dtype=np.float64).reshape(-1, 4))
        return len(self._clip_groups) - 1

    def light(self, light: ClassicLight) -> None:
        """Add a light source."""
        self.lights.append(light)

    def spheres(
        self,
        centers: ArrayLike,
        radii: ArrayLike,
        material: ArrayLike,
        *,
        inside_only: ArrayLike = False,
        clip_group: ArrayLike = -1,
    ) -> None:
        """Spheres: ``centers (n, 3)``, ``radii (n,)`` > 0."""
        self._add(Spheres, material, clip_group, centers=centers, radii=radii, inside_only=inside_only)

    def tubes(
        self,
        base: ArrayLike,
        apex: ArrayLike,
        base_radius: ArrayLike,
        material: ArrayLike,
        *,
        apex_radius: ArrayLike | None = None,
        inside_only: ArrayLike = False,
        clip_group: ArrayLike = -1,
    ) -> None:
        """Open cylinders from ``base`` to ``apex`` ``(n, 3)``; with ``apex_radius`` truncated cones."""
        radii = {"base_radius": base_radius, "apex_radius": base_radius if apex_radius is None else apex_radius}
        self._add(Tubes, material, clip_group, base=base, apex=apex, inside_only=inside_only, **radii)

    def cylinders(
        self, centers: ArrayLike, axes: ArrayLike, radii: ArrayLike, material: ArrayLike, *, clip_group: ArrayLike = -1
    ) -> None:
        """Cylinders without end; ``axes (n, 3)`` of any length."""
        self._add(Cylinders, material, clip_group, centers=centers, axes=unit(axes, "a cylinder's axis"), radii=radii)

    def rings(
        self,
        centers: ArrayLike,
        normals: ArrayLike,
        inner: ArrayLike,
        outer: ArrayLike,
        material: ArrayLike,
        *,
        clip_group: ArrayLike = -1,
    ) -> None:
        """Flat rings (``inner`` 0: discs); ``normals (n, 3)`` of any length."""
        normals = unit(normals, "a ring's normal")
        self._add(Rings, material, clip_group, centers=centers, normals=normals, inner=inner, outer=outer)

    def boxes(self, minimum: ArrayLike, maximum: ArrayLike, material: ArrayLike, *, clip_group: ArrayLike = -1) -> None:
        """Boxes along the axes between two corners ``(n, 3)``."""
        self._add(Boxes, material, clip_group, minimum=minimum, maximum=maximum)

    def planes(
        self, centers: ArrayLike, normals: ArrayLike, material: ArrayLike, *, clip_group: ArrayLike = -1
    ) -> None:
        """Planes without end; ``normals (n, 3)`` of any length."""
        self._add(Planes, material, clip_group, centers=centers, normals=unit(normals, "a plane's normal"))

    def triangles(
        self,
        positions: ArrayLike,
        material: ArrayLike,
        *,
        normals: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        clip_group: ArrayLike = -1,
    ) -> None:
        """Triangles ``(n, 3, 3)``: flat without ``normals``, else smooth; corner ``colors`` replace the material's."""
        corners = np.asarray(positions, dtype=np.float64).reshape(-1, 3, 3)
        self._add(
            Triangles,
            material,
            clip_group,
            positions=corners,
            normals=_geometric_normals(corners) if normals is None else normals,
            colors=np.zeros((3, 3)) if colors is None else colors,
            smooth=normals is not None,
            colored=colors is not None,
        )

    def mesh(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        material: ArrayLike,
        *,
        normals: ArrayLike | None = None,
        colors: ArrayLike | None = None,
    ) -> None:
        """Triangles from shared ``vertices (v, 3)`` and ``faces (n, 3)``; ``normals`` and ``colors`` per vertex."""
        corners = np.asarray(faces, dtype=np.int64).reshape(-1, 3)
        self.triangles(
            np.asarray(vertices, dtype=np.float64)[corners],
            material,
            normals=None if normals is None else np.asarray(normals, dtype=np.float64)[corners],
            colors=None if colors is None else np.asarray(colors, dtype=np.float64)[corners],
        )

    def build(
        self,
        lights: Iterable[ClassicLight] = (),
        *,
        camera: ClassicCamera | None = None,
        resolution: tuple[int, int] = (512, 512),
        background: Background | None = None,
        fog: Fog | None = None,
        ambient_occlusion: AmbientOcclusion | None = None,
        shading: Shading | None = None,
    ) -> ClassicScene:
        """The scene, with further ``lights`` and fields of :class:`ClassicScene`; None takes the field's default."""
        return ClassicScene(
            name=self.name,
            rules=self.rules,
            handedness=self.handedness,
            spheres=self._whole(Spheres),
            tubes=self._whole(Tubes),
            cylinders=self._whole(Cylinders),
            rings=self._whole(Rings),
            boxes=self._whole(Boxes),
            planes=self._whole(Planes),
            triangles=self._whole(Triangles),
            clip_groups=tuple(self._clip_groups),
            materials=tuple(self._materials),
            images=tuple(self._images),
            lights=(*self.lights, *lights),
            notes=tuple(self.notes),
            camera=camera or ClassicCamera(),
            resolution=resolution,
            background=background or Background(),
            fog=fog,
            ambient_occlusion=ambient_occlusion,
            shading=shading or Shading(),
        )

    def _add(self, kind: type[Batch], material: ArrayLike, clip_group: ArrayLike, **columns: ArrayLike) -> None:
        """Append one batch; single values are repeated to the number of rows of the longest column."""
        arrays: dict[str, np.ndarray] = {
            "material": np.asarray(material, dtype=np.int32),
            "clip_group": np.asarray(clip_group, dtype=np.int32),
        }
        for name, column in columns.items():
            array = np.asarray(column)
            arrays[name] = array if array.dtype == np.bool_ else array.astype(np.float64)
        row_axes = {name: len(kind.shapes.get(name, ())) for name in arrays}
        try:
            lengths = {len(array) for name, array in arrays.items() if array.ndim > row_axes[name]}
            rows = 0 if 0 in lengths else max(lengths, default=1)
            full = {
                name: np.broadcast_to(array, (rows, *kind.shapes.get(name, ()))).copy()
                for name, array in arrays.items()
            }
        except ValueError:
            shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
            raise SceneError(f"{kind.kind}: {shapes} do not fit together", rule="as many rows each, or one") from None
        self._parts.setdefault(kind, []).append(kind(**full))

    def _whole(self, kind: type[B]) -> B:
        parts: Sequence[Batch] = self._parts.get(kind, [])
        if not parts:
            return kind()
        names = [item.name for item in fields(kind)]
        return kind(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


def _geometric_normals(corners: Numbers) -> Numbers:
    """Unit normals ``(n, 3, 3)``, the same at all corners; zero for triangles without an area."""
    return np.repeat(unit_face_normals(corners)[:, None, :], 3, axis=1)
