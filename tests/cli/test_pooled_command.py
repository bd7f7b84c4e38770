"""Pooled light as a method of ``lippmann render``."""

from __future__ import annotations

import pytest


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--integrator", "classic"), "--integrator"),
        (("--integrator", "normal"), "--integrator"),
        (
            ("--denoise", "none"),
            "--denoise: pooled needs the denoiser; pooled shares denoised light; use --method full",
        ),
        (("--denoise", "none", "--quality-worst", "30"), "--denoise"),
        (("--spp", "1", "--quality-worst", "30"), "--spp"),
        (("--order", "paper"), "--order"),
    ],
)
def test_what_cannot_be_pooled_is_refused(lippmann, engine, tmp_path, words, complaint):
    done = lippmann("render", "teapot", "--method", "pooled", *words, "-o", tmp_path / "a.png")
    assert done.code == 2
    assert done.err.startswith(f"lippmann: {complaint}")
    assert done.err.count("\n") == 1
