"""Reader of Tachyon scene files (``.dat``) and camera paths (``.cam``).

The grammar and its meaning are those of the program Tachyon 0.99; ``docs/reference/tachyon.md`` lists what is
honoured, what is refused and where this reader is stricter. Numbers are rounded to single precision, as the program
does.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np

from lippmann.errors import SceneError
from lippmann.scene.parsing.files import NamedFiles
from lippmann.scene.parsing.tokens import Words
from lippmann.scene.readers.tachyon.files import SceneFiles
from lippmann.scene.readers.tachyon.shapes import SHAPES, ShapeReader
from lippmann.scene.readers.tachyon.textures import TextureTable
from lippmann.scene.values.whitted_scene import CameraPose, ClassicCamera, ClassicScene, Projection
from lippmann.scene.values.whitted_surfaces import AmbientOcclusion, Background, ClassicLight, Fog, Shading, Vector
from lippmann.scene.whitted.builder import ClassicSceneBuilder, unit

T = TypeVar("T")

_COMMENT = re.compile(r"(?<!\S)#(?!\S)[^\n]*")
_DEEPEST_INCLUDE = 32
_MOST_INCLUDES = 1000
_MOST_SAMPLES = 65535
_DEEPEST_RAY = 1000
_LARGEST_PICTURE = 65536

_PROJECTIONS: dict[str, Projection] = {
    "PERSPECTIVE": "perspective",
    "PERSPECTIVE_DOF": "perspective-dof",
    "ORTHOGRAPHIC": "orthographic",
    "FISHEYE": "fisheye",
}
_GRADIENTS: dict[str, Literal["sky-sphere", "sky-plane"]] = {"SKY_SPHERE": "sky-sphere", "SKY_ORTHO_PLANE": "sky-plane"}
_FOGS: dict[str, Literal["linear", "exp", "exp2"] | None] = {
    "LINEAR": "linear",
    "EXP": "exp",
    "EXP2": "exp2",
    "OFF": None,
}
_SHADING_MODES: dict[str, Literal["full", "medium", "low", "lowest"]] = {
    "FULL": "full",
    "MEDIUM": "medium",
    "LOW": "low",
    "LOWEST": "lowest",
}
_REFUSED = {
    "SCALARVOL": "volumes are not rendered",
    "MGFFILE": "MGF files are not read (nor by the usual builds of Tachyon)",
}


def read_tachyon(path: str | Path, *, files: NamedFiles | None = None) -> ClassicScene:
    """Read a Tachyon scene file with all that it includes.

    Parameters
    ----------
    path:
        The ``.dat`` file.
    files:
        Those that it may name; by default those of its folder and below.

    Raises
    ------
    SceneError
        With file, line, the word found and what was expected; also for files that are missing, and for a scene
        without any primitive.
    """
    path = Path(path)
    reader = _SceneReader(path, SceneFiles(NamedFiles.of(path, files)))
    return reader.read()


def read_cam(path: str | Path) -> list[CameraPose]:
    """Read a camera path: per frame nine numbers, the view direction, the up direction and the center.

    Raises
    ------
    SceneError
        If the file is missing or empty, or a frame is incomplete or impossible.
    """
    path = Path(path)
    words = Words.of_file(path, path.name, comment=_COMMENT, single=True)
    poses = []
    while words.left:
        pose = CameraPose(view=words.direction(), up=words.direction(), center=words.vector())
        if not np.cross(pose.view, pose.up).any():
            raise words.wrong("an up direction that is not the view direction", back=6)
        poses.append(pose)
    if not poses:
        raise SceneError("no frame of a camera path", where=path.name, rule="nine numbers per frame")
    return poses


class _SceneReader:
    """Reads the items one by one and holds their values until the scene is built."""

    def __init__(self, path: Path, files: SceneFiles) -> None:
        self._path = path
        self._files = files
        self._builder = ClassicSceneBuilder(path.stem)
        self._items: dict[str, Callable[[Words], None]] = {
            "CAMERA": self._read_camera,
            "LIGHT": self._read_point_light,
            "SPOTLIGHT": self._read_spotlight,
            "DIRECTIONAL_LIGHT": self._read_directional_light,
            "SKY_LIGHT": self._read_sky_light,
            "BACKGROUND": self._read_background,
            "BACKGROUND_GRADIENT": self._read_gradient,
            "FOG": self._read_fog,
            "SHADER_MODE": self._read_shader_mode,
            "INCLUDE": self._read_include,
            "START_CLIPGROUP": self._start_clip_group,
            "END_CLIPGROUP": self._end_clip_group,
            "TEXDEF": lambda words: self._textures.define(words, self._open_files[-1]),
            "TEXALIAS": lambda words: self._textures.alias(words),
            "IMAGEDEF": lambda words: self._textures.define_image(words),
        }
        reserved = {*self._items, *SHAPES, *_REFUSED, "END_SCENE"}
        self._textures = TextureTable(self._builder, files, reserved)
        self._shapes = ShapeReader(self._builder, self._textures, files)
        self._open_files: list[Path] = []
        self._includes = 0
        self._projection: Projection = "perspective"
        self._aperture = 0.0
        self._focal_length = 1.0
        self._planar_fog = False
        self._camera: ClassicCamera | None = None
        self._fog: Fog | None = None
        self._background = Background()
        self._ambient_occlusion: AmbientOcclusion | None = None
        self._shading = Shading()

    def read(self) -> ClassicScene:
        words = Words.of_file(self._path, self._path.name, comment=_COMMENT, single=True)
        words.keyword("BEGIN_SCENE")
        words.keyword("RESOLUTION")
        width, height = (words.integer(1, _LARGEST_PICTURE) for _ in range(2))
        if not self._read_items(words, self._path):
            raise SceneError("the file ends without END_SCENE", where=words.place(), fix="is it cut short?")
        if words.left:
            self._builder.notes.append(f"{words.place()}: what follows END_SCENE is not read")
        self._shapes.finish()
        self._textures.finish()
        if self._camera is None:
            self._builder.notes.append("no CAMERA: seen from the origin along +z")
        if self._focal_length != 1.0:
            self._builder.notes.append("FOCALLENGTH has no effect: Tachyon focuses at distance 1")
        scene = self._builder.build(
            resolution=(width, height),
            camera=self._camera,
            background=self._background,
            fog=None if self._fog is None else replace(self._fog, planar=self._planar_fog),
            ambient_occlusion=self._ambient_occlusion,
            shading=self._shading,
        )
        if not any(scene.counts().values()):
            raise SceneError("the scene has no geometry", where=self._path.name, rule="at least one primitive")
        return scene

    def _read_items(self, words: Words, holder: Path) -> bool:
        """Read the file ``holder`` to END_SCENE (True) or to its end (False)."""
        self._open_files.append(holder)
        ended = False
        while words.left and not ended:
            keyword = words.peek().upper()
            if keyword in SHAPES:
                words.take()
                SHAPES[keyword](self._shapes, words, holder)
            elif keyword in self._items:
                words.take()
                self._items[keyword](words)
            elif keyword == "END_SCENE":
                words.take()
                ended = True
            elif keyword in _REFUSED:
                raise SceneError(f"{keyword} cannot be rendered", where=words.place(), rule=_REFUSED[keyword])
            else:
                raise words.wrong("the keyword of an item, such as SPHERE, or END_SCENE")
        self._open_files.pop()
        return ended

    def _read_include(self, words: Words) -> None:
        where = words.place()
        path = self._files.find(
            words.name("the name of a file"), self._open_files[-1], where=where, what="included file"
        )
        included = self._files.relative_name(path)
        if any(path.samefile(other) for other in self._open_files):
            raise SceneError(f"'{included}' includes itself", where=where, rule="includes may not run in a circle")
        self._includes += 1
        if len(self._open_files) > _DEEPEST_INCLUDE or self._includes > _MOST_INCLUDES:
            limits = f"at most {_DEEPEST_INCLUDE} deep and {_MOST_INCLUDES} in all"
            raise SceneError(f"'{included}' is one include too many", where=where, rule=limits)
        self._read_items(self._files.words(path, comment=_COMMENT, where=where), path)

    def _read_camera(self, words: Words) -> None:
        if words.has("PROJECTION"):
            self._projection = _read_choice(words, _PROJECTIONS)
            if self._projection == "perspective-dof":
                self._focal_length = words.number("FOCALLENGTH")
                self._aperture = words.number("APERTURE")
        start = words.place()
        zoom, aspect = words.positive("ZOOM"), words.positive("ASPECTRATIO")
        antialiasing = words.integer(0, _MOST_SAMPLES, "ANTIALIASING")
        ray_depth = max(1, words.integer(0, _DEEPEST_RAY, "RAYDEPTH"))  # 0 traces as deep as 1
        center, view, up = words.vector("CENTER"), words.direction("VIEWDIR"), words.direction("UPDIR")
        frustum = None
        if words.has("FRUSTUM"):
            frustum = (words.number(), words.number(), words.number(), words.number())
        words.keyword("END_CAMERA")
        try:
            self._camera = ClassicCamera(
                projection=self._projection,
                center=center,
                view=view,
                up=up,
                zoom=zoom,
                aspect=aspect,
                antialiasing=antialiasing,
                ray_depth=ray_depth,
                aperture=self._aperture,
                frustum=frustum,
            )
        except SceneError as error:
            raise SceneError(error.what, where=start, rule=error.rule) from None

    def _read_point_light(self, words: Words) -> None:
        center, radius = words.vector("CENTER"), words.radius("RAD")
        self._add_light(words, ClassicLight("point", center=center, radius=radius))

    def _read_spotlight(self, words: Words) -> None:
        light = ClassicLight(
            "spot",
            center=words.vector("CENTER"),
            radius=words.radius("RAD"),
            direction=_unit(words.direction("DIRECTION")),
            falloff_start=words.number("FALLOFF_START"),
            falloff_end=words.number("FALLOFF_END"),
        )
        self._add_light(words, light)

    def _add_light(self, words: Words, light: ClassicLight) -> None:
        """Read the attenuation and colour that end a point or spot light, and add it to the scene."""
        if words.has("ATTENUATION"):
            factors = (words.radius("CONSTANT"), words.radius("LINEAR"), words.radius("QUADRATIC"))
            if not any(factors):
                raise words.wrong("factors of attenuation that are not all 0", back=1)
            light = replace(light, attenuation=factors)
        self._builder.light(replace(light, color=words.vector("COLOR"), clip_group=self._shapes.clip_group))

    def _read_directional_light(self, words: Words) -> None:
        direction = _unit(words.direction("DIRECTION"))
        self._builder.light(ClassicLight("directional", color=words.vector("COLOR"), direction=direction))

    def _read_sky_light(self, words: Words) -> None:
        samples = words.integer(0, _MOST_SAMPLES, "NUMSAMPLES")
        self._set_ambient_occlusion(samples, words.vector("COLOR"))

    def _set_ambient_occlusion(self, samples: int, color: Vector) -> None:
        self._ambient_occlusion = AmbientOcclusion(samples, color) if samples else None

    def _read_background(self, words: Words) -> None:
        self._background = replace(self._background, color=words.vector())

    def _read_gradient(self, words: Words) -> None:
        kind = _read_choice(words, _GRADIENTS)
        up = words.vector("UPDIR")
        top, bottom = words.number("TOPVAL"), words.number("BOTTOMVAL")
        if top == bottom:
            raise words.wrong("a bottom value that differs from the top value", back=1)
        self._background = replace(
            self._background,
            kind=kind,
            up=up,
            top_value=top,
            bottom_value=bottom,
            top_color=words.vector("TOPCOLOR"),
            bottom_color=words.vector("BOTTOMCOLOR"),
        )

    def _read_fog(self, words: Words) -> None:
        kind = _read_choice(words, _FOGS)
        start, end = words.number("START"), words.number("END")
        if kind == "linear" and start == end:
            raise words.wrong("an end of the fog that differs from its start", back=1)
        density, color = words.number("DENSITY"), words.vector("COLOR")
        self._fog = None if kind is None else Fog(kind, start, end, density, color)

    def _read_shader_mode(self, words: Words) -> None:
        shading = replace(self._shading, mode=_read_choice(words, _SHADING_MODES))
        while not words.has("END_SHADER_MODE"):
            if words.has("SHADOW_FILTER_ON"):
                shading = replace(shading, shadow_filter=True)
            elif words.has("SHADOW_FILTER_OFF"):
                shading = replace(shading, shadow_filter=False)
            elif words.has("TRANS_MAX_SURFACES"):
                shading = replace(shading, max_transparent_surfaces=words.integer(0, 2**31 - 1))
            elif words.has("TRANS_ORIG"):
                shading = replace(shading, raster3d=False, local_times_opacity=False)
            elif words.has("TRANS_RASTER3D"):
                shading = replace(shading, raster3d=True)
            elif words.has("TRANS_VMD"):
                shading = replace(shading, local_times_opacity=True)
            elif words.has("FOG_VMD"):
                self._planar_fog = True
            elif words.has("AMBIENT_OCCLUSION"):
                color = words.vector("AMBIENT_COLOR")
                shading = replace(shading, light_scale=words.number("RESCALE_DIRECT"))
                self._set_ambient_occlusion(words.integer(0, _MOST_SAMPLES, "SAMPLES"), color)
            else:
                raise words.wrong("an option of SHADER_MODE, or END_SHADER_MODE")
        self._shading = shading

    def _start_clip_group(self, words: Words) -> None:
        planes = words.numbers(words.count(4, "NUMPLANES"), 4)
        self._shapes.clip_group = self._builder.clip_group(planes)

    def _end_clip_group(self, words: Words) -> None:
        self._shapes.clip_group = -1


def _read_choice(words: Words, choices: Mapping[str, T]) -> T:
    """The value of the next word, which must be one of the keywords of ``choices``."""
    keyword = words.peek().upper()
    if keyword not in choices:
        raise words.wrong(" or ".join(choices))
    words.take()
    return choices[keyword]


def _unit(direction: Vector) -> Vector:
    x, y, z = unit(direction, "a direction").tolist()
    return x, y, z
