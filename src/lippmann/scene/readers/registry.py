"""Readers of scene files by what their files are called and begin with: Lippmann's own, and those of other packages.

None is imported before a file of its kind is read.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal, Protocol, get_args

from lippmann.errors import UsageError
from lippmann.options.scene import Up
from lippmann.runtime.plugins import Door, Extension, Target
from lippmann.scene.values.description import SceneDescription

#: A value of an option of a reader's own.
Setting = bool | int | float | str

#: Options of a scene that are for some readers alone: ``files`` are those that a file may name,
#: ``variants`` chooses among those of a file, ``depth_map`` names a photograph's, ``series`` one of several volumes.
ReaderOption = Literal["files", "variants", "depth_map", "series"]

_NAME = re.compile(r"[a-z][a-z0-9_]*")
_SUFFIX = re.compile(r"(\.[a-z0-9_+-]+){1,2}")


class MovingScene(Protocol):
    """A scene file that moves."""

    @property
    def duration(self) -> float:
        """Seconds to its last frame."""
        ...

    @property
    def content(self) -> object:
        """All values that its frames depend on, as plain values."""
        ...

    def at(self, seconds: float) -> SceneDescription:
        """The scene at a time; after the last frame it stands still."""
        ...


@dataclass(frozen=True)
class Reader(Extension):
    """A format of scene files.

    Functions may be given as texts, ``"module:function"``; their modules are then imported when a file is read.

    Parameters
    ----------
    suffixes:
        Endings of its files, in lower case, with their dots: ``(".tri",)``.
    read:
        ``read(path)`` returns a :class:`SceneDescription`, y up unless it says so. It raises a
        :class:`lippmann.LippmannError`, such as ``SceneError``, for a file that it cannot read.
    beginnings:
        Suffixes by the first bytes of files of that kind; these tell files that are called otherwise.
    options:
        Which of ``files``, ``variants``, ``depth_map`` and ``series`` ``read`` takes as keywords. ``files.find(name,
        where=..., what="texture")`` is the path of a file that the scene names, by the rules that hold for all scenes.
    settings:
        Options of its own, and their defaults: ``{"scale": 1.0}``. ``read`` (and ``moving``) takes each as a keyword of
        the type of its default: text, truth, whole number or number. Users set them by the option ``reader_options``.
    up:
        The way that mostly is up in files which do not say it: ``"y"``, ``"z"`` or ``"-y"``. Users may then ask for
        another (``up``). None: files say it.
    moving:
        ``moving(path, animation=..., ...)`` returns an object with ``duration`` (seconds), ``at(seconds)``, a
        :class:`SceneDescription`, and ``content``, the plain values that all depends on. It takes those of ``options``
        that are ``files`` or ``variants``. None: nothing moves.

    Examples
    --------
    >>> from lippmann.plugins import Reader
    >>> Reader((".tri",), "tri_reader:read", settings={"scale": 1.0}).suffixes
    ('.tri',)
    """

    suffixes: tuple[str, ...]
    read: Target
    beginnings: Mapping[bytes, str] = field(default_factory=dict)
    options: tuple[ReaderOption, ...] = ()
    up: Up | None = None
    moving: Target | None = None
    settings: Mapping[str, Setting] = field(default_factory=dict)

    group: ClassVar[str] = "lippmann.readers"

    def claims(self, name: str) -> tuple[str, ...]:
        """Its suffixes."""
        return self.suffixes

    def fault(self) -> str:
        """The fault in its fields; empty if all is well."""
        for each in self.suffixes:
            if not _SUFFIX.fullmatch(each):
                return f"its suffix '{each}' is no dot and letters in lower case"
        for name, default in self.settings.items():
            if not _NAME.fullmatch(name) or name in (*get_args(ReaderOption), "animation"):
                return f"its option '{name}' is no word of its own in lower case"
            if type(default) not in get_args(Setting):
                return f"the default of its option '{name}' is no text, number or truth"
        return ""

    def values_of(self, asked: Mapping[str, object], file: str) -> dict[str, Setting]:
        """The given :attr:`settings` that ``read`` takes, as values of the defaults' types.

        Raises
        ------
        UsageError
            It has no such option, or the value is of another type.
        """
        if asked and not self.settings:
            rule = "only readers of plugins have some"
            raise UsageError(
                f"the reader of {file} has no options", parameter="reader_options", rule=rule, fix="leave it out"
            )
        UsageError.refuse_unknown(f"option of the reader of {file}", asked, self.settings, parameter="reader_options")
        return {name: _setting(name, self.settings[name], str(value)) for name, value in asked.items()}


def _setting(name: str, default: Setting, text: str) -> Setting:
    """A text as a value of the default's type."""
    rule = ""
    if isinstance(default, bool):
        if text.lower() in ("true", "false"):
            return text.lower() == "true"
        rule = "must be true or false"
    elif isinstance(default, (int, float)):
        rule = "must be a whole number" if isinstance(default, int) else "must be a finite number"
        try:
            value = type(default)(text)
            if math.isfinite(value):
                return value
        except ValueError:
            pass
    else:
        return text
    raise UsageError(f"{name}={text}", parameter="reader_options", rule=rule)


_HERE = "lippmann.scene.readers"

#: Lippmann's own.
_OWN = {
    "blend": Reader(
        (".blend",),
        f"{_HERE}.blend:read_blend",
        {b"BLENDER": ".blend"},
        ("files",),
        moving=f"{_HERE}.blend.moving:MovingBlend",
    ),
    "tachyon": Reader((".dat",), f"{_HERE}.tachyon.reader:read_tachyon", options=("files",)),
    "gltf": Reader(
        (".glb", ".gltf"),
        f"{_HERE}.gltf:read_gltf",
        {b"glTF": ".glb", b"{": ".gltf"},
        ("files", "variants"),
        moving=f"{_HERE}.gltf_animation.animated_file:MovingGltf",
    ),
    "nff": Reader((".nff",), f"{_HERE}.nff:read_nff"),
    "obj": Reader((".obj",), f"{_HERE}.obj:read_obj", options=("files",), up="y"),
    "ply": Reader((".ply",), f"{_HERE}.ply:read_ply", {b"ply\n": ".ply", b"ply\r": ".ply"}, ("files",), "y"),
    "pcd": Reader((".pcd",), f"{_HERE}.pcd:read_pcd", {b"# .PCD": ".pcd"}, up="y"),
    "text-cloud": Reader((".pts", ".asc", ".csv"), f"{_HERE}.text_cloud:read_text_cloud", up="z"),
    "xyz": Reader((".xyz",), f"{_HERE}.text_cloud:read_xyz", up="z"),
    "las": Reader((".las", ".laz"), f"{_HERE}.lidar.reader:read_las", {b"LASF": ".las"}, up="z"),
    "off": Reader((".off",), f"{_HERE}.off:read_off", up="y"),
    "sog": Reader((".sog",), f"{_HERE}.splats.sog:read_sog", options=("files",), up="-y"),
    "spz": Reader((".spz",), f"{_HERE}.splats.spz:read_spz", up="y"),
    "splat": Reader((".splat",), f"{_HERE}.splats.splat:read_splat", up="-y"),
    "stl": Reader((".stl",), f"{_HERE}.stl:read_stl", up="z"),
    "3mf": Reader((".3mf",), f"{_HERE}.three_mf.reader:read_three_mf", up="z"),
    "usd": Reader(
        (".usd", ".usda", ".usdc", ".usdz"),
        f"{_HERE}.usd:read_usd",
        {b"#usda": ".usda", b"PXR-USDC": ".usdc"},
        ("files", "variants"),
        moving=f"{_HERE}.usd.moving_stage:MovingStage",
    ),
    "mitsuba": Reader((".xml",), "lippmann.scene.mitsuba_source:read_mitsuba", {b"<": ".xml"}, ("files",)),
    "nifti": Reader((".nii", ".nii.gz"), f"{_HERE}.volumes.nifti:read_nifti", options=("series",)),
    "numpy": Reader((".npy",), f"{_HERE}.volumes.numpy_arrays:read_array", up="y"),
    "numpy-archive": Reader((".npz",), f"{_HERE}.volumes.numpy_arrays:read_array", options=("series",), up="y"),
    "vtk": Reader(
        (".vtp", ".vtu", ".vtk", ".vti", ".vtr", ".vts"), f"{_HERE}.vtk.files:read_vtk", options=("series",), up="y"
    ),
    "dicom": Reader((".dcm",), f"{_HERE}.volumes.dicom:read_dicom", options=("series",)),
    "vdb": Reader((".vdb",), f"{_HERE}.volumes.vdb:read_vdb", options=("series",), up="y"),
    "mitsuba-volume": Reader((".vol",), f"{_HERE}.volumes.mitsuba_grid:read_mitsuba_grid"),
    "header-grid": Reader(
        (".nrrd", ".nhdr", ".mha", ".mhd"),
        f"{_HERE}.volumes.header_grids:read_header_grid",
        {b"NRRD": ".nrrd"},
        ("files",),
    ),
    "molecules": Reader(
        (".pdb", ".ent", ".cif", ".sdf", ".sd", ".mol", ".mol2", ".json", ".pdb.gz", ".ent.gz", ".cif.gz"),
        f"{_HERE}.molecules.reader:read_molecule",
        {b'{"data_': ".json"},
    ),
    "photographs": Reader(
        (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".heic", ".heif", ".hif"),
        f"{_HERE}.depth_photo:read_depth_photo",
        options=("depth_map",),
    ),
}

READERS = Door(Reader, _OWN)

#: Endings of pictures, which are scenes if they have depth, and of VTK's data sets, whose newer kind is XML.
PHOTOS, VTK = _OWN["photographs"].suffixes, _OWN["vtk"].suffixes


def suffixes_with(option: ReaderOption) -> list[str]:
    """Endings of Lippmann's own formats that have an option of a reader's."""
    return [suffix for each in _OWN.values() if option in each.options for suffix in each.suffixes]
