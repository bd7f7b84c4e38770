"""Which Gaussian splats or points of a scan are shown, and in which unit its coordinates count."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lippmann.errors import UsageError
from lippmann.options.scene import Crop
from lippmann.scene.matrices import scaling
from lippmann.scene.point_clouds import crop_cloud, is_cloud
from lippmann.scene.scene import Scene
from lippmann.scene.splat_clouds import check_splats, cropped, moved
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.values.splats import Splats

_LARGEST_FACTOR = 1e9


@dataclass(frozen=True)
class SplatSelection:
    """A choice of Gaussian splats; None where nothing is asked for.

    Parameters
    ----------
    crop:
        Splats are kept whose centres lie in this box of the upright scene, after ``unit_scale``; of a cloud of plain
        points, the points.
    unit_scale:
        Factor on the scene's coordinates, above 0.
    min_opacity:
        Splats of less opacity are left out; 0 to 1.

    Raises
    ------
    UsageError
        A value is out of its range.
    """

    crop: Crop | None = None
    unit_scale: float | None = None
    min_opacity: float | None = None

    def __post_init__(self) -> None:
        check_crop(self.crop)
        if self.unit_scale is not None and not 1 / _LARGEST_FACTOR <= self.unit_scale <= _LARGEST_FACTOR:
            rule = f"a factor from {1 / _LARGEST_FACTOR:g} to {_LARGEST_FACTOR:g}"
            raise UsageError(f"{self.unit_scale:g}", parameter="unit_scale", rule=rule)
        if self.min_opacity is not None and not 0.0 <= self.min_opacity <= 1.0:
            raise UsageError(f"{self.min_opacity:g}", parameter="min_opacity", rule="a number from 0 to 1")

    def of(self, scene: Scene) -> Scene:
        """The scene with the chosen splats alone.

        Raises
        ------
        UsageError
            The scene has no splats, or none is left.
        """
        asked = {name: value for name, value in vars(self).items() if value is not None}
        if not asked:
            return scene
        description = scene.description
        if isinstance(description, SceneDescription) and self.crop and len(asked) == 1 and is_cloud(description):
            points = crop_cloud(description, np.array([self.crop[:3], self.crop[3:]]))
            if points is None:
                raise _leaves_none("point", "crop", scene.name)
            return replace(scene, description=points)
        if not isinstance(description, SceneDescription) or description.splats is None:
            what = "Gaussian splats or cloud of points" if self.crop is not None else "Gaussian splats"
            raise holds_none(scene, what, next(iter(asked)))
        if self.unit_scale is not None and description.placements:
            raise UsageError(
                f"'{scene.name}' holds surfaces beside its splats",
                parameter="unit_scale",
                rule="it is for scenes of splats alone",
                fix="leave it out",
            )
        splats = description.splats
        if self.unit_scale is not None:
            splats = moved(splats, scaling(self.unit_scale))
            check_splats(splats, scene.name)
        if self.crop is not None:
            splats = _some(cropped(splats, np.array([self.crop[:3], self.crop[3:]])), "crop", scene.name)
        if self.min_opacity is not None:
            kept = splats.chosen(splats.opacities >= np.float32(self.min_opacity))
            splats = _some(kept, "min_opacity", scene.name)
        return replace(scene, description=replace(description, splats=splats))


def holds_none(scene: Scene, what: str, parameter: str) -> UsageError:
    """The error of an option for something that a scene does not hold."""
    return UsageError(
        f"'{scene.name}' holds no {what}", parameter=parameter, rule="it is for scenes that do", fix="leave it out"
    )


def check_crop(crop: Crop | None) -> None:
    """Check that a box, if there is one, has an extent.

    Raises
    ------
    UsageError
        It has none.
    """
    if crop is None:
        return
    box = np.asarray(crop, np.float64)
    if box.shape != (6,) or not np.isfinite(box).all() or (box[:3] >= box[3:]).any():
        rule = "six numbers: the lowest corner x, y, z of a box, then its highest"
        raise UsageError(f"{crop!r}", parameter="crop", rule=rule)


def _some(splats: Splats, parameter: str, name: str) -> Splats:
    if splats.count == 0:
        raise _leaves_none("Gaussian splat", parameter, name)
    return splats


def _leaves_none(what: str, parameter: str, name: str) -> UsageError:
    return UsageError(f"leaves no {what}", where=name, parameter=parameter, fix="ask for less")
