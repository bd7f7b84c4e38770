"""HTML of the viewer's page, as a server sends it and as one file, and the scripts and style sheets beside it.

The scripts are ES modules and run as they are written. They import each other as ``lippmann/NAME.js``. An import map
in the page resolves these names: to addresses of the server, or in a single file to ``data:`` URLs of the modules.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
from functools import lru_cache
from importlib.resources import files

_MODULE_PREFIX = "lippmann/"

#: Later rules win: those for narrow pages stand at the end of the last sheet.
_STYLE_SHEETS = ("controls.css", "viewer.css")

_SERVED_IMPORT_MAP = json.dumps({"imports": {_MODULE_PREFIX: "./assets/"}})

_START = f'import "{_MODULE_PREFIX}app.js";'

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


@lru_cache(maxsize=1)
def assets() -> dict[str, str]:
    """Text of each file beside the page by file name: scripts, style sheets, the icon."""
    folder = files(__package__) / "assets"
    return {entry.name: entry.read_text(encoding="utf-8") for entry in folder.iterdir()}


def modules() -> dict[str, str]:
    """Text of each script by the name under which the others import it, such as ``lippmann/viewer.js``."""
    return {f"{_MODULE_PREFIX}{name}": text for name, text in assets().items() if name.endswith(".js")}


def style() -> str:
    """All style rules. Every rule but the page's own margins applies below the class ``lippmann`` only."""
    return "".join(assets()[name] for name in _STYLE_SHEETS)


def served_page(pictures: int) -> str:
    """HTML of a server's page that shows the pictures ``0`` to ``pictures - 1``; all files come from the server.

    The import map is the only inline script: a policy has to allow :func:`served_script_hash`.
    """
    sheets = "\n".join(f'<link rel="stylesheet" href="assets/{name}">' for name in _STYLE_SHEETS)
    head = (
        "<title>Lippmann</title>\n"
        '<link rel="icon" href="assets/icon.svg" type="image/svg+xml">\n'
        f"{sheets}\n"
        f'<script type="importmap">{_SERVED_IMPORT_MAP}</script>\n'
        '<script type="module" src="assets/app.js"></script>'
    )
    return _PAGE.format(head=head, pictures=pictures, body="")


def served_script_hash() -> str:
    """Content-Security-Policy source of the inline import map in :func:`served_page`: ``'sha256-...'``, quoted."""
    return _csp_hash(_SERVED_IMPORT_MAP)


def single_file_page(title: str, data: str, pictures: int) -> str:
    """HTML of a page that contains everything it needs. Its Content-Security-Policy forbids all network access.

    Parameters
    ----------
    title:
        Title of the page, plain text.
    data:
        The pictures as JSON, see ``app.js``.
    pictures:
        Number of pictures in ``data``.
    """
    import_map = json.dumps({"imports": {name: _data_url(text, "text/javascript") for name, text in modules().items()}})
    rules = style()
    # "data:" is for the modules; no text of a picture ever becomes markup that could name another such script.
    policy = (
        f"default-src 'none'; script-src {_csp_hash(import_map)} {_csp_hash(_START)} data:; "
        f"style-src {_csp_hash(rules)}; img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    head = (
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        f"<title>{html.escape(title, quote=False)}</title>\n"
        f'<link rel="icon" href="{_data_url(assets()["icon.svg"], "image/svg+xml")}">\n'
        f"<style>{rules}</style>\n"
        f'<script type="importmap">{import_map}</script>'
    )
    # Inside a script element only an end tag or a comment could be mistaken, and both begin with "<".
    safe = data.replace("<", "\\u003c")
    body = (
        f'<script type="application/json" id="lippmann-data">{safe}</script>\n<script type="module">{_START}</script>\n'
    )
    return _PAGE.format(head=head, pictures=pictures, body=body)


def _data_url(text: str, media_type: str) -> str:
    return f"data:{media_type};base64,{base64.b64encode(text.encode()).decode('ascii')}"


def _csp_hash(text: str) -> str:
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"
