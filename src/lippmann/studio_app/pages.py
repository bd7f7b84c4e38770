"""HTML of the studio's page and of the window for a panel, and the files beside them."""

from __future__ import annotations

import base64
import hashlib
import json
from functools import cache
from importlib.resources import files

from lippmann.viewer import page
from lippmann.viewer.responses import Response, content_security_policy, file_response, text_response

#: The viewer's modules come along: results are shown by it, and controls are built with its functions.
_IMPORT_MAP = json.dumps({"imports": {"studio/": "./assets/", "lippmann/": "./viewer/"}})

_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="dark">
<title>{title}</title>
<link rel="icon" href="viewer/icon.svg" type="image/svg+xml">
{sheets}
<script type="importmap">{imports}</script>
<script type="module" src="assets/{script}"></script>
</head>
<body>
<main></main>
<noscript>This page needs JavaScript and WebGL 2.</noscript>
</body>
</html>
"""

_OWN_SHEETS = ("studio.css", "result.css", "settings.css")
_STUDIO_SHEETS = ("viewer/controls.css", "viewer/viewer.css", *(f"assets/{name}" for name in _OWN_SHEETS))
_PANEL_SHEETS = ("assets/panel_window.css",)


@cache
def static_files() -> dict[str, Response]:
    """Responses to the paths that never change: the two pages, ``""`` and ``panel``, their scripts and sheets."""
    own = {entry.name: entry.read_text(encoding="utf-8") for entry in (files(__package__) / "assets").iterdir()}
    return {
        "": _page("Lippmann Studio", "app.js", _STUDIO_SHEETS),
        "panel": _page("Lippmann: panel", "panel_window.js", _PANEL_SHEETS),
        **{f"assets/{name}": file_response(name, text) for name, text in own.items()},
        **{f"viewer/{name}": file_response(name, text) for name, text in page.assets().items()},
    }


def modules() -> dict[str, str]:
    """Text of each script of the studio by the name under which others import it, such as ``studio/stage.js``."""
    folder = files(__package__) / "assets"
    return {
        f"studio/{entry.name}": entry.read_text(encoding="utf-8")
        for entry in folder.iterdir()
        if entry.name.endswith(".js")
    }


def style() -> str:
    """All rules of the studio's page but those of the viewer."""
    folder = files(__package__) / "assets"
    return "".join((folder / name).read_text(encoding="utf-8") for name in _OWN_SHEETS)


def _page(title: str, script: str, sheets: tuple[str, ...]) -> Response:
    links = "\n".join(f'<link rel="stylesheet" href="{name}">' for name in sheets)
    html = text_response(_PAGE.format(title=title, sheets=links, imports=_IMPORT_MAP, script=script), "text/html")
    digest = base64.b64encode(hashlib.sha256(_IMPORT_MAP.encode()).digest()).decode("ascii")
    allowed = content_security_policy(f"'sha256-{digest}'")
    return Response(html.body, html.kind, headers={"Content-Security-Policy": f"{allowed}; media-src 'self'"})
