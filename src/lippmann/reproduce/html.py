"""HTML by small functions: text is escaped on the way in, markup is told apart by its type."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import NewType

#: Text that is markup already.
Markup = NewType("Markup", str)


def escaped(text: object) -> Markup:
    """Markup that shows ``text``."""
    return Markup(html.escape(str(text)))


def raw(*parts: str) -> Markup:
    """Pieces of markup as one."""
    return Markup("".join(parts))


def element(name: str, *inside: Markup, **attributes: object) -> Markup:
    """An element; a ``_`` at the end of an attribute's name is dropped, other ones become ``-``."""
    written = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{html.escape(str(value))}"'
        for key, value in attributes.items()
        if value is not None
    )
    return Markup(f"<{name}{written}>{''.join(inside)}</{name}>")


def paragraph(*inside: Markup, class_: str | None = None) -> Markup:
    return element("p", *inside, class_=class_)


def section(title: str, *inside: Markup, id_: str) -> Markup:
    return element("section", element("h2", escaped(title)), *inside, id_=id_)


def table(
    head: Sequence[str],
    rows: Sequence[Sequence[Markup]],
    *,
    caption: str,
    spans: Sequence[tuple[str, int]] = (),
    wrap: bool = False,
) -> Markup:
    """A table; the first cell of a row is its heading. Where it is too wide it scrolls by itself, or wraps its cells.

    ``spans`` are headings above those of ``head``: text, and how many columns it covers.
    """
    over = [element("th", escaped(text), colspan=count, scope="colgroup") for text, count in spans]
    columns = [element("colgroup", span=count) for _, count in spans]
    heads = [element("tr", *over, class_="over")] if over else []
    heads.append(element("tr", *(element("th", escaped(cell), scope="col") for cell in head)))
    body = element("tbody", *(_row(row) for row in rows))
    inside = element("table", *columns, element("thead", *heads), body, class_="wrap" if wrap else None)
    # The caption stays while the table scrolls; a scrolling region must be reachable by keyboard.
    scrolling = element("div", inside, class_="scroll", tabindex=0, role="region", aria_label=caption)
    return raw(paragraph(escaped(caption), class_="caption"), scrolling)


def _row(cells: Sequence[Markup]) -> Markup:
    first, *others = cells
    return element("tr", element("th", first, scope="row"), *(element("td", cell) for cell in others))


def figure(source: str, size: tuple[int, int], caption: str, alt: str) -> Markup:
    """A picture of ``size`` (width, height) pixels with a line below it."""
    width, height = size
    written = f'width="{width}" height="{height}" alt="{html.escape(alt)}" loading="lazy"'
    image = Markup(f'<img src="{html.escape(source)}" {written}>')
    return element("figure", image, element("figcaption", escaped(caption)))


def folded(title: str, *inside: Markup) -> Markup:
    """What is shown on demand."""
    return element("details", element("summary", escaped(title)), *inside)
