"""The script put together from its modules, and the pages around it."""

from __future__ import annotations

import html
import json
import re
from collections import Counter
from importlib.resources import files

import pytest

from lippmann.viewer.page_bundle import icon, page_html, script, style, whole_page

ASSETS = files("lippmann.viewer") / "assets"
MODULES = sorted(entry.name for entry in ASSETS.iterdir() if entry.name.endswith(".js"))
_NAMED = re.compile(r"^(?:export )?(?:async )?(?:const|let|function|class) (\w+)", re.M)


def test_script_holds_every_module_once_and_imports_nothing():
    code = script()
    for name in MODULES:
        first = re.search(r"^export (?:async )?(?:const|function|class) (\w+)", (ASSETS / name).read_text(), re.M)
        if first:
            assert len(re.findall(rf"^(?:async )?(?:const|function|class) {first[1]}\b", code, re.M)) == 1, name
    assert not re.search(r"^import\b", code, re.M)
    assert re.findall(r"^export\b.*", code, re.M) == ["export { createViewer };"]


def place(name):
    """Where the script gives a name its meaning."""
    found = re.search(rf"^(?:async )?(?:const|let|function|class) {name}\b", script(), re.M)
    assert found, name
    return found.start()


def test_modules_follow_what_they_import():
    for name in MODULES:
        text = (ASSETS / name).read_text()
        own = [place(found) for found in _NAMED.findall(text)]
        for names in re.findall(r"^import \{([^}]*)\} from", text, re.M):
            for imported in filter(None, (part.strip() for part in names.split(","))):
                assert place(imported) < min(own), f"{name} comes before {imported}"


def test_no_name_stands_for_two_things():
    names = Counter(name for module in MODULES for name in _NAMED.findall((ASSETS / module).read_text()))
    assert [name for name, count in names.items() if count > 1] == []


def test_nothing_is_fetched_from_elsewhere():
    known = "http://www.w3.org/2000/svg"  # a name, not an address
    for text in (script(), style(), icon(), page_html(1)):
        assert re.findall(r"https?://[^\s\"'`)]+", text.replace(known, "")) == []


def test_served_page_has_nothing_inline():
    page = page_html(2)
    assert 'data-lippmann-pictures="2"' in page
    assert "style=" not in page
    assert "<style" not in page
    assert re.findall(r"<script[^>]*>(.*?)</script>", page, re.S) == [""]


@pytest.mark.parametrize("title", ["<script>alert(1)</script>", "a & b", "</title><b>"])
def test_names_are_text(title):
    page = whole_page(title, json.dumps([title]), 1)
    told = re.search(r"<title>(.*?)</title>", page, re.S)
    data = re.search(r'id="lippmann-data">(.*?)</script>', page, re.S)
    assert html.unescape(told[1]) == title
    assert "<" not in told[1] + data[1]
    assert json.loads(data[1]) == [title]
    assert len(re.findall("<script", page)) == 2
