"""Live frames show what replay shows of a render, and nothing is compiled while things move."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

import lippmann
from lippmann.color.transfer import quantize
from lippmann.display import Display, LensArray, Panel, load_display
from lippmann.display.panel import PixelWindow
from lippmann.errors import SceneError, UsageError
from lippmann.options.light import LightOptions
from lippmann.options.placement import PlacementOptions
from lippmann.rendering.live import renderer as live_renderer
from lippmann.rendering.live import scene_kernels
from lippmann.rendering.live.live_view import LiveView
from lippmann.rendering.live.renderer import LiveRenderer
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.scene import Scene
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.values.splats import Splats
from lippmann.scene.values.volume import TransferFunction, Volume
from lippmann.studio_app.real_lens import RealEyeMap
from lippmann.viewing.replay import replay_points

pytestmark = pytest.mark.usefixtures("engine")

DISPLAYS = {
    "lenticular": Display("lenticular", Panel(96, 64, 0.5), LensArray("lenticular", 4.0), 3.0, "", 300.0, 20.0),
    "slanted": Display("slanted", Panel(90, 60, 0.5), LensArray("lenticular", 2.3, 12.0), 3.0, "", 400.0, 20.0),
    "square": Display("square", Panel(96, 64, 0.5), LensArray("square", 4.0), 3.0, "", float("inf"), 20.0),
    "print": load_display("print:lpi=60,ppi=360,size=8x5mm,thickness=0.6604mm,index=1.57"),
}
EYES = [(0.0, 0.0, 300.0), (25.0, -10.0, 220.0)]
SIZE = 60, 40
PLACED = PlacementOptions(place="fit", turn=(20.0, 10.0, 0.0), shift=(1.0, 0.0, -2.0))


@pytest.fixture(scope="module")
def teapot():
    return lippmann.load_scene("teapot")


@pytest.fixture
def renderers(teapot):
    """Renderers of a test alone: the kernels of another one would take in their surfaces too."""
    yield lambda name: LiveRenderer(teapot, DISPLAYS[name])
    gc.collect()  # what `refine` keeps


def refine(renderer, view):
    """One more step for a view at rest, whose steps go on as long as the view stays."""
    if getattr(renderer, "rest", (None,))[0] != view:
        renderer.rest = view, renderer.refine_steps(view)
    return next(renderer.rest[1])


def recorded(renderer):
    """How often the renderer's kernels were recorded."""
    kernels = renderer._kernels
    return sum(each.kernel._recorded.n_recordings for each in (*kernels._tracers.values(), *kernels._features.values()))


def rest_of(renderer):
    return renderer.rest[1].gi_frame.f_locals["progressive"]


def psnr(codes, others):
    error = np.mean((codes.astype(float) / 255 - others.astype(float) / 255) ** 2)
    return -10 * np.log10(max(error, 1e-12))


def render(scene, name, **options):
    return lippmann.render(
        scene, DISPLAYS[name], method="full", denoise="none", **{"placement": PLACED, "integrator": "direct"} | options
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "eye"), [("slanted", EYES[1]), ("square", EYES[0]), ("print", EYES[1])], ids=["slanted", "square", "print"]
)
def test_a_frame_is_the_replay_of_a_render(teapot, renderers, name, eye):
    tone_map = "none" if name == "slanted" else "pbr-neutral"
    request = RenderRequest(placement=PLACED, seed=5, tone_map=tone_map)
    frame = renderers(name).frame(LiveView(eye, SIZE, request=request))
    image = render(teapot, name, spp=1, seed=5, tone_map=tone_map)
    replayed = quantize(replay_points(image, eye, SIZE), 8, "srgb")
    assert replayed.std() > 20
    assert psnr(frame.pixels, replayed) > 60


@pytest.mark.slow
def test_a_frame_through_the_real_lens_is_the_optical_replay_of_a_render(teapot, renderers):
    request = RenderRequest(placement=PLACED, seed=5, tone_map="none")
    eye, size = (10.0, 0.0, 300.0), (320, 200)
    view = LiveView(eye, size, RealEyeMap, request=request)
    image = render(teapot, "print", spp=1, seed=5, tone_map="none")
    expected = quantize(image.replay(eye, size=size, optics=True), 8, "srgb")
    renderer = renderers("print")
    assert psnr(renderer.frame(view).pixels, expected) > 32
    for _ in range(20):
        rest = refine(renderer, view)
        if rest is not None and rest.is_denoised:
            break
    # The light of whole paths, without noise, of the same place.
    assert rest.is_denoised
    assert np.isfinite(renderer.pick(view, 0.5, 0.5))


@pytest.mark.slow
def test_a_rest_that_is_left_half_way_frees_its_pictures(renderers):
    """At once, not when Python looks for objects that hold each other, which may be hours later."""
    renderer = renderers("lenticular")
    view = LiveView(EYES[0], SIZE, request=RenderRequest(placement=PLACED))
    for _ in range(10):  # recording a kernel leaves such circles of its own, once
        refine(renderer, LiveView(EYES[1], SIZE, request=view.request))
    gc.collect()
    gc.disable()
    try:
        for _ in range(20):
            refine(renderer, view)
            if rest_of(renderer)._task is not None:
                break
        else:
            pytest.fail("no picture was being denoised")
        left = weakref.ref(rest_of(renderer))
        del renderer.rest
        assert left() is None
    finally:
        gc.enable()


def test_a_scene_is_freed_with_its_renderer(renderers):
    """At once, too: kernels of the next scene would take in its surfaces and emitters."""
    gc.collect()
    gc.disable()
    try:
        renderer = renderers("square")
        renderer.frame(LiveView(EYES[0], SIZE, request=RenderRequest(placement=PLACED)))
        built = weakref.ref(renderer._kernels.built)
        del renderer
        assert built() is None
    finally:
        gc.enable()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["slanted", pytest.param("square", marks=pytest.mark.long)])
def test_native_pixels_at_rest_are_those_of_a_render_with_as_many_samples(teapot, renderers, name):
    window = PixelWindow(20, 10, 30, 25)
    request = RenderRequest(placement=PLACED, integrator="path", depth=3, tone_map="pbr-neutral")
    view = LiveView(None, window=window, request=request)
    steps = renderers(name).refine_steps(view)
    frames = [next(steps) for _ in range(3)]
    del steps
    assert [frame.is_denoised for frame in frames] == [False] * 3
    assert frames[0].samples == 2 < frames[1].samples < frames[2].samples
    image = render(
        teapot, name, integrator="path", depth=3, spp=frames[2].samples, caustics="paths", tone_map="pbr-neutral"
    )
    assert psnr(frames[2].pixels, quantize(image.pixels[window.slices], 8, "srgb")) > 60


@pytest.mark.long
def test_rest_comes_near_a_long_render(teapot, renderers):
    renderer, eye = renderers("lenticular"), EYES[0]
    view = LiveView(eye, SIZE, request=RenderRequest(placement=PLACED, tone_map="pbr-neutral"))
    image = render(teapot, "lenticular", integrator="path", spp=512, caustics="paths", tone_map="pbr-neutral")
    reference = quantize(replay_points(image, eye, SIZE), 8, "srgb")
    found = {}
    while max(found, default=0) < 64:
        frame = refine(renderer, view)
        if frame is not None:
            assert frame.is_denoised
            found[frame.samples] = psnr(frame.pixels, reference)
    first, last = found[min(found)], found[max(found)]
    assert last > 35
    assert last > first + 3


@pytest.mark.slow
def test_large_pictures_get_their_samples_part_by_part(renderers, monkeypatch):
    """None is counted twice, and no picture is shown of which some parts have more than others."""
    renderer = renderers("square")
    view = LiveView(None, request=RenderRequest(placement=PLACED, seed=3))
    whole = refine(renderer, view)
    monkeypatch.setattr(scene_kernels.SceneKernels, "most_lanes", 5000)
    steps = renderer.refine_steps(view)
    frames = [next(steps) for _ in range(3)]  # 96 x 64 pixels
    assert frames[:2] == [None, None]
    assert frames[2].samples == whole.samples == 2
    assert (frames[2].pixels == whole.pixels).all()


@pytest.mark.slow
def test_neither_a_move_nor_another_display_compiles_anything(renderers):
    import drjit as dr

    renderer = renderers("square")
    views = [
        LiveView(
            (5.0 * number, 0.0, 300.0 + number),
            SIZE,
            request=RenderRequest(
                placement=PlacementOptions(
                    place="fit", turn=(number, 2.0 * number, 0.0), scale=1.0 + 0.01 * number, depth_scale=0.5
                ),
                exposure=0.1 * number,
                seed=number,
            ),
            light=LightOptions((3.0 * number, number), 1.0 + number, 2.0 + number),
        )
        for number in range(4)
    ]

    def work(view):
        renderer.frame(view)
        refine(renderer, view)
        refine(renderer, view)
        refine(renderer, view)

    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        for view in views[:2]:
            work(view)
        first = {kernel["hash"] for kernel in dr.kernel_history() if "hash" in kernel}
        recordings = recorded(renderer)
        for view in views[2:]:
            work(view)
        assert recorded(renderer) == recordings
        other = replace(renderer.display, panel=Panel(80, 72, 0.4), lens_array=LensArray("square", 3.1), gap=2.0)
        renderer.set_display(replace(other, viewing_distance=500.0))
        work(views[0])
        later = {kernel["hash"] for kernel in dr.kernel_history() if "hash" in kernel}
    assert len(later) > 1
    assert later <= first


@pytest.mark.long
def test_light_is_that_of_a_render(renderers):
    scene = lippmann.load_scene("gears")
    display = DISPLAYS["square"]
    renderer = LiveRenderer(scene, display)
    light = LightOptions((40.0, 20.0), 1.5, 0.7)
    request = RenderRequest(placement=PLACED, tone_map="pbr-neutral", exposure=0.5)
    plain = renderer.frame(LiveView(EYES[0], SIZE, request=request)).pixels
    # The weights of emitters are those of the first view.
    lit = LiveRenderer(scene, display).frame(LiveView(EYES[0], SIZE, request=request, light=light)).pixels
    renderer.frame(LiveView(EYES[0], SIZE, request=request, light=light))
    again = renderer.frame(LiveView(EYES[0], SIZE, request=request)).pixels
    image = render(replace(scene, light=light), "square", spp=1, tone_map="pbr-neutral", exposure=0.5)
    assert psnr(lit, quantize(replay_points(image, EYES[0], SIZE), 8, "srgb")) > 60
    assert psnr(plain, lit) < 35  # most of the picture is background
    assert psnr(plain, again) > 60


def test_pictures_in_turns_are_those_by_themselves(teapot, monkeypatch):
    """Of other lights, exposures and displays: what one picture sets between two steps of another is put right."""
    monkeypatch.setattr(live_renderer, "TRANSPORT", replace(live_renderer.TRANSPORT, lanes=1000))
    renderer = LiveRenderer(teapot, DISPLAYS["square"])
    request = RenderRequest(placement=PLACED, exposure=0.0)
    view = LiveView(None, request=request)
    other = LiveView(
        EYES[0],
        SIZE,
        request=replace(request, exposure=2.0, placement=replace(PLACED, turn=(70.0, 0.0, 0.0))),
        light=LightOptions((50.0, 20.0), 2.0, 0.5),
    )
    alone = renderer.frame(view).pixels
    rested = next(renderer.refine_steps(view)).pixels
    steps, number = renderer.frame_steps(view), 0
    while (frame := next(steps)) is None:
        renderer.set_display(DISPLAYS["slanted"])
        renderer.frame(other)
        number += 1
    assert number == 96 * 64 // 1000
    assert (frame.pixels == alone).all()
    renderer.set_display(DISPLAYS["square"])
    rest = renderer.refine_steps(view)
    renderer.set_display(DISPLAYS["slanted"])
    assert (next(rest).pixels == rested).all()
    renderer.frame(other)
    # Of more samples, as many as the time allows.
    assert next(rest).pixels.mean() == pytest.approx(rested.mean(), abs=4.0)


@pytest.mark.parametrize(("name", "top", "height"), [("square", 5, 22), ("slanted", 0, 60)])
def test_of_some_rows_one_is_traced_and_stands_for_all(renderers, name, top, height):
    panel, step = DISPLAYS[name].panel, 5
    window = None if height == panel.height else PixelWindow(3, top, 40, height)
    view = LiveView(None, window=window, request=RenderRequest(placement=PLACED))
    renderer = renderers(name)
    whole, coarse = (renderer.frame(each).pixels for each in (view, replace(view, row_step=step)))
    rows = np.minimum(np.arange(height) // step * step + step // 2, height - 1)
    np.testing.assert_array_equal(coarse, whole[rows])


@pytest.mark.long
def test_a_newer_view_drops_the_samples_of_the_last(renderers):
    renderer = renderers("square")
    view = LiveView(None, request=RenderRequest(placement=PLACED))
    assert refine(renderer, view).samples < refine(renderer, view).samples
    assert refine(renderer, replace(view, request=RenderRequest(placement=PLACED, seed=1))).samples == 2


@pytest.mark.long
def test_heights_are_the_depth_that_a_render_shows(teapot, renderers):
    request = RenderRequest(placement=PLACED, pixel_filter="point")
    view = LiveView(EYES[0], SIZE, request=request)
    renderer = renderers("square")
    found = renderer.heights(view)
    image = render(teapot, "square", integrator="depth", pixel_filter="point", spp=1)
    expected = replay_points(image, EYES[0], SIZE)[..., 0]
    seen = np.isfinite(found)
    assert 0.1 < seen.mean() < 0.9
    assert np.abs(found - expected)[seen].max() < 1e-2
    row, column = np.argwhere(seen)[len(np.argwhere(seen)) // 2]
    picked = renderer.pick(view, (column + 0.5) / SIZE[0], (row + 0.5) / SIZE[1])
    assert picked == pytest.approx(found[row, column])


def test_what_cannot_be_shown_is_said(renderers):
    with pytest.raises(UsageError, match="in front of the lens plane"):
        LiveView((0.0, 0.0, -1.0), SIZE)
    with pytest.raises(UsageError, match="at least 1x1"):
        LiveView(EYES[0], (0, 5))
    renderer = renderers("square")
    with pytest.raises(UsageError, match="path and direct"):
        renderer.frame(LiveView(EYES[0], SIZE, request=RenderRequest(integrator="normal")))
    with pytest.raises(UsageError, match="0 to 1"):
        renderer.pick(LiveView(EYES[0], SIZE), 2.0, 0.0)


def test_splats_and_volumes_are_refused_and_the_scene_before_stays(renderers):
    ones = np.ones((1, 3), np.float32)
    splats = Splats(ones, ones, np.float32([[0, 0, 0, 1]]), np.float32([1]), np.ones((1, 1, 3), np.float32))
    renderer = renderers("square")
    scene = renderer.scene
    with pytest.raises(SceneError, match="splats cannot be shown live"):
        renderer.set_scene(Scene("scan", SceneDescription("scan", splats=splats)))
    transfer = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.array([0.0, 0.5]))
    volume = Volume(np.zeros((2, 2, 2), np.float32), np.eye(4), transfer)
    with pytest.raises(SceneError, match="volumes cannot be shown live"):
        renderer.set_scene(Scene("ct", SceneDescription("ct", volume=volume)))
    assert renderer.scene is scene


@pytest.mark.long
def test_a_display_or_a_scene_takes_the_place_of_another(teapot):
    renderer = LiveRenderer(teapot, DISPLAYS["square"])
    view = LiveView(EYES[0], SIZE, request=RenderRequest(placement=PLACED))
    square = renderer.frame(view).pixels
    renderer.set_display(DISPLAYS["lenticular"])
    assert psnr(renderer.frame(view).pixels, square) < 40
    renderer.set_scene(lippmann.load_scene("gears"))
    renderer.set_display(DISPLAYS["square"])
    assert psnr(renderer.frame(view).pixels, square) < 30
    renderer.set_scene(teapot)
    assert (renderer.frame(view).pixels == square).all()


@pytest.mark.slow
def test_either_eye_of_a_tracked_monitor_sees_its_own_picture(teapot):
    """Though such a monitor takes no native pixels, the studio shows what each eye sees through its lenses."""
    monitor = lippmann.load_display("displayxr").resized(192, 108)
    renderer = LiveRenderer(teapot, monitor)
    request = RenderRequest(placement=replace(PLACED, depth_scale=4.0), exposure=0.0)
    left, again, right = (
        renderer.frame(LiveView((x, 0, 600), SIZE, request=request)).pixels for x in (-31.5, -25, 31.5)
    )
    assert psnr(left, again) > 40 > psnr(left, right) + 5
