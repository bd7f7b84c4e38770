"""Reader of USD stages: records of the process that opens them become a scene description."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import SceneError
from lippmann.scene.parsing.files import NamedFiles, read_bytes
from lippmann.scene.parsing.vertex_colors import GREY
from lippmann.scene.readers.usd.assets import Assets, check_package
from lippmann.scene.readers.usd.lights import LightReader, camera_of
from lippmann.scene.readers.usd.materials import Surface, SurfaceReader
from lippmann.scene.readers.usd.meshes import MeshReader, Part
from lippmann.scene.readers.usd.process import ask_stage
from lippmann.scene.readers.usd.records import Record
from lippmann.scene.readers.usd.splats import SplatReader
from lippmann.scene.values.description import AlphaMode, Instance, Material, Matrix, Mesh, SceneDescription

_UPRIGHT = {"Z": np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])}
#: Entries of matrices up to which positions stay within single precision.
_FARTHEST = 1e30


def read_usd(
    path: Path, *, files: NamedFiles | None = None, variants: Mapping[str, str] | None = None
) -> SceneDescription:
    """Read a stage as it is at its beginning.

    Parameters
    ----------
    files:
        Those that it may name; by default those of its folder and below.
    variants:
        ``{"set": "choice"}`` for every prim that has them, ``{"/prim:set": "choice"}`` for one.

    Raises
    ------
    SceneError
        The file, or one that it names, is missing, damaged or outside; USD refuses it or breaks down at it; it shows no
        mesh; no prim has such a variant.
    """
    check_file(path)
    named = NamedFiles(path.resolve().parent, NamedFiles.of(path, files).anywhere)
    tree, arrays = ask_stage(path, variants or {}, None, named)
    if tree["moves"]:
        tree["notes"].append("time samples are not played without frames=...; the stage is shown at its beginning")
    return describe(tree, arrays, path, Assets(path, named))


def check_file(path: Path) -> None:
    """Look at a file before USD does.

    Raises
    ------
    SceneError
        It is missing, empty or a folder, or a package that is no stored ZIP archive.
    """
    if read_bytes(path, 4).startswith(b"PK") or path.suffix.lower() == ".usdz":
        check_package(path)


def describe(tree: Record, arrays: Sequence[NDArray[np.generic]], path: Path, assets: Assets) -> SceneDescription:
    """A scene of the records of a stage.

    Raises
    ------
    SceneError
        A mesh does not fit itself, a texture is damaged, or nothing is shown.
    """
    notes: dict[str, None] = dict.fromkeys(tree["notes"])
    scene_from_stage = _scene_from_stage(tree, path)
    surfaces = [SurfaceReader(assets, notes, tree["meters_per_unit"]).read(record) for record in tree["materials"]]
    reader = MeshReader(arrays, surfaces, path.name, tree["meshes"])
    content = _Content(surfaces)
    lights = LightReader(scene_from_stage, tree["up"], assets, notes)
    splats = SplatReader(arrays, path.name, notes)

    def worlds_of(record: Record) -> Matrix:
        with np.errstate(invalid="ignore", over="ignore"):  # such places are refused next
            worlds = scene_from_stage @ np.asarray(arrays[record["worlds"]], np.float64)
        if not np.abs(worlds).max() < _FARTHEST:
            raise SceneError(f"{record['name']} lies beyond all bounds", where=path.name)
        return worlds

    for record in tree["splats"]:
        splats.add(record, worlds_of(record))
    for record in tree["meshes"]:
        worlds = worlds_of(record)
        parts = reader.parts(record)
        if "light" in record:
            shown = [(part.mesh, content.materials[content.material_of(part)]) for part in parts]
            lights.add_mesh(record, shown, worlds)
            continue
        for part in parts:
            content.add(part, worlds @ np.diag([part.scale, part.scale, part.scale, 1.0]))
    if not content.instances and not splats.placed and not lights.meshes:
        raise SceneError(
            "the stage shows no meshes", where=path.name, rule="a scene needs some", fix="; ".join([*notes][:3])
        )
    for record in tree["lights"]:
        lights.add(record)
    for glowing in lights.meshes:
        content.add_mesh(glowing.mesh, glowing.material, glowing.world)
    cameras = [camera_of(record, scene_from_stage) for record in tree["cameras"]]
    return SceneDescription(
        name=path.stem,
        meshes=content.meshes,
        materials=content.materials,
        instances=content.instances,
        lights=lights.lights,
        cameras=[camera for camera in cameras if camera is not None],
        environment=lights.environment,
        notes=[*notes, *reader.notes, *assets.notes],
        physical_lights=bool(lights.lights or lights.meshes),
        splats=splats.join(),
    )


def _scene_from_stage(tree: Record, path: Path) -> Matrix:
    """Upright, in metres."""
    meters = tree["meters_per_unit"]
    if not 0.0 < meters < _FARTHEST:
        raise SceneError(f"a unit is {meters:g} metres", where=path.name, rule="more than 0")
    return np.asarray(np.diag([meters, meters, meters, 1.0]) @ _UPRIGHT.get(tree["up"], np.eye(4)), np.float64)


class _Content:
    """Meshes, materials and instances as they come together."""

    def __init__(self, surfaces: Sequence[Surface]) -> None:
        self.materials: list[Material] = [surface.material for surface in surfaces]
        self.meshes: list[Mesh] = []
        self.instances: list[Instance] = []
        self._without: dict[tuple[bool, bool], int] = {}

    def add(self, part: Part, worlds: Matrix) -> None:
        """Place the triangles of one material at ``worlds`` ``(k, 4, 4)``."""
        if not len(part.mesh.faces):
            return
        self.instances.append(Instance(len(self.meshes), worlds[0] if len(worlds) == 1 else worlds))
        self.meshes.append(replace(part.mesh, material=self.material_of(part)))

    def material_of(self, part: Part) -> int:
        """The number of its material, or of one that shows its display colours."""
        return part.material if part.material >= 0 else self._plain(part.mesh)

    def add_mesh(self, mesh: Mesh, material: Material, world: Matrix) -> None:
        """Place one mesh with a material of its own."""
        self.instances.append(Instance(len(self.meshes), world))
        self.meshes.append(replace(mesh, material=len(self.materials)))
        self.materials.append(material)

    def _plain(self, mesh: Mesh) -> int:
        """The material of a mesh that has none: its display colours, else the light grey of formats without any.

        UsdPreviewSurface's own grey, 0.18, is that of the studio's backdrop: what faces the viewer would not be seen.
        """
        colored = mesh.colors is not None
        fades = mesh.colors is not None and mesh.colors.shape[1] == 4
        if (colored, fades) not in self._without:
            self._without[colored, fades] = len(self.materials)
            color = (1.0, 1.0, 1.0) if colored else GREY.base_color
            mode: AlphaMode = "blend" if fades else "opaque"
            self.materials.append(
                Material("display colour", base_color=color, roughness=0.6, alpha_mode=mode, double_sided=True)
            )
        return self._without[colored, fades]
