"""Elements: plain text is shown as it is, whatever it holds; markup stays markup."""

from __future__ import annotations

from html.parser import HTMLParser

from markupsafe import Markup

from lippmann.reproduce.html import element, figure, folded, join, table

NASTY = "<b>a & \"b\" 'c'</b>"


def parsed(markup):
    """Tags with their attributes, and the texts."""
    reader, tags, texts = HTMLParser(), [], []
    reader.handle_starttag = lambda tag, attributes: tags.append((tag, dict(attributes)))
    reader.handle_data = texts.append
    reader.feed(markup)
    reader.close()
    return tags, "".join(texts)


def test_text_and_attributes_are_escaped():
    tags, text = parsed(element("p", NASTY, title=NASTY, class_="x", aria_label=NASTY, id_=None))
    assert tags == [("p", {"title": NASTY, "class": "x", "aria-label": NASTY})]
    assert text == NASTY


def test_markup_is_not():
    assert element("p", element("b", "a"), Markup("<br>")) == "<p><b>a</b><br></p>"
    assert join(NASTY, Markup("<br>")) == element("p", NASTY)[3:-4] + Markup("<br>")


def test_parts_of_the_page_escape_what_they_are_given():
    shown = join(
        table((NASTY,), [(NASTY,)], caption=NASTY, spans=[(NASTY, 1)]),
        figure("data:,", (3, 2), NASTY, NASTY),
        folded(NASTY, NASTY),
    )
    tags, text = parsed(shown)
    assert "b" not in [tag for tag, _ in tags]
    assert text == NASTY * 7
    assert next(values for tag, values in tags if tag == "img")["alt"] == NASTY
