"""The visible prims of a stage at a time, in order, with the places of all copies."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdLux, UsdShade, UsdSkel

from lippmann.scene.readers.usd.records import Arrays, Record
from lippmann.scene.readers.usd.stage_layers import StageError
from lippmann.scene.readers.usd.stage_lights import camera_record, light_record
from lippmann.scene.readers.usd.stage_meshes import (
    PRIMITIVES,
    THIN,
    mesh_record,
    primitive_record,
    tetrahedra_record,
    thin_record,
)
from lippmann.scene.readers.usd.stage_shading import MaterialTable
from lippmann.scene.readers.usd.stage_skinning import Skinning
from lippmann.scene.readers.usd.stage_splats import PARTICLES, splat_record
from lippmann.scene.readers.usd.stage_surfaces import is_coded

Matrices = NDArray[np.float64]

#: Copies of all meshes together.
_MOST_COPIES = 1 << 21
#: Colours of the copies of one prototype, each of which has meshes of its own.
_MOST_COLORS = 256
#: Point instancers within the prototypes of others.
_DEEPEST = 16

_PREDICATE = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract & Usd.PrimIsLoaded)
#: Prototypes may lie below an ``over``, which keeps them from being shown by themselves (UsdImaging's own rule).
_OF_PROTOTYPES = Usd.TraverseInstanceProxies(Usd.PrimIsActive & ~Usd.PrimIsAbstract & Usd.PrimIsLoaded)

#: Widths of Blender's curves: twice the radius 1 that they have beside the bevel, which makes them wide.
_BLENDER_WIDTH = 2.0

#: Ways of drawing a model that show its meshes; others put cards, its bounds or its origin in their place.
_AS_MESHES = (None, "", "default", "inherited")
#: Names of colour spaces whose values are taken as they stand.
_AS_REC709 = (None, "", "lin_rec709_scene", "lin_rec709", "raw", "data", "identity", "unknown")


class Traversal:
    """One walk over a stage.

    Attributes
    ----------
    notes:
        What is not read, in the order of its first appearance.
    """

    def __init__(self, stage: Usd.Stage, time: Usd.TimeCode, arrays: Arrays, notes: dict[str, None]) -> None:
        self.notes = notes
        self._stage, self._time, self._arrays = stage, time, arrays
        self._writer = stage.GetRootLayer().documentation
        self._transforms = UsdGeom.XformCache(time)
        self._materials = MaterialTable(time, notes)
        self._skinning = Skinning(stage, time, _PREDICATE)
        self._meshes: dict[tuple[object, ...], Record] = {}
        self._worlds: dict[tuple[object, ...], list[Matrices]] = {}
        self._lights: list[Record] = []
        self._cameras: list[Record] = []
        self._splats: list[Record] = []
        self._copy_color: tuple[float, ...] | None = None
        self._copies = 0
        self._unread: dict[str, int] = {}
        self._departures: dict[str, dict[str, None]] = {}

    def run(self) -> None:
        """Visit all prims.

        Raises
        ------
        StageError
            Too many copies, or instancers that hold themselves.
        """
        self._visit(self._stage.GetPseudoRoot(), np.eye(4)[None], np.eye(4), 0)
        for kind, count in self._unread.items():
            self.notes[f"{count} prim(s) of type {kind} are not drawn"] = None
        for text, paths in self._departures.items():
            more = f" and {len(paths) - 1} more" if len(paths) > 1 else ""
            self.notes[f"{next(iter(paths))}{more}: {text}"] = None

    def tree(self) -> Record:
        """All records."""
        meshes = []
        for key, record in self._meshes.items():
            worlds = np.concatenate(self._worlds[key])
            meshes.append({**record, "worlds": self._arrays.add(worlds)})
        return {
            "meshes": meshes,
            "materials": self._materials.records,
            "lights": self._lights,
            "cameras": self._cameras,
            "splats": self._splats,
        }

    def _visit(self, root: Usd.Prim, base: Matrices, base_from_world: Matrices, depth: int) -> None:
        """Take over what ``root`` and all below it show, at ``base`` ``(k, 4, 4)``, in a frame of their own."""
        prims = iter(Usd.PrimRange(root, _OF_PROTOTYPES if depth else _PREDICATE))
        for prim in prims:
            if prim.IsPseudoRoot():
                continue
            kind = str(prim.GetTypeName())
            self._note_schemas(prim)
            if not prim.IsA(UsdGeom.Imageable):
                if kind.startswith(PARTICLES):  # which usd-core before 26 does not know
                    self._leave_out(kind)
                continue
            imageable = UsdGeom.Imageable(prim)
            if imageable.GetVisibilityAttr().Get(self._time) == UsdGeom.Tokens.invisible:
                prims.PruneChildren()
                continue
            if imageable.ComputePurpose() in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy):
                continue  # what is below may have a purpose of its own
            place = base_from_world @ self._world(prim)
            if prim.IsA(UsdGeom.PointInstancer):
                self._add_instancer(UsdGeom.PointInstancer(prim), base @ place, depth)
                prims.PruneChildren()
            elif prim.IsA(UsdGeom.Mesh) or kind == "TetMesh" or kind in PRIMITIVES or kind in THIN:
                self._add_mesh(prim, base, place)
            elif kind.startswith(PARTICLES):
                self._add_splats(prim, base @ place)
            elif prim.IsA(UsdGeom.Camera):
                self._cameras.append(camera_record(UsdGeom.Camera(prim), (base @ place)[0], self._time, self.notes))
            elif prim.HasAPI(UsdLux.LightAPI):
                self._lights += [light_record(prim, world, self._time, self.notes) for world in base @ place]
                if kind == "DistantLight" and self._writer.startswith("Blender"):
                    self.notes[f"{self._writer[:40]} writes suns at a quarter of the strength of its other lights"] = (
                        None
                    )
            elif prim.IsA(UsdGeom.Boundable) and not prim.IsA(UsdSkel.Root) and not prim.IsA(UsdSkel.Skeleton):
                self._leave_out(kind)

    def _note_schemas(self, prim: Usd.Prim) -> None:
        """Name what schemas applied to a prim, and to what is below it, would change."""
        applied = prim.GetAppliedSchemas()
        if "GeomModelAPI" in applied and (mode := prim.GetAttribute("model:drawMode").Get()) not in _AS_MESHES:
            self._note_departure(prim, f"model:drawMode '{mode}' is not honoured: meshes are shown")
        if "ColorSpaceAPI" in applied and (space := prim.GetAttribute("colorSpace:name").Get()) not in _AS_REC709:
            if prim.IsA(UsdShade.Shader) and is_coded(space):
                return  # of an image, whose sourceColorSpace says so
            self._note_departure(prim, f"colours in the space '{space}' are taken as linear Rec. 709")

    def _note_departure(self, prim: Usd.Prim | UsdGeom.PointInstancer, text: str) -> None:
        """Say of all prims together, by their first, how they are shown otherwise than the stage has them."""
        self._departures.setdefault(text, {})[str(prim.GetPath())] = None

    def _leave_out(self, kind: str) -> None:
        self._unread[kind] = self._unread.get(kind, 0) + 1

    def _add_splats(self, prim: Usd.Prim, worlds: Matrices) -> None:
        record = splat_record(prim, self._time, self._arrays, self.notes)
        if record is not None:
            self._count(len(worlds))
            self._splats.append({**record, "worlds": self._arrays.add(worlds)})

    def _world(self, prim: Usd.Prim) -> Matrices:
        """``world_from_prim``; USD's matrices act on row vectors."""
        return np.array(self._transforms.GetLocalToWorldTransform(prim), np.float64).T

    def _add_mesh(self, prim: Usd.Prim, base: Matrices, place: Matrices) -> None:
        kind = str(prim.GetTypeName())
        skin = self._skinning.of(prim) if prim.IsA(UsdGeom.Mesh) else None
        if skin is not None:
            place = self._world(skin.skeleton)
        material = self._materials.bound(prim)
        for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
            self._materials.bound(subset.GetPrim())  # whose colours part copies, too
        own = prim.GetPrimInPrototype() if prim.IsInstanceProxy() and skin is None else prim
        inherited = {name: inherited_color(prim, name) for name in self._materials.color_names}
        colors = {name: color for name, color in inherited.items() if color is not None}
        copy_color = self._copy_color if self._shows_color(prim, material) else None
        key = (own.GetPath(), material, str(colors), copy_color)
        worlds = base @ place
        self._count(len(worlds))
        if key not in self._meshes:
            if kind in THIN:
                record = thin_record(prim, self._time, self._arrays, self._materials)
                if record["widths"] is not None and self._are_blender_s(prim, record["widths"]["values"]):
                    record["widths"] = None
                    self.notes["Blender writes curves as wide as 2, whatever their bevel: drawn as without a width"] = (
                        None
                    )
            elif prim.IsA(UsdGeom.Mesh):
                record = mesh_record(UsdGeom.Mesh(prim), self._time, self._arrays, self._materials, skin)
            elif kind == "TetMesh":
                record = tetrahedra_record(prim, self._time, self._arrays, self._materials)
            else:
                record = primitive_record(prim, self._time, self._arrays, self._materials)
            if copy_color is not None:
                values = self._arrays.add(np.array([copy_color], np.float32))
                record["colors"]["displayColor"] = {"values": values, "interpolation": "constant"}
            if kind == "Mesh" and prim.HasAPI(UsdLux.LightAPI):
                record["light"] = light_record(prim, worlds[0], self._time, self.notes)
            self._meshes[key] = {**record, "name": str(prim.GetPath()), "material": material}
        self._worlds.setdefault(key, []).append(worlds)

    def _are_blender_s(self, prim: Usd.Prim, widths: int) -> bool:
        """Whether widths of curves are those that Blender gives all that have no radius of their own."""
        is_curve = prim.GetTypeName() == "BasisCurves" and self._writer.startswith("Blender")
        return is_curve and bool((self._arrays.stored[widths] == _BLENDER_WIDTH).all())

    def _shows_color(self, prim: Usd.Prim, material: int) -> bool:
        """Whether a prim has no display colour of its own, and would show one that its copy has."""
        if _has_own(prim, "displayColor"):
            return False
        if material < 0:
            return True
        return bool(
            self._materials.records[material]["inputs"].get("diffuseColor", {}).get("primvar") == "displayColor"
        )

    def _add_instancer(self, instancer: UsdGeom.PointInstancer, worlds: Matrices, depth: int) -> None:
        name = str(instancer.GetPath())
        if depth >= _DEEPEST:
            raise StageError(f"instancers within instancers at {name}", rule=f"up to {_DEEPEST} deep are read")
        targets = instancer.GetPrototypesRel().GetForwardedTargets()
        kinds = np.asarray(instancer.GetProtoIndicesAttr().Get(self._time) or [], np.int64)
        places = _instance_matrices(instancer, self._time)
        visible = np.asarray(instancer.ComputeMaskAtTime(self._time) or [True] * len(kinds), bool)
        if len(places) != len(kinds) or len(visible) != len(kinds):
            self._note_departure(instancer, "has not one position for each copy, and is left out")
            return
        if len(kinds) and not 0 <= kinds.min() <= kinds.max() < len(targets):
            self._note_departure(instancer, "has copies of prototypes that it does not name, and is left out")
            return
        colors = self._colors_of_copies(instancer, len(kinds))
        for number, target in enumerate(targets):
            chosen = (kinds == number) & visible
            own = places[chosen]
            prim = self._stage.GetPrimAtPath(target)
            if not len(own):
                continue
            if not prim or prim.IsAbstract():
                self.notes[f"{target}: a prototype that is abstract or not there; its copies are left out"] = None
                continue
            if len(own) * len(worlds) > _MOST_COPIES:
                self._count(len(own) * len(worlds))
            # The prototype's own transformation belongs to it; that of what lies above does not.
            parent = self._world(prim.GetParent())
            if not np.linalg.det(parent):
                self.notes[f"{target}: lies under a transformation that is flat, and is left out"] = None
                continue
            base_from_world = np.asarray(np.linalg.inv(parent), np.float64)
            outer = self._copy_color
            for color in [None] if colors is None else np.unique(colors[chosen], axis=0):
                of_color = own if color is None else places[chosen & (colors == color).all(axis=1)]
                self._copy_color = outer if color is None else tuple(color.tolist())
                self._visit(prim, (worlds[:, None] @ of_color[None]).reshape(-1, 4, 4), base_from_world, depth + 1)
            self._copy_color = outer

    def _colors_of_copies(self, instancer: UsdGeom.PointInstancer, count: int) -> NDArray[np.float32] | None:
        """Display colours ``(count, 3)``; of more than are kept apart, the nearest of six steps a channel."""
        primvar = UsdGeom.PrimvarsAPI(instancer.GetPrim()).GetPrimvar("displayColor")
        values = primvar.ComputeFlattened(self._time) if primvar and primvar.HasValue() else None
        if not values:
            return None
        colors = np.asarray(values, np.float32)
        if colors.shape not in ((1, 3), (count, 3)):
            self.notes[f"{instancer.GetPath()}: {len(colors)} colours for {count} copies are not read"] = None
            return None
        if len(np.unique(colors, axis=0)) > _MOST_COLORS:
            self.notes[f"{instancer.GetPath()}: colours of copies are rounded to those of six steps a channel"] = None
            colors = np.rint(np.clip(colors, 0.0, 1.0) * 5.0) / np.float32(5.0)
        return np.broadcast_to(colors, (count, 3))

    def _count(self, copies: int) -> None:
        self._copies += copies
        if self._copies > _MOST_COPIES:
            raise StageError(f"places more than {_MOST_COPIES} copies of meshes", rule="so many may be placed")


def inherited_color(prim: Usd.Prim, name: str) -> Any:
    """The primvar that a prim inherits, such as the display colour of a prototype's copy; None for its own or none."""
    if _has_own(prim, name):
        return None
    inherited = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    return inherited.Get() if inherited else None


def _has_own(prim: Usd.Prim, name: str) -> bool:
    """Whether a prim has values of a primvar, whose attribute may come with its type."""
    primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar(name)
    return bool(primvar) and bool(primvar.HasAuthoredValue())


def _instance_matrices(instancer: UsdGeom.PointInstancer, time: Usd.TimeCode) -> Matrices:
    """``instancer_from_copy`` ``(k, 4, 4)`` of all copies, hidden ones too."""
    samples = instancer.GetPositionsAttr().GetTimeSamples()
    if samples and time.IsEarliestTime():  # from which velocities would carry them to their places
        time = Usd.TimeCode(samples[0])
    exclude, ignore = UsdGeom.PointInstancer.ExcludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
    matrices = instancer.ComputeInstanceTransformsAtTime(time, time, exclude, ignore)
    return np.array(matrices, np.float64).reshape(-1, 4, 4).transpose(0, 2, 1)
