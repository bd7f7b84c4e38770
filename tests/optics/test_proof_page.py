"""Pages of proofs: their formats, their text, and what cannot be written."""

from __future__ import annotations

import pytest
from PIL import Image

from lippmann.display import load_display
from lippmann.errors import OutputError
from lippmann.optics.proof import prove
from lippmann.optics.proof_page import check_proof_page, write_proof_page


@pytest.mark.slow
def test_a_page_shows_the_proof_and_its_plots(tmp_path):
    display = load_display("print-60lpi")
    proof = prove(display)
    page = tmp_path / "proof.html"
    write_proof_page(proof, display, page)
    text = page.read_text(encoding="utf-8")
    assert "Proof of print-60lpi" in text
    for value in (proof.in_words()["crosstalk"], proof.in_words()["zone"]):
        assert value in text
    assert "where an eye sees the whole picture" in text
    assert "http://" not in text.replace("http://www.w3.org", "")
    assert "<script" not in text


@pytest.mark.slow
def test_pictures_and_documents(tmp_path):
    for name, ending in (("print-60lpi", "png"), ("panel-4k", "pdf")):
        display = load_display(name)
        write_proof_page(prove(display), display, tmp_path / f"proof.{ending}")
    assert (tmp_path / "proof.pdf").read_bytes().startswith(b"%PDF")
    with Image.open(tmp_path / "proof.png") as picture:
        assert picture.height > picture.width > 1000


def test_other_endings_are_refused(tmp_path):
    with pytest.raises(OutputError, match=r"the ending is '.txt'; the page of a proof ends in .html, .pdf, .png"):
        check_proof_page(tmp_path / "proof.txt")
