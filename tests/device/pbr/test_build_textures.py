"""Texels land where glTF says, with the values that it says."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.scene.values.description import Image, Instance, Material, Texture

MODES = ("repeat", "mirror", "clamp")


def decoded(codes):
    """sRGB to linear, by the standard's own words."""
    v = np.asarray(codes, np.float64) / 255
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def wrapped(index, mode, count):
    if mode == "repeat":
        return index % count
    if mode == "clamp":
        return np.clip(index, 0, count - 1)
    folded = index % (2 * count)
    return np.where(folded < count, folded, 2 * count - 1 - folded)


def sampled(texels, u, v, wrap_u, wrap_v, filtering):
    """A texture lookup by the letter: texel centres at (i + 1/2) / n, v downwards."""
    rows, columns = texels.shape[:2]
    if filtering == "nearest":
        i, j = np.floor(u * columns).astype(int), np.floor(v * rows).astype(int)
        return texels[wrapped(j, wrap_v, rows), wrapped(i, wrap_u, columns)]
    x, y = u * columns - 0.5, v * rows - 0.5
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    total = 0.0
    for dj in (0, 1):
        for di in (0, 1):
            weight = (1 - abs(x - i - di)) * (1 - abs(y - j - dj))
            total = total + weight[..., None] * texels[wrapped(j + dj, wrap_v, rows), wrapped(i + di, wrap_u, columns)]
    return total


def glowing(texture, **rest):
    return Material(base_color=(0, 0, 0), emission=(1, 1, 1), emission_texture=texture, **rest)


@pytest.fixture(scope="module")
def texels():
    return np.random.default_rng(7).integers(0, 256, (3, 4, 3), dtype=np.uint8)


def test_picture_stands_upright(build, look, parts, texels):
    texture = Texture(Image("t", texels), srgb=False, filter="nearest")
    built = build(parts.describe([parts.square()], [glowing(texture)]))
    x = (np.arange(4) + 0.5) / 2 - 1
    y = 1 - (np.arange(3) + 0.5) / 1.5
    seen = look.emitted(built, *np.meshgrid(x, y)).reshape(3, 4, 3)
    np.testing.assert_allclose(seen, texels / 255, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("filtering", ["nearest", "linear"])
@pytest.mark.parametrize("wrap_u", MODES)
@pytest.mark.parametrize("wrap_v", MODES)
def test_wrap_modes_per_axis(build, look, parts, texels, wrap_u, wrap_v, filtering):
    texture = Texture(Image("t", texels), False, wrap_u, wrap_v, filtering)
    uvs = (np.array([(-1.5, 2.5), (2.5, 2.5), (2.5, -1.5), (-1.5, -1.5)], np.float32),)
    built = build(parts.describe([parts.square(uvs=uvs)], [glowing(texture)]))
    # Points off texel borders, where "nearest" would be decided by rounding.
    x, y = np.meshgrid(np.linspace(-0.99, 0.98, 61), np.linspace(-0.985, 0.99, 53))
    expected = sampled(texels / 255, x * 2 + 0.5, 0.5 - y * 2, wrap_u, wrap_v, filtering).reshape(-1, 3)
    np.testing.assert_allclose(look.emitted(built, x, y), expected, atol=2e-5)


@pytest.mark.long
@given(
    scale=st.tuples(st.floats(0.3, 3), st.floats(0.3, 3)),
    angle=st.floats(-3, 3),
    offset=st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
)
@settings(deadline=None, max_examples=20)
def test_texture_transform(build, look, parts, texels, scale, angle, offset):
    cosine, sine = np.cos(angle), np.sin(angle)
    matrix = np.array([[cosine, sine, offset[0]], [-sine, cosine, offset[1]], [0, 0, 1]]) @ np.diag([*scale, 1])
    texture = Texture(Image("t", texels), srgb=False, uv_transform=matrix)
    built = build(parts.describe([parts.square()], [glowing(texture)]))
    x, y = np.meshgrid(np.linspace(-0.99, 0.98, 21), np.linspace(-0.985, 0.99, 23))
    u, v, _ = np.einsum("ij,jkl->ikl", matrix, np.stack([(x + 1) / 2, (1 - y) / 2, np.ones_like(x)]))
    expected = sampled(texels / 255, u, v, "repeat", "repeat", "linear").reshape(-1, 3)
    np.testing.assert_allclose(look.emitted(built, x, y), expected, atol=1e-4)


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_coded_colours_are_decoded_before_they_are_filtered(build, look, parts, texels, dtype):
    stored = texels if dtype == np.uint8 else (texels / 255).astype(np.float32)
    texture = Texture(Image("t", stored), srgb=True)
    built = build(parts.describe([parts.square()], [glowing(texture)]))
    x, y = np.meshgrid(np.linspace(-0.99, 0.98, 31), np.linspace(-0.985, 0.99, 33))
    expected = sampled(decoded(texels), (x + 1) / 2, (1 - y) / 2, "repeat", "repeat", "linear").reshape(-1, 3)
    np.testing.assert_allclose(look.emitted(built, x, y), expected, atol=2e-5)


def test_kernels_do_not_depend_on_where_numpys_arrays_lie(build, parts, texels):
    """Dr.Jit would read them in place, by loads for their alignment, which is a matter of chance."""
    import mitsuba as mi

    from lippmann.device.pbr.textures import _upload

    for stored in (texels, (texels / 255).astype(np.float32)):
        read = [np.asarray(_upload(stored, False, "nearest", "repeat").tensor().array) for _ in range(8)]
        assert not any(array.ctypes.data % 64 for array in read)
    scenes = [build(parts.describe([parts.square()], [glowing(Texture(Image("t", texels), True))])) for _ in range(8)]
    meshes = [mi.traverse(built.mitsuba.shapes()[0]) for built in scenes]
    assert not any(np.asarray(mesh["vertex_texcoords"]).ctypes.data % 64 for mesh in meshes)


def test_channels_of_the_metallic_roughness_texture(build, look, parts, texels):
    texture = Texture(Image("t", texels), srgb=False, filter="nearest")
    material = Material(metallic=0.5, roughness=0.8, metallic_roughness_texture=texture)
    built = build(parts.describe([parts.square()], [material]))
    x, y = np.meshgrid((np.arange(4) + 0.5) / 2 - 1, 1 - (np.arange(3) + 0.5) / 1.5)
    np.testing.assert_allclose(look.scalar(built, "roughness", x, y), texels[..., 1].ravel() / 255 * 0.8, atol=1e-6)
    np.testing.assert_allclose(look.scalar(built, "metallic", x, y), texels[..., 2].ravel() / 255 * 0.5, atol=1e-6)


def test_grey_picture_serves_all_channels(build, look, parts, texels):
    texture = Texture(Image("t", texels[..., :1]), srgb=False, filter="nearest")
    material = Material(base_color_texture=texture, metallic_roughness_texture=texture, metallic=1.0)
    built = build(parts.describe([parts.square()], [material]))
    x, y = np.meshgrid((np.arange(4) + 0.5) / 2 - 1, 1 - (np.arange(3) + 0.5) / 1.5)
    grey = texels[..., 0].ravel() / 255
    np.testing.assert_allclose(look.attribute(built, "base_color", x, y), np.repeat(grey[:, None], 3, 1), atol=1e-6)
    np.testing.assert_allclose(look.scalar(built, "metallic", x, y), grey, atol=1e-6)


@pytest.mark.parametrize("shape", [(1, 1), (1, 5), (5, 1)])
def test_pictures_one_texel_wide(build, look, parts, shape):
    texels = np.random.default_rng(3).integers(0, 256, (*shape, 3), dtype=np.uint8)
    texture = Texture(Image("t", texels), srgb=False, wrap_u="clamp", wrap_v="mirror")
    built = build(parts.describe([parts.square()], [glowing(texture)]))
    x, y = np.meshgrid(np.linspace(-0.99, 0.98, 31), np.linspace(-0.985, 0.99, 33))
    expected = sampled(texels / 255, (x + 1) / 2, (1 - y) / 2, "clamp", "mirror", "linear").reshape(-1, 3)
    np.testing.assert_allclose(look.emitted(built, x, y), expected, atol=2e-5)


def test_second_set_of_coordinates(build, look, parts, texels):
    base = Texture(Image("a", texels), srgb=False, filter="nearest")
    other = Texture(Image("b", texels), srgb=False, filter="nearest", uv_set=1)
    upright = parts.square().uvs[0]
    mesh = parts.square(uvs=(upright, upright[:, ::-1].copy()))  # the second set swaps u and v
    material = Material(base_color_texture=base, metallic_roughness_texture=other, metallic=1.0)
    built = build(parts.describe([mesh], [material]))
    x, y = np.meshgrid(np.linspace(-0.97, 0.98, 13), np.linspace(-0.98, 0.97, 11))
    u, v = (x + 1) / 2, (1 - y) / 2
    first = sampled(texels / 255, u, v, "repeat", "repeat", "nearest").reshape(-1, 3)
    second = sampled(texels / 255, v, u, "repeat", "repeat", "nearest").reshape(-1, 3)
    np.testing.assert_allclose(look.attribute(built, "base_color", x, y), first, atol=1e-6)
    np.testing.assert_allclose(look.scalar(built, "metallic", x, y), second[:, 2], atol=1e-6)


def test_mesh_without_coordinates_takes_the_first_texel_and_says_so(build, look, parts, texels):
    texture = Texture(Image("t", texels), srgb=False, filter="nearest")
    material = Material("wood", base_color_texture=texture)
    built = build(parts.describe([parts.square(uvs=())], [material]))
    seen = look.attribute(built, "base_color", [0.3, -0.6], [0.1, 0.7])
    np.testing.assert_allclose(seen, np.tile(texels[0, 0] / 255, (2, 1)), atol=1e-6)
    assert len(built.notes) == 1
    assert "'wood'" in built.notes[0]


def test_channels_of_a_picture_are_looked_up_together(engine, texels):
    import mitsuba as mi

    from lippmann.device.pbr.textures import Place, TextureStore

    class Counted:
        def __init__(self, texture):
            self.texture, self.lookups = texture, 0

        def eval(self, uv, active):
            self.lookups += 1
            return self.texture.eval(uv, active)

    turned = Texture(Image("t", texels), srgb=False, uv_transform=((0, 1, 0), (1, 0, 0), (0, 0, 1)))
    store = TextureStore()
    signals = [store.channel([turned], channel, np.array([factor]), {}) for channel, factor in ((1, 1.0), (2, 0.5))]
    counted = Counted(signals[0].lookup.texture)
    for signal in signals:
        assert signal.lookup.texture is counted.texture
        signal.lookup.texture = counted
    si = mi.SurfaceInteraction3f()
    si.uv = mi.Point2f(0.5 / 3, 0.5 / 4)  # of the transposed picture
    place = Place(si, mi.Bool(True))
    values = [signal.eval(place)[0] for signal in signals]
    row = texels[[0, -1], 0].astype(float) / 255  # the first row of v may be either
    assert min(np.abs(values - expected[1:] * (1.0, 0.5)).max() for expected in row) < 1e-6
    assert counted.lookups == 1


@pytest.mark.parametrize(("srgb", "kind"), [(True, np.uint8), (False, np.uint8), (False, np.float32)])
def test_upload_runs_no_kernel_over_the_texels(engine, srgb, kind):
    import drjit as dr

    from lippmann.device.pbr.textures import TextureStore

    texels = np.random.default_rng(1).integers(0, 256, (40, 50, 3)).astype(np.uint8)
    picture = texels if kind == np.uint8 else texels.astype(np.float32) / 255
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
        dr.kernel_history_clear()
        signal = TextureStore().color([Texture(Image("t", picture), srgb=srgb)], np.ones((1, 3)), {})
        dr.eval(signal.lookup.texture)
        sizes = [kernel["size"] for kernel in dr.kernel_history() if kernel["type"] == dr.KernelType.JIT]
    assert max(sizes, default=0) < texels.size // 3


def test_one_row_of_texels_is_the_same_at_every_height(engine):
    import mitsuba as mi

    from lippmann.device.pbr.textures import Place, TextureStore

    texels = np.array([[[10, 20, 30], [40, 50, 60], [70, 80, 90]]], np.uint8)
    signal = TextureStore().color([Texture(Image("t", texels), srgb=False)], np.ones((1, 3)), {})
    si = mi.SurfaceInteraction3f()
    si.uv = mi.Point2f(0.5, mi.Float(0.1, 0.5, 0.9, 1.7))
    np.testing.assert_allclose(np.array(signal.eval(Place(si, mi.Bool(True)))), [[c / 255] * 4 for c in (40, 50, 60)])


def test_picture_is_uploaded_once(engine, texels):
    from lippmann.device.pbr.materials import Variant, make_finishes
    from lippmann.device.pbr.textures import TextureStore

    image = Image("t", texels)
    materials = [
        Material(base_color=(0.5, shade, 0.5), base_color_texture=Texture(image, srgb=True), metallic=metallic)
        for shade in (0.1, 0.2, 0.3)
        for metallic in (0.0, 0.5)
    ]
    store = TextureStore()
    make_finishes(materials, [Variant(number) for number in range(len(materials))], store)
    assert len(store._bitmaps) + len(store._pooled) == 1


@pytest.mark.slow
@pytest.mark.parametrize("filtering", ["nearest", "linear"])
@pytest.mark.parametrize(("wrap_u", "wrap_v"), [("repeat", "mirror"), ("clamp", "repeat"), ("mirror", "clamp")])
@pytest.mark.parametrize("srgb", [False, True])
def test_pictures_of_many_materials(build, look, parts, wrap_u, wrap_v, filtering, srgb):
    """Materials that differ in their pictures share one shape and one plugin, and each shows its own."""
    rng = np.random.default_rng(12)
    count = 12
    sizes = [(1, 2), (2, 1), (2, 2), (1, 5), (5, 1), *((rng.integers(2, 6), rng.integers(2, 6)) for _ in range(7))]
    pictures = [rng.integers(0, 256, (*size, 3), dtype=np.uint8) for size in sizes]
    turns = [np.array([[1.0, 0.3 * n, 0.1 * n], [-0.2, 1.0, 0.05 * n], [0, 0, 1]]) for n in range(count)]
    factors = rng.random((count, 3))
    materials = [
        Material(
            base_color=tuple(factor),
            base_color_texture=Texture(Image("p", picture), srgb, wrap_u, wrap_v, filtering, turn),
        )
        for picture, turn, factor in zip(pictures, turns, factors, strict=True)
    ]
    uvs = (np.array([(-1, 2), (2, 2), (2, -1), (-1, -1)], np.float32),)
    meshes = [parts.square(number, half=0.5, uvs=uvs) for number in range(count)]
    instances = [Instance(number, parts.shift(float(number))) for number in range(count)]
    built = build(parts.describe(meshes, materials, instances=instances))
    assert len(built.mitsuba.shapes()) == 1
    x, y = rng.uniform(-0.49, 0.49, (2, 1, 900))
    for number in range(count):
        u, v, _ = np.einsum("ij,jkl->ikl", turns[number], np.stack([x * 3 + 0.5, 0.5 - y * 3, np.ones_like(x)]))
        texels = decoded(pictures[number]) if srgb else pictures[number] / 255
        expected = sampled(texels, u, v, wrap_u, wrap_v, filtering).reshape(-1, 3) * factors[number]
        seen = look.attribute(built, "base_color", x + number, y)
        wrong = np.abs(seen - expected).max(1) > 2e-4
        assert wrong.mean() < (0.01 if filtering == "nearest" else 1e-9)  # on borders of texels, rounding decides


@pytest.mark.slow
def test_channels_of_many_materials(build, look, parts):
    rng = np.random.default_rng(13)
    pictures = [rng.integers(0, 256, (3, 4, 4), dtype=np.uint8) for _ in range(9)]
    materials = [
        Material(
            metallic=1.0,
            base_color_texture=Texture(Image("c", picture), srgb=True, filter="nearest"),
            metallic_roughness_texture=Texture(Image("m", picture[..., :3].copy()), srgb=False, filter="nearest"),
            alpha_mode="blend",
        )
        for picture in pictures
    ]
    instances = [Instance(number, parts.shift(2.0 * number)) for number in range(9)]
    built = build(parts.describe([parts.square(n) for n in range(9)], materials, instances=instances))
    assert len(built.mitsuba.shapes()) == 1
    x, y = np.meshgrid((np.arange(4) + 0.5) / 2 - 1, 1 - (np.arange(3) + 0.5) / 1.5)
    for number, picture in enumerate(pictures):
        part = picture.reshape(-1, 4) / 255
        at = x + 2 * number
        np.testing.assert_allclose(look.scalar(built, "roughness", at, y), part[:, 1], atol=1e-6)
        np.testing.assert_allclose(look.scalar(built, "metallic", at, y), part[:, 2], atol=1e-6)
        np.testing.assert_allclose(look.opacity(built, at, y), part[:, 3], atol=1e-6)


def test_even_picture_counts_as_a_number(engine):
    from lippmann.device.pbr.textures import TextureStore

    even = Texture(Image("t", np.full((8, 8, 4), 128, np.uint8)), srgb=True)
    store = TextureStore()
    np.testing.assert_allclose(store.constant(even, (0, 1, 2)), decoded([128] * 3), atol=1e-12)
    np.testing.assert_allclose(store.constant(even, (3,)), [128 / 255], atol=1e-12)  # alpha is linear
    assert not store._bitmaps
    assert not store._pooled
