"""The page's HTML, and its modules: how they find each other, and what the policies let run."""

from __future__ import annotations

import html
import json
import re

import pytest
from pages import DISPLAYS, VIEWER, noise, opened, page_of

from lippmann.image.write import write_picture
from lippmann.viewer.http_server import WebServer
from lippmann.viewer.page import assets, modules, served_page, single_file_page, style
from lippmann.viewer.served_picture import PictureFile
from lippmann.viewer.server import ViewerSite

#: Loads every module of the page by name, and counts what each exports.
LOAD_ALL = """async (names) => {
  const loaded = await Promise.all(names.map((name) => import(name)));
  return loaded.map((module) => Object.keys(module).length);
}"""

#: Adds a script to the page as an intruder would, and tells whether it ran.
INTRUDE = """async (attributes) => {
  const script = document.createElement("script");
  Object.assign(script, attributes);
  document.body.append(script);
  await new Promise((done) => setTimeout(done, 200));
  return globalThis.hasRun === true;
}"""


@pytest.fixture
def served(tmp_path):
    """Address of a server's page with one picture."""
    write_picture(noise(DISPLAYS["square"]), tmp_path / "picture.png")
    with WebServer(ViewerSite([PictureFile(tmp_path / "picture.png")])) as server:
        yield server.address


def test_modules_import_modules_of_the_page_only():
    for name, text in modules().items():
        imported = re.findall(r'^import\b[^"]*"([^"]+)";$', text, re.M)
        assert len(imported) == len(re.findall(r"^import\b", text, re.M)), name
        assert set(imported) <= set(modules()), name


@pytest.mark.long
def test_modules_of_a_server_are_the_files_themselves(open_tab, served):
    tab = open_tab().open(served)
    tab.evaluate(f"{VIEWER}.ready")
    addresses = {name: f"{served}assets/{name.removeprefix('lippmann/')}" for name in modules()}
    assert set(addresses.values()) <= set(tab.asked_for)
    assert len(tab.asked_for) == len(set(tab.asked_for))
    for name, address in addresses.items():
        text = tab.evaluate("async (address) => (await fetch(address)).text()", address)
        assert text == modules()[name]
    assert min(tab.evaluate(LOAD_ALL, [name for name in modules() if name != "lippmann/app.js"])) > 0
    tab.assert_clean()


@pytest.mark.slow
def test_modules_of_a_single_file_come_from_the_file(open_tab, tmp_path):
    page = page_of(tmp_path / "page.html", noise(DISPLAYS["square"]))
    tab = opened(open_tab, page)
    assert min(tab.evaluate(LOAD_ALL, [name for name in modules() if name != "lippmann/app.js"])) > 0
    assert {address.partition(":")[0] for address in tab.asked_for} <= {"file", "data", "blob"}
    assert [address for address in tab.asked_for if address.startswith("file:")] == [page.resolve().as_uri()]
    tab.assert_clean()


def policy_of(page):
    return re.search(r'http-equiv="Content-Security-Policy" content="(.*?)"', page)[1]


@pytest.mark.slow
def test_single_file_allows_no_network_and_no_other_inline_script(open_tab, tmp_path):
    page = page_of(tmp_path / "page.html", noise(DISPLAYS["square"]))
    rules = dict(rule.split(" ", 1) for rule in policy_of(page.read_text(encoding="utf-8")).split("; "))
    assert rules["default-src"] == "'none'"
    assert re.fullmatch(r"'sha256-[^ ]{44}' 'sha256-[^ ]{44}' data:", rules["script-src"])
    tab = opened(open_tab, page)
    assert not tab.evaluate(INTRUDE, {"textContent": "globalThis.hasRun = true"})
    assert "Content Security Policy" in " ".join(tab.said)


@pytest.mark.slow
@pytest.mark.parametrize(
    "script",
    [
        {"textContent": "globalThis.hasRun = true"},
        pytest.param({"src": "data:text/javascript,globalThis.hasRun = true"}, marks=pytest.mark.long),
        pytest.param({"type": "module", "textContent": "globalThis.hasRun = true"}, marks=pytest.mark.long),
    ],
    ids=["inline", "data", "module"],
)
def test_server_allows_no_inline_script_but_its_import_map(open_tab, served, script):
    tab = open_tab().open(served)
    tab.evaluate(f"{VIEWER}.ready")
    tab.assert_clean()
    assert not tab.evaluate(INTRUDE, script)
    assert "Content Security Policy" in " ".join(tab.said)


def test_nothing_is_fetched_from_elsewhere():
    known = "http://www.w3.org/2000/svg"  # a name, not an address
    for text in (*assets().values(), served_page(1)):
        assert re.findall(r"https?://[^\s\"'`)]+", text.replace(known, "")) == []


def test_served_page_has_only_its_import_map_inline():
    page = served_page(2)
    assert 'data-lippmann-pictures="2"' in page
    assert "style=" not in page
    assert "<style" not in page
    scripts = [text for text in re.findall(r"<script[^>]*>(.*?)</script>", page, re.S) if text]
    assert [json.loads(text) for text in scripts] == [{"imports": {"lippmann/": "./assets/"}}]


def test_style_sheets_are_linked_in_the_order_in_which_they_are_embedded():
    linked = re.findall(r'rel="stylesheet" href="assets/(.*?)"', served_page(1))
    assert "".join(assets()[name] for name in linked) == style()
    assert set(linked) == {name for name in assets() if name.endswith(".css")}


@pytest.mark.parametrize("title", ["<script>alert(1)</script>", "a & b", "</title><b>"])
def test_names_are_text(title):
    page = single_file_page(title, json.dumps([title]), 1)
    told = re.search(r"<title>(.*?)</title>", page, re.S)
    data = re.search(r'id="lippmann-data">(.*?)</script>', page, re.S)
    assert html.unescape(told[1]) == title
    assert "<" not in told[1] + data[1]
    assert json.loads(data[1]) == [title]
    assert len(re.findall("<script", page)) == 3
