"""The job sheet: what it says of a print."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from lippmann.calibration.job_sheet import job_facts, job_steps, write_job_sheet
from lippmann.display.formats.print_sheet import Print
from lippmann.display.sheet_layout import with_bleed, with_margin
from lippmann.errors import OutputError

#: 200 x 100 pixels of 0.127 mm.
PLAIN = Print(ppi=200, size=(25.4, 12.7), lpi=20, viewing_distance=300, thickness=3.14).display()
SHEET = with_margin(with_bleed(PLAIN, 2.54), 40)


def test_sizes_and_pitch():
    facts = dict(job_facts(SHEET, "print.tif"))
    assert facts["File"] == "print.tif"
    assert facts["Finished print"] == "25.40 x 12.70 mm, 200 x 100 pixels"
    assert facts["Sheet"] == "40.64 x 27.94 mm, 320 x 220 pixels"
    assert facts["Bleed"] == "2.54 mm on every side"
    assert facts["Margin with marks"] == "5.08 mm on every side"
    assert facts["Resolution"] == "200 pixels per inch"
    # The gap is 1.928 mm, a little less than 3.14 / 1.57: 20 lpi D / (D + g) = 20 * 300 / 301.928.
    assert facts["Lens sheet"].startswith("20 lenses per inch")
    assert facts["Print pitch"].startswith("19.8723 per inch, 10.06 pixels per lens")
    assert facts["Viewing distance"] == "300 mm"
    assert facts["Colours"] == "RGB, profile sRGB"
    assert dict(job_facts(PLAIN, "print.tif"))["Bleed"] == "none"


def test_the_order_of_work():
    on_paper = job_steps(SHEET.sheet)
    on_lenses = job_steps(replace(SHEET.sheet, mirrored=True))
    assert [bool(re.search("[Ll]aminate", step)) for step in on_paper] == [False, True, False, False, True, False]
    assert "mirrored already" in on_lenses[1]
    assert on_paper[-1] == on_lenses[-1] == "Cut at the cutting lines."
    assert not any("strips" in step or "Cut" in step for step in job_steps(PLAIN.sheet))


@pytest.mark.parametrize("file", ["print.tif", "$x^2$ _ % {a}.tif", "\u5370\u5237.tif", "long" * 60 + ".tif"])
def test_any_name_fits_one_page(tmp_path, file):
    write_job_sheet(SHEET, tmp_path / "job.pdf", file)
    content = (tmp_path / "job.pdf").read_bytes()
    assert content.startswith(b"%PDF")
    assert content.count(b"/Type /Page ") == 1
    if file == "print.tif":
        write_job_sheet(SHEET, tmp_path / "again.pdf", file)
        assert (tmp_path / "again.pdf").read_bytes() == content


def test_other_endings_are_refused(tmp_path):
    with pytest.raises(OutputError, match=r"a job sheet is a \.pdf file"):
        write_job_sheet(SHEET, tmp_path / "job.png", "print.tif")
