"""Animations: values of the nodes' properties at a time (glTF 2.0, section 3.11 and appendix C)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.scene.readers.gltf import accessors as storage
from lippmann.scene.readers.gltf.accessors import Accessors, Storage
from lippmann.scene.readers.gltf.document import Document
from lippmann.scene.readers.gltf.json_fields import Fields

Floats = NDArray[np.float64]
Path = Literal["translation", "rotation", "scale", "weights"]
Interpolation = Literal["LINEAR", "STEP", "CUBICSPLINE"]

#: Index of a node, and the property of it that is animated.
Target = tuple[int, Path]

_STORAGE: dict[str, Storage] = {
    "translation": storage.TRANSLATION,
    "rotation": storage.KEY_ROTATION,
    "scale": storage.SCALE,
    "weights": storage.KEY_WEIGHTS,
}
_INTERPOLATIONS: tuple[Interpolation, ...] = ("LINEAR", "STEP", "CUBICSPLINE")

#: Pointers of KHR_animation_pointer to what a channel without it can move, too.
_NODE_POINTER = re.compile(r"/nodes/(\d+)/(translation|rotation|scale|weights)")

#: Quaternions closer than this (cosine of half the angle) are blended linearly: the arc's sine would vanish.
_CLOSE = 0.9995


@dataclass(frozen=True, eq=False)
class Sampler:
    """Interpolated keyframes.

    Attributes
    ----------
    times:
        ``(k,)`` seconds, rising; of equal ones the last counts from then on.
    values:
        ``(k, width)``; for cubic splines ``(k, 3, width)``: tangent before, value, tangent after.
    turning:
        The values are quaternions (x, y, z, w): they are blended along the arc and have unit length.
    """

    times: Floats
    values: Floats
    interpolation: Interpolation
    turning: bool = False

    def at(self, seconds: float) -> Floats:
        """The value ``(width,)`` at a time; before the first key the first value, after the last the last one."""
        after = int(np.searchsorted(self.times, seconds, side="right"))
        if after == 0 or after == len(self.times):
            key = 0 if after == 0 else after - 1
            return self._unit(self._value(key))
        before = after - 1
        if self.interpolation == "STEP":
            return self._unit(self._value(before))
        length = float(self.times[after] - self.times[before])
        share = (seconds - float(self.times[before])) / length
        if self.interpolation == "CUBICSPLINE":
            return self._unit(_interpolate_hermite(self.values[before], self.values[after], share, length))
        if self.turning:
            return _slerp(self._unit(self._value(before)), self._unit(self._value(after)), share)
        return (1.0 - share) * self._value(before) + share * self._value(after)

    def _value(self, key: int) -> Floats:
        value: Floats = self.values[key, 1] if self.interpolation == "CUBICSPLINE" else self.values[key]
        return value

    def _unit(self, value: Floats) -> Floats:
        if not self.turning:
            return value
        length = float(np.linalg.norm(value))
        # A spline may pass through zero, which is no rotation: none is the best guess.
        return value / length if length > 0.0 else np.array([0.0, 0.0, 0.0, 1.0])


def _interpolate_hermite(before: Floats, after: Floats, share: float, length: float) -> Floats:
    """Cubic Hermite spline between two keys ``(3, width)`` (appendix C.5)."""
    s, s2, s3 = share, share**2, share**3
    value: Floats = (
        (2 * s3 - 3 * s2 + 1) * before[1]
        + length * (s3 - 2 * s2 + s) * before[2]
        + (-2 * s3 + 3 * s2) * after[1]
        + length * (s3 - s2) * after[0]
    )
    return value


def _slerp(before: Floats, after: Floats, share: float) -> Floats:
    """Spherical linear interpolation of unit quaternions, the shorter way round (appendix C.4)."""
    cosine = float(before @ after)
    if cosine < 0.0:
        after, cosine = -after, -cosine
    if cosine > _CLOSE:
        blended = (1.0 - share) * before + share * after
        return blended / float(np.linalg.norm(blended))
    angle = float(np.arccos(min(cosine, 1.0)))
    value: Floats = (np.sin((1.0 - share) * angle) * before + np.sin(share * angle) * after) / np.sin(angle)
    return value


@dataclass(frozen=True, eq=False)
class Animation:
    """One animation of a file: a sampler for each target."""

    name: str
    samplers: Mapping[Target, Sampler]

    @property
    def duration(self) -> float:
        """Seconds from time 0 to the last key."""
        return max((0.0, *(float(sampler.times[-1]) for sampler in self.samplers.values())))

    def at(self, seconds: float) -> dict[Target, Floats]:
        """Values of all targets at a time."""
        return {target: sampler.at(seconds) for target, sampler in self.samplers.items()}


def read_animations(document: Document, accessors: Accessors) -> tuple[Animation, ...]:
    """All animations of a file, in its order.

    Channels of KHR_animation_pointer are followed to translations, rotations, scales and weights of nodes; its other
    channels, and those of other extensions, are left out with a note.

    Raises
    ------
    SceneError
        A channel without a sampler, times of keys or values that do not fit their keys or are not finite, a
        rotation of length 0, a node that has a matrix.
    """
    return tuple(
        _read(fields, number, document, accessors) for number, fields in enumerate(document.root.children("animations"))
    )


def _read(fields: Fields, number: int, document: Document, accessors: Accessors) -> Animation:
    by_target: dict[Target, Sampler] = {}
    samplers = fields.children("samplers")
    for channel in fields.children("channels"):
        target = channel.child("target")
        if target is None:
            raise channel.error("target", "it is required")
        node = document.reference(target, "node", "nodes")
        path = target.text("path")
        extension = target.extension("KHR_animation_pointer")
        pointed = None if extension is None else _NODE_POINTER.fullmatch(extension.text("pointer") or "")
        if pointed is not None:
            target = Fields({"node": int(pointed[1]), "path": pointed[2]}, target.place, target.file)
            node, path = document.reference(target, "node", "nodes"), pointed[2]
        elif path == "pointer" or (node is None and target.has("extensions")):
            document.notes.add("animations of anything but nodes and weights are not followed", channel.place)
            continue
        if path not in _STORAGE:
            raise target.error("path", f"{', '.join(_STORAGE)} belongs here")
        if node is None:  # section 3.11: such a channel says nothing
            continue
        if path != "weights" and document.all("nodes")[node].has("matrix"):
            raise target.error("node", f"nodes[{node}] has a matrix, which cannot be animated")
        index = channel.integer("sampler")
        if index >= len(samplers):
            raise channel.error("sampler", f"there are {len(samplers)} samplers, counted from 0")
        key: Target = (node, path)  # type: ignore[assignment]
        if key in by_target:
            raise target.error("path", f"another channel moves the {path} of nodes[{node}]")
        by_target[key] = _read_sampler(samplers[index], path, document, accessors)
    return Animation(fields.text("name") or f"animations[{number}]", by_target)


def _read_sampler(fields: Fields, path: str, document: Document, accessors: Accessors) -> Sampler:
    interpolation = fields.text("interpolation") or "LINEAR"
    if interpolation not in _INTERPOLATIONS:
        raise fields.error("interpolation", f"{', '.join(_INTERPOLATIONS)} belongs here")
    keys = document.required_reference(fields, "input", "accessors")
    times = accessors.floats(keys, storage.KEY_TIMES)[:, 0].astype(np.float64)
    if not len(times) or not np.isfinite(times).all():
        raise fields.error("input", "its times must be finite")
    if (np.diff(times) <= 0.0).any():
        document.notes.add("keys whose times do not rise are sorted; of equal times the last counts", fields.place)
    output = document.required_reference(fields, "output", "accessors")
    values = accessors.floats(output, _STORAGE[path]).astype(np.float64)
    per_key = 3 if interpolation == "CUBICSPLINE" else 1
    if path == "weights" and len(values) % (len(times) * per_key) == 0:
        values = values.reshape(len(times) * per_key, -1)
    if len(values) != len(times) * per_key or not values.shape[1]:
        raise fields.error("output", f"{len(times)} keys of {interpolation} need {len(times) * per_key} values each")
    if not np.isfinite(values).all():
        raise fields.error("output", "its values must be finite")
    if per_key == 3:
        values = values.reshape(len(times), 3, -1)
    turning = path == "rotation"
    if turning and not (values[:, 1] if per_key == 3 else values).any(axis=1).all():
        raise fields.error("output", "a quaternion of length 0 is no rotation")
    order = np.argsort(times, kind="stable")
    return Sampler(times[order], values[order], interpolation, turning)
