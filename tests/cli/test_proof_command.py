"""``lippmann proof``: text, JSON and pages; what is refused, in one line; and what a plan says of the lens."""

from __future__ import annotations

import json

import pytest

SHEET = "print:lpi=60,ppi=360,size=30x20mm,thickness=26mil"


def test_a_print_is_proved_in_words(lippmann):
    done = lippmann("proof", SHEET)
    assert done.code == 0
    names = [line.split("  ")[0].strip() for line in done.out.splitlines()]
    assert names == [
        *("display", "lens", "directions", "crosstalk", "depth", "field", "zone", "moire"),
        *("3 % thicker", "strips", "dot gain", "register", "pitch", "advice"),
    ]


def test_as_json_with_a_page(lippmann, tmp_path):
    page = tmp_path / "page.html"
    done = lippmann("proof", "seed-lenticular", "--json", "-o", page)
    found = json.loads(done.out)
    assert found["output"] == str(page)
    assert found["viewing_distance"] == "infinite"
    assert found["directions"] == pytest.approx(8)
    assert found["lens"] is None
    assert page.exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((SHEET + ",radius=0.2mm",), "print: radius: radius is 0.2 mm; lenses 0.4233 mm wide need more than 0.2117 mm"),
        ((SHEET + ",index=2.1",), "print: index: index is 2.1; it must lie between 1.3 and 2; sheets have 1.49"),
        (
            ("print:lpi=60,ppi=360,size=30x20mm,thickness=0.1mm",),
            "thickness is 0.1 mm; the crest alone is 0.1532 mm high",
        ),
        (("print:lpi=60,ppi=360,size=30x20mm,radius=0.3mm",), "print: radius: radius is given without a thickness"),
        (("print:sheet=60lpi,ppi=360,size=30x20mm",), "unknown sheet '60lpi'"),
        (("odyssey-3d",), "odyssey-3d has no proof; an eye-tracked monitor steers the light of unknown lenses"),
        (("nowhere",), "unknown display 'nowhere'"),
        ((SHEET, "-o", "page.docx"), "page.docx: the ending is '.docx'; the page of a proof ends in .html, .pdf, .png"),
    ],
)
def test_bad_input_is_refused_in_one_line(lippmann, tmp_path, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    done = lippmann("proof", *arguments)
    assert (done.code, done.out) == (2, "")
    assert said in done.err
    assert done.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("engine", "short_probe")
def test_a_plan_tells_of_the_lens(lippmann):
    done = lippmann("plan", "teapot", "--display", SHEET, "--json")
    found = json.loads(done.out)
    assert found["proof"]["tolerances"]["best_strips"] == 23
    assert any("not thickness / index (0.4206 mm)" in note for note in found["notes"])
