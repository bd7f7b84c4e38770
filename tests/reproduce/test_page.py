"""The page: whole, well-formed, self-contained, and with the right numbers in the right places."""

from __future__ import annotations

import base64
import json
import re
import struct
from html.parser import HTMLParser

import pytest

from lippmann.reproduce import Manner, report_page, summary, tables
from lippmann.reproduce.style import STYLE

VOID = {"meta", "link", "img"}


class Reader(HTMLParser):
    """Checks that elements are closed in order; keeps tables, pictures, links and the words."""

    def __init__(self):
        super().__init__()
        self.open, self.pictures, self.ids, self.targets, self.addresses = [], [], set(), set(), []
        self.tables, self.words = [], []

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        if tag not in VOID:
            self.open.append(tag)
        if "id" in values:
            self.ids.add(values["id"])
        self.addresses += [values[key] for key in ("src", "href", "srcset", "data", "poster") if key in values]
        if tag == "a":
            self.targets.add(values["href"])
        if tag == "img":
            self.pictures.append(values)
        if tag == "table":
            self.tables.append([])
        if tag == "tr":
            self.tables[-1].append([])
        if tag in ("td", "th"):
            self.tables[-1][-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)
        if self.open and "tr" in self.open:
            self.tables[-1][-1][-1] += data


def read(markup):
    reader = Reader()
    reader.feed(markup)
    reader.close()
    assert reader.open == []
    return reader


@pytest.fixture(scope="module")
def page(results):
    return report_page(results)


@pytest.fixture(scope="module")
def reader(page):
    return read(page)


def test_the_page_refers_to_nothing_outside_itself(page, reader):
    assert page.startswith("<!doctype html>")
    assert all(address.startswith(("data:", "#")) for address in reader.addresses)
    assert not re.search(r"@import|url\(|https?:", page)
    assert "<script" not in page


def test_names_are_unique_and_references_lead_to_them(page):
    names, references = re.findall(r' id="([^"]+)"', page), re.findall(r' href="#([^"]+)"', page)
    assert len(names) == len(set(names))
    assert set(references) <= set(names)


def test_the_page_is_the_same_every_time(page, results):
    assert report_page(results) == page


def test_links_lead_to_sections(reader):
    assert reader.targets
    assert {target[1:] for target in reader.targets} <= reader.ids


def test_the_page_fits_a_phone_and_follows_the_readers_light(page):
    assert "width=device-width" in page
    assert "prefers-color-scheme: dark" in STYLE
    assert "color-scheme: light dark" in STYLE


def test_every_picture_is_inside_with_its_size_and_a_text(reader):
    assert all(picture["alt"] for picture in reader.pictures)
    pictures = [picture for picture in reader.pictures if "svg" not in picture["src"][:20]]
    assert len(pictures) == 2 * 4 + 2 * 2 + 2  # parts, scenes, errors
    assert len(reader.pictures) == len(pictures) + 2  # charts
    for picture in pictures:
        data = base64.b64decode(picture["src"].partition(",")[2])
        assert struct.unpack(">II", data[16:24]) == (int(picture["width"]), int(picture["height"]))


def test_what_comes_from_outside_is_escaped(page, reader):
    assert "<test>" not in page
    assert "a <test> device" in "".join(reader.words)


def test_table_1_puts_our_display_beside_the_papers(results):
    rows = {row[0]: row[1:] for row in read(tables.table_1(results.experiment.display)).tables[0]}
    assert rows["Lens pitch"] == ["2.116667 mm", "2.116667 mm"]
    assert rows["Pixels"] == ["512 x 512 at 96 dpi", "128 x 48 at 96 dpi"]
    assert rows["Field of view"] == ["17.7 degrees", "17.7 degrees"]


def test_table_2_has_seconds_savings_and_the_papers_slip(results):
    (rows,) = read(tables.table_2(results, Manner.PAPER)).tables
    teapot, tree = rows[-2:]
    assert teapot[:3] == ["teapot", "2.000", "1.000"]
    assert teapot[6:10] == ["0.800", "60 % saved", "20.0 %", "20.0 %"]
    assert (teapot[-1], tree[-1]) == ("57 to 66", "66 *")
    assert "69.9 %" in tables.table_2(results, Manner.PAPER)
    assert "66" not in tables.table_2(results, Manner.GLOSS)  # the paper prints nothing of that


def test_table_3_shows_eight_interpolated_lenses_and_their_mean(results):
    lenses = tables.lenses_of_table_3(results.experiment.display)
    assert lenses == (1, 3, 5, 7, 9, 11, 13, 15)
    (rows,) = read(tables.table_3(results, "teapot")).tables
    row = next(row for row in rows if row[0] == "interpolated, as in the paper")
    psnr = results.of("teapot", "interpolated-paper").comparison.paper.psnr[0]
    assert row[1:9] == [f"{psnr[lens]:.2f}" for lens in lenses]
    assert row[9] == f"{psnr[list(lenses)].mean():.2f}"
    assert row[10] == f"{psnr[1:].mean():.2f}"  # the first has no error
    assert rows[-1][9] == "37.67"
    assert "37.67" not in tables.table_3(results, "tree")


def test_lenses_of_table_3_on_the_papers_display():
    from lippmann.display import load_display

    assert tables.lenses_of_table_3(load_display("seed-lenticular")) == (5, 13, 21, 29, 37, 45, 53, 61)


def test_the_gloss_table_has_before_and_after(results):
    (rows,) = read(tables.gloss_table(results, "interpolated")).tables
    before, after = (results.of("tree", f"interpolated-{key}").comparison for key in ("default", "gloss"))
    assert rows[-1][:2] == ["tree", f"{before.psnr:.2f} → {after.psnr:.2f}"]
    assert rows[-1][3:] == ["15.0 % → 25.0 %", "0.500 → 1.000"]


def test_infinite_figures_have_words():
    assert tables.decibels(float("inf")) == "="
    assert tables.finite_mean([30.0, float("inf"), 32.0]) == 31.0
    assert tables.finite_mean([float("inf")]) == float("inf")


def test_the_summary_is_json_with_the_same_figures(results):
    values = json.loads(json.dumps(summary(results), allow_nan=False))
    run = values["scenes"]["teapot"]["interpolated-paper"]
    assert run["saved_percent"] == pytest.approx(60)
    assert run["order"] == "paper"
    assert run["psnr"] == results.of("teapot", "interpolated-paper").comparison.psnr
    assert "psnr" not in values["scenes"]["teapot"]["full"]
    assert values["printed"]["saved_percent"] == [57, 66]
    assert values["device"] == "a <test> device"


def test_slowdowns_are_said_as_such():
    assert tables.in_words(0.29) == "71 % saved"
    assert tables.in_words(1.0) == "0 % saved"
    assert tables.in_words(1.34) == "1.3 times as long"
    assert tables.in_words(10.07) == "10 times as long"
