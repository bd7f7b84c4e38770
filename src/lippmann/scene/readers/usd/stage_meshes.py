"""Records of meshes: points, polygons, primvars, creases and subsets as they stand in a stage."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from lippmann.scene.readers.usd.records import Arrays, Record
from lippmann.scene.readers.usd.stage_layers import StageError
from lippmann.scene.readers.usd.stage_shading import MaterialTable
from lippmann.scene.readers.usd.stage_skinning import Skin, skinned_points, skinned_turns

#: Types that are given by numbers, and which.
PRIMITIVES = {
    "Sphere": ("radius",),
    "Cube": ("size",),
    "Cylinder": ("height", "radius", "axis"),
    "Cylinder_1": ("height", "radiusTop", "radiusBottom", "axis"),
    "Cone": ("height", "radius", "axis"),
    "Capsule": ("height", "radius", "axis"),
    "Capsule_1": ("height", "radiusTop", "radiusBottom", "axis"),
    "Plane": ("width", "length", "axis"),
}

#: Types whose points are drawn as balls or rods.
THIN = ("Points", "BasisCurves")

_UV_TYPES = ("texCoord2f[]", "texCoord2d[]", "texCoord2h[]", "float2[]", "double2[]", "half2[]")
_MOST_UV_SETS = 8
_COLOR_TYPE = re.compile(r"(?:color|float|double|half)([34])[fdh]?(?:\[\])?")


def mesh_record(
    mesh: UsdGeom.Mesh, time: Usd.TimeCode, arrays: Arrays, materials: MaterialTable, skin: Skin | None
) -> Record:
    """A mesh as it is at a time; a skinned one in the space of its skeleton."""

    def integers(attribute: Any) -> int:
        return arrays.add(np.asarray(attribute.Get(time) or [], np.int64).ravel())

    prim = mesh.GetPrim()
    points = mesh.GetPointsAttr().Get(time)
    normals = _normals(mesh, time, arrays)
    if skin is not None and points:
        if normals is not None:
            normals["turns"] = arrays.add(skinned_turns(skin, prim, points, time))
        points = skinned_points(skin, prim, points, time)
    subsets = _subsets(prim, time, arrays, materials)  # whose materials read colours, too
    crease_lengths = np.asarray(mesh.GetCreaseLengthsAttr().Get(time) or [], np.int64)
    return {
        **_visible(prim, time, arrays, materials),
        "points": arrays.add(_floats(points, 3)),
        "counts": integers(mesh.GetFaceVertexCountsAttr()),
        "indices": integers(mesh.GetFaceVertexIndicesAttr()),
        "holes": integers(mesh.GetHoleIndicesAttr()),
        "crease_indices": integers(mesh.GetCreaseIndicesAttr()),
        "crease_lengths": arrays.add(crease_lengths),
        "crease_sharpnesses": arrays.add(_floats(mesh.GetCreaseSharpnessesAttr().Get(time), 1).ravel()),
        "corner_indices": integers(mesh.GetCornerIndicesAttr()),
        "corner_sharpnesses": arrays.add(_floats(mesh.GetCornerSharpnessesAttr().Get(time), 1).ravel()),
        "scheme": str(mesh.GetSubdivisionSchemeAttr().Get(time) or "catmullClark"),
        "boundary": str(mesh.GetInterpolateBoundaryAttr().Get(time) or "edgeAndCorner"),
        "normals": normals,
        "uvs": _uv_sets(prim, time, arrays),
        "subsets": subsets,
    }


def tetrahedra_record(prim: Usd.Prim, time: Usd.TimeCode, arrays: Arrays, materials: MaterialTable) -> Record:
    """The surface of tetrahedra: the faces that are given, else those that one tetrahedron alone has.

    Values of each tetrahedron, or of each of its faces, do not belong to a surface, and are left out.
    """
    tetrahedra = UsdGeom.TetMesh(prim)
    given = tetrahedra.GetSurfaceFaceVertexIndicesAttr().Get(time)
    faces = np.asarray(given or UsdGeom.TetMesh.ComputeSurfaceFaces(tetrahedra, time), np.int64).reshape(-1, 3)

    def at_points(primvars: Record) -> Record:
        fitting = ("constant", "vertex", "varying")
        return {name: each for name, each in primvars.items() if each and each["interpolation"] in fitting}

    record = _visible(prim, time, arrays, materials)
    return {
        **record,
        "colors": at_points(record["colors"]),
        "opacity": at_points({"opacity": record["opacity"]}).get("opacity"),
        "points": arrays.add(_floats(tetrahedra.GetPointsAttr().Get(time), 3)),
        "counts": arrays.add(np.full(len(faces), 3)),
        "indices": arrays.add(faces.ravel()),
        "holes": arrays.add(np.zeros(0, np.int64)),
        "scheme": "none",
        "normals": None,
        "uvs": at_points(_uv_sets(prim, time, arrays)),
        "subsets": [],
    }


def primitive_record(prim: Usd.Prim, time: Usd.TimeCode, arrays: Arrays, materials: MaterialTable) -> Record:
    """Record of a primitive (cube, sphere, cylinder, ...): its kind, and its sizes at a time."""
    kind = str(prim.GetTypeName())
    values = {name: prim.GetAttribute(name).Get(time) for name in PRIMITIVES[kind]}
    numbers = {name: str(value) if name == "axis" else float(value) for name, value in values.items()}
    return {**_visible(prim, time, arrays, materials), "primitive": kind, "numbers": numbers}


def thin_record(prim: Usd.Prim, time: Usd.TimeCode, arrays: Arrays, materials: MaterialTable) -> Record:
    """Points, or curves, with the widths that are given."""
    thin = UsdGeom.PointBased(prim)
    widths = _primvar(UsdGeom.PrimvarsAPI(prim).GetPrimvar("widths"), 1, time, arrays)
    attribute = UsdGeom.Points(prim) if prim.IsA(UsdGeom.Points) else UsdGeom.Curves(prim)
    if widths is None and (values := attribute.GetWidthsAttr().Get(time)):
        widths = {"values": arrays.add(_floats(values, 1)), "interpolation": str(attribute.GetWidthsInterpolation())}
    record = {
        **_visible(prim, time, arrays, materials),
        "thin": arrays.add(_floats(thin.GetPointsAttr().Get(time), 3)),
        "widths": widths,
    }
    if prim.IsA(UsdGeom.BasisCurves):
        curves = UsdGeom.BasisCurves(prim)
        is_linear = curves.GetTypeAttr().Get(time) == UsdGeom.Tokens.linear
        record["counts"] = arrays.add(np.asarray(curves.GetCurveVertexCountsAttr().Get(time) or [], np.int64))
        record["basis"] = "linear" if is_linear else str(curves.GetBasisAttr().Get(time))
        record["wrap"] = str(curves.GetWrapAttr().Get(time))
    return record


def _visible(prim: Usd.Prim, time: Usd.TimeCode, arrays: Arrays, materials: MaterialTable) -> Record:
    gprim = UsdGeom.Gprim(prim)
    primvars = UsdGeom.PrimvarsAPI(prim)
    colors = {}
    for name in materials.color_names:
        primvar = primvars.FindPrimvarWithInheritance(name)
        kind = _COLOR_TYPE.fullmatch(str(primvar.GetTypeName())) if primvar else None
        if kind and (color := _primvar(primvar, int(kind[1]), time, arrays)) is not None:
            colors[name] = color
    return {
        "left_handed": str(gprim.GetOrientationAttr().Get(time)) == "leftHanded",
        "colors": colors,
        "opacity": _primvar(primvars.FindPrimvarWithInheritance("displayOpacity"), 1, time, arrays),
    }


def _normals(mesh: UsdGeom.Mesh, time: Usd.TimeCode, arrays: Arrays) -> Record | None:
    """The primvar ``normals``, which wins over the attribute of that name."""
    record = _primvar(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("normals"), 3, time, arrays)
    values = mesh.GetNormalsAttr().Get(time)
    if record is not None or not values:
        return record
    return {"values": arrays.add(_floats(values, 3)), "interpolation": str(mesh.GetNormalsInterpolation())}


def _uv_sets(prim: Usd.Prim, time: Usd.TimeCode, arrays: Arrays) -> Record:
    sets: Record = {}
    for primvar in UsdGeom.PrimvarsAPI(prim).FindPrimvarsWithInheritance():
        if str(primvar.GetTypeName()) in _UV_TYPES and len(sets) < _MOST_UV_SETS:
            record = _primvar(primvar, 2, time, arrays)
            if record is not None:
                sets[str(primvar.GetPrimvarName())] = record
    return sets


def _primvar(primvar: UsdGeom.Primvar, width: int, time: Usd.TimeCode, arrays: Arrays) -> Record | None:
    """Values of a primvar without its indices, and how they lie on the mesh; None where it has none."""
    if not primvar or not primvar.HasValue():
        return None
    values = primvar.ComputeFlattened(time)
    if not values:
        return None
    return {"values": arrays.add(_floats(values, width)), "interpolation": str(primvar.GetInterpolation())}


def _subsets(prim: Usd.Prim, time: Usd.TimeCode, arrays: Arrays, materials: MaterialTable) -> list[Record]:
    """Faces that have a material of their own."""
    subsets = []
    for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
        faces = np.asarray(subset.GetIndicesAttr().Get(time) or [], np.int64).ravel()
        subsets.append({"faces": arrays.add(faces), "material": materials.bound(subset.GetPrim())})
    return subsets


def _floats(values: Any, width: int) -> np.ndarray:
    """Values ``(n, width)`` float32."""
    array = np.asarray(values if values else [], np.float32)
    if array.size % width:
        raise StageError(f"{array.size} numbers where {width} each belong")
    return array.reshape(-1, width)
