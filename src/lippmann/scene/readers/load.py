"""Scenes from files, names of bundled scenes or Python objects: :func:`load_scene`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lippmann.codecs.types import FILMS
from lippmann.errors import SceneError, UsageError
from lippmann.options.light import LightOptions
from lippmann.options.option import changed_options, takes
from lippmann.options.outputs import AccessOptions
from lippmann.options.scene import LoadKeywords, SceneOptions, Up
from lippmann.options.texts import settings_of
from lippmann.printable import shorten
from lippmann.runtime.machine import keep_freed_memory
from lippmann.runtime.plugins import Plugin, function_of
from lippmann.scene.parsing.dicom_files import HEAD_LENGTH, begins_dicom, holds_dicom
from lippmann.scene.parsing.far_origin import make_traceable
from lippmann.scene.parsing.files import NamedFiles, read_bytes
from lippmann.scene.readers.registry import READERS, VTK, MovingScene, Reader, ReaderOption, suffixes_with
from lippmann.scene.readers.splats.sog_folder import holds_sog
from lippmann.scene.scene import Scene, check_description, override_light
from lippmann.scene.splat_clouds import move
from lippmann.scene.values.description import (
    Camera,
    Direction,
    Environment,
    Material,
    Matrix,
    SceneDescription,
)
from lippmann.scene.volumes.grid import move as move_volume

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from lippmann.scene.mitsuba_source import MitsubaSource
    from lippmann.scene.values.whitted_scene import ClassicScene

#: Words in place of an environment file: the built-in studio, and no light but the scene's own.
STUDIO, NO_ENVIRONMENT = "studio", "none"

#: Libraries whose objects are scenes -> "module:function" that finds the reader of an object.
_LIBRARIES = {
    "trimesh": "lippmann.scene.readers.trimesh_objects:adapter_for",
    "pyvista": "lippmann.scene.readers.vtk.objects:adapter_for",
}

#: Ray depth with which the paper renders its scenes.
_PAPER_DEPTH = 2

_BLENDER = "open it in Blender, then File > Export > glTF 2.0 (.glb)"
_FREECAD = "open it in FreeCAD, then File > Export > glTF (.glb)"
_CLOUD_COMPARE = "save it as .ply, in CloudCompare for instance"
_NIBABEL = "save it as .nii.gz, in Python by: nibabel.save(nibabel.load('a{0}'), 'a.nii.gz')"
_HDF5 = "save a volume as .npy: numpy.save('a.npy', h5py.File('a.h5')['NAME']), views of a light field as pictures"
_MAYA = "export it from Maya as FBX, and that from Blender as glTF 2.0 (.glb)"
_ASSIMP = "convert it by Assimp: assimp export in{0} out.glb"
_AUTODESK = "export it there as FBX, and that from Blender as glTF 2.0 (.glb)"
_TILES = "take the .glb out of it by: npx 3d-tiles-tools {0}ToGlb -i in.{0} -o out.glb"
_PARAVIEW = "open it in ParaView, then File > Save Data as .vtu"
_STEP = "export it as STEP, open that in FreeCAD, then File > Export > glTF (.glb)"
_LYTRO = "decode it by LFToolbox or PlenoptiCam; views become a picture by 'lippmann weave', .mat by 'lippmann import'"
_OPEN_BABEL = "save it as .pdb or .cif, in Avogadro or by: obabel in{0} -O out.pdb"

#: Height over length below which a scan is one of land.
_FLAT = 1 / 8

#: Files of other programs, and how one that is read is made of them.
_ELSEWHERE = {
    **dict.fromkeys((".fbx", ".abc"), _BLENDER),
    ".max": "in 3ds Max: File > Export > glTF",
    ".c4d": "in Cinema 4D: File > Export > glTF",
    ".skp": "in SketchUp: File > Export > 3D Model > glTF (.glb)",
    ".3dm": "in Rhino: File > Export > glTF (.glb)",
    **dict.fromkeys((".ma", ".mb"), _MAYA),
    **dict.fromkeys((".step", ".stp", ".iges", ".igs", ".brep", ".fcstd", ".dxf"), _FREECAD),
    **dict.fromkeys(
        (".pmx", ".pmd"), "import it into Blender by its add-on MMD Tools, then File > Export > glTF 2.0 (.glb)"
    ),
    **dict.fromkeys((".rvt", ".rfa", ".nwd", ".dwg"), _AUTODESK),
    ".reality": "in Reality Composer: export it as .usdz",
    ".kmz": "open it in SketchUp, then File > Export > 3D Model > glTF (.glb)",
    ".ifc": "convert it by IfcOpenShell: IfcConvert in.ifc out.glb",
    ".pbrt": "its meshes, mostly .ply files beside it, are read one by one",
    **dict.fromkeys((".wrl", ".x3d", ".x3dv", ".vrml"), "open it in MeshLab, and export it as .ply or .obj"),
    **{
        kind: _ASSIMP.format(kind)
        for kind in (".dae", ".3ds", ".lwo", ".x", ".ac", ".ase", ".b3d", ".lws", ".md2", ".ms3d", ".smd")
    },
    ".drc": "convert it by Draco: draco_decoder -i in.drc -o out.ply",
    **dict.fromkeys((".sldprt", ".sldasm", ".sat", ".x_t", ".jt", ".catpart", ".ipt"), _STEP),
    **dict.fromkeys((".hip", ".hipnc", ".bgeo"), "in Houdini: export it as .usd"),
    **dict.fromkeys((".case", ".cgns", ".e", ".exo", ".foam", ".msh", ".xdmf"), _PARAVIEW),
    **dict.fromkeys((".lfp", ".lfr"), _LYTRO),
    ".mat": "a light field becomes a picture by 'lippmann import'",
    **dict.fromkeys((".h5", ".hdf5"), _HDF5),
    ".exr": "a sky is given by environment=..., depth by depth_map=...",
    ".vox": "in MagicaVoxel: Export > ply",
    **{f".{kind}": _TILES.format(kind) for kind in ("b3dm", "i3dm", "cmpt")},
    ".vtm": "save its blocks as one data set, in PyVista by: pyvista.read('a.vtm').combine().save('a.vtu')",
    ".pvd": "name one of the files that it lists",
    ".vtkhdf": "save it as .vtu, in PyVista by: pyvista.read('a.vtkhdf').cast_to_unstructured_grid().save('a.vtu')",
    ".raw": "name the .mhd or .nhdr file beside it, or save it as .npy: numpy.fromfile(...).reshape(z, y, x)",
    **dict.fromkeys((".mgz", ".mgh"), "convert it by FreeSurfer: mri_convert in.mgz out.nii.gz"),
    **{kind: _NIBABEL.format(kind) for kind in (".mnc", ".par", ".rec", ".img")},
    ".mtl": "it holds the materials of an .obj file: name that",
    ".hdr": "a sky is given by environment=...; save a volume as .nii, which holds header and voxels in one file",
    ".amf": "save it as .stl in the slicer",
    **dict.fromkeys((".zip", ".gz", ".7z", ".rar", ".tar"), "unpack it, and name the scene file inside"),
    ".zae": "unzip it, and convert the .dae by Assimp: assimp export in.dae out.glb",
    **dict.fromkeys((".ksplat", ".lcc"), "open it in SuperSplat (superspl.at/editor), export it as .ply"),
    **dict.fromkeys((".e57", ".ptx", ".xyzrgb"), _CLOUD_COMPARE),
    ".txt": "call rows of x, y, z of points .xyz; save COLMAP's by its model_converter as .ply",
    **dict.fromkeys((".mrc", ".map", ".ccp4"), "save it as .npy: numpy.save('a.npy', mrcfile.read('a.mrc'))"),
    **{kind: _OPEN_BABEL.format(kind) for kind in (".cube", ".gro", ".mae", ".pqr")},
    **dict.fromkeys((".bcif", ".mmtf"), "take the entry's .cif file from the data bank"),
    **dict.fromkeys((".bmp", ".avif"), "save photographs with depth as .png or .jpg"),
    **dict.fromkeys(FILMS, "take its pictures out: ffmpeg -i in.mp4 frames/%04d.png"),
}

#: First bytes, in small letters, of files that hold no scene, and what to do about each.
_NO_SCENES = {
    b"pk\3\4": ("is a ZIP archive", "unpack it, and name the scene file inside"),
    **dict.fromkeys((b"<!doctype html", b"<html"), ("is a web page, no scene", "download the file itself")),
}
#: Kinds that are ZIP archives themselves.
_ZIPPED = (".3mf", ".npz", ".sog", ".usdz", ".usd")

_DIRECTIONS: dict[Up, Direction] = {"y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0), "-y": (0.0, -1.0, 0.0)}


@takes(SceneOptions, AccessOptions)
def load_scene(
    source: object, *, light: LightOptions | Mapping[str, object] | None = None, **options: Unpack[LoadKeywords]
) -> Scene:
    """Load a scene from a file, a bundled scene's name, or an object of another library.

    Parameters
    ----------
    source:
        Path of a ``.glb``, ``.gltf``, ``.obj``, ``.ply``, ``.pcd``, ``.spz``, ``.splat``, ``.sog``, ``.stl``, ``.off``,
        ``.blend``, ``.usd`` (``.usda``, ``.usdc``, ``.usdz``), Mitsuba ``.xml``, Tachyon ``.dat`` or ``.nff`` file; of
        a volume (``.nii``, ``.nii.gz``, ``.nrrd``, ``.mha``, ``.mhd``, ``.vdb``, ``.npy``, ``.npz``, Mitsuba ``.vol``,
        ``.dcm`` or a folder of such) or of VTK (``.vtp``, ``.vtu``, ``.vtk``, ``.vti``); name of a bundled scene; a
        ``mi.Scene`` or Mitsuba dict; a trimesh scene or mesh; a PyVista data set or plotter; a
        :class:`~lippmann.scene.values.description.SceneDescription`.
    light:
        A :class:`~lippmann.options.light.LightOptions`, or a dict of them: turns and scales the scene's light.
    **options:
        Fields of :class:`~lippmann.options.scene.SceneOptions`, and ``allow_outside``.

    Returns
    -------
    Scene
        Its ``.notes`` say what the file has and is not shown; ``.bounds`` is its box in world units.

    Raises
    ------
    SceneError
        The scene or something it needs is missing, damaged, foreign, or has nothing to see.
    UsageError
        An option is out of its range or not for such a scene, or ``source`` is an object that is not understood.

    Examples
    --------
    >>> scene = lippmann.load_scene("teapot", background=(0.0, 0.0, 0.1))
    >>> len(scene.cameras)
    1
    """
    allow_outside = options.pop("allow_outside", False)
    if isinstance(light, Mapping):
        light = LightOptions.of(light)
    elif light is not None and not isinstance(light, LightOptions):
        raise UsageError(
            f"{light!r}", parameter="light", rule='a LightOptions, or a dict such as {"light_strength": 2}'
        )
    return read_scene(source, SceneOptions.of(options), light, allow_outside=allow_outside)


def read_scene(
    source: object, asked: SceneOptions, light: LightOptions | None = None, *, allow_outside: bool = False
) -> Scene:
    """:func:`load_scene` with all that is asked for in one value; without ``light`` it stays as the file has it.

    Raises
    ------
    SceneError, UsageError
        As :func:`load_scene`.
    """
    keep_freed_memory()  # each texture takes memory several times, and hardly more than the one before it
    sky = _environment(asked.environment)
    color = asked.background
    if isinstance(source, str | Path):
        scene = _from_name(source, allow_outside, asked)
    else:
        for name in ("up", "variants", "reader_options", "depth_map", "series"):
            if getattr(asked, name):
                raise UsageError("is for files", parameter=name, fix="leave it out")
        scene = _from_object(source)
    chosen = asked.crop, asked.unit_scale, asked.min_opacity, asked.transfer_function, asked.window
    if any(value is not None for value in chosen):
        scene = _select(scene, asked)
    scene = replace(scene, light=light or scene.light, settings=(*scene.settings, *settings_of(asked)))
    scene = scene if color is None else replace(scene, has_chosen_background=True)
    studio = scene.studio and str(asked.environment) != NO_ENVIRONMENT
    if color is not None and scene.classic is not None:
        from lippmann.scene.values.whitted_surfaces import Background

        scene = replace(scene, classic_form=replace(scene.classic, background=Background(color=color)))
    if scene.is_classic and sky is None and not asked.single_scattering:
        return replace(scene, studio=studio)
    # The classic light models know neither surroundings nor microfacets: who asks for them gets the physical form.
    description = override_light(scene.physical, sky, color)
    if scene.keeps_its_colors and isinstance(description, SceneDescription):
        description = _note_unused_light(description, asked, light or LightOptions())
    elif asked.single_scattering:
        description = _single_scattering(description)
    return replace(scene, description=description, studio=studio)


def _select(scene: Scene, asked: SceneOptions) -> Scene:
    """The scene with what is asked for of its splats and of its volume."""
    from lippmann.scene.cloud_selection import SplatSelection, VolumeSelection

    of_splats, of_volume = (None, asked.crop) if scene.has_volume else (asked.crop, None)
    scene = SplatSelection(of_splats, asked.unit_scale, asked.min_opacity).of(scene)
    return VolumeSelection(of_volume, asked.transfer_function, asked.window).of(scene)


def _note_unused_light(scene: SceneDescription, asked: SceneOptions, light: LightOptions) -> SceneDescription:
    """A scene that nothing lights, with notes on the options of light that were given and for which it has no use.

    An environment is seen beside it, but for photographs, which fill the panel.
    """
    ignored = ("environment", "single_scattering") if scene.fills_panel else ("single_scattering",)
    unused = [*(name for name in ignored if getattr(asked, name)), *changed_options(light)]
    if asked.background is not None and scene.fills_panel:
        remark = "background: seen beyond the photograph's edge alone, which a scale below 1 or a shift shows"
        scene = replace(scene, notes=(*scene.notes, remark))
    if not unused:
        return scene
    what = "a photograph" if scene.fills_panel else "the scene"
    remark = f"{what} keeps its own colours, whatever light is given: {', '.join(unused)}"
    return replace(scene, notes=(*scene.notes, remark))


def _single_scattering(description: SceneDescription | MitsubaSource) -> SceneDescription:
    if not isinstance(description, SceneDescription):
        raise UsageError(
            "a scene of Mitsuba's has materials of its own",
            where=description.name,
            parameter="single_scattering",
            rule="it is for materials in glTF's terms",
            fix="leave it out",
        )
    remark = "single scattering between microfacets: rough metal and glass are darker than they would be"
    return replace(description, multiple_scattering=False, notes=(*description.notes, remark))


def kind_of_file(source: str | Path) -> str | None:
    """The ending that goes with a scene file's content, or else its own; None for the name of a bundled scene.

    Raises
    ------
    SceneError
        The file is missing or cannot be read.
    """
    path = Path(source)
    if isinstance(source, str) and not path.suffix and path.name == source and not path.exists():
        return None
    return _suffix_by_content(path) or kind_of_name(path)


def kind_of_name(path: Path) -> str:
    """The ending that names a file's kind, of two parts as that of packed volumes where such a kind is known."""
    suffix, whole = path.suffix.lower(), "".join(path.suffixes[-2:]).lower()
    is_plain = suffix == whole or suffix in READERS.own_claims or READERS.find(whole) is None
    return suffix if is_plain else whole


def unknown_kind(path: Path) -> SceneError | None:
    """The error of a file whose ending is that of no scene; None for a known ending or none."""
    suffix = kind_of_name(path)
    return None if not suffix or READERS.find(suffix) is not None else _unknown_kind(path)


def _unknown_kind(path: Path) -> SceneError:
    suffix, broken = kind_of_name(path), READERS.problems
    if suffix in _ELSEWHERE:
        return SceneError(f"is no scene file: {suffix}", where=path.name, rule=_ELSEWHERE[suffix], fix=broken)
    return SceneError.unknown("kind of scene file", suffix, READERS.claims(), where=path.name, fix=broken)


def _from_name(source: str | Path, allow_outside: bool, asked: SceneOptions) -> Scene:
    from lippmann.scene import bundled

    path = Path(source)
    if source in bundled.names():
        _check_options(source, "", asked)
        return _from_library(path.name)
    suffix = ".sog" if holds_sog(path) else kind_of_name(path)
    _check_options(source, suffix, asked)
    if isinstance(source, str) and not suffix and path.name == source and not path.exists():
        raise SceneError.unknown("bundled scene or file", source, bundled.names())
    plugin = _reader_of(path, suffix)
    reader = plugin.value
    keywords = _keywords(reader, path, asked, allow_outside)
    with plugin.guard(SceneError, path.name):
        description = function_of(reader.read)(path, **keywords)
    if isinstance(description, SceneDescription):
        description = _upright(_with_remarks(check_description(description, path.name)), suffix, reader, asked.up)
        description = make_traceable(description)
        return Scene(description.name, description)
    scene = _of_other_kind(description)
    if scene is None:
        what = f"the plugin {plugin} made a {type(description).__name__} of it"
        raise SceneError(what, where=path.name, rule="a reader returns a SceneDescription")
    return scene


def _of_other_kind(content: object) -> Scene | None:
    """A :class:`Scene` of a Whitted scene or of an object of Mitsuba; None for other objects."""
    from lippmann.scene.mitsuba_source import MitsubaSource
    from lippmann.scene.values.whitted_scene import ClassicScene
    from lippmann.scene.whitted.world_frame import world_camera

    if isinstance(content, ClassicScene):
        return _classic(content, world_camera(content))
    return Scene(content.name, content) if isinstance(content, MitsubaSource) else None


def _keywords(reader: Reader, path: Path, asked: SceneOptions, allow_outside: bool) -> dict[str, object]:
    """The given options that a reader's functions take."""
    values = {
        "files": NamedFiles(path.parent, allow_outside),
        "variants": asked.variants,
        "depth_map": None if asked.depth_map is None else Path(asked.depth_map),
        "series": asked.series,
    }
    own = reader.values_of(asked.reader_options or {}, path.name)
    return {**{name: values[name] for name in reader.options if values[name]}, **own}


def open_moving(
    source: str | Path, animation: str | None, asked: SceneOptions, *, allow_outside: bool = False
) -> MovingScene:
    """The scene file ``source``, which moves.

    Raises
    ------
    SceneError
        As its reader, and where it has no (such) animation.
    UsageError
        Nothing moves in scenes of this kind.
    """
    plugin = READERS.find(kind_of_file(source) or "")
    if plugin is None or plugin.value.moving is None:
        raise UsageError(
            f"nothing moves in '{source}'",
            parameter="frames",
            rule="glTF and Blender files and USD stages have animations; Tachyon and NFF scenes are flown through",
            fix="add camera_path=FILE.cam for a flight, or turntable=48 for a turn",
        )
    path = Path(source)
    _check_options(path, kind_of_name(path), asked)
    keywords = _keywords(plugin.value, path, asked, allow_outside)
    with plugin.guard(SceneError, path.name):
        moving: MovingScene = function_of(plugin.value.moving)(path, animation=animation, **keywords)
    return moving


def _check_options(source: str | Path, suffix: str, asked: SceneOptions) -> None:
    """Refuse options that are not for files of this kind."""
    name = Path(source).name
    named = READERS.find(suffix) if asked.up is not None else None
    if asked.up is not None and (named is None or named.value.up is None):
        guessed = ", ".join(each for own in READERS.own.values() if own.up for each in own.suffixes)
        what = f"{name} says itself which way is up"
        raise UsageError(what, parameter="up", rule=f"y, z or -y, for {guessed}", fix="leave it out")
    if asked.reader_options and kind_of_file(source) is None:
        raise UsageError(f"{name} is no file", parameter="reader_options", fix="leave it out")
    has_none: dict[ReaderOption, str] = {
        "variants": f"{name} has no variants",
        "depth_map": f"{name} is no photograph",
        "series": f"{name} has no series to choose from",
    }
    for option, what in has_none.items():
        if getattr(asked, option):
            plugin = READERS.find(kind_of_file(source) or "")
            if plugin is None or option not in plugin.value.options:
                raise UsageError(what, parameter=option, rule=f"for {', '.join(suffixes_with(option))} files")


def _reader_of(path: Path, suffix: str) -> Plugin[Reader]:
    """The reader of a file by its ending; files of Lippmann's own kinds must also begin like one, if like any."""
    named, beginning = READERS.find(suffix), _suffix_by_content(path)
    if named is not None and named.distribution:
        return named
    if named is not None and path.is_file():
        _refuse_others(path, suffix)
    detected = named if beginning is None else READERS.find(beginning)
    if detected is None or (named is None and suffix in _ELSEWHERE):  # Collada is XML, too
        raise _unknown_kind(path)
    if named not in (None, detected):
        raise SceneError(f"is no {suffix} file", where=path.name, rule=f"it begins like a {beginning} file")
    return detected


def _refuse_others(path: Path, suffix: str) -> None:
    """Raise :class:`SceneError` for an archive or a web page that is called as a scene file."""
    head = read_bytes(path, 32).lstrip().lower()
    if suffix == ".json" and path.stem.startswith("transforms"):
        what, fix = "lists photographs and their cameras, no scene", "train splats of them, and name the .ply file"
        raise SceneError(what, where=path.name, fix=fix)
    for start, (what, fix) in _NO_SCENES.items():
        if head.startswith(start) and not (start.startswith(b"pk") and suffix in _ZIPPED):
            raise SceneError(what, where=path.name, fix=fix)


def _upright(description: SceneDescription, suffix: str, reader: Reader, up: Up | None) -> SceneDescription:
    """A description of a file that does not say which way is up, with y up, and a note where that was guessed."""
    if reader.up is None:
        return description
    splats = description.splats
    usual: Up = "-y" if splats is not None and suffix == ".ply" else reader.up
    is_guessed = up is None and description.up is None
    notes = [*description.notes]
    is_printed = suffix in (".stl", ".3mf")
    if is_guessed and usual == "z" and not is_printed and _is_land(description):
        usual = "y"
        notes.append("land is shown from above, as a map with +y on top (else up=z)")
    elif is_guessed and usual == "z":
        who = "3D printing" if is_printed else "surveying"
        notes.append(f"up is taken as +z, as {who} has it, for nothing in {suffix} files says it (else up=y)")
    if is_guessed and usual == "-y":
        notes.append("up is taken as -y, as trainers of splats have it, for nothing in the file says it (else up=y)")
    if is_guessed and suffix == ".spz":
        notes.append("up is taken as +y, as SPZ has it, but some programs leave it at -y (then up=-y)")
    if is_guessed and suffix in (".ply", ".off", ".pcd") and usual == "y":
        others = "z, or -y of depth cameras" if suffix == ".pcd" else "z"
        notes.insert(0, f"up is taken as +y, for nothing in the data says it (else up={others})")
    if is_guessed and suffix in VTK:
        notes.append(f"up is taken as +y, for nothing in {suffix} files says it (else up=z)")
    matrix = _turn_up(_DIRECTIONS[up or usual] if up is not None or description.up is None else description.up)
    if np.array_equal(matrix, np.eye(4)):
        return replace(description, notes=notes)
    instances = [
        replace(each, world_from_mesh=matrix @ np.asarray(each.world_from_mesh, np.float64))
        for each in description.instances
    ]
    splats = None if splats is None else move(splats, matrix)
    volume = None if description.volume is None else move_volume(description.volume, matrix)
    return replace(description, instances=instances, splats=splats, volume=volume, notes=notes)


def _is_land(description: SceneDescription) -> bool:
    """Whether a scan with z up is so flat that it is a strip from the side; storeys of buildings are less flat."""
    extents = np.ptp(np.concatenate([each.positions for each in description.meshes if each.fitted]), axis=0)
    return bool(extents[2] < _FLAT * extents.max())


def _turn_up(direction: Direction) -> Matrix:
    """The smallest rotation that brings a direction to +y; about x where there are several."""
    x, y, z = np.asarray(direction, np.float64) / np.linalg.norm(direction)
    matrix = np.eye(4)
    if y < -1.0 + 1e-9:  # where single precision would not tell it from -y
        matrix[:3, :3] = np.diag([1.0, -1.0, -1.0])
        return matrix
    cross = np.array([[0.0, -x, 0.0], [x, 0.0, z], [0.0, -z, 0.0]])  # of the axis, direction x (0, 1, 0)
    matrix[:3, :3] += cross + cross @ cross / (1.0 + y)
    return matrix


def _with_remarks(description: SceneDescription) -> SceneDescription:
    """The description with a note on materials that nobody can see: a file that was meant so is rare."""
    used = sorted({description.meshes[mesh].material for mesh in description.placements})
    invisible = [index for index in used if _is_invisible(description.materials[index])]
    if not invisible:
        return description
    name = description.materials[invisible[0]].name or f"number {invisible[0]}"
    others = f" and {len(invisible) - 1} more" if len(invisible) > 1 else ""
    note = f"material '{name}'{others}: opacity 0, so that nothing is seen of what has it"
    return replace(description, notes=(*description.notes, note))


def _is_invisible(material: Material) -> bool:
    """Whether nothing is seen of a surface: textures and vertex colours can only lower its opacity further."""
    if material.alpha_mode == "mask":
        return material.alpha < material.alpha_cutoff
    return material.alpha_mode == "blend" and material.alpha <= 0.0


def _suffix_by_content(path: Path) -> str | None:
    """The suffix that the first bytes of a file imply; None if they imply none."""
    if path.is_dir() and holds_dicom(path):
        return ".dcm"
    if holds_sog(path):
        return ".sog"
    head = read_bytes(path, HEAD_LENGTH)
    if begins_dicom(head):
        return ".dcm"
    head = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if b"<VTKFile" in head or (kind_of_name(path) in VTK and head.startswith(b"<")):  # they are XML, too
        return None
    readers = [*READERS.own_claims.values()]
    if kind_of_name(path) not in READERS.own_claims:
        readers += [each for each in READERS.plugins if not each.problem]
    fitting = [start for each in readers for start in each.value.beginnings if head.startswith(start)]
    longest = max(fitting, key=len, default=b"")
    return next((each.value.beginnings[longest] for each in readers if longest in each.value.beginnings), None)


def _from_library(name: str) -> Scene:
    from lippmann.scene import bundled

    content = bundled.make(name)
    if not isinstance(content, SceneDescription):
        return replace(_classic(_with_paper_depth(content), bundled.stage_of(name).camera()), home_may_move=True)
    description = check_description(content, name)
    home = description.cameras[0].name if description.cameras else None
    return Scene(name, description, home_camera=home, home_may_move=True, classic_form=_ClassicForm(name))


@dataclass(frozen=True)
class _ClassicForm:
    """Makes the form of a bundled scene for the classic light models; a plain value, as scenes are hashed."""

    name: str

    def __call__(self) -> ClassicScene:
        from lippmann.scene import bundled

        return _with_paper_depth(bundled.make_classic(self.name))


def _with_paper_depth(scene: ClassicScene) -> ClassicScene:
    return replace(scene, camera=replace(scene.camera, ray_depth=_PAPER_DEPTH))


def _classic(scene: ClassicScene, camera: Camera) -> Scene:
    return Scene(scene.name, home_camera=camera.name, classic_form=scene, views=(camera,))


def _from_object(source: object) -> Scene:
    if isinstance(source, Scene):
        return source
    if isinstance(source, SceneDescription):
        return Scene(source.name, check_description(source, source.name))
    scene = _of_other_kind(source)
    if scene is not None:
        return scene
    from lippmann.scene.mitsuba_source import MitsubaSource

    if isinstance(source, Mapping):
        if source.get("type") != "scene":
            raise SceneError(f"a dictionary of type {source.get('type')!r}", rule="Mitsuba scenes have type 'scene'")
        return Scene("mitsuba", MitsubaSource("mitsuba", dict(source)))
    if type(source).__module__.partition(".")[0] == "mitsuba" and type(source).__name__ == "Scene":
        return Scene("mitsuba", MitsubaSource("mitsuba", source))
    adapter = _adapter_for(source)
    if adapter is None:
        raise UsageError(
            f"{shorten(source)} is no scene",
            rule="a path, a bundled scene's name, or a scene of Mitsuba, trimesh or PyVista is",
        )
    description = adapter(source)
    check_description(description, description.name)
    # A plotter shows its scene by its camera.
    home = description.cameras[0].name if hasattr(source, "renderers") else None
    return Scene(description.name, description, home_camera=home, home_may_move=True)


def _adapter_for(source: object) -> Callable[[object], SceneDescription] | None:
    """The adapter of an object of another library: that of the library which its class, or a base class, comes from."""
    libraries = {kind.__module__.partition(".")[0] for kind in type(source).__mro__}
    home = next((each for library, each in _LIBRARIES.items() if library in libraries), None)
    adapter: Callable[[object], SceneDescription] | None = None if home is None else function_of(home)(source)
    return adapter


def _environment(environment: str | Path | Environment | None) -> Environment | None:
    if environment is None or isinstance(environment, Environment):
        return environment
    if str(environment) == NO_ENVIRONMENT:
        return None
    if str(environment) == STUDIO:
        from lippmann.scene.studio_light import studio

        return studio()
    from lippmann.scene.readers.environment_map import read_environment

    return read_environment(Path(environment))
