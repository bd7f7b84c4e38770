"""What the viewer's server answers, and that it answers nothing else."""

from __future__ import annotations

import json
import os
from contextlib import contextmanager, suppress
from http import HTTPStatus
from http.client import HTTPMessage
from urllib.parse import quote, unquote

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from lippmann.color.transfer import quantize
from lippmann.display import Display, LensArray, Panel
from lippmann.errors import PictureError
from lippmann.image import IntegralImage, read_picture
from lippmann.viewer.responses import RefusedError, Request
from lippmann.viewer.served_picture import PictureFile
from lippmann.viewer.server import ViewerSite

SECRET = b"not for the page"
DISPLAY = Display(
    "d", Panel(20, 12, 0.1), LensArray("lenticular", 0.4), gap=1.0, viewing_distance=500.0, aperture_distance=5.0
)


def write(path, seed=1):
    pixels = np.random.default_rng(seed).random((12, 20, 3), dtype=np.float32)
    depth = np.linspace(-1, 1, 240, dtype=np.float32).reshape(12, 20)
    IntegralImage(pixels, DISPLAY, maps={"depth": depth}).save(path)
    return path


@pytest.fixture
def file(tmp_path):
    (tmp_path / "secret.txt").write_bytes(SECRET)
    return write(tmp_path / "picture.exr")


def request(path, **headers):
    message = HTTPMessage()
    for name, value in headers.items():
        message[name.replace("_", "-")] = value
    return Request(path, message)


def get(site, path, **headers):
    return site.get(request(path, **headers))


@contextmanager
def refused(status):
    with pytest.raises(RefusedError) as caught:
        yield caught
    assert caught.value.status == status


def test_page_and_its_files(file):
    site = ViewerSite([PictureFile(file)])
    kinds = {"/": "text/html", "/assets/viewer.js": "text/javascript", "/assets/viewer.css": "text/css"}
    for path, kind in {**kinds, "/assets/icon.svg": "image/svg+xml"}.items():
        answer = get(site, path)
        assert answer.kind == f"{kind}; charset=utf-8"
        assert answer.body


def test_manifest_and_tiles_are_the_picture(file):
    site = ViewerSite([PictureFile(file)])
    answer = get(site, "/pictures/0/manifest.json")
    manifest = json.loads(answer.body)
    assert manifest["name"] == "picture.exr"
    assert [layer["name"] for layer in manifest["tiles"]["layers"]] == ["picture", "depth"]
    tile = get(site, "/pictures/0/tiles/picture/0_0", If_Match=answer.headers["ETag"])
    codes = np.frombuffer(tile.body, np.uint8).reshape(12, 20, 3)
    np.testing.assert_array_equal(codes, quantize(read_picture(file).pixels, 8, "srgb"))


def test_two_pictures(file, tmp_path):
    site = ViewerSite([PictureFile(file), PictureFile(write(tmp_path / "other.png", seed=2))])
    names = [json.loads(get(site, f"/pictures/{n}/manifest.json").body)["name"] for n in (0, 1)]
    assert names == ["picture.exr", "other.png"]
    tiles = [get(site, f"/pictures/{n}/tiles/picture/0_0").body for n in (0, 1)]
    assert tiles[0] != tiles[1]
    with refused(HTTPStatus.NOT_FOUND):
        get(site, "/pictures/2/manifest.json")


def test_packed_tiles(file):
    site = ViewerSite([PictureFile(file, tile_format="png")])
    assert json.loads(get(site, "/pictures/0/manifest.json").body)["tiles"]["format"] == "png"
    assert get(site, "/pictures/0/tiles/depth/0_0").body.startswith(b"\x89PNG")


@pytest.mark.parametrize("tile", ["picture/1_0", "picture/0_1", "gone/0_0", "picture/999999_999999"])
def test_tiles_that_are_not_there(file, tile):
    with refused(HTTPStatus.NOT_FOUND):
        get(ViewerSite([PictureFile(file)]), f"/pictures/0/tiles/{tile}")


def test_a_file_written_anew_is_shown_after_a_reload(file):
    site = ViewerSite([PictureFile(file)])
    old = get(site, "/pictures/0/manifest.json").headers["ETag"]
    before = get(site, "/pictures/0/tiles/picture/0_0", If_Match=old).body
    write(file, seed=3)
    os.utime(file, ns=(1, 1))
    assert get(site, "/pictures/0/tiles/picture/0_0", If_Match=old).body == before
    new = get(site, "/pictures/0/manifest.json").headers["ETag"]
    assert new != old
    assert get(site, "/pictures/0/tiles/picture/0_0", If_Match=new).body != before
    with refused(HTTPStatus.PRECONDITION_FAILED) as caught:
        get(site, "/pictures/0/tiles/picture/0_0", If_Match=old)
    assert "reload" in str(caught.value)


def test_a_file_that_is_gone_or_damaged_is_said(file):
    site = ViewerSite([PictureFile(file)])
    content = file.read_bytes()
    file.unlink()
    with pytest.raises(PictureError, match=r"picture\.exr: no such file"):
        get(site, "/pictures/0/manifest.json")
    file.write_bytes(content[: len(content) // 2])
    with pytest.raises(PictureError, match=r"picture\.exr"):
        get(site, "/pictures/0/manifest.json")
    file.write_bytes(content)
    assert get(site, "/pictures/0/manifest.json").status == HTTPStatus.OK


def test_nothing_is_taken(file):
    with refused(HTTPStatus.METHOD_NOT_ALLOWED):
        ViewerSite([PictureFile(file)]).post(request("/"), b"{}")


UP = (
    "..",
    "%2e%2e",
    "%2E%2E",
    ".%2e",
    "%252e%252e",
    "..%00",
    "..%c0%af",
    "..;",
    "\\..",
    "%5c..",
    "....",
    "\uff0e\uff0e",
)


def outside(root, target):
    """Ways of naming a file through folders that are served, whole, encoded and doubly so."""
    below = target.lstrip("/")
    for base in ("", "/assets", "/pictures", "/pictures/0", "/pictures/0/tiles", "/pictures/0/tiles/picture"):
        yield f"{base}/{target}"
        yield f"{base}/{quote(target, safe='')}"
        for up in UP:
            for slash in ("/", "%2f", "\\", "%5c"):
                yield f"{base}/" + (up + slash) * 12 + below.replace("/", slash)
    yield from (target, f"file://{target}", f"http://evil.example{target}", f"//{target}", f"/{root}/secret.txt")


def test_files_outside_are_never_served(file, tmp_path):
    site = ViewerSite([PictureFile(file)])
    secret = str(tmp_path / "secret.txt")
    tried = [*outside(tmp_path, secret), *outside(tmp_path, str(file)), *outside(tmp_path, "/etc/passwd")]
    assert len(tried) > 500
    for path in tried:
        with refused(HTTPStatus.NOT_FOUND):
            get(site, path)


@pytest.mark.parametrize(
    "path",
    [
        "",
        "*",
        "/.",
        "/index.html",
        "/assets",
        "/assets/",
        "/assets/viewer.js/",
        "/assets/viewer.js?x",
        "/assets/../server.py",
        "/assets/viewer.py",
        "/pictures",
        "/pictures/",
        "/pictures/00000/manifest.json",
        "/pictures/-1/manifest.json",
        "/pictures/0/manifest.json\n",
        "/pictures/0/manifest.json/x",
        "/pictures/\u0660/manifest.json",
        "/pictures/0/picture.exr",
        "/pictures/0/tiles/picture/0_0.png",
        "/pictures/0/tiles/picture/\u0660_0",
        "/pictures/0/tiles/picture/0_-1",
        "/pictures/0/tiles/picture/1e3_0",
        "/pictures/0/tiles//0_0",
        "/picture.exr",
        "/secret.txt",
    ],
)
def test_only_listed_paths_are_answered(file, path):
    with refused(HTTPStatus.NOT_FOUND):
        get(ViewerSite([PictureFile(file)]), path)


WORDS = (
    "assets",
    "pictures",
    "0",
    "1",
    "tiles",
    "picture",
    "manifest.json",
    "viewer.js",
    "0_0",
    "..",
    "%2e",
    "etc",
    "",
)
PATHS = st.lists(st.sampled_from(WORDS) | st.text(max_size=4), max_size=8).map(lambda words: "/" + "/".join(words))


@pytest.mark.slow
@settings(
    max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(path=PATHS | st.text())
@example(path="/pictures/0/tiles/__class__/0_0")
@example(path="/pictures/0/tiles/codes/0_0")
def test_any_path_gives_an_answer_or_a_refusal(file, path):
    site = ViewerSite([PictureFile(file)])
    with suppress(RefusedError):
        answer = get(site, path)
        assert path == unquote(path)
        assert SECRET not in answer.body
