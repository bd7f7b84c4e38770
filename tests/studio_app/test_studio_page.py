"""The studio's page in a real browser, before a studio whose pictures a stand-in draws."""

from __future__ import annotations

import json

import imagecodecs
import numpy as np
import pytest
from stand_in import TINY

from lippmann.display.visible_pixels import EyeMap
from lippmann.studio_app.real_lens import RealEyeMap
from lippmann.studio_app.render_jobs import Job
from lippmann.studio_app.state import StudioState

STUDIO = "window.lippmann.studio"
COMMAND = "document.querySelector('footer code').textContent"
#: Codes of the picture's pixel, read from a copy: browsers warn of reading a canvas that they draw on graphics memory.
PIXEL = """(([x, y]) => {
  const copy = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  copy.drawImage(window.lippmann.studio.page.canvas, -x, -y);
  return [...copy.getImageData(0, 0, 1, 1).data];
})"""
ALERT = "(a => a.hidden ? '' : a.textContent)(document.querySelector('.failure'))"


@pytest.fixture
def page(studio, open_tab):
    """``page(**options)``: a tab that shows the studio and its first picture."""

    def opened(**options):
        studio.session.set_state(StudioState(display=TINY))
        tab = open_tab(**{"size": (1440, 900), **options}).open(studio.address)
        tab.wait_for(f"({STUDIO}?.stage?.header?.number ?? 0) > 0 && {COMMAND} !== ''")
        return tab

    return opened


def drag(tab, by, *, touches=None):
    box = tab.page.locator("canvas").first.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    tab.page.mouse.move(x + by[0] / 2, y + by[1] / 2)
    tab.page.mouse.move(x + by[0], y + by[1])
    tab.page.mouse.up()


def state(tab):
    return tab.evaluate(f"{STUDIO}.store.state")


@pytest.mark.slow
def test_the_model_is_turned_by_hand_and_undone(page):
    tab = page()
    tab.page.keyboard.press("t")
    assert tab.evaluate("document.querySelector('.deck input:checked').value") == "orbit"
    drag(tab, (200, 0))
    yaw = state(tab)["turn"][0]
    assert yaw > 10
    # The line follows on the way, too.
    line = f"lippmann render teapot --display {TINY} --turn {yaw:g},0,0"
    tab.wait_until(lambda: tab.evaluate(COMMAND).startswith(line))
    # The picture follows: the stand-in's red is the turn.
    tab.wait_until(lambda: abs(tab.evaluate(PIXEL, [3, 3])[0] - int(yaw)) <= 4)
    tab.page.keyboard.press("Control+z")
    assert state(tab)["turn"] == [0, 0, 0]
    tab.page.keyboard.press("Control+y")
    assert state(tab)["turn"][0] == yaw
    tab.page.get_by_role("button", name="Undo").click()
    assert state(tab)["turn"] == [0, 0, 0]
    assert tab.page.get_by_role("button", name="Undo").is_disabled()
    tab.assert_clean()


@pytest.mark.long
def test_the_pointer_moves_the_eye(page):
    tab = page()
    box = tab.page.locator("canvas").first.bounding_box()
    tab.page.mouse.move(box["x"] + 0.9 * box["width"], box["y"] + box["height"] / 2)
    eye = tab.evaluate(f"{STUDIO}.stage.eye")
    assert eye["x"] > 20
    tab.wait_until(lambda: abs(tab.evaluate(PIXEL, [3, 3])[1] - int(128 + eye["x"]) % 256) <= 4)
    tab.page.keyboard.press("s")
    assert tab.page.get_by_role("button", name="Sway").get_attribute("aria-pressed") == "true"
    tab.wait_until(lambda: tab.evaluate(f"{STUDIO}.stage.eye.x") != eye["x"])
    tab.page.keyboard.press("Home")
    assert tab.evaluate(f"{STUDIO}.stage.eye.x") == 0
    assert tab.page.get_by_role("button", name="Sway").get_attribute("aria-pressed") == "false"
    tab.assert_clean()


@pytest.mark.slow
def test_keys_work_on_a_fresh_page_and_after_a_click_on_a_tool(page):
    tab = page()
    press = tab.page.keyboard.press
    press("ArrowRight")
    assert tab.evaluate(f"{STUDIO}.stage.eye.x") > 0
    press("Home")
    press("t")
    press("ArrowRight")
    turn = state(tab)["turn"][0]
    assert turn > 0
    tab.page.locator(".deck label", has_text="Move").click()
    assert tab.evaluate("document.querySelector('.deck input:checked').value") == "pan"
    press("ArrowUp")
    assert state(tab)["shift"][1] > 0
    assert tab.evaluate("document.querySelector('.deck input:checked').value") == "pan"
    press("t")
    tab.page.get_by_role("button", name="Sway").click()
    press("ArrowRight")
    assert state(tab)["turn"][0] > turn
    # Keys of controls stay theirs: a slider that has the focus takes the arrows, and the tools can be reached by them.
    before = state(tab)["turn"]
    slider = tab.page.get_by_role("slider", name="Sideways")
    slider.focus()
    press("ArrowRight")
    assert state(tab)["turn"] == before
    tab.page.locator(".deck input:checked").focus()
    press("ArrowRight")
    assert tab.evaluate("document.querySelector('.deck input:checked').value") == "pan"
    press("e")
    assert tab.evaluate("document.querySelector('.deck input:checked').value") == "eye"
    tab.assert_clean()


@pytest.mark.slow
def test_the_bar_speaks_as_people_do_and_resume_is_for_these_settings(page):
    tab = page()
    command = tab.evaluate(COMMAND)
    job = {
        "type": "job", "number": 1, "kind": "picture", "name": "teapot.png", "phase": "running", "share": 0.42,
        "stage": "Tracing light", "seconds_left": 131, "line": "", "can_resume": False, "shows": "picture",
        "command": command, "settings": command,
    }  # fmt: skip
    show = f"job => {STUDIO}.jobs.showJob(job)"
    stage, resume = tab.page.locator(".job-stage"), tab.page.get_by_role("button", name="Resume")
    told = {
        None: "Tracing light · 42 %",
        3: "a few seconds left",
        43: "about 45 seconds left",
        9000: "about 3 hours left",
    }
    for seconds, words in told.items():
        tab.evaluate(show, job | {"seconds_left": seconds})
        assert stage.inner_text().endswith(words)
    tab.evaluate(show, job)
    assert stage.inner_text() == "Tracing light · 42 % · about 2 minutes left"
    assert resume.is_hidden()
    tab.evaluate(show, job | {"phase": "cancelled"})
    assert stage.inner_text() == "Cancelled"
    assert resume.is_hidden()
    tab.evaluate(show, job | {"phase": "cancelled", "can_resume": True})
    assert resume.is_visible()
    tab.evaluate(f"{STUDIO}.store.set({{ scale: 2 }})")
    tab.wait_for(f"{COMMAND}.includes('--scale 2')")
    assert resume.is_hidden()
    tab.page.get_by_role("button", name="Undo").click()
    tab.wait_until(resume.is_visible)
    tab.assert_clean()


@pytest.mark.slow
def test_values_are_typed_and_automatic_ones_are_given_back(page):
    tab = page()
    tab.page.get_by_role("spinbutton", name="Size", exact=True).fill("2.5")
    tab.page.keyboard.press("Tab")
    tab.wait_for(f"{COMMAND}.includes('--scale 2.5')")
    auto = tab.page.locator(".automatic", has_text="Depth scale").get_by_role("checkbox")
    auto.uncheck()
    tab.wait_for(f"{COMMAND}.includes('--depth-scale')")
    auto.check()
    tab.wait_for(f"!{COMMAND}.includes('--depth-scale')")
    # The stand-in's scene reaches from -10 to 5 mm, where 8 mm are sharp on both sides.
    tab.page.get_by_role("button", name="Fit into the sharp range").click()
    tab.wait_for(f"{COMMAND}.includes('--depth-scale 0.8')")
    quality = tab.page.get_by_label("Quality of a render")
    quality.select_option("draft")
    tab.wait_for(f"{COMMAND}.includes('--effort draft')")
    quality.select_option("final")
    tab.wait_for(f"{COMMAND}.includes('--effort final')")
    quality.select_option("46")
    tab.wait_for(f"{COMMAND}.includes('--quality 46') && !{COMMAND}.includes('--effort')")
    quality.select_option("")
    # An eye-tracked monitor takes no native pixels.
    window = tab.page.get_by_role("button", name="On the display")
    assert window.is_visible()
    tab.page.get_by_label("Display", exact=True).select_option("odyssey-3d")
    tab.wait_until(lambda: tab.evaluate(COMMAND).startswith("lippmann quilt render teapot --display odyssey-3d"))
    tab.wait_until(window.is_hidden)
    # The two views meet before its middle: the left eye sees one of them.
    tab.wait_until(lambda: tab.evaluate(f"{STUDIO}.stage.eye.x") == -31.5)
    tab.page.keyboard.press("Home")
    assert tab.evaluate(f"{STUDIO}.stage.eye.x") == -31.5
    tab.wait_for(f"!{COMMAND}.includes('--quality')")
    tab.page.get_by_label("Display", exact=True).select_option("mla-square")
    tab.wait_for(f"{STUDIO}.stage.optics.lenses.layout === 'square'")
    assert "--display mla-square" in tab.wait_for(f"{COMMAND}.includes('mla-square') && {COMMAND}")
    assert "depth scale 1 shows it whole" in tab.page.locator(".warnings").inner_text()
    assert "blur" in tab.page.locator(".depth-bars .note").inner_text()
    # Of a monitor that follows the eyes nothing blurs.
    sentence = "(await import('studio/depth_bars.js')).sentence([-200, 50], [-120, 86], true)"
    said = tab.evaluate(f"async () => {sentence}")
    assert said == "Comfortable from 120 mm behind to 86 mm in front. The farthest parts strain the eyes."
    tab.assert_clean()


@pytest.mark.long
def test_a_print_and_a_monitor_are_given_another_size(page):
    tab = page(size=(1024, 768))
    width = tab.page.get_by_role("spinbutton", name="Size, width")
    assert (width.input_value(), tab.page.locator(".size .unit").inner_text()) == ("10", "mm")
    width.fill("12.5")
    tab.page.keyboard.press("Tab")
    tab.wait_for(f"{COMMAND}.includes('size=12.5x8mm')")
    tab.wait_for(f"{STUDIO}.stage.optics.panel.width === 148")
    assert tab.page.get_by_label("Display", exact=True).locator(":scope > option").count() == 1
    # A size that cannot be is one line, and what was typed stays to be put right.
    width.fill("0.001")
    tab.page.keyboard.press("Tab")
    assert "size" in tab.wait_for(ALERT)
    assert width.input_value() == "0.001"
    width.fill("")
    tab.page.keyboard.press("Tab")
    assert width.input_value() == "12.5"
    undo = tab.page.get_by_role("button", name="Undo")
    while undo.is_enabled():
        undo.click()
    tab.wait_for(f"{COMMAND}.includes('size=10x8mm')", 10)
    tab.wait_until(lambda: width.input_value() == "10")
    monitor = "monitor:size=400x300,dpi=282,pitch=45.5,slope=-6,center=0"
    tab.evaluate(f"display => {STUDIO}.store.set({{ display }})", monitor)
    tab.wait_until(lambda: width.input_value() == "400")
    tab.page.get_by_role("spinbutton", name="Size, height").fill("200")
    tab.page.keyboard.press("Tab")
    tab.wait_for(f"{COMMAND}.includes('size=400x200,dpi')")
    assert "px" in tab.page.locator(".size .unit").inner_text()
    tab.page.get_by_label("Display", exact=True).select_option("mla-square")
    tab.wait_for(f"{COMMAND}.includes('mla-square')")
    assert tab.page.locator(".size").is_hidden()
    tab.assert_clean()


@pytest.mark.long
def test_a_clicked_point_comes_into_the_lens_plane(page):
    tab = page()
    tab.page.keyboard.press("l")
    box = tab.page.locator("canvas").first.bounding_box()
    tab.page.mouse.click(box["x"] + 0.8 * box["width"], box["y"] + box["height"] / 2)
    tab.wait_for(f"{STUDIO}.store.state.shift[2] === -3")
    tab.page.mouse.click(box["x"] + 0.2 * box["width"], box["y"] + box["height"] / 2)
    assert "nothing at this place" in tab.wait_for(ALERT)
    tab.assert_clean()


@pytest.mark.long
def test_native_pixels_are_shown_one_by_one(page):
    tab = page()
    tab.page.keyboard.press("n")
    tab.wait_for(f"{STUDIO}.stage.header.width < 200 && {STUDIO}.stage.header.width === {STUDIO}.stage.view().size[0]")
    tab.wait_for(f"{STUDIO}.stage.header.samples > 1")  # until then pictures are coded with losses
    zoom = tab.evaluate(f"{STUDIO}.stage.nativeZoom")
    size = tab.evaluate(f"[{STUDIO}.page.canvas.width, {STUDIO}.stage.header.width]")
    assert size[0] == zoom * size[1]
    first = [tab.evaluate(PIXEL, [x, 0])[2] for x in (0, zoom - 1, zoom, 2 * zoom - 1)]
    assert {tuple(first[:2]), tuple(first[2:])} == {(255, 255), (0, 0)}
    tab.assert_clean()


DROP = """async (files) => {
  const data = new DataTransfer();
  for (const [name, text] of files) data.items.add(new File([text], name));
  document.dispatchEvent(new DragEvent('dragenter', { dataTransfer: data, bubbles: true }));
  document.dispatchEvent(new DragEvent('drop', { dataTransfer: data, bubbles: true }));
}"""
WEDGE = "v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\n"


@pytest.mark.slow
def test_models_are_dropped_and_bad_ones_are_one_line(page):
    tab = page()
    tab.evaluate(f"{STUDIO}.store.set({{ turn: [30, 0, 0] }})")
    tab.evaluate(DROP, [["50%25 off, Anna's.obj", WEDGE]])
    tab.wait_for(f"{COMMAND}.includes('50%25 off, Anna')")
    assert tab.evaluate("document.title").startswith("50%25 off, Anna's.obj")
    assert tab.evaluate("document.querySelector('.drop-shade').hidden")
    assert state(tab)["turn"] == [0, 0, 0]
    tab.page.keyboard.press("Control+z")
    assert (state(tab)["scene"], state(tab)["turn"]) == ("teapot", [30, 0, 0])
    tab.evaluate(DROP, [["notes.txt", "x"]])
    assert "notes.txt: this cannot be opened" in tab.wait_for(f"{ALERT}.includes('notes') && {ALERT}")
    tab.evaluate(DROP, [["mine.toml", 'scene = "teapot"\nscale = 1.75\n']])
    tab.wait_for(f"{STUDIO}.store.state.scale === 1.75")
    # A model with the material that it names, and a hidden file of the desktop's.
    tab.evaluate(DROP, [["red.mtl", "newmtl red\n"], [".DS_Store", "x"], ["two.obj", f"mtllib red.mtl\n{WEDGE}"]])
    tab.wait_for(f"{COMMAND}.includes('two.obj')")
    tab.assert_clean()


@pytest.mark.slow
def test_a_model_that_cannot_be_opened_changes_nothing_here_nor_in_other_tabs(page, open_tab, studio):
    tab = page()
    before = state(tab)
    tab.evaluate(DROP, [["bad.glb", "no model"]])
    assert "bad.glb" in tab.wait_for(ALERT)
    assert state(tab) == before
    other = open_tab(size=(1440, 900)).open(studio.address)
    for each in (other, tab):
        each.page.reload()
        each.wait_for(f"({STUDIO}?.stage?.header?.number ?? 0) > 0 && {COMMAND} !== ''")
        assert (state(each)["scene"], each.evaluate(ALERT)) == ("teapot", "")
        assert max(each.evaluate(PIXEL, [3, 3])[1:3]) > 0


@pytest.mark.long
def test_everything_has_a_name_and_is_reached_by_keys(page):
    tab = page()
    nameless = tab.evaluate(
        """[...document.querySelectorAll('button, input, select, [tabindex="0"], summary')]
        .filter((e) => e.checkVisibility() && e.type !== 'file')
        .filter((e) => !(e.getAttribute('aria-label') || e.textContent.trim() || e.labels?.length))
        .map((e) => e.outerHTML)"""
    )
    assert nameless == []
    reached = set()
    for _ in range(80):
        tab.page.keyboard.press("Tab")
        reached.add(tab.evaluate("document.activeElement.outerHTML.slice(0, 90)"))
        assert tab.evaluate(
            "document.activeElement === document.body || document.activeElement.matches(':focus-visible')"
        )
    for word in ("primary", "<canvas", "Direction of the light", "<summary", "<code", "<select"):
        assert any(word in each for each in reached), word
    tab.page.keyboard.press("Escape")
    tab.evaluate("document.activeElement.blur()")
    tab.page.keyboard.press("?")
    assert tab.page.get_by_role("dialog").is_visible()
    tab.page.keyboard.press("Escape")
    tab.assert_clean()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "options"),
    [
        ((1440, 900), {}),
        pytest.param((1024, 768), {}, marks=pytest.mark.long),
        pytest.param(
            (820, 1180), {"has_touch": True, "device_scale_factor": 2, "is_mobile": True}, marks=pytest.mark.long
        ),
    ],
    ids=["desk", "small", "tablet"],
)
def test_nothing_is_cut_off(page, size, options):
    tab = page(size=size, **options)
    cut = tab.evaluate(
        """[...document.querySelectorAll('header > *, .deck > *, .number > *, .choice > *, .automatic, .bar > button')]
        .filter((e) => e.checkVisibility()).map((e) => [e, e.getBoundingClientRect()])
        .filter(([e, r]) => r.left < -0.5 || r.right > innerWidth + 0.5 || e.scrollWidth > e.clientWidth + 1
          && !e.matches('.title, .hint, select, input, code, .status'))
        .map(([e]) => e.outerHTML.slice(0, 200))"""
    )
    assert cut == []
    picture = tab.page.locator("canvas").first.bounding_box()
    assert picture["width"] * picture["height"] > 0.15 * size[0] * size[1]
    tab.assert_clean()


@pytest.mark.long
def test_two_fingers_change_the_size(page):
    tab = page(size=(820, 1180), has_touch=True)
    before = state(tab)["scale"]
    tab.evaluate(
        """() => {
      const canvas = document.querySelector('canvas');
      canvas.setPointerCapture = () => {};
      const box = canvas.getBoundingClientRect();
      const fire = (type, id, x) => canvas.dispatchEvent(new PointerEvent(type, { pointerId: id, pointerType: 'touch',
        button: 0, clientX: box.left + x * box.width, clientY: box.top + box.height / 2, bubbles: true }));
      fire('pointerdown', 1, 0.45); fire('pointerdown', 2, 0.55);
      fire('pointermove', 1, 0.3); fire('pointermove', 2, 0.7);
      fire('pointerup', 1, 0.3); fire('pointerup', 2, 0.7);
    }"""
    )
    assert state(tab)["scale"] == pytest.approx(4 * before, rel=1e-3)
    tab.assert_clean()


@pytest.mark.long
def test_a_studio_that_died_is_said(tmp_path, open_tab):
    from stand_in import running

    with running(tmp_path) as made:
        tab = open_tab().open(made.address)
        tab.wait_for(f"({STUDIO}?.stage?.header?.number ?? 0) > 0")
    assert "still running" in tab.wait_for(ALERT)


@pytest.mark.slow
def test_the_page_is_refused_without_its_token(studio, open_tab):
    tab = open_tab().open(studio.address.replace("secret", "guess"))
    assert json.loads(tab.page.inner_text("body")) == {"error": "there is nothing here"}


def test_a_result_of_any_name_is_found(page, studio):
    """An output that is named after a model with signs that addresses have a meaning for."""
    tab = page()
    name = "50%25 off #1, what? 'ü'_qs2x1.png"
    output = studio.outputs / name
    output.write_bytes(imagecodecs.png_encode(np.full((4, 8, 3), 255, np.uint8)))
    runner = studio.session.jobs
    number = len(runner._jobs) + 1
    runner._jobs.append(Job(number, "quilt", (), output, phase="done"))
    tab.evaluate(f"job => {STUDIO}.jobs.showJob(job)", runner._jobs[-1].message())
    image = "document.querySelector('.result-frame img')?"
    tab.wait_for(f"{image}.naturalWidth === 8")
    assert tab.page.get_by_role("link", name="Download").get_attribute("download") == name
    tab.page.get_by_role("button", name="Back to the live view").click()
    runner._jobs.pop()
    tab.assert_clean()


@pytest.mark.long
def test_a_print_is_rendered_and_seen_through_its_sheet(page, studio):
    """A whole render, by the command that the page shows."""
    tab = page()
    tab.evaluate(f"{STUDIO}.store.set({{ integrator: 'direct', spp: 1 }})")
    tab.page.get_by_label("What to render").select_option("print")
    tab.page.get_by_role("button", name="Render", exact=True).click()
    phase = "document.querySelector('.job').dataset.phase"
    tab.wait_until(lambda: tab.evaluate(phase) in ("done", "failed"), seconds=120)
    assert tab.evaluate(phase) == "done", tab.evaluate("document.querySelector('.job-stage').textContent")
    heading = tab.page.locator(".result > header h2")
    assert heading.inner_text().endswith(".tif")
    tab.wait_until(lambda: tab.page.locator(".result canvas").count() > 0)
    tab.wait_until(lambda: "30-lpi lenticular print" in tab.page.locator(".result-frame").inner_text())
    assert tab.page.get_by_role("button", name="Show on the display").count() == 0
    tab.page.get_by_role("button", name="Back to the live view").click()
    assert tab.page.locator(".result").is_hidden()
    tab.assert_clean()


@pytest.mark.slow
def test_the_real_lens_is_a_switch_of_displays_that_have_one(studio, page):
    tab = page()
    button = tab.page.get_by_role("button", name="Real lens")
    assert button.count() == 0
    tab.page.keyboard.press("o")
    assert tab.evaluate(f"{STUDIO}.stage.isReal") is False
    tab.evaluate(f"{STUDIO}.store.set({{ display: '{TINY},thickness=1.4mm,index=1.57' }})")
    tab.wait_until(lambda: button.count() == 1)
    views = []
    want = studio.session.thread.want
    studio.session.thread.want = lambda watcher, wanted: (views.append(wanted.view), want(watcher, wanted))
    try:
        button.click()
        tab.wait_until(lambda: views and views[-1].eye_map is RealEyeMap)
        assert button.get_attribute("aria-pressed") == "true"
        tab.page.keyboard.press("o")
        tab.wait_until(lambda: views[-1].eye_map is EyeMap)
        # Without a lens nothing is left of it.
        tab.page.keyboard.press("o")
        tab.evaluate(f"{STUDIO}.store.set({{ display: '{TINY}' }})")
        tab.wait_until(lambda: button.count() == 0 and views[-1].eye_map is EyeMap)
    finally:
        studio.session.thread.want = want
    tab.assert_clean()
