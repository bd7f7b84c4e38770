"""Scenes as plain values, independent of readers and renderers.

Readers of files produce a :class:`SceneDescription`; :mod:`lippmann.device.pbr` turns it into a Mitsuba scene.
World units are the file's own; the frame is right-handed with +y up unless a reader's format says otherwise. Colours
are linear RGB, non-negative. Matrices are 4x4 float64, acting on column vectors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.engine_lock import cached_property
from lippmann.scene.values.splats import Splats
from lippmann.scene.values.volume import Volume

FloatArray = NDArray[np.float32]
IndexArray = NDArray[np.uint32]
Matrix = NDArray[np.float64]
Color = tuple[float, float, float]
Direction = tuple[float, float, float]

Wrap = Literal["repeat", "mirror", "clamp"]
Filter = Literal["linear", "nearest"]
AlphaMode = Literal["opaque", "mask", "blend"]
Round = Literal["ball", "rod"]


@dataclass(frozen=True, eq=False)
class Image:
    """Decoded texels, shared by textures.

    ``pixels`` is ``(height, width, channels)`` uint8 or float32, row 0 on top, channels 1 (L), 3 (RGB) or 4 (RGBA) as
    stored. The texture that uses the image says whether its values are sRGB-coded.

    Examples
    --------
    >>> from lippmann.plugins import Image
    >>> import numpy as np
    >>> Image("white", np.full((1, 2, 3), 255, np.uint8)).pixels.shape
    (1, 2, 3)
    """

    name: str
    pixels: NDArray[np.generic]


@dataclass(frozen=True, eq=False)
class Texture:
    """An image seen through a sampler: ``uv' = uv_transform @ (u, v, 1)``, v pointing down from the top row.

    Examples
    --------
    >>> from lippmann.plugins import Image, Texture
    >>> import numpy as np
    >>> Texture(Image("white", np.full((1, 2, 3), 255, np.uint8)), srgb=True).wrap_u
    'repeat'
    """

    image: Image
    srgb: bool
    wrap_u: Wrap = "repeat"
    wrap_v: Wrap = "repeat"
    filter: Filter = "linear"
    uv_transform: Matrix = field(default_factory=lambda: np.eye(3))
    uv_set: int = 0


@dataclass(frozen=True, eq=False)
class Material:
    """A surface in glTF's metallic-roughness terms (glTF 2.0 and its KHR_materials extensions).

    A factor multiplies its texture where both are given. ``base_color_texture`` carries alpha in its fourth channel;
    ``metallic_roughness_texture`` carries roughness in G and metallic in B; single-channel textures name the channel
    that the extension fixes (transmission R, specular A, clearcoat R, clearcoat roughness G, sheen roughness A,
    thickness G, iridescence R, its thickness G). Colours of light (``emission``) are radiances; all others lie in
    [0, 1]. ``anisotropy`` is a strength in [0, 1], its ``rotation`` in radians from +u toward the top of the picture;
    its texture holds a direction in RG and a strength in B. The thin film of ``iridescence`` is some nanometres thick:
    from minimum to maximum as its texture says, the maximum without one. An opaque ``front_only`` material has no back
    faces: rays pass through them, and light falls through from behind.

    Examples
    --------
    >>> from lippmann.plugins import Material
    >>> Material("red", base_color=(0.8, 0.0, 0.0), roughness=0.3).metallic
    0.0
    """

    name: str = ""
    base_color: Color = (1.0, 1.0, 1.0)
    base_color_texture: Texture | None = None
    alpha: float = 1.0
    alpha_mode: AlphaMode = "opaque"
    alpha_cutoff: float = 0.5
    metallic: float = 0.0
    roughness: float = 1.0
    metallic_roughness_texture: Texture | None = None
    normal_texture: Texture | None = None
    normal_scale: float = 1.0
    emission: Color = (0.0, 0.0, 0.0)
    emission_texture: Texture | None = None
    double_sided: bool = False
    front_only: bool = False
    unlit: bool = False
    ior: float = 1.5
    transmission: float = 0.0
    transmission_texture: Texture | None = None
    thickness: float = 0.0
    thickness_texture: Texture | None = None
    attenuation_color: Color = (1.0, 1.0, 1.0)
    attenuation_distance: float = float("inf")
    specular: float = 1.0
    specular_texture: Texture | None = None
    specular_color: Color = (1.0, 1.0, 1.0)
    specular_color_texture: Texture | None = None
    clearcoat: float = 0.0
    clearcoat_texture: Texture | None = None
    clearcoat_roughness: float = 0.0
    clearcoat_roughness_texture: Texture | None = None
    clearcoat_normal_texture: Texture | None = None
    clearcoat_normal_scale: float = 1.0
    sheen_color: Color = (0.0, 0.0, 0.0)
    sheen_color_texture: Texture | None = None
    sheen_roughness: float = 0.0
    sheen_roughness_texture: Texture | None = None
    anisotropy: float = 0.0
    anisotropy_rotation: float = 0.0
    anisotropy_texture: Texture | None = None
    iridescence: float = 0.0
    iridescence_texture: Texture | None = None
    iridescence_ior: float = 1.3
    iridescence_thickness_minimum: float = 100.0
    iridescence_thickness_maximum: float = 400.0
    iridescence_thickness_texture: Texture | None = None


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with one material.

    ``positions`` ``(n, 3)``, ``faces`` ``(m, 3)`` counter-clockwise seen from the front, ``normals`` ``(n, 3)`` unit or
    None (flat), ``uvs`` a tuple of ``(n, 2)`` (v down from the image's top row, as in glTF), ``colors`` ``(n, 3 or 4)``
    linear or None. ``tangents`` ``(n, 4)``: unit vectors along the x of normal maps, and 1 or -1 by which ``normal x
    tangent`` is their y; zeros or None for those of the uv parametrisation. ``fitted``: whether displays are
    fitted to it; not so a light source around the scene. ``stands_for``: the round body that the triangles stand for, a
    ball of radius 1 about the origin, or a rod of radius 1 from there to (0, 0, 1), open at its ends; what can trace
    such bodies does so instead. ``points``: vertices of each of the balls that stand for points of a cloud, one ball
    after the other; 0 for other meshes.

    Examples
    --------
    >>> from lippmann.plugins import Mesh
    >>> import numpy as np
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    >>> Mesh("triangle", corners, np.array([[0, 1, 2]], np.uint32), material=0).normals is None
    True
    """

    name: str
    positions: FloatArray
    faces: IndexArray
    material: int
    normals: FloatArray | None = None
    uvs: tuple[FloatArray, ...] = ()
    colors: FloatArray | None = None
    fitted: bool = True
    stands_for: Round | None = None
    points: int = 0
    tangents: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Instance:
    """Placements of one mesh (index into ``SceneDescription.meshes``).

    ``world_from_mesh`` is ``(4, 4)``, or ``(k, 4, 4)`` for k copies, which takes less memory than k instances.

    Examples
    --------
    >>> from lippmann.plugins import Instance
    >>> import numpy as np
    >>> Instance(0, np.stack([np.eye(4), np.diag([2, 2, 2, 1])])).world_from_mesh.shape  # two copies
    (2, 4, 4)
    """

    mesh: int
    world_from_mesh: Matrix


@dataclass(frozen=True, eq=False)
class Light:
    """A point, spot or directional light source (as in KHR_lights_punctual).

    ``point``: ``color`` is radiant intensity (W/sr, falling with the square of the distance); ``spot``: the same inside
    a cone about the light's -z, smooth between the inner and outer half-angle (radians); ``directional``: irradiance
    (W/m^2) travelling along the light's -z. ``radius`` > 0 makes point and spot lights emissive spheres of that size.

    Examples
    --------
    >>> from lippmann.plugins import Light
    >>> import numpy as np
    >>> Light("point", (10.0, 10.0, 10.0), np.eye(4)).radius
    0.0
    """

    kind: Literal["point", "spot", "directional"]
    color: Color
    world_from_light: Matrix
    inner_angle: float = 0.0
    outer_angle: float = float(np.pi / 4)
    radius: float = 0.0
    name: str = ""


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera looking along its own -z with +y up.

    ``fov_y`` is the full vertical angle in radians (perspective), ``height`` the full vertical extent in world units
    (orthographic), ``aspect`` width over height of its picture; None for that of the display it places.
    ``focus_distance`` (world units) becomes the lens plane when the camera places a display; None means
    the distance of the scene's centre. ``shift`` is where the middle of the picture lies beside the axis, to the right
    and up: a slope (perspective), or world units (orthographic). ``exposure`` is the camera's own, in stops.

    Examples
    --------
    >>> from lippmann.plugins import Camera
    >>> import numpy as np
    >>> Camera("front", np.eye(4), fov_y=np.radians(40)).shift
    (0.0, 0.0)
    """

    name: str
    world_from_camera: Matrix
    fov_y: float | None = None
    height: float | None = None
    aspect: float | None = 1.0
    focus_distance: float | None = None
    shift: tuple[float, float] = (0.0, 0.0)
    exposure: float = 0.0


@dataclass(frozen=True, eq=False)
class Environment:
    """Light from far away: an equirectangular image ``(h, w, 3)`` of float32 linear radiance.

    Row 0 lies at +y (up), the middle column at -z, ahead of a viewer who looks that way; columns run to the right (+x).
    ``follows_viewer`` says that this holds for whoever looks at the scene, wherever the display or camera stands;
    ``world_from_environment`` is then set for each picture. ``notes`` say what of its file is not used.

    Examples
    --------
    >>> from lippmann.plugins import Environment
    >>> import numpy as np
    >>> scene = lippmann.load_scene("teapot", environment=Environment(np.ones((8, 16, 3), np.float32)))
    """

    pixels: FloatArray
    world_from_environment: Matrix = field(default_factory=lambda: np.eye(4))
    name: str = ""
    follows_viewer: bool = False
    notes: Sequence[str] = ()

    def brighten(self, factor: float) -> Environment:
        """The same environment with its radiance times ``factor`` (>= 0)."""
        return replace(self, pixels=np.asarray(self.pixels, np.float32) * np.float32(factor))


@dataclass(frozen=True, eq=False)
class SceneDescription:
    """The content of a scene file.

    ``background`` is the colour seen where nothing is hit (None: the environment itself, black without one).
    ``notes`` are one-line remarks of the reader: features that it ignored, and its assumptions.
    ``multiple_scattering`` gives back the light that rough surfaces reflect more than once between microfacets; without
    it they are as dark as glTF's formulas make them. ``physical_lights`` says that the file tells its light sources in
    lux or candela. ``splats`` and ``volume`` stand in the world. ``fills_panel`` says that displays are to show no
    border of the scene, as of a photograph. ``up`` is the direction that points up by the file's own words, where its
    format leaves that open; None where nothing says it.

    Examples
    --------
    >>> from lippmann.plugins import Instance, Material, Mesh, SceneDescription
    >>> import numpy as np
    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    >>> triangle = Mesh("triangle", corners, np.array([[0, 1, 2]], np.uint32), material=0)
    >>> scene = SceneDescription("one", [triangle], [Material()], [Instance(0, np.eye(4))])
    >>> lippmann.load_scene(scene).bounds.tolist()
    [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0]]
    """

    name: str
    meshes: Sequence[Mesh] = ()
    materials: Sequence[Material] = ()
    instances: Sequence[Instance] = ()
    lights: Sequence[Light] = ()
    cameras: Sequence[Camera] = ()
    environment: Environment | None = None
    background: Color | None = None
    notes: Sequence[str] = ()
    multiple_scattering: bool = True
    physical_lights: bool = False
    splats: Splats | None = None
    volume: Volume | None = None
    fills_panel: bool = False
    up: Direction | None = None

    @cached_property
    def placements(self) -> Mapping[int, Matrix]:
        """The places ``(k, 4, 4)`` of each mesh that has any, float64, by the mesh's index."""
        matrices: dict[int, list[Matrix]] = {}
        for instance in self.instances:
            own = np.asarray(instance.world_from_mesh, np.float64).reshape(-1, 4, 4)
            matrices.setdefault(instance.mesh, []).append(own)
        return {mesh: stacks[0] if len(stacks) == 1 else np.concatenate(stacks) for mesh, stacks in matrices.items()}

    @cached_property
    def fitted_placements(self) -> Mapping[int, Matrix]:
        """:attr:`placements` of the meshes that displays are fitted to; all where there is no such mesh."""
        fitted = {mesh: places for mesh, places in self.placements.items() if self.meshes[mesh].fitted}
        return fitted or self.placements
