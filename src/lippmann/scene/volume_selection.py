"""Which part of a volume is shown, and by which transfer function."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lippmann.errors import UsageError
from lippmann.options.scene import Crop
from lippmann.scene.scene import Scene
from lippmann.scene.splat_selection import check_crop, holds_none
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.values.volume import TransferFunction, Volume
from lippmann.scene.volumes.grid import cropped
from lippmann.scene.volumes.presets import PRESETS, preset, sample
from lippmann.scene.volumes.transfer_file import SUFFIXES, read_transfer_function


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
            part = cropped(volume, np.array([self.crop[:3], self.crop[3:]]))
            if part is None:
                raise UsageError("leaves no voxel", where=scene.name, parameter="crop", fix="ask for less")
            volume = part
        transfer = self._transfer(volume)
        return replace(scene, description=replace(description, volume=replace(volume, transfer=transfer)))

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
