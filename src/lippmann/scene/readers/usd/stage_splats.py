"""Records of Gaussian splats: fields of particles (UsdVol, usd-core 26), as their schema tells their arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd

from lippmann.scene.readers.usd.records import Arrays, Record

#: Types of fields of particles, by the beginning of their names.
PARTICLES = "ParticleField"

_ELLIPSOID, _DISC = "ParticleFieldKernelGaussianEllipsoidAPI", "ParticleFieldKernelGaussianSurfletAPI"
_HARMONICS = "radiance:sphericalHarmonics"


def splat_record(prim: Usd.Prim, time: Usd.TimeCode, arrays: Arrays, notes: dict[str, None]) -> Record | None:
    """The Gaussians of a field of particles; None of one of another kind or without particles.

    An array that is too long is cut; one that is too short or absent is left out, and has the schema's default.
    """
    kernels = prim.GetAppliedSchemas()
    if _ELLIPSOID not in kernels and _DISC not in kernels:
        notes[f"{prim.GetPath()}: particles that are no Gaussians are not drawn"] = None
        return None
    positions = _values(prim, "positions", 3, time)
    count = len(positions)
    if not count:
        return None
    degree = int(prim.GetAttribute(f"{_HARMONICS}Degree").Get(time) or 0)
    record: Record = {
        "name": str(prim.GetPath()),
        "positions": arrays.add(positions),
        "degree": degree,
        "is_flat": _ELLIPSOID not in kernels,
    }
    parts = {
        "orientations": ("orientations", 4, 1),
        "scales": ("scales", 3, 1),
        "opacities": ("opacities", 1, 1),
        "harmonics": (f"{_HARMONICS}Coefficients", 3, (max(degree, 0) + 1) ** 2),
    }
    for part, (name, width, each) in parts.items():
        values = _values(prim, name, width, time)
        if 0 < len(values) < count * each:
            notes[f"{prim.GetPath()}: {name} holds {len(values)} of {count * each} values, and is passed over"] = None
        record[part] = arrays.add(values[: count * each]) if len(values) >= count * each else None
    return record


def _values(prim: Usd.Prim, name: str, width: int, time: Usd.TimeCode) -> NDArray[np.float32]:
    """An array ``(n, width)``, or where it is empty its twin in half precision."""
    for each in (name, f"{name}h"):
        attribute = prim.GetAttribute(each)
        values: Any = attribute.Get(time) if attribute else None
        if values is not None and len(values):
            return np.asarray(values, np.float32).reshape(-1, width)
    return np.empty((0, width), np.float32)
