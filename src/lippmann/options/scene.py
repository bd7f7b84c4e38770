"""Options of a scene: the parts that are read of it, and its surroundings."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypedDict

from lippmann.options import texts
from lippmann.options.option import Options, option

if TYPE_CHECKING:
    from lippmann.scene.values.description import Environment
    from lippmann.scene.values.volume import TransferFunction

#: Which axis points up.
Up = Literal["y", "z", "-y"]
#: Lowest corner x, y and z of a box, then its highest.
Crop = tuple[float, float, float, float, float, float]

_scene = partial(option, group="Scene")
_light = partial(option, group="Light")


@dataclass(frozen=True)
class SceneOptions(Options):
    """Options of a scene's file and of its surroundings. Each reader checks which of them its files have."""

    noun = "scene"

    up: Up | None = _scene(
        None,
        "Which axis points up in OBJ, PLY (y by default), STL (z) and splat files (-y; of .spz y).",
        first=True,
    )
    variants: Mapping[str, str] | None = _scene(
        None,
        "Choose a variant: of a USD stage SET=CHOICE, for all prims that have it, or /PRIM:SET=CHOICE for one "
        "(repeatable); of a glTF file's materials its name.",
        flag="variant",
        metavar="[SET=]CHOICE",
        read=texts.variants,
        words=list[str] | None,
    )
    reader_options: Mapping[str, str] | None = _scene(
        None,
        "An option of the plugin that reads the file (repeatable); lippmann doctor lists them.",
        flag="reader-option",
        metavar="NAME=VALUE",
        read=texts.reader_options,
        words=list[str] | None,
    )
    depth_map: "str | Path | None" = _scene(
        None,
        "The depth of a photograph: .pfm, .npy, .exr (metres), a picture of 16 bits (millimetres) or of 8 bits "
        "(brighter is nearer).",
        words=Path | None,
        is_file=True,
    )
    transfer_function: "str | Path | TransferFunction | None" = _scene(
        None,
        "Colours and opacities of a volume: ct-bone, ct-soft, mr, grey, fire, or a .toml or .json file. By default "
        "what suits its values.",
        words=str | None,
        is_file=True,
    )
    window: tuple[float, float] | None = _scene(
        None,
        "Lay the transfer function of a volume between these values.",
        metavar="LOW,HIGH",
        read=partial(texts.numbers, counts=(2,)),
    )
    series: str | None = _scene(
        None,
        "Of several volumes the one to show: a DICOM series' number, description or UID, a NIfTI volume's number, an "
        "array's name (also of VTK's files).",
    )
    crop: Crop | None = _scene(
        None,
        "Of splats, points and volumes, keep what is in the box X0,Y0,Z0,X1,Y1,Z1 (y up, after `unit_scale`).",
        read=partial(texts.numbers, counts=(6,)),
    )
    unit_scale: float | None = _scene(
        None,
        "Factor on the coordinates of Gaussian splats, whose files have no unit: for `crop` and `place` display.",
    )
    min_opacity: float | None = _scene(
        None, "Leave out Gaussian splats of less opacity (0 to 1): most floaters are faint."
    )
    environment: "str | Path | Environment | None" = _light(
        None,
        "Light the scene by this picture of the surroundings (EXR, HDR).",
        first=True,
        words=Path | None,
        is_file=True,
    )
    background: tuple[float, float, float] | None = _light(
        None,
        "Colour seen where nothing is hit: three numbers from 0 to 1, linear.",
        first=True,
        metavar="R,G,B",
        low=0.0,
        high=1.0,
        rule="must be three numbers from 0 to 1, linear: 1,1,1 is white",
        read=texts.triple,
    )
    single_scattering: bool = _scene(
        False, "Shade rough metal and glass exactly by glTF's formulas, which lose light between microfacets."
    )


class SceneKeywords(TypedDict, total=False):
    """:class:`SceneOptions` as keywords."""

    up: Up | None
    variants: Mapping[str, str] | None
    reader_options: Mapping[str, str] | None
    depth_map: "str | Path | None"
    transfer_function: "str | Path | TransferFunction | None"
    window: tuple[float, float] | None
    series: str | None
    crop: Crop | None
    unit_scale: float | None
    min_opacity: float | None
    environment: "str | Path | Environment | None"
    background: tuple[float, float, float] | None
    single_scattering: bool


class LoadKeywords(SceneKeywords, total=False):
    """Options of :func:`lippmann.load_scene`."""

    allow_outside: bool
