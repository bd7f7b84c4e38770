"""Skinned meshes: which skeleton moves a mesh, and its points as joints and blend shapes have them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd, UsdSkel, Vt


@dataclass(frozen=True)
class Skin:
    """A mesh's skinning: its query, and the skeleton's prim and query."""

    skinning: UsdSkel.SkinningQuery
    skeleton: Usd.Prim
    query: UsdSkel.SkeletonQuery


class Skinning:
    """The skeletons of a stage."""

    def __init__(self, stage: Usd.Stage, time: Usd.TimeCode, predicate: Any) -> None:
        self._cache = UsdSkel.Cache()
        for prim in Usd.PrimRange(stage.GetPseudoRoot(), predicate):
            if prim.IsA(UsdSkel.Root):
                self._cache.Populate(UsdSkel.Root(prim), predicate)

    def of(self, prim: Usd.Prim) -> Skin | None:
        """The mesh's skinning; None for a mesh without any."""
        skinning = self._cache.GetSkinningQuery(prim)
        if not skinning or not (skinning.HasJointInfluences() or skinning.HasBlendShapes()):
            return None
        skeleton = UsdSkel.BindingAPI(prim).GetInheritedSkeleton()
        query = self._cache.GetSkelQuery(skeleton) if skeleton else None
        return Skin(skinning, skeleton.GetPrim(), query) if query else None


def skinned_points(skin: Skin, prim: Usd.Prim, points: Any, time: Usd.TimeCode) -> Any:
    """The points of a mesh in the space of its skeleton: blend shapes first, then joints."""
    points = Vt.Vec3fArray(points)
    if skin.skinning.HasBlendShapes() and skin.query.GetAnimQuery():
        _blend(skin, prim, points, time)
    if skin.skinning.HasJointInfluences():
        skin.skinning.ComputeSkinnedPoints(skin.query.ComputeSkinningTransforms(time), points, time)
    return points


def skinned_turns(skin: Skin, prim: Usd.Prim, points: Any, time: Usd.TimeCode) -> np.ndarray:
    """Skinning of directions at each point: matrices ``(n, 3, 3)``, by points moved along each axis."""
    rest = np.asarray(points, np.float64)
    step = float(np.abs(rest).max()) or 1.0  # as long as the mesh, for the sake of single precision
    moved = [
        np.asarray(skinned_points(skin, prim, Vt.Vec3fArray.FromNumpy((rest + way).astype(np.float32)), time))
        for way in (np.zeros(3), *(step * np.eye(3)))
    ]
    return np.stack([(each - moved[0]) / step for each in moved[1:]], axis=-1)


def _blend(skin: Skin, prim: Usd.Prim, points: Any, time: Usd.TimeCode) -> None:
    weights = skin.query.GetAnimQuery().ComputeBlendShapeWeights(time)
    mapper = skin.skinning.GetBlendShapeMapper()
    if mapper:
        weights = mapper.Remap(weights)
    shapes = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(prim))
    if not weights or len(weights) != shapes.GetNumBlendShapes():
        return
    parts = shapes.ComputeSubShapeWeights(weights)
    sub_weights, blend_shapes, sub_shapes = parts if len(parts) == 3 else parts[1:]
    shapes.ComputeDeformedPoints(
        sub_weights,
        blend_shapes,
        sub_shapes,
        shapes.ComputeBlendShapePointIndices(),
        shapes.ComputeSubShapePointOffsets(),
        points,
    )
