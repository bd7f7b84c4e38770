"""One file that shows a picture anywhere."""

from __future__ import annotations

import base64
import json
import re

import numpy as np
import pytest
from pages import DISPLAYS, VIEWER, noise, opened, page_of, seen, shown
from PIL import Image

from lippmann.errors import OutputError, UsageError
from lippmann.viewer.export import export_page
from lippmann.viewer.overlays import overlays
from lippmann.viewing.replay import default_eye


def data_of(page):
    found = re.search(r'id="lippmann-data">(.*?)</script>', page.read_text(encoding="utf-8"), re.S)
    return json.loads(found[1])


@pytest.mark.slow
def test_page_opens_from_disk_without_any_network(open_tab, tmp_path):
    image = noise(DISPLAYS["square"])
    page = page_of(tmp_path / "page.html", image)
    tab = opened(open_tab, page)
    codes = shown(tab)
    assert np.array_equal(codes, seen(image, default_eye(image.display), codes.shape[1::-1]))
    assert tab.asked_for[0] == page.resolve().as_uri()
    assert [address for address in tab.asked_for[1:] if not address.startswith(("data:", "blob:"))] == []
    tab.assert_clean()


@pytest.mark.slow
def test_page_may_ask_nothing_of_any_network(open_tab, tmp_path):
    tab = opened(open_tab, page_of(tmp_path / "page.html", noise(DISPLAYS["square"])), offline=False)
    blocked = tab.evaluate("fetch('http://127.0.0.1:9/').then(() => 'went through', (error) => error.name)")
    assert blocked == "TypeError"
    assert "Content Security Policy" in " ".join(tab.said)


def test_page_holds_the_very_codes(tmp_path):
    image = noise(DISPLAYS["slanted"])
    tile = base64.b64decode(data_of(page_of(tmp_path / "page.html", image))[0]["tiles"]["picture"]["0_0"])
    (tmp_path / "tile.png").write_bytes(tile)
    with Image.open(tmp_path / "tile.png") as picture:
        assert np.array_equal(np.asarray(picture), np.round(image.pixels * 255))


def test_page_holds_the_layers(tmp_path):
    status = np.zeros((80, 96), dtype=np.float32)
    image = noise(DISPLAYS["square"], maps={"status": status})
    data = data_of(page_of(tmp_path / "page.html", image))[0]
    assert list(data["tiles"]) == ["picture", *overlays(image)]


def test_two_pictures_at_most(tmp_path):
    image = noise(DISPLAYS["square"])
    assert len(data_of(page_of(tmp_path / "two.html", image, image))) == 2
    for count in (0, 3):
        with pytest.raises(UsageError, match="one or two"):
            export_page([("a", image)] * count, tmp_path / "page.html")
    assert not (tmp_path / "page.html").exists()


def test_a_picture_too_large_for_a_page_is_refused(tmp_path, monkeypatch):
    image = noise(DISPLAYS["square"])
    pixels = image.pixels.shape[0] * image.pixels.shape[1]
    monkeypatch.setattr("lippmann.viewer.export.MOST_PIXELS", pixels)
    page_of(tmp_path / "page.html", image)
    monkeypatch.setattr("lippmann.viewer.export.MOST_PIXELS", pixels - 1)
    with pytest.raises(UsageError, match="a page in one file shows at most") as caught:
        export_page([("large", image)], tmp_path / "other.html")
    assert "96 x 80 pixels" in str(caught.value)
    assert not (tmp_path / "other.html").exists()


def test_place_that_cannot_be_written_is_named(tmp_path):
    with pytest.raises(OutputError, match="nowhere"):
        export_page([("a", noise(DISPLAYS["square"]))], tmp_path / "nowhere" / "page.html")


@pytest.mark.slow
def test_hostile_name_is_shown_as_text(open_tab, tmp_path):
    name = "</script><img src=x onerror=console.log('ran')>.png"
    export_page([(name, noise(DISPLAYS["square"]))], tmp_path / "page.html")
    tab = opened(open_tab, tmp_path / "page.html")
    assert tab.page.locator("h1").inner_text() == name
    assert tab.evaluate(f"{VIEWER}.manifests[0].name") == name
    tab.assert_clean()
