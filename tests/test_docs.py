"""Every command in the README and in docs/ runs, and every Python example too."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.S | re.M)


def commands(page: Path) -> list[list[str]]:
    text = "\n".join(blocks(page, "sh")).replace("\\\n", " ")
    return [shlex.split(line, comments=True) for line in text.splitlines() if shlex.split(line, comments=True)]


def cheaper(words: list[str]) -> list[str]:
    """The same command with less work: what it says is what is tested, not how fine the picture is."""
    if words[1:3] == ["quilt", "render"]:
        return [*words, "--size", "384x384", "--spp", "2"]
    if words[1] not in ("render", "preview") or any(word.startswith(("--quality", "--max-time")) for word in words):
        return words
    kept = list(words)
    if "--spp" in kept:
        kept[kept.index("--spp") + 1] = "1"
    return kept if "--spp" in kept else [*kept, "--spp", "1"]


@pytest.fixture
def workplace(tmp_path, monkeypatch, moving_ball):
    """A folder with the files that the pages speak of."""
    import trimesh

    from lippmann.image.write import write_plain_picture

    scene = trimesh.Scene(trimesh.creation.icosphere(subdivisions=2))
    (tmp_path / "model.glb").write_bytes(trimesh.exchange.gltf.export_glb(scene))
    trimesh.creation.box().export(tmp_path / "model.obj")
    trimesh.creation.box().export(tmp_path / "model.stl")
    sky = np.ones((8, 16, 3), dtype=np.float32)
    write_plain_picture(sky, tmp_path / "sky.exr")
    body = "CAMERA ZOOM 1 ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH 2 CENTER 0 0 -5 VIEWDIR 0 0 1 UPDIR 0 1 0 END_CAMERA"
    ball = "SPHERE CENTER 0 0 0 RAD 1 TEXTURE AMBIENT 0.2 DIFFUSE 0.8 SPECULAR 0 OPACITY 1 COLOR 1 1 1 TEXFUNC 0"
    (tmp_path / "room.dat").write_text(f"BEGIN_SCENE RESOLUTION 64 64 {body} {ball} END_SCENE")
    (tmp_path / "room.cam").write_text("0 0 1 0 1 0 0 0 -5\n")
    presets = ROOT / "src" / "lippmann" / "display" / "presets"
    shutil.copy(presets / "mla-square.toml", tmp_path / "my-display.toml")
    monitor = 'width = 384\nheight = 216\npixel_pitch = "80 dpi"\npitch = 12.9\nslope = -6.0\ncenter = 0.37\n'
    (tmp_path / "monitor.toml").write_text(f"[monitor]\n{monitor}")
    numbers = {"pitch": 52.58, "slope": -7.145, "center": 0.42, "viewCone": 40, "invView": 1, "DPI": 324}
    numbers |= {"screenW": 150, "screenH": 200}
    calibration = {"serial": "LKG-P00001"} | {key: {"value": value} for key, value in numbers.items()}
    (tmp_path / "visual.json").write_text(json.dumps(calibration))
    (tmp_path / "pinholes").mkdir()
    for number in range(48):
        view = np.full((64, 48, 3), number / 48, dtype=np.float32)
        write_plain_picture(view, tmp_path / "pinholes" / f"view_{number:02}.png")
    shutil.copytree(moving_ball.parent, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("page", [p for p in PAGES if commands(p)], ids=lambda page: page.name)
def test_commands_run_in_the_order_of_the_page(page, workplace, engine, capfd):
    from lippmann.cli import run

    for words in commands(page):
        assert words[0] == "lippmann", f"{page.name}: only lippmann's own commands are shown as sh"
        code = run(cheaper(words)[1:])
        assert code == 0, f"{page.name}: {shlex.join(words)}\n{capfd.readouterr().err}"


@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p, "python")], ids=lambda page: page.name)
def test_python_examples_run(page, workplace, engine):
    for code in blocks(page, "python"):
        exec(compile(code, str(page), "exec"), {"__name__": "example"})


def test_links_lead_somewhere():
    for page in PAGES:
        for target in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name} links to {target}"
