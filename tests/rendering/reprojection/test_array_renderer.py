"""Reuse under lenses of any layout, in a world of flat things."""

from __future__ import annotations

from types import FunctionType, SimpleNamespace

import numpy as np
import pytest

from lippmann.display import Display, LensArray, Panel

pytestmark = pytest.mark.usefixtures("engine")

GAP = 4.0
DISPLAYS = {
    "square": Display("q", Panel(96, 96, 1.0), LensArray("square", 8.0), GAP, aperture_distance=30.0),
    "hexagonal": Display("h", Panel(96, 96, 1.0), LensArray("hexagonal", 9.0), GAP, aperture_distance=30.0),
    "slanted": Display("t", Panel(120, 80, 1.0), LensArray("lenticular", 8.2, slant=11.0), GAP, "", 700.0, 30.0),
    "square-near-eye": Display("e", Panel(96, 90, 1.0), LensArray("square", 7.3), GAP, "", 400.0, 30.0),
}


def soft(x, y):
    """A pattern that changes little from pixel to pixel, if it is not far away."""
    waves = [0.5 + 0.3 * np.sin(x / 90 + phase) * np.cos(y / 80 - phase) for phase in (0.0, 1.0, 2.0)]
    return np.stack(waves, axis=-1)


def checks(x, y):
    return np.where(((np.floor(x / 31) + np.floor(y / 31)) % 2 == 0)[..., None], (0.9, 0.8, 0.7), (0.1, 0.2, 0.1))


def disc(x0, y0, radius):
    return lambda x, y: (x - x0) ** 2 + (y - y0) ** 2 < radius**2


def rules(careful=True, **others):
    from lippmann.rendering.reprojection.rules import Rules

    if careful:
        return Rules(True, 0.06, False, probe_rows=4, probe_stride=16, run_step=3)._replace(**others)
    return Rules(False, 0.12, False, probe_rows=8, probe_stride=32, run_step=4)._replace(**others)


def make(display, tracer, the_rules, method="lens_view", threads=1, searching=False):
    from lippmann.rendering.reprojection.default_order import DefaultOrder
    from lippmann.rendering.reprojection.point_image import PointImage
    from lippmann.runtime.row_threads import Bands

    points = PointImage.empty(display.panel.height, display.panel.width)
    renderer = DefaultOrder(display, points, tracer, Bands(threads), the_rules)
    getattr(renderer, method)()
    if searching:
        renderer.correct()
    return points


def worst(points, full):
    return float(np.abs(points.color - full.color).max())


def mean_error(points, full):
    return float(np.square(points.color - full.color).mean())


# ---- Lens-view -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", DISPLAYS)
@pytest.mark.parametrize("z", [-30.0, 24.0])
def test_a_soft_plane_is_nearly_exact(name, z, flat_tracer, sheet):
    display = DISPLAYS[name]
    tracer = flat_tracer(display, [sheet(z, soft)])
    points = make(display, tracer, rules())
    assert np.all(points.status >= 0)
    assert worst(points, tracer.full()) < 0.008
    assert points.share(0) < 0.45
    # The plane's disparity is known everywhere, whatever the way it came.
    assert np.allclose(points.disparity, GAP / z, rtol=1e-4)


@pytest.mark.parametrize("name", DISPLAYS)
def test_the_background_is_the_background(name, flat_tracer):
    display = DISPLAYS[name]
    tracer = flat_tracer(display, [], sky=(0.25, 0.5, 0.75))
    points = make(display, tracer, rules())
    assert np.allclose(points.color, (0.25, 0.5, 0.75), atol=1e-6)
    assert points.share(0) < 0.35
    assert len(np.unique(points.disparity)) == 1


@pytest.mark.parametrize("name", DISPLAYS)
def test_traced_pixels_are_traced_once_and_stay(name, flat_tracer, sheet):
    display = DISPLAYS[name]
    tracer = flat_tracer(display, [sheet(-40.0, checks), sheet(12.0, soft, disc(5, 3, 20))])
    points = make(display, tracer, rules())
    assert len(np.unique(tracer.traced)) == len(tracer.traced) == np.count_nonzero(points.status == 0)
    full = tracer.full()
    is_traced = points.status == 0
    assert np.array_equal(points.color[is_traced], full.color[is_traced])


@pytest.mark.parametrize("name", DISPLAYS)
def test_edges_and_outlines_stay_sharp(name, flat_tracer, sheet):
    display = DISPLAYS[name]
    tracer = flat_tracer(display, [sheet(-40.0, checks), sheet(12.0, soft, disc(5, 3, 20))])
    full = tracer.full()
    points = make(display, tracer, rules(), searching=True)
    wrong = np.abs(points.color - full.color).max(axis=-1) > 0.1
    assert wrong.mean() < 0.001
    assert mean_error(points, full) < 1e-4


@pytest.mark.parametrize("name", DISPLAYS)
def test_without_care_far_fewer_are_traced(name, flat_tracer, sheet):
    display = DISPLAYS[name]
    sheets = [sheet(-40.0, soft), sheet(12.0, soft, disc(5, 3, 20))]
    careful = make(display, flat_tracer(display, sheets), rules())
    tracer = flat_tracer(display, sheets)
    careless = make(display, tracer, rules(careful=False))
    assert careless.share(0) < 0.3
    assert careless.share(0) < 0.75 * careful.share(0)
    assert mean_error(careless, tracer.full()) < 3e-3


def test_a_mirror_is_traced_where_care_is_taken(flat_tracer, sheet):
    display = DISPLAYS["square"]
    mirror = sheet(-30.0, lambda x, y: 0.5 + 0.3 * np.stack([x, y, x * y], axis=-1), mirror=True)
    careful = flat_tracer(display, [mirror])
    points = make(display, careful, rules())
    full = careful.full()
    assert mean_error(points, full) < 1e-4
    careless = flat_tracer(display, [mirror])
    assert mean_error(make(display, careless, rules(careful=False)), full) > 1e-3
    assert len(careless.traced) < 0.4 * len(careful.traced)


@pytest.mark.parametrize("name", ["square", "hexagonal", "slanted"])
def test_small_things_that_no_source_has_seen_are_found(name, flat_tracer, sheet):
    """A spot right in front of the lens plane is seen by one lens, which is not a key; a wall far behind it by all."""
    display = DISPLAYS[name]
    lens = (5.0, 5.0 if name != "slanted" else 0.0)
    x, y = (float(a) for a in display.lens_center(*lens, 0.0, 0.0))
    spot = sheet(2.0, lambda x, y: np.tile((1.0, 0.0, 0.0), (len(x), 1)), disc(x, y, 1.8))
    tracer = flat_tracer(display, [sheet(-60.0, soft), spot])
    full = tracer.full()
    red = (full.color[..., 0] == 1.0) & (full.color[..., 1] == 0.0)
    assert red.sum() > 15
    points = make(display, tracer, rules(), searching=True)
    found = np.abs(points.color - full.color).max(axis=-1) < 0.1
    assert found.all()


@pytest.mark.parametrize("name", DISPLAYS)
def test_mirrors_are_not_gathered_even_if_they_look_the_same(name, flat_tracer, sheet):
    display = DISPLAYS[name]
    plain = make(display, flat_tracer(display, [sheet(-30.0, soft)]), rules())
    mirror = make(display, flat_tracer(display, [sheet(-30.0, soft, mirror=True)]), rules())
    assert mirror.share(0) > plain.share(0) + 0.05


@pytest.mark.parametrize("name", DISPLAYS)
def test_surfaces_do_not_mix(name, flat_tracer, sheet):
    display = DISPLAYS[name]
    red, blue = (
        sheet(z, lambda x, y, color=color: np.tile(color, (len(x), 1)), inside)
        for z, color, inside in ((12.0, (1.0, 0.0, 0.0), disc(5, 3, 20)), (-30.0, (0.0, 0.0, 1.0), disc(0, 0, 1e3)))
    )
    points = make(display, flat_tracer(display, [red, blue]), rules(careful=False))
    assert np.all(np.isclose(points.color, (1.0, 0.0, 0.0)).all(-1) | np.isclose(points.color, (0.0, 0.0, 1.0)).all(-1))
    is_red = points.color[..., 0] > 0.5
    assert np.allclose(points.disparity, np.where(is_red, GAP / 12, -GAP / 30), rtol=1e-4)


def test_probes_come_to_every_row_and_column():
    from lippmann.rendering.reprojection.backward_warp import scatter_shift

    for stride in range(2, 80):
        shift = scatter_shift(stride)
        columns = {row * shift % stride for row in range(stride)}
        assert columns == set(range(stride))


def test_what_memory_held_before_counts_for_nothing(flat_tracer, sheet, monkeypatch):
    """Depths that no source gives are not set; they may be no numbers."""
    from lippmann.rendering.reprojection import backward_warp as arrays

    gather = arrays.gather.py_func
    memory = SimpleNamespace(empty=lambda shape: np.full(shape, np.nan))
    gather = FunctionType(gather.__code__, {**gather.__globals__, "np": memory})
    display = DISPLAYS["slanted"]
    sheets = [sheet(-40.0, checks), sheet(12.0, soft, disc(5, 3, 20))]
    usual = make(display, flat_tracer(display, sheets), rules())
    monkeypatch.setattr(arrays, "gather", gather)
    for one, other in zip(usual, make(display, flat_tracer(display, sheets), rules()), strict=True):
        assert np.array_equal(one, other)


@pytest.mark.parametrize("name", ["hexagonal", "slanted"])
def test_threads_change_nothing(name, flat_tracer, sheet):
    display = DISPLAYS[name]
    sheets = [sheet(-40.0, checks), sheet(12.0, soft, disc(5, 3, 20))]
    pictures = [
        make(display, flat_tracer(display, sheets), rules(), searching=True, threads=threads) for threads in (1, 3)
    ]
    for one, other in zip(*pictures, strict=True):
        assert np.array_equal(one, other)


def test_a_point_behind_what_probes_have_met_is_not_taken(flat_tracer, sheet):
    """A wall seen by all lenses, but the probes of one lens have met something nearer there."""
    from lippmann.display.lens_field import LensField
    from lippmann.rendering.reprojection.backward_warp import Gathering, gather, probed_limit
    from lippmann.rendering.reprojection.epipolar_march import mark_nearest
    from lippmann.rendering.reprojection.point_image import MISSED, QUEUED, REPROJECTED, TRACED

    display = DISPLAYS["square"]
    field = LensField.of(display)
    points = flat_tracer(display, [sheet(-30.0, soft)]).full()
    wall, near = -GAP / 30, GAP / 3
    lens, count = 5 * field.columns + 5, len(field.center)
    here = field.lens == lens
    points.status[~here], points.status[here] = REPROJECTED, MISSED
    target = np.zeros(count, dtype=np.bool_)
    target[lens] = True
    source = np.full((count, 2), -1)
    source[lens] = lens - 1, lens + 1
    gathering = Gathering(target, source, 8, 3, 3)
    probes = here & ((np.arange(96) - 3 * np.arange(96)[:, None]) % 8 == 0)
    assert probes.sum() == 8
    nearest = np.zeros(here.shape, np.float32)
    mark_nearest(0, 96, points, field, ~target, nearest)
    missed = {}
    for name, seen in (("wall", [wall]), ("mixed", [wall, near]), ("near", [near])):
        points.status[here], points.status[probes] = MISSED, TRACED
        points.disparity[probes] = np.resize(seen, 8)
        gather(0, 96, points, field, gathering, rules(), nearest)
        missed[name] = np.count_nonzero(points.status[here] == QUEUED)
        middle = probed_limit(points, field, 43, 43, gathering)
        assert middle == pytest.approx(wall if name == "wall" else near)
    assert missed["wall"] < 20
    assert missed["near"] == 56
    assert missed["wall"] + 10 < missed["mixed"] <= 56


@pytest.mark.parametrize(("apart", "careful", "taken"), [(0.02, True, True), (0.3, True, False), (0.3, False, True)])
def test_care_does_not_gather_what_the_sources_dispute(apart, careful, taken, flat_tracer, sheet):
    from lippmann.display.lens_field import LensField
    from lippmann.rendering.reprojection.backward_warp import Gathering, gather
    from lippmann.rendering.reprojection.epipolar_march import mark_nearest
    from lippmann.rendering.reprojection.point_image import MISSED, QUEUED, REPROJECTED

    field = LensField.of(DISPLAYS["square"])
    points = flat_tracer(DISPLAYS["square"], [], sky=(0.2, 0.2, 0.2)).full()
    lens, count = 5 * field.columns + 5, len(field.center)
    here = field.lens == lens
    points.status[here] = MISSED
    points.color[field.lens == lens + 1] += apart
    target = np.arange(count) == lens
    source = np.where(target[:, None], (lens - 1, lens + 1), -1)
    nearest = np.zeros(here.shape, np.float32)
    mark_nearest(0, 96, points, field, ~target, nearest)
    gather(0, 96, points, field, Gathering(target, source, 8, 3, 3), rules(careful), nearest)
    both = here & np.isin(np.arange(96) % 8, np.arange(1, 7))  # the outermost are shown by one source only
    assert np.all(points.status[both] == (REPROJECTED if taken else QUEUED))
    if taken:
        assert points.color[both] == pytest.approx(0.2 + apart / 2)


@pytest.mark.parametrize(("shown", "missing"), [(-0.05, True), (-0.2, False), (0.1, False), (0.3, False)])
def test_a_traced_point_is_missing_beside_unless_something_hides_it(shown, missing, flat_tracer, sheet):
    from lippmann.display.lens_field import LensField
    from lippmann.rendering.reprojection.point_image import REPROJECTED, TRACED
    from lippmann.rendering.reprojection.search import follow_points

    field = LensField.of(DISPLAYS["square"])
    points = flat_tracer(DISPLAYS["square"], [sheet(-30.0, soft)]).full()
    points.status[:], points.disparity[:], points.color[:] = REPROJECTED, shown, 0.3
    points.status[44, 44], points.disparity[44, 44] = TRACED, -0.2
    wanted = np.zeros(points.status.shape, dtype=np.bool_)
    numbers = np.array([44 * 96 + 44], np.uint32)
    lens = int(field.lens[44, 44])
    neighbors = np.full((len(field.center), 2), -1)
    neighbors[lens] = lens + 1, lens + field.columns
    follow_points(points, field, neighbors, numbers, rules(), wanted)
    # One lens on, 8 pixels away, the point lies 8 * 0.2 pixels back, between four pixels.
    expected = {(r, c) for i in (44, 45) for k in (50, 51) for r, c in ((i, k), (k, i))} if missing else set()
    assert {(int(r), int(c)) for r, c in np.argwhere(wanted)} == expected


# ---- Interpolated ----------------------------------------------------------------------------------------------------


@pytest.mark.long_cases("slanted")
@pytest.mark.parametrize("name", DISPLAYS)
def test_only_even_micro_images_are_interpolated(name, flat_tracer, sheet):
    from lippmann.display.lens_field import LensField

    display = DISPLAYS[name]
    tracer = flat_tracer(display, [sheet(2.5, soft, disc(0, 0, 30)), sheet(-40.0, soft)])
    points = make(display, tracer, rules(careful=False), "interpolated")
    field = LensField.of(display)
    assert np.all(points.status >= 0)
    interpolated = points.status == 2
    assert interpolated.mean() > 0.02
    assert np.all(field.lens[interpolated] % field.columns % 2 == 1)


def test_the_mean_of_corresponding_pixels(flat_tracer, sheet):
    """A plane so near to the lens plane that every lens sees other points of it, one colour for each lens."""
    from lippmann.display.lens_field import LensField

    display = DISPLAYS["square"]
    values = np.linspace(0.1, 0.8, 12)

    def by_lens(x, y):
        return np.repeat(values[np.clip(np.floor(x / 8).astype(int) + 6, 0, 11)][:, None], 3, axis=1)

    tracer = flat_tracer(display, [sheet(1e-5, by_lens)])
    points = make(display, tracer, rules(careful=False, tolerance=0.001), "interpolated")
    column = LensField.of(display).lens % 12
    for i in range(1, 11, 2):
        got = points.color[(column == i) & (points.status == 2)]
        assert np.allclose(got, (values[i - 1] + values[i + 1]) / 2, atol=1e-6)
    # The last one has one neighbour.
    assert np.allclose(points.color[(column == 11) & (points.status == 2)], values[10], atol=1e-6)
    assert np.all(points.status[column % 2 == 0] != 2)
    assert (points.status[column % 2 == 1] == 2).mean() > 0.9


def test_with_care_neighbors_that_disagree_are_traced(flat_tracer, sheet):
    display = DISPLAYS["square"]

    def noise(x, y):
        return np.stack([np.modf(np.abs(np.sin(12.9 * x + 78.2 * y + k) * 437.5))[0] for k in range(3)], axis=-1)

    tracer = flat_tracer(display, [sheet(2.0, noise)])
    points = make(display, tracer, rules(), "interpolated")
    assert mean_error(points, tracer.full()) < 1e-3
