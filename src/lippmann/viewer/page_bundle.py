"""The page's own files: its HTML, its script as one module, its style.

The script is written as modules, which a page opened from disk may not load, and which a notebook's widget could not
find. :func:`script` therefore puts them one after the other, each after those that it imports, and takes the imports
out: no tool is needed, and no two modules may give the same name to different things (a test holds that).
"""

from __future__ import annotations

import base64
import hashlib
import re
from functools import lru_cache
from importlib.resources import files
from typing import Any

_ENTRY = "app.js"
_IMPORT = re.compile(r'^import (?:\{[^}]*\} from )?"\./([a-z_]+\.js)";\n', re.M)
_EXPORT = re.compile(r"^export (?=(?:const|let|function|async function|class) )", re.M)

#: What a notebook's widget takes from the script.
_EXPORTS = "export { createViewer };\n"

_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
{head}
</head>
<body>
<main data-lippmann-pictures="{pictures}"></main>
<noscript>This page needs JavaScript and WebGL 2.</noscript>
{body}</body>
</html>
"""


def page_html(pictures: int) -> str:
    """The page of a server that shows so many pictures, called ``0``, ``1``, ...; it loads script and style from it."""
    head = (
        "<title>Lippmann</title>\n"
        '<link rel="icon" href="assets/icon.svg" type="image/svg+xml">\n'
        '<link rel="stylesheet" href="assets/viewer.css">\n'
        '<script type="module" src="assets/viewer.js"></script>'
    )
    return _PAGE.format(head=head, pictures=pictures, body="")


def whole_page(title: str, data: str, pictures: int) -> str:
    """A page with everything in it; its own policy forbids it to ask any network for anything.

    Parameters
    ----------
    title:
        The page's title, as text.
    data:
        JSON of the pictures, see ``app.js``.
    pictures:
        How many these are.
    """
    code, look = script(), style()
    policy = (
        f"default-src 'none'; script-src {_hash(code)}; style-src {_hash(look)}; img-src data: blob:; "
        "base-uri 'none'; form-action 'none'"
    )
    drawn = base64.b64encode(icon().encode()).decode("ascii")
    head = (
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        f"<title>{_escaped(title)}</title>\n"
        f'<link rel="icon" href="data:image/svg+xml;base64,{drawn}">\n'
        f"<style>{look}</style>"
    )
    # Inside a script element only an end tag or a comment could be mistaken, and both begin with "<".
    safe = data.replace("<", "\\u003c")
    body = (
        f'<script type="application/json" id="lippmann-data">{safe}</script>\n<script type="module">{code}</script>\n'
    )
    return _PAGE.format(head=head, pictures=pictures, body=body)


@lru_cache(maxsize=1)
def script() -> str:
    """The script as one module, which starts the page it is in, if there is one, and exports ``createViewer``."""
    parts: dict[str, str] = {}
    _add(_ENTRY, parts)
    return "\n".join(parts.values()) + _EXPORTS


@lru_cache(maxsize=1)
def style() -> str:
    """The style sheet; all of it holds below the class ``lippmann`` but the margins of a page of its own."""
    # What holds on narrow pages stands at the end of the second, and has the last word.
    return _asset("controls.css") + _asset("viewer.css")


def icon() -> str:
    """The page's icon, SVG."""
    return _asset("icon.svg")


def _add(name: str, parts: dict[str, str]) -> None:
    """Adds a module after those that it imports."""
    text = _asset(name)
    for imported in _IMPORT.findall(text):
        if imported not in parts:
            _add(imported, parts)
    parts[name] = _EXPORT.sub("", _IMPORT.sub("", text))


def _asset(name: str) -> str:
    folder: Any = files("lippmann.viewer") / "assets"
    text: str = (folder / name).read_text(encoding="utf-8")
    return text


def _hash(text: str) -> str:
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
