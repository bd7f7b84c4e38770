"""The widget: what it sends to a notebook, and that the page works from that alone."""

from __future__ import annotations

import base64
import io
import json
import subprocess
import sys
import types

import numpy as np
import pytest
from PIL import Image

from lippmann.color.transfer import quantize
from lippmann.display import Display, LensArray, Panel
from lippmann.image import IntegralImage, Provenance
from lippmann.viewer import notebook

pytest.importorskip("anywidget")

DISPLAY = Display(
    "d", Panel(40, 30, 0.5), LensArray("lenticular", 2.0), gap=5.0, viewing_distance=500.0, aperture_distance=5.0
)
WIDGET_VIEW = "application/vnd.jupyter.widget-view+json"

#: A page that does with a widget what notebooks do: run its script, hand it a model and a place.
HOST = """<!doctype html><meta charset="utf-8"><title>notebook</title><style>{css}</style><div id="cell"></div>
<script type="application/json" id="state">{state}</script>
<script type="module">
const state = JSON.parse(document.getElementById("state").textContent);
const bytes = (text) => new DataView(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
const tiles = Object.fromEntries(Object.entries(state.tiles).map(([name, text]) => [name, bytes(text)]));
const model = {{ get: (name) => ({{ ...state, tiles }})[name] }};
const address = URL.createObjectURL(new Blob([state.script], {{ type: "text/javascript" }}));
const widget = (await import(address)).default;
globalThis.clean = widget.render({{ model, el: document.getElementById("cell") }});
</script>"""


@pytest.fixture
def image():
    pixels = np.random.default_rng(1).random((30, 40, 3), dtype=np.float32)
    depth = np.linspace(0, 1, 1200, dtype=np.float32).reshape(30, 40)
    return IntegralImage(pixels, DISPLAY, provenance=Provenance(scene="teapot"), maps={"depth": depth})


@pytest.fixture
def kernel(monkeypatch):
    """As if a notebook's kernel ran this."""
    shell = types.SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))


@pytest.fixture
def widget(image):
    from lippmann.viewer.widget import PictureWidget

    made = PictureWidget(image)
    yield made
    made.close()


def test_a_picture_shows_itself_as_a_widget_in_a_notebook(image, kernel):
    bundle = image._repr_mimebundle_(include=None, exclude=None)
    data = bundle[0] if isinstance(bundle, tuple) else bundle
    assert WIDGET_VIEW in data
    assert data["text/plain"] == repr(image)


@pytest.mark.parametrize("shell", [None, types.SimpleNamespace()], ids=["script", "terminal"])
def test_a_plain_picture_has_to_do_elsewhere(image, monkeypatch, shell):
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))
    assert image._repr_mimebundle_() is None
    assert image._repr_html_().startswith("<figure>")


def test_a_plain_picture_has_to_do_without_the_extra(image, kernel, monkeypatch):
    monkeypatch.setattr(notebook, "find_spec", lambda name: None)
    assert image._repr_mimebundle_() is None


def test_asking_costs_nothing_where_no_notebook_is():
    code = "import sys, lippmann.viewer.notebook as n; n.mimebundle(None); print('anywidget' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout == "False\n"


def test_widget_holds_the_picture_and_its_maps(image, widget):
    assert set(widget.tiles) == {"picture/0_0", "depth/0_0"}
    with Image.open(io.BytesIO(widget.tiles["picture/0_0"])) as png:
        np.testing.assert_array_equal(np.asarray(png), quantize(image.pixels, 8, "srgb"))
    assert widget.description["name"] == "teapot"
    assert widget.description["tiles"]["format"] == "png"


def test_nothing_that_a_page_sends_is_listened_to(widget):
    before = widget.get_state()
    widget._handle_custom_msg({"command": "__import__('os').system('false')", "kind": "anywidget-command"}, [])
    assert widget.get_state() == before


def host(widget, folder):
    tiles = {name: base64.b64encode(data).decode() for name, data in widget.tiles.items()}
    state = json.dumps({"script": str(widget._esm), "description": widget.description, "tiles": tiles})
    path = folder / "notebook.html"
    path.write_text(HOST.format(css=widget._css, state=state.replace("<", "\\u003c")), encoding="utf-8")
    return path


@pytest.mark.slow
def test_widget_draws_in_a_browser_without_any_kernel(widget, open_tab, tmp_path):
    tab = open_tab(size=(900, 700), offline=True).open(host(widget, tmp_path))
    tab.wait_for("document.querySelector('#cell canvas') !== null")
    colors = "() => new Set(document.querySelector('#cell canvas').toDataURL()).size"
    tab.wait_for(f"({colors})() > 10")
    assert tab.evaluate("getComputedStyle(document.querySelector('#cell [role=alert]') ?? document.head).display") == (
        "none"
    )
    assert tab.evaluate("document.querySelector('#cell').clientHeight") > 400
    assert not tab.page.is_visible("#cell aside")
    tab.page.click("text=Controls")
    assert tab.page.is_visible("#cell aside")
    tab.assert_clean()
    tab.evaluate("clean()")
    assert tab.evaluate("document.querySelector('#cell canvas')") is None
    tab.assert_clean()
