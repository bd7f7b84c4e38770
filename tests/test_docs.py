"""Every command in the README and in docs/ runs, every Python example too, and the site of docs/ builds."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
import sys
import urllib.request
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


#: Pages are known by their folder, too: several folders have a page of the same name.
def name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.S | re.M)


def named_files(page: Path) -> list[tuple[str, str]]:
    """Files that a page tells its reader to save."""
    return re.findall(r'^```\w+ title="([^"]+)"\n(.*?)^```', page.read_text(encoding="utf-8"), re.S | re.M)


def commands(page: Path) -> list[list[str]]:
    text = "\n".join(blocks(page, "sh")).replace("\\\n", " ")
    return [shlex.split(line, comments=True) for line in text.splitlines() if shlex.split(line, comments=True)]


def cheaper(words: list[str]) -> list[str]:
    """The same command with less work: what it says is what is tested, not how fine the picture is."""
    if "--turntable" in words:
        words = list(words)
        words[words.index("--turntable") + 1] = "2"
    if "--target" in words and words[1] == "quilt":
        return [*words, "--size", "960x270" if "displayxr" in words else "480x270", "--spp", "2"]
    if words[1:3] == ["quilt", "render"]:
        plain = [] if {"--method", "--denoise"} & set(words) else ["--method", "full", "--denoise", "none"]
        return [*words, "--size", "384x384", "--spp", "2", *plain]
    if "--sweep" in words:
        return [*words, "--frames", "2"]
    if words[1] not in ("render", "preview") or any(
        word.startswith(("--effort", "--quality", "--max-time")) for word in words
    ):
        return words
    kept = list(words)
    if "--spp" in kept:
        kept[kept.index("--spp") + 1] = "1"
    if words[1] == "render" and not {"--method", "--denoise", "--integrator", "--turntable", "--frames"} & set(words):
        kept += ["--method", "full"]
    return kept if "--spp" in kept else [*kept, "--spp", "1"]


#: Pixels of a display along its longer side, at most, while commands run: its shape and its lenses stay as they are.
MOST_PIXELS = 384


@pytest.fixture
def workplace(tmp_path, monkeypatch, moving_ball, fake_bridge):
    """A folder with the files that the pages speak of; displays that are no prints have fewer pixels."""
    import trimesh

    import lippmann.display
    from lippmann.image.write import write_plain_picture

    load = lippmann.display.load_display

    def load_part(*words):
        whole = load(*words)
        panel, share = whole.panel, MOST_PIXELS / max(whole.panel.width, whole.panel.height)
        if whole.name.startswith("print") or share > 1:
            return whole
        return whole.resized(round(share * panel.width), round(share * panel.height))

    monkeypatch.setattr(lippmann.display, "load_display", load_part)

    scene = trimesh.Scene(trimesh.creation.icosphere(subdivisions=2))
    (tmp_path / "model.glb").write_bytes(trimesh.exchange.gltf.export_glb(scene))
    trimesh.creation.box().export(tmp_path / "model.obj")
    trimesh.creation.box().export(tmp_path / "model.stl")
    save_splats(tmp_path / "scan.ply")
    save_film(tmp_path / "film.mp4")
    save_head(tmp_path)
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
    (tmp_path / "photos").mkdir()
    for number in range(3):
        Image.new("RGB", (80, 60), (50 + 50 * number,) * 3).save(tmp_path / "photos" / f"IMG_{number}.jpg")
    Image.new("RGB", (32, 24), (200, 120, 60)).save(tmp_path / "photo.png")
    eyes = [Image.new("RGB", (320, 256), (level, 120, 60)) for level in (200, 100)]
    eyes[0].save(tmp_path / "photo.mpo", save_all=True, append_images=eyes[1:])
    np.save(tmp_path / "photo-depth.npy", np.where(np.arange(32) < 16, 1.0, 3.0) * np.ones((24, 1)))
    shutil.copytree(moving_ball.parent, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def save_head(folder: Path) -> None:
    """A bone in tissue in air, as NIfTI, and a transfer function."""
    import nibabel

    values = np.full((12, 12, 12), -1000, np.int16)
    values[2:10, 2:10, 2:10] = 40
    values[4:8, 4:8, 4:8] = 900
    nibabel.save(nibabel.Nifti1Image(values, np.diag([15.0, 15, 15, 1])), folder / "head.nii.gz")


def save_film(path: Path) -> None:
    import av

    with av.open(str(path), "w") as film:
        stream = film.add_stream("libx264", rate=24)
        stream.width, stream.height, stream.pix_fmt = 192, 256, "yuv420p"
        for level in (50, 150):
            film.mux(stream.encode(av.VideoFrame.from_ndarray(np.full((256, 192, 3), level, np.uint8), format="rgb24")))
        film.mux(stream.encode())


def save_splats(path: Path) -> None:
    """A ball of Gaussian splats, as trainers write them."""
    names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2"]
    names += ["rot_0", "rot_1", "rot_2", "rot_3"]
    rows = np.zeros((200, len(names)), "<f4")
    rows[:, :3] = np.random.default_rng(0).normal(scale=10, size=(200, 3))
    rows[:, 6:11] = 2, 1, 1, 1, 1
    lines = ["ply", "format binary_little_endian 1.0", "element vertex 200", *(f"property float {n}" for n in names)]
    path.write_bytes("\n".join([*lines, "end_header", ""]).encode() + rows.tobytes())


def save_named_files(page: Path, folder: Path) -> None:
    for file, text in named_files(page):
        (folder / file).write_text(text, encoding="utf-8")


def run_python(page: Path) -> None:
    for code in blocks(page, "python"):
        exec(compile(code, str(page), "exec"), {"__name__": "example"})


def serve_once(content, what, console, *, host, port, browser, folder="", started=lambda: None):
    """In place of a server that runs until Ctrl-C: the page is fetched, once."""
    from lippmann.viewer.http_server import WebServer

    with WebServer(content, host, port, folder=folder) as server, urllib.request.urlopen(server.address) as answer:
        assert b"<main" in answer.read()
    console.result({"address": server.address}, server.address)


@pytest.mark.long_cases(
    but=[
        "README.md",
        "docs/how-to/calibrate.md",
        "docs/how-to/caustics.md",
        "docs/how-to/install.md",
        "docs/how-to/reach-the-panel.md",
        "docs/how-to/volumes.md",
        "docs/reference/layers.md",
        "docs/reference/looking-glass.md",
        "docs/reference/monitor-display.md",
        "docs/tutorials/print-maker.md",
    ]
)
@pytest.mark.slow
@pytest.mark.parametrize("page", [p for p in PAGES if commands(p)], ids=name)
def test_commands_and_python_run_in_the_order_of_the_page(page, workplace, engine, capfd, monkeypatch):
    from lippmann.cli import run

    monkeypatch.setattr("lippmann.cli.commands.view.serve", serve_once)
    save_named_files(page, workplace)
    for words in commands(page):
        assert words[0] == "lippmann", f"{name(page)}: only lippmann's own commands are shown as sh"
        code = run(cheaper(words)[1:])
        assert code == 0, f"{name(page)}: {shlex.join(words)}\n{capfd.readouterr().err}"
    run_python(page)


@pytest.mark.long_cases("docs/tutorials/python.md")
@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p, "python") and not commands(p)], ids=name)
def test_python_examples_run(page, workplace, engine):
    run_python(page)


def test_links_lead_somewhere():
    """In the source tree, too, where pages of the site that are built from help texts do not exist."""
    for page in PAGES:
        for target in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{name(page)} links to {target}"


#: The tags by which a page may load something, which are a small part of it.
LOADING = re.compile(r"<(?:script|img|iframe|source|link)\b[^>]*>")


class Loaded(HTMLParser):
    """Addresses that a browser fetches to show a page."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        if tag in ("script", "img", "iframe", "source"):
            self.addresses.append(values.get("src") or "")
        elif tag == "link" and values.get("rel") in ("stylesheet", "preload", "preconnect", "icon"):
            self.addresses.append(values.get("href") or "")


#: The index for searches, colours of code and line breaks of signatures take a third of the time of a build.
LESS_OF_THE_SITE = {
    "  - search\n": "",
    "  - pymdownx.highlight\n": "  - pymdownx.highlight: {use_pygments: false}\n",
    "separate_signature: true": "separate_signature: false",
}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site built without what no test looks at; a warning of MkDocs ends the build."""
    pytest.importorskip("mkdocs")
    folder = tmp_path_factory.mktemp("site")
    settings = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    for whole, less in LESS_OF_THE_SITE.items():
        assert settings.count(whole) == 1, whole
        settings = settings.replace(whole, less)
    words = [sys.executable, "-m", "mkdocs", "build", "--strict", "--config-file", "-", "--site-dir", str(folder)]
    done = subprocess.run(words, cwd=ROOT, input=settings, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.mark.slow
def test_the_site_tells_of_every_option_and_function(site):
    render = (site / "reference" / "commands" / "render.html").read_text(encoding="utf-8")
    assert "--quality" in render
    assert "--tls-key" in render
    assert (site / "reference" / "commands" / "quilt-pack.html").exists()
    functions = (site / "reference" / "python" / "rendering.html").read_text(encoding="utf-8")
    assert 'id="lippmann.render_to_file"' in functions
    assert "placement" in functions
    options = (site / "reference" / "python" / "options.html").read_text(encoding="utf-8")
    assert "clamp_indirect" in options
    assert "environment_strength" in options


def test_the_site_shows_the_tables_of_properties(site):
    page = (site / "reference" / "properties.html").read_text(encoding="utf-8")
    for table in (ROOT / "docs" / "reference" / "properties").glob("*.toml"):
        name = table.read_text(encoding="utf-8").split('name = "')[1].split('"')[0]
        assert name.replace("&", "&amp;") in page, table.stem


@pytest.mark.slow
def test_pages_of_the_site_load_nothing_from_other_hosts(site):
    pages = list(site.rglob("*.html"))
    assert len(pages) > 50
    for page in pages:
        loaded = Loaded()
        for tag in LOADING.findall(page.read_text(encoding="utf-8")):
            loaded.feed(tag)
            loaded.clear_cdata_mode()  # of a script, whose end is left out
        foreign = [address for address in loaded.addresses if re.match(r"(https?:)?//", address)]
        assert not foreign, f"{page.relative_to(site)} loads {foreign}"


@pytest.mark.parametrize(
    "word",
    [
        "accommodation",
        "crosstalk",
        "elemental image",
        "EPI",
        "focal length",
        "interlacing",
        "orthoscopic",
        "pseudoscopic",
        "sub-aperture view",
        "turntable",
        "view zone",
    ],
)
def test_the_glossary_explains_what_users_search_for(word):
    rows = (ROOT / "docs" / "reference" / "glossary.md").read_text(encoding="utf-8").splitlines()
    entries = [row.split("|")[1] for row in rows if row.startswith("| ")]
    assert any(word in entry for entry in entries)


def test_the_research_notes_list_each_finding():
    listed = re.findall(r"^\| `(\w+\.sh)` \|", (ROOT / "docs/research/index.md").read_text(encoding="utf-8"), re.M)
    assert sorted(listed) == sorted(file.name for file in (ROOT / "findings").glob("*.sh"))
