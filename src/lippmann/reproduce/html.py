"""HTML elements by small functions: plain text is escaped, :class:`markupsafe.Markup` is not."""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup


def join(*parts: str) -> Markup:
    """Pieces of markup as one; plain text among them is escaped."""
    return Markup("").join(parts)


def element(name: str, *inside: str, **attributes: object) -> Markup:
    """An element; a ``_`` at the end of an attribute's name is dropped, other ones become ``-``."""
    written = join(
        *(
            Markup(' {}="{}"').format(key.rstrip("_").replace("_", "-"), value)
            for key, value in attributes.items()
            if value is not None
        )
    )
    return Markup("<{0}{1}>{2}</{0}>").format(name, written, join(*inside))


def paragraph(*inside: str, class_: str | None = None) -> Markup:
    return element("p", *inside, class_=class_)


def section(title: str, *inside: str, id_: str) -> Markup:
    return element("section", element("h2", title), *inside, id_=id_)


def table(
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    caption: str,
    spans: Sequence[tuple[str, int]] = (),
    wrap: bool = False,
) -> Markup:
    """A table; the first cell of a row is its heading. Where it is too wide it scrolls by itself, or wraps its cells.

    ``spans`` are headings above those of ``head``: text, and how many columns it covers.
    """
    over = [element("th", text, colspan=count, scope="colgroup") for text, count in spans]
    columns = [element("colgroup", span=count) for _, count in spans]
    heads = [element("tr", *over, class_="over")] if over else []
    heads.append(element("tr", *(element("th", cell, scope="col") for cell in head)))
    body = element("tbody", *(_row(row) for row in rows))
    inside = element("table", *columns, element("thead", *heads), body, class_="wrap" if wrap else None)
    # The caption stays while the table scrolls; a scrolling region must be reachable by keyboard.
    scrolling = element("div", inside, class_="scroll", tabindex=0, role="region", aria_label=caption)
    return join(paragraph(caption, class_="caption"), scrolling)


def _row(cells: Sequence[str]) -> Markup:
    first, *others = cells
    return element("tr", element("th", first, scope="row"), *(element("td", cell) for cell in others))


def figure(source: str, size: tuple[int, int], caption: str, alt: str) -> Markup:
    """A picture of ``size`` (width, height) pixels with a line below it."""
    image = Markup('<img src="{}" width="{}" height="{}" alt="{}" loading="lazy">').format(source, *size, alt)
    return element("figure", image, element("figcaption", caption))


def folded(title: str, *inside: str) -> Markup:
    """Content that opens on a click on its title."""
    return element("details", element("summary", title), *inside)
