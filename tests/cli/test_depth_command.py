"""``--integrator depth``: shades and a legend in formats for eyes, millimetres in those for data."""

from __future__ import annotations

import pytest

from lippmann.image import read_picture


@pytest.mark.slow
def test_the_command_writes_shades_and_a_legend_but_floats_as_they_are(lippmann, engine, cut_display, tmp_path):
    words = ("render", "teapot", "-d", cut_display(128, 128), "--integrator", "depth", "-o")
    done = lippmann(*words, tmp_path / "d.png")
    assert "see d-legend.png; .exr keeps millimetres" in done.err
    shades = read_picture(tmp_path / "d.png")
    assert shades.srgb().std() > 30
    assert (tmp_path / "d-legend.png").exists()
    assert lippmann(*words, tmp_path / "d.exr").code == 0
    exact = read_picture(tmp_path / "d.exr").pixels
    assert exact.min() < -10
    low, high = shades.provenance.options["depth_shades"]
    assert (low, high) == (pytest.approx(exact.min(), abs=1e-3), pytest.approx(exact[exact != 0].max(), abs=1e-3))
    assert not (tmp_path / "d.exr-legend.png").exists()
