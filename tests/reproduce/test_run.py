"""``lippmann reproduce``: the folder that it writes, what it says, and a small real run."""

from __future__ import annotations

import csv
import json
import re

import numpy as np
import pytest

from lippmann.reproduce import VARIANTS, Experiment, reproduce, run_experiment
from lippmann.reproduce.run import engine_renderer, make_experiment
from lippmann.scene import bundled


@pytest.fixture
def lippmann(capfd):
    """Run one command: ``(exit code, standard output, standard error)``."""
    from lippmann.cli import run

    def call(*words):
        capfd.readouterr()
        code = run([str(word) for word in words])
        captured = capfd.readouterr()
        return code, captured.out, captured.err

    return call


@pytest.fixture
def without_engine(monkeypatch, fake_renderer):
    """Pictures come from the fake renderer."""
    monkeypatch.setattr(
        "lippmann.reproduce.run.engine_renderer",
        lambda display, device, threads, physical=False: fake_renderer(display),
    )


def test_quick_is_a_part_of_the_whole():
    quick, whole = make_experiment(quick=True), make_experiment(quick=False)
    assert set(quick.scenes) < set(whole.scenes) == set(bundled.names())
    assert quick.display.panel.width < whole.display.panel.width == 512
    assert quick.runs < whole.runs


@pytest.mark.slow
def test_the_command_writes_the_page_and_its_figures(lippmann, without_engine, tmp_path):
    out = tmp_path / "report"
    code, said, _ = lippmann("reproduce", "-o", out, "--quick", "--json")
    assert code == 0
    values = json.loads(said)
    assert values["output"] == str(out / "report.html")
    assert (out / "report.html").read_text(encoding="utf-8").startswith("<!doctype html>")
    figures = json.loads((out / "results.json").read_text(encoding="utf-8"))
    assert figures == {key: value for key, value in values.items() if key != "output"}
    assert figures["display"]["pixels"] == [256, 256]
    assert set(figures["scenes"]) == {"teapot", "small-balls"}
    assert set(figures["scenes"]["teapot"]) == {variant.key for variant in VARIANTS}
    assert set(figures["physical"]) == {"teapot"}


@pytest.mark.slow
def test_tables_for_other_programs(lippmann, without_engine, tmp_path):
    assert lippmann("reproduce", "-o", tmp_path / "report", "--quick")[0] == 0
    with (tmp_path / "report" / "results.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * len(VARIANTS)
    first = next(row for row in rows if row["method"] == "interpolated, as in the paper")
    assert (first["light"], first["time"], first["pixels traced, %"]) == ("cheap", "60 % saved", "20.0")
    assert {row["light"] for row in rows} == {"cheap", "physically based"}
    latex = (tmp_path / "report" / "results.tex").read_text()
    lines = latex.splitlines()
    assert lines[:2] == [r"\begin{tabular}{lllrrrrr}", r"\toprule"]
    assert lines[-2:] == [r"\bottomrule", r"\end{tabular}"]
    assert all(line.count(" & ") == 7 for line in lines if line.endswith(r"\\"))
    assert r"60 \% saved" in latex
    assert "%" not in latex.replace(r"\%", "")


def test_lost_time_is_never_a_negative_saving(lippmann, without_engine, tmp_path, monkeypatch):
    from lippmann.reproduce.experiment import Run

    monkeypatch.setattr(Run, "time_share", property(lambda run: 1.0 if run.comparison is None else 10.07))
    code, said, _ = lippmann("reproduce", "-o", tmp_path / "report", "--quick")
    assert code == 0
    told = {name: (tmp_path / "report" / name).read_text() for name in ("results.csv", "results.tex", "report.html")}
    for name, text in {"the command": said, **told}.items():
        assert "10 times as long" in text, name
        assert not re.search(r"-\d+(\.\d+)? ?\\?%", text), name


@pytest.mark.long
def test_it_says_what_was_saved(lippmann, without_engine, tmp_path):
    code, said, _ = lippmann("reproduce", "-o", tmp_path / "report", "--quick")
    assert code == 0
    assert "teapot       interpolated as in the paper: time 60 % saved, 31." in said
    assert lippmann("reproduce", "-o", tmp_path / "report", "--quick", "-q") == (0, "", "")


def test_a_folder_with_other_files_is_left_alone(lippmann, without_engine, tmp_path):
    (tmp_path / "thesis.txt").write_text("years of work")
    code, said, complaint = lippmann("reproduce", "-o", tmp_path, "--quick")
    assert (code, said) == (2, "")
    assert "thesis.txt" in complaint
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_nothing_is_rendered_for_a_place_that_cannot_be_written(monkeypatch, tmp_path):
    from lippmann.errors import OutputError

    def refuse(*_):
        raise AssertionError("rendering began")

    monkeypatch.setattr("lippmann.reproduce.run.engine_renderer", refuse)
    with pytest.raises(OutputError, match="there is no folder"):
        reproduce(tmp_path / "no" / "such", quick=True)


@pytest.mark.slow
def test_nothing_is_left_of_a_run_that_fails(monkeypatch, fake_renderer, tmp_path):
    def interrupt(results):
        raise KeyboardInterrupt

    monkeypatch.setattr("lippmann.reproduce.run.engine_renderer", lambda display, *_, **__: fake_renderer(display))
    monkeypatch.setattr("lippmann.reproduce.run.report_page", interrupt)
    with pytest.raises(KeyboardInterrupt):
        reproduce(tmp_path / "report", quick=True)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_small_real_run(engine, small_display):
    results = run_experiment(
        Experiment(("small-balls",), small_display, runs=1, warm_up=0), engine_renderer(small_display)
    )
    full = results.full("small-balls")
    assert full.image.provenance.integrator == "classic"
    assert full.image.provenance.rays["primary"] == 128 * 48
    assert full.image.pixels.std() > 0.05  # there is something to be seen
    for variant in VARIANTS[1:]:
        run = results.of("small-balls", variant.key)
        made, status = run.image.provenance, run.image.maps["status"]
        assert made.method == variant.method
        assert 0 < made.traced_fraction < 1
        assert set(np.unique(status)) <= {0, 1, 2}
        assert np.mean(status == 0) == pytest.approx(made.traced_fraction, abs=1e-6)
        assert (status == 2).any() == (variant.method == "interpolated")
        assert run.comparison.psnr > 15
    respected = results.of("small-balls", "lens-view-gloss").comparison.psnr
    assert respected > results.of("small-balls", "lens-view-default").comparison.psnr
