"""The surface plugin against glTF's formulas, written down a second time in NumPy, and against itself."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.scene.values.description import Environment, Image, Light, Material, Texture

F0 = 0.04


def weight(cosine):
    return np.clip(1 - cosine, 0, 1) ** 5


def ggx(wi, wo, alpha):
    """D V cos_o and the half vector."""
    h = wi + wo
    h = h / np.linalg.norm(h, axis=-1, keepdims=True)
    a2 = alpha**2
    density = a2 / (np.pi * ((a2 - 1) * h[..., 2] ** 2 + 1) ** 2)
    root_i, root_o = (np.sqrt(a2 + (1 - a2) * w[..., 2] ** 2) for w in (wi, wo))
    visibility = 0.5 / (wo[..., 2] * root_i + wi[..., 2] * root_o)
    return density * visibility * wo[..., 2], (wi * h).sum(-1)


def reflected_share(f0, wi, roughness, steps=48):
    """What a GGX lobe with Schlick's Fresnel factor sends back of the light from ``wi`` ``(n, 3)``: ``(n, 3)``.

    Summed over microfacets drawn by D (Walter et al. 2007, eq. 35), evenly in both numbers.
    """
    alpha = roughness**2
    u, v = np.meshgrid(*[(np.arange(steps) + 0.5) / steps] * 2)
    z = 1 / np.sqrt(1 + alpha**2 * u / (1 - u))
    r = np.sqrt(1 - z**2)
    h = np.stack([r * np.cos(2 * np.pi * v), r * np.sin(2 * np.pi * v), z], -1).reshape(1, -1, 3)
    cosine = (wi[:, None] * h).sum(-1)
    wo = 2 * cosine[..., None] * h - wi[:, None]
    masking = 1.0
    for w in (np.broadcast_to(wi[:, None], wo.shape), wo):
        masking = masking + (np.sqrt(1 + alpha**2 * (1 / w[..., 2] ** 2 - 1)) - 1) / 2
    weight_of = np.where((cosine > 0) & (wo[..., 2] > 0), cosine / (masking * wi[:, None, 2] * h[..., 2]), 0)
    s = weight(cosine)[..., None]
    return (weight_of[..., None] * (f0 * (1 - s) + s)).mean(1)


def reference(m, wi, wo):
    """glTF's material for directions ``(n, 3)`` above an opaque surface, times cosine, ``(n, 3)``.

    What is scattered below the interface is what the interface does not reflect, as a whole.
    """
    gloss, cosine = ggx(wi, wo, m.roughness**2)
    base = np.array(m.base_color)
    s = weight(cosine)[:, None]
    f0 = np.minimum(((m.ior - 1) / (m.ior + 1)) ** 2 * np.array(m.specular_color), 1)
    dielectric = (f0 + (1 - f0) * s) * m.specular
    below = 1 - reflected_share(f0, wi, m.roughness).max(1, keepdims=True) * m.specular
    plastic = dielectric * gloss[:, None] + below * base * (1 - m.transmission) * wo[:, 2:] / np.pi
    metal = (base + (1 - base) * s) * gloss[:, None]
    body = plastic * (1 - m.metallic) + metal * m.metallic
    coat, _ = ggx(wi, wo, m.clearcoat_roughness**2)
    share = m.clearcoat * (F0 + (1 - F0) * weight(wi[:, 2]))[:, None]
    return body * (1 - share) + coat[:, None] * share


def through_sheet(m, wi, wo):
    """What a thin sheet lets through to ``wo``, below it."""
    mirrored = wo * [1, 1, -1]
    gloss, cosine = ggx(wi, mirrored, m.roughness**2)
    f0 = ((m.ior - 1) / (m.ior + 1)) ** 2
    fresnel = (f0 + (1 - f0) * weight(cosine)) * m.specular
    share = (1 - m.metallic) * m.transmission * (1 - fresnel) * gloss
    return share[:, None] * np.array(m.base_color)


def directions(count, seed, *, below=False):
    rng = np.random.default_rng(seed)
    z = rng.uniform(0.05, 1, count)
    phi = rng.uniform(0, 2 * np.pi, count)
    r = np.sqrt(1 - z**2)
    return np.column_stack([r * np.cos(phi), r * np.sin(phi), -z if below else z])


def vectors(array):
    import mitsuba as mi

    from lippmann.device.kernel_ops import upload

    return mi.Vector3f(*(upload(column) for column in array.T))


def bsdf_of(build, parts, material, *, exact=False):
    """The plugin of a material; ``exact`` leaves out light that is reflected more than once between microfacets."""
    scene = build(parts.describe([parts.square()], [material], multiple_scattering=not exact))
    return scene.mitsuba.shapes()[0].bsdf()


def evaluate(bsdf, wi, wo):
    """``(values, densities)`` for directions in the local frame."""
    import drjit as dr
    import mitsuba as mi

    si = dr.zeros(mi.SurfaceInteraction3f, len(wo))
    si.wi = vectors(np.broadcast_to(wi, wo.shape))
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, vectors(wo))
    dr.eval(value, pdf)  # by one kernel
    return np.array(value).T, np.array(pdf)


def draw(bsdf, wi, count, seed=0, *, asked=0):
    """``(directions, weights, densities, kinds)`` of many draws for one incident direction.

    ``asked``: bits of the context's types beside those of Mitsuba.
    """
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.kernel_ops import upload

    rng = np.random.default_rng(seed)
    u = [upload(rng.random(count, dtype=np.float32)) for _ in range(3)]
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = dr.opaque(mi.Vector3f, [float(x) for x in wi])  # no literal: directions share a kernel
    context = mi.BSDFContext()
    context.type_mask |= asked
    bs, factor = bsdf.sample(context, si, u[0], mi.Point2f(u[1], u[2]))
    dr.eval(bs, factor)  # by one kernel
    return np.array(bs.wo).T, np.array(factor).T, np.array(bs.pdf), np.array(bs.sampled_type)


def at(cosine):
    """A direction of that cosine, above or below the surface."""
    sine = np.sqrt(1 - cosine**2)
    return np.array([0.6 * sine, 0.8 * sine, cosine])


unit = st.floats(0, 1)


@pytest.mark.slow
@given(
    base=st.tuples(unit, unit, unit),
    metallic=unit,
    roughness=st.floats(0.1, 1),
    ior=st.floats(1, 2.5),
    specular=unit,
    tint=st.tuples(unit, unit, unit),
    clearcoat=unit,
    coat_roughness=st.floats(0.1, 1),
    transmission=st.sampled_from([0.0, 0.7]),
)
@settings(deadline=None, max_examples=25)
def test_formula(build, parts, base, metallic, roughness, ior, specular, tint, clearcoat, coat_roughness, transmission):
    material = Material(
        base_color=base,
        metallic=metallic,
        roughness=roughness,
        ior=ior,
        specular=specular,
        specular_color=tint,
        clearcoat=clearcoat,
        clearcoat_roughness=coat_roughness,
        transmission=transmission,
    )
    bsdf = bsdf_of(build, parts, material, exact=True)
    wi, wo, down = directions(60, 1), directions(60, 2), directions(60, 3, below=True)
    mirror = [1, 1, -1]
    values, _ = evaluate(bsdf, np.concatenate([wi, wi * mirror, wi]), np.concatenate([wo, wo * mirror, down]))
    value, behind, below = np.split(values, 3)
    expected = reference(material, wi, wo)
    np.testing.assert_allclose(value, expected, rtol=2e-3, atol=1e-3)
    # From behind, an opaque or thin surface looks the same.
    np.testing.assert_allclose(behind, value, rtol=1e-5, atol=1e-6)
    share = clearcoat * (F0 + (1 - F0) * weight(wi[:, 2]))[:, None]
    through = Material(base_color=base, metallic=metallic, roughness=roughness, ior=ior, transmission=transmission)
    if specular == 1 and tint == (1, 1, 1):
        np.testing.assert_allclose(below, through_sheet(through, wi, down) * (1 - share), rtol=2e-4, atol=2e-5)
    elif transmission == 0:
        assert not below.any()


def test_light_through_a_frosted_sheet(build, parts):
    material = Material(base_color=(0.9, 0.5, 0.2), transmission=0.7, roughness=0.4, metallic=0.2, ior=1.4)
    wi, wo = directions(400, 4), directions(400, 5, below=True)
    value, _ = evaluate(bsdf_of(build, parts, material, exact=True), wi, wo)
    np.testing.assert_allclose(value, through_sheet(material, wi, wo), rtol=2e-4, atol=2e-6)


@pytest.mark.slow
@pytest.mark.parametrize("cosine", [0.9, 0.35, -0.8, -0.3])
@pytest.mark.parametrize("ior", [1.5, 1.2])
def test_frosted_glass_refracts_as_mitsubas_does(build, parts, cosine, ior):
    import mitsuba as mi

    material = Material(base_color=(1, 1, 1), transmission=1.0, thickness=1.0, roughness=0.5, ior=ior)
    plain = mi.load_dict(
        {"type": "roughdielectric", "distribution": "ggx", "alpha": 0.25, "int_ior": ior, "ext_ior": 1.0}
    )
    wo = directions(400, 6, below=cosine > 0)
    ours, _ = evaluate(bsdf_of(build, parts, material, exact=True), at(cosine), wo)
    theirs, _ = evaluate(plain, at(cosine), wo)
    assert theirs.max() > 0.01
    np.testing.assert_allclose(ours, theirs, rtol=2e-3, atol=1e-5)


def normal_texture(normal, **rest):
    """A map of one normal all over."""
    code = (np.asarray(normal, np.float32) / np.linalg.norm(normal) + 1) / 2
    return Texture(Image("n", np.tile(code.astype(np.float32), (2, 2, 1))), srgb=False, **rest)


CASES = {
    "plastic": Material(base_color=(0.8, 0.8, 0.8), roughness=0.5),
    "matte": Material(base_color=(0.8, 0.8, 0.8), specular=0.0),
    "brushed metal": Material(base_color=(0.9, 0.6, 0.2), metallic=1.0, roughness=0.4),
    "dusty metal": Material(base_color=(0.9, 0.6, 0.2), metallic=0.4, roughness=0.6),
    "polish": Material(base_color=(0.2, 0.2, 0.8), roughness=0.2),
    "frosted sheet": Material(base_color=(0.9, 0.8, 0.7), transmission=0.8, roughness=0.5),
    "frosted glass": Material(base_color=(0.9, 0.8, 0.7), transmission=1.0, thickness=1.0, roughness=0.4),
    "cloudy glass": Material(base_color=(0.9, 0.8, 0.7), transmission=0.6, thickness=1.0, roughness=0.4),
    "car paint": Material(base_color=(0.7, 0.1, 0.1), roughness=0.7, clearcoat=1.0, clearcoat_roughness=0.3),
    "cloth": Material(base_color=(0.3, 0.3, 0.3), sheen_color=(0.8, 0.7, 0.6), sheen_roughness=0.5),
    "wrapped paint": Material(
        base_color=(0.5, 0.5, 0.5),
        roughness=0.6,
        normal_texture=normal_texture((-0.5, 0.3, 0.8)),
        clearcoat=1.0,
        clearcoat_roughness=0.6,
        clearcoat_normal_texture=normal_texture((0.6, 0.4, 0.6)),
    ),
    "rippled sheet": Material(
        transmission=0.8,
        roughness=0.6,
        normal_texture=normal_texture((0.6, 0.4, 0.6)),
        clearcoat=1.0,
        clearcoat_roughness=0.5,
    ),
    "brushed along": Material(
        base_color=(0.9, 0.9, 0.9), metallic=1.0, roughness=0.4, anisotropy=0.8, anisotropy_rotation=0.5
    ),
    "brushed bumps": Material(
        base_color=(0.9, 0.9, 0.9),
        metallic=0.5,
        roughness=0.4,
        anisotropy=0.6,
        normal_texture=normal_texture((0.5, 0.3, 0.6)),
    ),
    "soap film": Material(
        base_color=(0.2, 0.2, 0.2), roughness=0.3, iridescence=1.0, iridescence_thickness_maximum=380.0
    ),
    "oiled glass": Material(
        transmission=1.0, thickness=1.0, roughness=0.5, iridescence=0.8, iridescence_thickness_maximum=500.0
    ),
    "veil": Material(base_color=(0.6, 0.6, 0.6), alpha=0.3, alpha_mode="blend"),
}


BINS = 8, 8  # of directions, in z and azimuth


def binned(vectors, values):
    """Sums of ``values`` by bins of directions."""
    edges = np.linspace(-1, 1, BINS[0] + 1), np.linspace(-np.pi, np.pi, BINS[1] + 1)
    return np.histogram2d(vectors[:, 2], np.arctan2(vectors[:, 1], vectors[:, 0]), edges, weights=values)[0]


@pytest.mark.parametrize("name", ["veil", "oiled glass"])
def test_one_call_gives_what_evaluation_and_sampling_give(build, parts, name):
    import drjit as dr
    import mitsuba as mi

    from lippmann.device.kernel_ops import upload

    bsdf, context = bsdf_of(build, parts, CASES[name]), mi.BSDFContext()
    ways = directions(64, 1)
    si = dr.zeros(mi.SurfaceInteraction3f, len(ways))
    si.wi = vectors(directions(64, 2))
    u = upload(np.linspace(0.01, 0.99, len(ways)))
    points = mi.Point2f(u, dr.sqrt(u))
    value, pdf, bs, factor = bsdf.eval_pdf_sample(context, si, vectors(ways), u, points)
    alone, factor_alone = bsdf.sample(context, si, u, points)
    together = value, pdf, bs.wo, bs.pdf, bs.sampled_type, factor
    apart = *bsdf.eval_pdf(context, si, vectors(ways)), alone.wo, alone.pdf, alone.sampled_type, factor_alone
    dr.eval(together)  # by one kernel each
    dr.eval(apart)
    for one, other in zip(together, apart, strict=True):
        np.testing.assert_allclose(np.array(one), np.array(other), rtol=1e-6)


@pytest.mark.long_cases("oiled glass-0.3")
@pytest.mark.slow
@pytest.mark.parametrize(
    "cosine", [pytest.param(0.9, marks=pytest.mark.long), 0.3, pytest.param(-0.6, marks=pytest.mark.long)]
)
@pytest.mark.parametrize("name", CASES)
def test_draws_follow_their_density_and_weigh_right(build, parts, name, cosine):
    """Share of draws per bin of directions equals the integral of the density, and of light that of the value."""
    bsdf = bsdf_of(build, parts, CASES[name])
    count, wi = 200_000, at(cosine)
    wo, factor, pdf, kinds = draw(bsdf, wi, count)
    from mitsuba import BSDFFlags

    scattered = (pdf > 0) & (kinds != int(BSDFFlags.Null))
    drawn = binned(wo[scattered], np.full(scattered.sum(), 1 / count))
    light = binned(wo[scattered], factor[scattered, 0] / count)

    steps = 48  # midpoints per bin and axis
    z = (np.arange(BINS[0] * steps) + 0.5) / (BINS[0] * steps) * 2 - 1
    phi = ((np.arange(BINS[1] * steps) + 0.5) / (BINS[1] * steps) * 2 - 1) * np.pi
    z, phi = (part.ravel() for part in np.meshgrid(z, phi, indexing="ij"))
    r = np.sqrt(1 - z**2)
    grid = np.column_stack([r * np.cos(phi), r * np.sin(phi), z])
    value, density = evaluate(bsdf, wi, grid)
    area = 4 * np.pi / len(z)
    for found, per_direction in ((drawn, density), (light, value[:, 0])):
        expected = binned(grid, per_direction * area)
        noise = 6 * np.sqrt(np.maximum(expected, 1e-4) * factor.max() / count)
        assert (np.abs(found - expected) < noise + 0.003 * expected).all()
    assert factor.max() < 4  # no draw weighs far more than it should


NARROW = {
    "glaze": Material(base_color=(0.8, 0.8, 0.8), roughness=0.1),
    "varnish": Material(base_color=(0.8, 0.3, 0.1), roughness=0.7, clearcoat=1.0, clearcoat_roughness=0.1),
    "varnish with bumps": Material(
        base_color=(0.8, 0.3, 0.1),
        roughness=0.7,
        clearcoat=0.6,
        clearcoat_roughness=0.1,
        clearcoat_normal_texture=normal_texture((0.3, 0.2, 0.9)),
    ),
    "chrome under a rough coat": Material(metallic=1.0, roughness=0.1, clearcoat=1.0, clearcoat_roughness=0.6),
    "chrome under a coat": Material(metallic=0.6, roughness=0.1, clearcoat=1.0, clearcoat_roughness=0.05),
    "cloudy sheet": Material(transmission=0.5, roughness=0.1),
    "cloudy glass": Material(transmission=0.5, thickness=1.0, roughness=0.1),
    "veil": Material(base_color=(0.6, 0.6, 0.6), roughness=0.1, alpha=0.3, alpha_mode="blend"),
}


@pytest.mark.long_cases(
    "cloudy glass-0.9", *(f"{name}--0.6" for name in NARROW if NARROW[name].transmission == 0 and "bumps" not in name)
)
@pytest.mark.parametrize("cosine", [0.9, -0.6])
@pytest.mark.parametrize("name", NARROW)
def test_narrow_lobes_first_show_the_same_light(build, parts, name, cosine):
    """The light of draws is the same by bins of directions, with narrow lobes drawn hardly ever or nearly always."""
    from mitsuba import BSDFFlags

    from lippmann.device.pbr.gltf_bsdf import SHARP_FIRST

    bsdf = bsdf_of(build, parts, NARROW[name])
    count, wi = 200_000, at(cosine)
    sums, chances, drawn = [], [], []
    for asked in (0, SHARP_FIRST):
        wo, factor, pdf, kinds = draw(bsdf, wi, count, seed=1 + asked % 7, asked=asked)
        scattered = (kinds != int(BSDFFlags.Null)) & (factor[:, 0] > 0)
        wo, light = wo[scattered], factor[scattered, 0] / count
        sums.append([binned(wo, part) for part in (light, light**2)])
        chances.append((pdf[scattered] > 2).mean())
        drawn.append((wo, pdf[scattered]))
        assert factor.max() < 25
    # The density is that of plain draws; below a thousandth float32 has nothing to say about narrow lobes.
    told = evaluate(bsdf, wi, np.concatenate([wo for wo, _ in drawn]))[1]
    for (_, pdf), density in zip(drawn, np.split(told, [len(drawn[0][1])]), strict=True):
        assert np.median(np.abs(pdf - density) / density) < 1e-4
    (plain, plain_noise), (first, first_noise) = sums
    assert (np.abs(plain - first) < 6 * np.sqrt(plain_noise + first_noise) + 1e-4).all()
    assert chances[1] > max(0.7, chances[0])


@pytest.mark.parametrize("cosine", [0.9, -0.6])
def test_samples_tell_whether_they_keep_images_sharp(build, parts, cosine):
    """Whichever lobe was sampled: half vectors within 0.05 rad of the narrow lobe's normal, and all transmission."""
    from mitsuba import BSDFFlags

    from lippmann.device.pbr.gltf_bsdf import SHARP_FIRST
    from lippmann.device.pbr.surface_lobes import SHARP_EVENT

    wi = at(cosine)
    for name, asked in (("glaze", 0), ("veil", 0), ("varnish", SHARP_FIRST), ("cloudy glass", SHARP_FIRST)):
        wo, _, _, kinds = draw(bsdf_of(build, parts, NARROW[name]), wi, 4000, seed=3, asked=asked)
        half = (wi + wo) / np.linalg.norm(wi + wo, axis=1, keepdims=True)
        angle = np.arccos(np.clip(np.abs(half[:, 2]), -1, 1))
        expected = ((wo[:, 2] * wi[2] < 0) | (angle < 0.05)) & (kinds & int(BSDFFlags.Null) == 0)
        sure = np.abs(angle - 0.05) > 1e-3
        assert 0.05 < expected.mean() < 0.99
        assert np.array_equal((kinds & SHARP_EVENT != 0)[sure], expected[sure])
    rough = draw(bsdf_of(build, parts, CASES["plastic"]), wi, 4000, seed=3)[3]
    assert not (rough & SHARP_EVENT).any()


def test_wide_lobes_are_drawn_as_ever(build, parts):
    from lippmann.device.pbr.gltf_bsdf import SHARP_FIRST

    for name in ("plastic", "car paint", "frosted glass"):
        bsdf = bsdf_of(build, parts, CASES[name])
        for plain, first in zip(*(draw(bsdf, at(0.7), 1000, asked=asked) for asked in (0, SHARP_FIRST)), strict=True):
            assert np.array_equal(plain, first)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in CASES if "glass" not in name])
@pytest.mark.parametrize("cosine", [1.0, pytest.param(0.5, marks=pytest.mark.long)])
def test_no_surface_makes_light(build, parts, name, cosine):
    """Glass is left out: radiance grows by the square of the refractive index on entering it."""
    _, factor, _, _ = draw(bsdf_of(build, parts, CASES[name]), at(cosine), 200_000)
    assert (factor.mean(0) < 1.002).all()


def test_white_matte_surface_loses_nothing(build, parts):
    white = Material(base_color=(1, 1, 1), specular=0.0)
    for cosine in (1.0, 0.5, 0.01, -0.3):
        _, factor, _, _ = draw(bsdf_of(build, parts, white), at(cosine), 10_000)
        np.testing.assert_allclose(factor, 1, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("roughness", [0.05, 0.2, 0.5, 1.0])
@pytest.mark.parametrize("cosine", [1.0, 0.6, 0.2, 0.05])
def test_white_plastic_neither_makes_nor_loses_light(build, parts, roughness, cosine):
    bsdf = bsdf_of(build, parts, Material(base_color=(1, 1, 1), roughness=roughness))
    _, factor, _, _ = draw(bsdf, at(cosine), 50_000)
    assert factor.mean() == pytest.approx(1, abs=0.01)


def test_white_furnace(build, look, parts):
    """A matte white body in even light cannot be seen."""
    white = Material(base_color=(1, 1, 1), specular=0.0)
    even = Environment(np.ones((2, 4, 3), np.float32))
    ball = replace(parts.ball(steps=12), normals=None)  # smooth normals of a coarse body would not conserve light
    built = build(parts.describe([ball], [white], environment=even))
    picture = look.picture(built, size=16, samples=400, depth=20, half=1.2)
    np.testing.assert_allclose(picture.mean(), 1, atol=2e-3)
    np.testing.assert_allclose(picture, 1, atol=0.1)


def charlie(wi, wo, alpha):
    """Sheen lobe of white cloth, times cosine."""
    h = wi + wo
    h = h / np.linalg.norm(h, axis=-1, keepdims=True)
    density = (2 + 1 / alpha) * (1 - h[..., 2] ** 2) ** (0.5 / alpha) / (2 * np.pi)

    def masking(cosine):
        t = (1 - alpha) ** 2
        a, b, c, d, e = (
            rough + t * (smooth - rough)
            for rough, smooth in [
                (21.5473, 25.3245),
                (3.82987, 3.32435),
                (0.19823, 0.16801),
                (-1.97760, -1.27393),
                (-4.32054, -4.85967),
            ]
        )

        def curve(x):
            return a / (1 + b * x**c) + d * x + e

        low, high = np.exp(curve(np.minimum(cosine, 0.5))), np.exp(2 * curve(0.5) - curve(np.minimum(1 - cosine, 0.5)))
        return np.where(cosine < 0.5, low, high)

    return density / ((1 + masking(wi[..., 2]) + masking(wo[..., 2])) * 4 * wi[..., 2])


@pytest.mark.slow
def test_sheen_formula(build, parts):
    """Cloth adds its lobe and dims what it covers by its own albedo, integrated here over the hemisphere."""
    tint = np.array([0.8, 0.6, 0.4])
    cloth = Material(base_color=(0.5, 0.5, 0.5), specular=0.0, sheen_color=tuple(tint), sheen_roughness=0.6)
    wi, wo = directions(60, 8), directions(60, 9)
    z, phi = np.meshgrid((np.arange(200) + 0.5) / 200, (np.arange(100) + 0.5) / 100 * 2 * np.pi, indexing="ij")
    r = np.sqrt(1 - z**2)
    sky = np.stack([r * np.cos(phi), r * np.sin(phi), z], -1).reshape(-1, 3)

    def albedo(ways):
        return np.array([charlie(way[None], sky, 0.36).sum() for way in ways]) * 2 * np.pi / len(sky)

    hidden = tint.max() * np.maximum(albedo(wi), albedo(wo))
    expected = (0.5 / np.pi * wo[:, 2] * (1 - hidden))[:, None] + charlie(wi, wo, 0.36)[:, None] * tint
    value, _ = evaluate(bsdf_of(build, parts, cloth, exact=True), wi, wo)
    np.testing.assert_allclose(value, expected, rtol=0.02, atol=1e-3)


@pytest.mark.slow
def test_albedo_table_matches_the_integral(engine):
    from lippmann.device.pbr.microfacet import sheen_albedo_table

    coarse, fine = sheen_albedo_table(16), sheen_albedo_table(16, steps=(256, 256))
    np.testing.assert_allclose(coarse[3:], fine[3:], atol=0.01)  # rows below have roughness under 0.2


@pytest.mark.parametrize("roughness", [0.0, 0.3])
def test_absorbing_colours_stay_finite(build, parts, roughness):
    """Black, without any reflection: nothing to draw, and no division by it."""
    black = Material(base_color=(0, 0, 0), specular=0.0, roughness=roughness)
    _, factor, pdf, _ = draw(bsdf_of(build, parts, black), at(0.5), 1000)
    assert np.isfinite(factor).all()
    assert np.isfinite(pdf).all()
    assert not factor.any()


# ---- normal maps ----


TILT = np.array([0.3, 0.5, 0.8]) / np.linalg.norm([0.3, 0.5, 0.8])
UPRIGHT = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float32)


@pytest.mark.parametrize(
    ("uv", "expected"),
    [
        (UPRIGHT, TILT),
        (UPRIGHT * [-1, 1] + [1, 0], TILT * [-1, 1, 1]),  # mirrored left to right
        (UPRIGHT * [1, -1] + [0, 1], TILT * [1, -1, 1]),  # upside down
        (UPRIGHT[[1, 2, 3, 0]], TILT[[1, 0, 2]] * [1, -1, 1]),  # a quarter turn to the right
    ],
)
def test_normal_map_follows_the_picture(build, look, parts, uv, expected):
    """x of the map points right in the picture, y up, wherever the picture lies on the surface."""
    mesh = parts.square(uvs=(uv.astype(np.float32),))
    built = build(parts.describe([mesh], [Material(normal_texture=normal_texture(TILT))]))
    seen = look.attribute(built, "normal", [0.2, -0.5], [0.4, -0.3])
    np.testing.assert_allclose(seen, [expected] * 2, atol=1e-5)


@pytest.mark.parametrize("normal", [(0.0, 0.0, -0.4), (0.3, 0.2, -0.2)])
def test_normals_of_a_map_never_point_into_the_surface(build, look, parts, normal):
    """Ringing of a compressed map leaves such texels; light was NaN there."""
    material = Material(base_color=(0.5, 0.5, 0.5), roughness=0.1, normal_texture=normal_texture(normal))
    built = build(parts.describe([parts.square()], [material]))
    seen = look.attribute(built, "normal", [0.1, -0.4], [0.1, 0.3])
    assert (seen[:, 2] > 0).all()
    assert np.isfinite(look.picture(built, size=4, samples=16, depth=2)).all()


def test_normal_scale(build, look, parts):
    material = Material(normal_texture=normal_texture(TILT), normal_scale=0.5)
    expected = TILT * [0.5, 0.5, 1]
    built = build(parts.describe([parts.square()], [material]))
    seen = look.attribute(built, "normal", 0.1, 0.1)
    np.testing.assert_allclose(seen, [expected / np.linalg.norm(expected)], atol=1e-5)


def test_bump_seen_from_behind_is_a_dent(build, look, parts):
    built = build(parts.describe([parts.square()], [Material(normal_texture=normal_texture(TILT))]))
    seen = look.attribute(built, "normal", 0.1, 0.1, z=-5.0, toward=1.0)
    np.testing.assert_allclose(seen, [-TILT], atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("rotation", [0.0, 0.5, np.pi / 2])
def test_brushed_metal_spreads_light_along_its_direction(build, look, parts, rotation):
    """Its direction is told by the texture coordinates, which all triangles of a mesh carry without any texture."""
    metal = Material(base_color=(1, 1, 1), metallic=1.0, roughness=0.2, anisotropy=1.0, anisotropy_rotation=rotation)
    built = build(parts.describe([parts.square()], [metal]))
    import mitsuba as mi

    x, y = np.meshgrid(np.linspace(-0.9, 0.9, 7), np.linspace(-0.85, 0.95, 7))
    si = look.hit(built, x.ravel(), y.ravel())
    along, across = (
        np.array([np.sin(0.6) * np.cos(angle), np.sin(0.6) * np.sin(angle), np.cos(0.6)])
        for angle in (rotation, rotation + np.pi / 2)
    )
    bright, dark = (
        np.array(si.bsdf().eval(mi.BSDFContext(), si, si.to_local(mi.Vector3f(*map(float, wo)))))[0]
        for wo in (along, across)
    )
    np.testing.assert_allclose(bright, bright[0], rtol=1e-3)
    assert (bright > 50 * dark).all()


def test_mapped_normal_shades_as_a_turned_surface(build, look, parts):
    """A matte surface under a normal map is as bright as its mapped normal says."""
    toward = np.array([0.4, -0.2, 0.9]) / np.linalg.norm([0.4, -0.2, 0.9])
    frame = np.eye(4)
    frame[:3, 2] = toward  # it shines along -z of its frame
    sun = Light("directional", (2.0, 2.0, 2.0), frame)
    material = Material(base_color=(0.5, 0.5, 0.5), specular=0.0, normal_texture=normal_texture(TILT))
    built = build(parts.describe([parts.square()], [material], lights=[sun]))
    picture = look.picture(built, size=4, samples=4, depth=2)
    np.testing.assert_allclose(picture, 0.5 / np.pi * 2.0 * (toward @ TILT), rtol=1e-3)


def test_coat_has_a_normal_map_of_its_own(build, parts):
    """With it the coat alone turns: the lobe moves, the body stays."""
    bare = Material(base_color=(0.5, 0.5, 0.5), specular=0.0, clearcoat=1.0, clearcoat_roughness=0.2)
    tilted = replace(bare, clearcoat_normal_texture=normal_texture((0.2, 0, 1)))
    body = Material(base_color=(0.5, 0.5, 0.5), specular=0.0)
    wi = np.array([0.0, 0.0, 1.0])
    mirror = np.array([2 * 0.2, 0, 1 - 0.04]) / 1.04  # wi mirrored about the tilted normal
    ways = np.array([wi, mirror])
    plain = evaluate(bsdf_of(build, parts, bare), wi, ways)[0][:, 0]
    mapped = evaluate(bsdf_of(build, parts, tilted), wi, ways)[0][:, 0]
    under = evaluate(bsdf_of(build, parts, body), wi, ways)[0][:, 0]
    assert plain[0] - under[0] > 0.5 > plain[1] - under[1]
    assert mapped[1] - under[1] > 0.5 > mapped[0] - under[0]


@pytest.mark.parametrize(("roughness", "root"), [(0.05, True), (0.8, False)])
def test_narrow_lobes_are_sampled_oftener_than_they_reflect(build, parts, roughness, root):
    """What they show differs most from sample to sample."""
    import mitsuba as mi

    material = Material("glaze", base_color=(0.8, 0.8, 0.8), roughness=roughness)
    wi = np.array([0.0, 0.0, 1.0])
    kinds = draw(bsdf_of(build, parts, material), wi, 20000)[3]
    chance = np.mean((kinds & int(mi.BSDFFlags.GlossyReflection)) != 0)
    gloss = float(reflected_share(F0, wi[None], roughness).max())
    share = gloss / (gloss + (1 - gloss) * 0.8)
    expected = np.sqrt(share) if root else share
    assert chance == pytest.approx(expected, rel=0.12)
