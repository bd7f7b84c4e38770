"""Which Gaussian splats, points of a scan or voxels of a volume are shown, and in which unit or colours."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lippmann.errors import UsageError
from lippmann.options.scene import Crop
from lippmann.scene.matrices import scaling
from lippmann.scene.point_clouds import crop_cloud, is_cloud
from lippmann.scene.scene import Scene
from lippmann.scene.splat_clouds import check_splats, crop, move
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.values.splats import Splats
from lippmann.scene.values.volume import TransferFunction, Volume
from lippmann.scene.volumes import grid
from lippmann.scene.volumes.description import transfer_note
from lippmann.scene.volumes.presets import PRESETS, preset, sample
from lippmann.scene.volumes.transfer_file import SUFFIXES, read_transfer_function

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
            rule = f"must be a factor from {1 / _LARGEST_FACTOR:g} to {_LARGEST_FACTOR:g}"
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
            splats = move(splats, scaling(self.unit_scale))
            check_splats(splats, scene.name)
        if self.crop is not None:
            splats = _some(crop(splats, np.array([self.crop[:3], self.crop[3:]])), "crop", scene.name)
        if self.min_opacity is not None:
            kept = splats.select(splats.opacities >= np.float32(self.min_opacity))
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


@dataclass(frozen=True)
class VolumeSelection:
    """How a volume is shown; None where nothing is asked for.

    Parameters
    ----------
    crop:
        Voxels are kept whose middles lie in this box of the upright scene.
    transfer_function:
        The name of a preset, a file, or the function itself.
    window:
        Lowest and highest value, between which the transfer function is laid.

    Raises
    ------
    UsageError
        A value is out of its range.
    """

    crop: Crop | None = None
    transfer_function: str | Path | TransferFunction | None = None
    window: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        check_crop(self.crop)
        if self.window is not None:
            low, high = self.window
            if not (np.isfinite([low, high]).all() and max(abs(low), abs(high)) <= 1e30 and low + 1e-30 < high):
                raise UsageError(f"{low:g}, {high:g}", parameter="window", rule="two numbers, the lower first")

    def of(self, scene: Scene) -> Scene:
        """The scene with its volume shown so.

        Raises
        ------
        UsageError
            The scene has no volume, nothing is left of it, or no transfer function has that name.
        SceneError
            The file of the transfer function is missing or damaged.
        """
        asked = {name: value for name, value in vars(self).items() if value is not None}
        if not asked:
            return scene
        description = scene.description
        if not isinstance(description, SceneDescription) or description.volume is None:
            raise holds_none(scene, "volume", next(iter(asked)))
        volume = description.volume
        if self.crop is not None:
            part = grid.crop(volume, np.array([self.crop[:3], self.crop[3:]]))
            if part is None:
                raise UsageError("leaves no voxel", where=scene.name, parameter="crop", fix="ask for less")
            volume = part
        transfer, before = self._transfer(volume), transfer_note(volume.transfer)
        notes = [transfer_note(transfer) if note == before else note for note in description.notes]
        return replace(scene, description=replace(description, volume=replace(volume, transfer=transfer), notes=notes))

    def _transfer(self, volume: Volume) -> TransferFunction:
        transfer, asked = volume.transfer, self.transfer_function
        if isinstance(asked, TransferFunction):
            transfer = asked
        elif asked is not None and Path(asked).suffix.lower() in SUFFIXES:
            transfer = read_transfer_function(Path(asked))
        elif asked is not None:
            if asked not in PRESETS:
                rule = f"known are {', '.join(PRESETS)}, or a .toml or .json file"
                raise UsageError.unknown("preset", asked, PRESETS, parameter="transfer_function", rule=rule)
            transfer = preset(str(asked), sample(volume.grid, volume.slope, volume.intercept))
        if self.window is None:
            return transfer
        first, last = transfer.values[[0, -1]]
        low, high = self.window
        return replace(transfer, values=low + (transfer.values - first) * ((high - low) / (last - first)))
