"""Names for the types of Dr.Jit and Mitsuba that functions on the device take and return.

Mitsuba picks the concrete classes by its variant, once the engine has started, and ships no types that a checker could
use. These aliases stand in for them: a signature says what it takes, and nothing is imported. All arrays have one value
per lane of a wavefront, or a single one for all lanes.
"""

from __future__ import annotations

from typing import Any, TypeAlias

#: ``mi.Bool``: a mask of lanes.
Bool: TypeAlias = Any
#: ``mi.Float``: single-precision numbers.
Float: TypeAlias = Any
#: ``mi.Float64``: double-precision numbers.
Float64: TypeAlias = Any
#: ``mi.UInt32``: indices, counts and hashes.
UInt32: TypeAlias = Any
#: ``mi.Int32``: signed whole numbers.
Int32: TypeAlias = Any

#: ``mi.Point2f``: points of the plane, such as samples in [0, 1)^2.
Point2f: TypeAlias = Any
#: ``mi.Point3f``: points of space.
Point3f: TypeAlias = Any
#: ``mi.Vector3f``: directions and offsets.
Vector3f: TypeAlias = Any
#: ``mi.Vector4f``: four numbers, as tables are read.
Vector4f: TypeAlias = Any
#: ``mi.Vector3d``: directions and offsets in double precision.
Vector3d: TypeAlias = Any
#: ``mi.Normal3f``: surface normals.
Normal3f: TypeAlias = Any
#: ``mi.Color3f``: linear RGB.
Color3f: TypeAlias = Any
#: ``mi.Float`` or ``mi.Color3f``: one channel of a texture, or three.
FloatOrColor: TypeAlias = Any
#: ``mi.Spectrum``: radiance, throughput or reflectance; linear RGB in every variant used here.
Spectrum: TypeAlias = Any

#: Any array of Dr.Jit's; functions that take one return the same kind.
Array: TypeAlias = Any

#: ``mi.Ray3f``: a ray with origin ``o``, unit direction ``d`` and extent ``maxt``.
Ray3f: TypeAlias = Any
#: ``mi.Interaction3f``: a point where light scatters.
Interaction3f: TypeAlias = Any
#: ``mi.SurfaceInteraction3f``: a point on a surface, with its frame.
SurfaceInteraction3f: TypeAlias = Any
#: ``mi.PreliminaryIntersection3f``: distance and primitive that a ray has hit.
PreliminaryIntersection3f: TypeAlias = Any
#: ``mi.DirectionSample3f``: a direction toward an emitter, with its pdf per steradian.
DirectionSample3f: TypeAlias = Any
#: ``mi.BSDFSample3f``: a sampled direction of scattering.
BSDFSample3f: TypeAlias = Any

#: ``mi.BSDFContext``: which components and kind of transport a BSDF is asked for.
BSDFContext: TypeAlias = Any
#: ``mi.BoundingBox3f``: an axis-aligned box.
BoundingBox3f: TypeAlias = Any
#: ``mi.Frame3f``: a local frame, z along the normal.
Frame3f: TypeAlias = Any

#: ``mi.BSDFPtr``: the material of a surface.
BSDFPtr: TypeAlias = Any
#: ``mi.MediumPtr``: the participating medium around a point.
MediumPtr: TypeAlias = Any
#: ``mi.EmitterPtr``: an emitter of the scene.
EmitterPtr: TypeAlias = Any
#: ``mi.ShapePtr``: a shape of the scene.
ShapePtr: TypeAlias = Any
#: ``mi.BSDF``, ``mi.Emitter``, ``mi.Medium``, ``mi.Texture``, ``mi.Shape`` and ``mi.Mesh``: plugins of a scene.
BSDF: TypeAlias = Any
Medium: TypeAlias = Any
Emitter: TypeAlias = Any
MitsubaTexture: TypeAlias = Any
Shape: TypeAlias = Any
Mesh: TypeAlias = Any
#: ``mi.Texture2f`` or one of 8 bits: texels, looked up and filtered by Dr.Jit.
DeviceTexture: TypeAlias = Any
#: ``mi.Properties``: parameters of a plugin.
Properties: TypeAlias = Any
#: ``mi.Scene``: shapes, emitters and their acceleration structure.
MitsubaScene: TypeAlias = Any
