"""Every reader of what others wrote, as a function of bytes; see ``docs/reference/file-formats.md``.

Formats whose reader follows references (materials, chunks, views) take whole folders, packed by :mod:`parcels`.
"""

from __future__ import annotations

import asyncio
import gzip
import io
import json
import os
import re
import shutil
import zipfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest import mock

import numpy as np
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

from lippmann.api import render
from lippmann.cli import run
from lippmann.cli.commands.sequence import frame_range, name_frames
from lippmann.cli.shared import parse
from lippmann.cluster import job_pickle
from lippmann.cluster.address import parse_target
from lippmann.codecs.ktx2 import Ktx2Error, decode_ktx2
from lippmann.codecs.pfm import read_pfm
from lippmann.display import Display, LensArray, Panel, load_display
from lippmann.display.formats.load import display_of_short_form
from lippmann.display.formats.looking_glass import display_of_calibration
from lippmann.display.formats.monitor_toml import monitor_of_tables
from lippmann.errors import LippmannError, PictureError, SceneError
from lippmann.exchange.hci_parameters import read_parameters
from lippmann.exchange.layouts import import_image
from lippmann.image import compose, read_picture, streamed
from lippmann.image.metadata import from_text
from lippmann.journal import DamagedTile, FrameJournal, TileGrid, TileStore, decode
from lippmann.options import texts
from lippmann.quilts import files as quilt_files
from lippmann.quilts import quilt
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.parsing.files import decode_image
from lippmann.scene.readers.depth_map import read_depth_map
from lippmann.scene.readers.environment_map import read_environment
from lippmann.scene.readers.gltf_animation.animated_file import MovingGltf
from lippmann.scene.readers.load import load_scene
from lippmann.scene.readers.tachyon.reader import read_cam
from lippmann.scene.values.description import SceneDescription
from lippmann.scene.volumes.transfer_file import read_transfer_function
from lippmann.tiles.job import make_job
from lippmann.viewer.calibrate.site import CalibrationSite
from lippmann.viewer.request_guard import RequestGuard
from lippmann.viewer.served_picture import PictureFile
from lippmann.viewer.server import ViewerSite
from lippmann.viewer.site_application import site_application

from forms import (  # isort: skip
    body_tree,
    glb_repaired,
    glb_tree,
    part_tree,
    png_repaired,
    tile_repaired,
    tile_tree,
)
from guard import SECONDS, Read  # isort: skip
from mutation import json_tree  # isort: skip
from parcels import LINK, PIPE, unpack  # isort: skip
from vocabulary import VOCABULARY  # isort: skip

CORPUS = Path(__file__).parent / "corpus"


@dataclass(frozen=True)
class Target:
    """A reader.

    Attributes
    ----------
    read:
        Gives it an input, in a folder of its own that is empty; returns, or raises what the reader raises.
    words, tree, repair:
        As of :class:`mutation.Mutator`.
    seconds:
        CPU seconds that an input may take.
    """

    read: Read
    words: tuple[bytes, ...] = ()
    tree: Callable[[bytes], Any] | None = None
    repair: Callable[[bytes], bytes] | None = None
    seconds: float = SECONDS


def _format(name: str) -> str:
    """The target whose inputs a target shares: what is rendered is what is read."""
    return name.removeprefix("rendered-")


def seeds(name: str) -> list[bytes]:
    """The sound inputs of a target."""
    return list(named_seeds(name).values())


def named_seeds(name: str) -> dict[str, bytes]:
    """The sound inputs of a target by name."""
    if name == "parcel":
        return {"seed-now": _sound_parcel()}
    return {path.name: path.read_bytes() for path in sorted((CORPUS / _format(name)).glob("seed-*"))}


def found(name: str) -> list[Path]:
    """Inputs of a target that broke the rule once, or led somewhere odd."""
    return sorted((CORPUS / name).glob("found-*"))


def _scene(name: str) -> Read:
    def read(data: bytes, folder: Path) -> object:
        (folder / name).write_bytes(data)
        scene = load_scene(folder / name)
        if isinstance(scene.description, SceneDescription):
            _check_whole(scene.description)
        return scene.bounds

    return read


def _check_whole(scene: SceneDescription) -> None:
    """A scene that comes of a damaged file holds together."""
    for mesh in scene.meshes:
        count = len(mesh.positions)
        assert mesh.faces.shape[1] == 3
        assert (mesh.faces < count).all()
        assert np.isfinite(mesh.positions).all()
        assert 0 <= mesh.material < len(scene.materials)
        for values in (mesh.normals, mesh.colors, *mesh.uvs):
            assert values is None or (len(values) == count and np.isfinite(values).all())
    assert all(0 <= instance.mesh < len(scene.meshes) for instance in scene.instances)
    for places in scene.placements.values():
        assert np.isfinite(np.linalg.inv(places)).all()
    for matrix in (*(c.world_from_camera for c in scene.cameras), *(x.world_from_light for x in scene.lights)):
        np.testing.assert_allclose(np.linalg.det(matrix), 1.0)


def _depth_map(data: bytes, folder: Path) -> object:
    """A depth map in whichever form its first bytes are of."""
    endings = {b"\x93NUMPY": ".npy", b"Pf": ".pfm", b"v/1\x01": ".exr"}
    ending = next((ending for head, ending in endings.items() if data.startswith(head)), ".png")
    (folder / f"d{ending}").write_bytes(data)
    with np.errstate(all="ignore"):
        return read_depth_map(folder / f"d{ending}").inverse.shape


def _volume(name: str) -> Read:
    """A volume."""
    still = _scene(name)

    def read(data: bytes, folder: Path) -> object:
        with np.errstate(all="ignore"):
            return still(data, folder)

    return read


def _transfer_function(data: bytes, folder: Path) -> object:
    """A transfer function as JSON if it begins so, else as TOML."""
    path = folder / ("t.json" if data.lstrip().startswith(b"{") else "t.toml")
    path.write_bytes(data)
    return read_transfer_function(path)


def _with(library: str, reader: Read) -> Read:
    """A reader by a library of an extra: one that is not installed is not under fire."""

    def read(data: bytes, folder: Path) -> object:
        return reader(data, folder) if find_spec(library) else None

    return read


def _gltf(name: str) -> Read:
    still = _scene(name)

    def read(data: bytes, folder: Path) -> object:
        still(data, folder)
        moving = MovingGltf(folder / name)
        return moving.at(moving.duration / 2)

    return read


def _obj(data: bytes, folder: Path) -> object:
    unpack(data, folder)
    return load_scene(folder / "s.obj").bounds


def _mitsuba(data: bytes, folder: Path) -> object:
    import mitsuba

    # Mitsuba reads its scenes alike in all variants; in this one it then compiles nothing. A change of it takes 0.1 s.
    if mitsuba.variant() != "scalar_rgb":
        mitsuba.set_variant("scalar_rgb")
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    unpack(data, folder)
    scene = load_scene(folder / "s.xml")
    return scene.bounds, scene.cameras, scene.has_lights


def _spz(data: bytes, folder: Path) -> object:
    """A file as it is, or what it packs."""
    is_whole = data.startswith((b"\x1f\x8b", b"NGSP\4"))
    (folder / "s.spz").write_bytes(data if is_whole else gzip.compress(data, 1))
    return load_scene(folder / "s.spz").bounds


def _sog(data: bytes, folder: Path) -> object:
    """A file as it is, or what it bundles."""
    if data.startswith(b"PK"):
        (folder / "s.sog").write_bytes(data)
    else:
        (folder / "s").mkdir()
        unpack(data, folder / "s")
        with zipfile.ZipFile(folder / "s.sog", "w") as archive:
            for path in sorted((folder / "s").rglob("*")):
                if path.is_file():
                    archive.write(path, path.relative_to(folder / "s"))
    return load_scene(folder / "s.sog").bounds


def _environment(data: bytes, folder: Path) -> object:
    (folder / "sky").write_bytes(data)
    return read_environment(folder / "sky")


def _texture(data: bytes, folder: Path) -> object:
    return decode_image(data, "t.png", where="s.obj")


def _ktx2(data: bytes, folder: Path) -> object:
    try:
        return decode_ktx2(data).sum()
    except Ktx2Error as error:  # whoever reads textures tells it further, with a place
        raise SceneError(str(error)).with_traceback(error.__traceback__) from None


#: Commands whose words are tried: those that neither render nor serve.
_TRIED = ("compare", "displays", "info", "quilt sizes", "quilt unpack", "views", "weave")


def _command(data: bytes, folder: Path) -> object:
    """Words of a command, one a line, in a folder with a picture."""
    words = [line.decode("utf-8", "surrogateescape").replace("\0", "") for line in data.split(b"\n")][:12]
    if words[0] not in _TRIED or any("/" in word or ".." in word for word in words):
        return None
    shutil.copy(CORPUS / "picture-png" / "seed-8.png", folder / "p.png")
    before = os.getcwd()
    os.chdir(folder)
    try:
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()) as said:
            code = run([*words[0].split(), *words[1:]])
    finally:
        os.chdir(before)
    line = said.getvalue()
    if "internal error" in line or "Traceback" in line:
        raise RuntimeError(line)
    return code


#: CPU seconds for those that are rendered: a new kind of scene is compiled first.
COMPILED = 10.0

#: A display with few pixels: what is under fire is that the scene is built and traced.
_FEW = Display("few", Panel(6, 4, 0.5), LensArray("square", 1.0), gap=2.0)


def _rendered(name: str) -> Read:
    """A scene built and traced, with all that its meshes, materials and textures may be."""

    def render_scene(data: bytes, folder: Path) -> object:
        if name in ("s.obj", "s.xml"):
            unpack(data, folder)
        else:
            (folder / name).write_bytes(data)
        # Splats bring their colours: no light model is asked for.
        integrator = "auto" if name == "s.ply" else "direct"
        return render(folder / name, _FEW, method="full", integrator=integrator, spp=1).pixels.sum()

    return render_scene


#: Stands between the key, the outline, and the names and contents of the parts of a job on its way to a worker.
_SEAM = b"<part>"


@cache
def _sound_parcel() -> bytes:
    """A job as it is sent now: the corpus could only hold that of one version."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "s.xml")
        path.write_text(
            '<scene version="3.0.0"><shape type="obj"><string name="filename" value="m.obj"/></shape></scene>'
        )
        Path(folder, "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        job = make_job(load_scene(path), _FEW, RenderRequest(integrator="direct", spp=2), stored="uint8")
        parcel = job_pickle.pack(job)
    parts = [field for name in parcel.names for field in (name.encode(), parcel.parts[name].tobytes())]
    return _SEAM.join([parcel.key.encode(), parcel.outline.tobytes(), *parts])


def _parcel(data: bytes, folder: Path) -> object:
    """A job on its way to a worker; whatever is not what was sent is refused before it is restored."""
    key, outline, *parts = [*data.split(_SEAM), b""][: data.count(_SEAM) + 1 + (_SEAM not in data)]
    names = [name.decode("latin-1") for name in parts[::2]]
    contents = [np.frombuffer(part, np.uint8) for part in parts[1::2]]
    return job_pickle.unpack(key.decode("latin-1"), np.frombuffer(outline, np.uint8), names, contents, folder)


def _cam(data: bytes, folder: Path) -> object:
    (folder / "s.cam").write_bytes(data)
    return read_cam(folder / "s.cam")


def _toml(data: bytes, folder: Path) -> object:
    (folder / "d.toml").write_bytes(data)
    return load_display(folder / "d.toml").to_dict()


def _visual(data: bytes, folder: Path) -> object:
    (folder / "visual.json").write_bytes(data)
    return display_of_calibration(data.decode("utf-8", "replace"), where="visual.json"), load_display(
        folder / "visual.json"
    )


def _short(data: bytes, folder: Path) -> object:
    return display_of_short_form(data.decode("utf-8", "surrogateescape"))


def _quilt_name(data: bytes, folder: Path) -> object:
    return quilt.layout_of_name(Path(data.decode("utf-8", "surrogateescape")))


def _quilt(data: bytes, folder: Path) -> object:
    (folder / "q_qs3x2a0.75.jpg").write_bytes(data)
    with mock.patch.object(quilt, "LEAST_SIDE", 1):  # small ones are decoded sooner
        return quilt_files.read_quilt(folder / "q_qs3x2a0.75.jpg").pixels.sum()


def _words(data: bytes, folder: Path) -> object:
    """What is typed after options."""
    text = data.decode("utf-8", "surrogateescape")
    readers: tuple[Callable[[], object], ...] = (
        lambda: frame_range(text),
        lambda: name_frames(folder / text.replace("/", "_").replace("\0", "_")[:80], 2)(7),
        lambda: texts.numbers(text, "--eye", (1, 3)),
        lambda: parse.size(text, "--resolution"),
        lambda: texts.memory(text, "--memory"),
        lambda: parse_target(text),
    )
    refused: list[LippmannError] = []
    for reader in readers:
        try:
            reader()
        except LippmannError as error:
            refused.append(error)
    if len(refused) == len(readers):
        raise refused[0]
    return None


#: Of the pictures whose journals are read.
GRID = TileGrid(6, 4, 4)


def _tile(data: bytes, folder: Path) -> object:
    try:
        return decode(data).pixels.sum()
    except DamagedTile as error:  # whoever reads tiles expects that, and makes it anew
        raise PictureError(str(error)).with_traceback(error.__traceback__) from None


def _journal(data: bytes, folder: Path) -> object:
    """Go on with a picture as far as what lies there allows, and make the rest anew."""
    (folder / "p.tif.parts").mkdir(mode=0o700)
    unpack(data, folder / "p.tif.parts")
    with TileStore.open(folder / "p.tif", {"version": "1", "spp": "4"}, GRID, resume=True) as store:
        missing = store.missing()
        for index in set(range(len(GRID))) - set(missing):
            try:
                store.get(index)
            except DamagedTile:
                missing.append(index)
        if not missing:
            store.finish()
        return missing


def _frames(data: bytes, folder: Path) -> object:
    """Go on with a sequence as far as its journal allows."""
    (folder / "0.png").write_bytes(b"frame")
    (folder / "j").write_bytes(data)
    with FrameJournal.open(folder / "j", {"version": "1", "spp": "4"}, resume=True) as journal:
        found = [number for number in range(3) if journal.holds(number, folder / "0.png")]
        journal.add(2, folder / "0.png")
    return found


def _metadata(data: bytes, folder: Path) -> object:
    found = from_text(data.decode("utf-8", "replace"), "picture.png")
    return None if found is None else json.dumps(found.to_dict())


def _picture(name: str) -> Read:
    def read(data: bytes, folder: Path) -> object:
        (folder / name).write_bytes(data)
        return read_picture(folder / name)

    return read


def _in_pieces(path: Path) -> object:
    """A picture read as those are that are larger than memory."""
    with mock.patch.object(streamed, "LARGE", 0):
        picture = streamed.open_picture(path)
    assert isinstance(picture, streamed.LargePicture)
    return picture.rows(0, picture.display.panel.height)


def _pieces(data: bytes, folder: Path) -> object:
    (folder / "p.tif").write_bytes(data)
    if not data.startswith((b"II", b"MM")):
        return None  # another format, which is never read in pieces
    return _in_pieces(folder / "p.tif")


def _folder(reader: Callable[[Path], object]) -> Read:
    def read(data: bytes, folder: Path) -> object:
        unpack(data, folder)
        return reader(folder)

    return read


def _layout_folder(layout: str) -> Read:
    return _folder(lambda folder: import_image(folder, layout))


def _layout_file(name: str, layout: str) -> Read:
    def read(data: bytes, folder: Path) -> object:
        (folder / name).write_bytes(data)
        return import_image(folder / name, layout)

    return read


def _parameters(data: bytes, folder: Path) -> object:
    (folder / "parameters.cfg").write_bytes(data)
    return read_parameters(folder / "parameters.cfg")


def _pfm(data: bytes, folder: Path) -> object:
    (folder / "a.pfm").write_bytes(data)
    return read_pfm(folder / "a.pfm")


class _Connection(asyncio.Transport):
    """A connection whose other side has said all that it will."""

    def __init__(self) -> None:
        super().__init__()
        self.answered = b""
        self._protocol: Any = None
        self._is_closing = False

    def set_protocol(self, protocol: Any) -> None:
        self._protocol = protocol

    def get_protocol(self) -> Any:
        return self._protocol

    def write(self, data: Any) -> None:
        self.answered += bytes(data)

    def is_closing(self) -> bool:
        return self._is_closing

    def close(self) -> None:
        self._is_closing = True

    abort = close

    def pause_reading(self) -> None:
        pass

    resume_reading = pause_reading


async def _talk(site: object, said: bytes) -> bytes:
    application = RequestGuard(site_application(site), "127.0.0.1")  # type: ignore[arg-type]
    config = uvicorn.Config(application, http=H11Protocol, lifespan="off", log_config=None, log_level="critical")
    connection, state = _Connection(), ServerState()
    protocol = H11Protocol(config, state, {}, asyncio.get_running_loop())
    connection.set_protocol(protocol)
    protocol.connection_made(connection)
    if said:  # asyncio calls for no empty bytes
        protocol.data_received(said)
    protocol.eof_received()
    while pending := list(state.tasks):
        if protocol.cycle is not None and protocol.cycle.more_body:
            break  # the body never comes
        await asyncio.wait(pending)
    connection.get_protocol().connection_lost(None)
    await asyncio.gather(*state.tasks)
    return connection.answered


def _asked(site: object, data: bytes) -> bytes:
    """What is answered to a connection; a ValueError if that is no answer of a sound server."""
    # Not in this thread, which may have a loop already: that of a test's browser.
    with ThreadPoolExecutor(1) as pool:
        answer = pool.submit(lambda: asyncio.run(_talk(site, data))).result()
    if answer and not re.match(rb"HTTP/1\.1 ([1-4]\d\d|50[57]) ", answer):
        raise ValueError(f"the answer begins with {answer[:60]!r}")
    return answer


@cache
def _viewer_site() -> ViewerSite:
    return ViewerSite([PictureFile(CORPUS / "picture-png" / "seed-8.png")])


def _viewer(data: bytes, folder: Path) -> object:
    return _asked(_viewer_site(), data)


def _calibration(data: bytes, folder: Path) -> object:
    table = {"width": 384, "height": 216, "pixel_pitch": 0.3175, "pitch": 12.9, "slope": -6.0, "center": 0.37}
    site = CalibrationSite(
        monitor_of_tables({"name": "m", "monitor": table}), folder / "out.toml", lambda monitor: None
    )
    start = _asked(site, b"GET /calibration.json HTTP/1.1\r\nHost: localhost\r\n\r\n")
    token = json.loads(start.partition(b"\r\n\r\n")[2])["token"].encode()
    body = data.partition(b"\r\n\r\n")[2]
    answer = _asked(site, data.replace(b"TOKEN", token).replace(b"LENGTH", str(len(body)).encode()))
    try:
        if (folder / "out.toml").exists():
            load_display(folder / "out.toml")
    except LippmannError as error:
        raise ValueError(f"what was written is not read: {error}") from error
    return answer


_READERS: dict[str, Target] = {
    "gltf": Target(_gltf("s.gltf"), tree=json_tree),
    "glb": Target(_gltf("s.glb"), tree=glb_tree, repair=glb_repaired),
    "obj": Target(_obj),
    "ply": Target(_scene("s.ply")),
    "ply-splats": Target(_scene("s.ply")),
    "spz": Target(_spz),
    "splat": Target(_scene("s.splat")),
    "pcd": Target(_scene("s.pcd")),
    "las": Target(_with("laspy", _scene("s.laz"))),
    "sog": Target(_sog, tree=part_tree(b"meta.json")),
    "stl": Target(_scene("s.stl")),
    "off": Target(_scene("s.off")),
    "tachyon": Target(_scene("s.dat")),
    "cam": Target(_cam),
    "nff": Target(_scene("s.nff")),
    "mitsuba-xml": Target(_mitsuba),
    "photograph": Target(_scene("s.jpg")),
    "heif": Target(_with("pillow_heif", _scene("s.heic"))),
    "depth-map": Target(_depth_map),
    "molecule-pdb": Target(_with("gemmi", _scene("s.pdb"))),
    "molecule-sdf": Target(_with("gemmi", _scene("s.sdf"))),
    "molecule-mol2": Target(_with("gemmi", _scene("s.mol2"))),
    "molecule-xyz": Target(_with("gemmi", _scene("s.xyz"))),
    "molecule-cif": Target(_with("gemmi", _scene("s.cif"))),
    "usd": Target(_with("pxr", _scene("s.usda"))),
    "usd-package": Target(_with("pxr", _scene("s.usdz"))),
    "nifti": Target(_with("nibabel", _volume("s.nii"))),
    "nifti-packed": Target(_with("nibabel", _volume("s.nii.gz"))),
    "dicom": Target(_with("pydicom", _volume("s.dcm"))),
    "volume-npy": Target(_volume("s.npy")),
    "volume-npz": Target(_volume("s.npz")),
    "volume-vol": Target(_volume("s.vol")),
    "volume-nrrd": Target(_volume("s.nrrd")),
    "volume-mha": Target(_volume("s.mha")),
    "volume-vdb": Target(_with("pyopenvdb", _volume("s.vdb"))),
    "vtk-vtp": Target(_with("pyvista", _volume("s.vtp"))),
    "vtk-vtk": Target(_with("pyvista", _volume("s.vtk"))),
    "vtk-vti": Target(_with("pyvista", _volume("s.vti"))),
    "transfer-function": Target(_transfer_function),
    "environment": Target(_environment),
    "texture": Target(_texture, repair=png_repaired),
    "ktx2": Target(_ktx2),
    "rendered-gltf": Target(_rendered("s.gltf"), tree=json_tree, seconds=COMPILED),
    "rendered-ply-splats": Target(_rendered("s.ply"), seconds=COMPILED),
    "rendered-obj": Target(_rendered("s.obj"), seconds=COMPILED),
    "rendered-mitsuba-xml": Target(_rendered("s.xml"), seconds=COMPILED),
    "parcel": Target(_parcel),
    "command": Target(_command),
    "display-toml": Target(_toml),
    "short-form": Target(_short),
    "visual-json": Target(_visual, tree=json_tree),
    "quilt-name": Target(_quilt_name),
    "quilt-picture": Target(_quilt),
    "words": Target(_words),
    "metadata": Target(_metadata, tree=json_tree),
    "picture-png": Target(_picture("p.png"), repair=png_repaired),
    "picture-tiff": Target(_picture("p.tif")),
    "picture-exr": Target(_picture("p.exr")),
    "picture-zarr": Target(_folder(read_picture), tree=part_tree(b"zarr.json")),
    "pieces-tiff": Target(_pieces),
    "pieces-zarr": Target(_folder(_in_pieces), tree=part_tree(b"zarr.json")),
    "journal": Target(_journal, tree=part_tree(b"job.json")),
    "frame-journal": Target(_frames),
    "tile": Target(_tile, tree=tile_tree, repair=tile_repaired),
    "views-folder": Target(_folder(compose), tree=part_tree(b"lippmann.json")),
    "layout-hci": Target(_layout_folder("hci"), tree=part_tree(b"lippmann.json")),
    "layout-views": Target(_layout_folder("views"), tree=part_tree(b"lippmann.json")),
    "layout-zarr": Target(_layout_folder("zarr"), tree=part_tree(b"LF/.zarray")),
    "layout-lftoolbox": Target(_layout_file("l.mat", "lftoolbox")),
    "layout-eslf": Target(_layout_file("l.png", "eslf"), repair=png_repaired),
    "parameters-cfg": Target(_parameters),
    "pfm": Target(_pfm),
    # A long input is thousands of requests of one connection.
    "viewer-request": Target(_viewer, seconds=5 * SECONDS),
    "calibration-request": Target(_calibration, tree=body_tree),
}
#: Inputs that are whole folders, whose files may be links and pipes, too.
_FOLDERS = (
    "obj",
    "mitsuba-xml",
    "rendered-obj",
    "rendered-mitsuba-xml",
    "picture-zarr",
    "pieces-zarr",
    "journal",
    "views-folder",
    "layout-hci",
    "layout-views",
)
_KINDS = (LINK, LINK + b"nothing", LINK + b".", PIPE, b"\n=== s.xml\n" + PIPE)
TARGETS: dict[str, Target] = {
    name: replace(target, words=(*VOCABULARY.get(_format(name), ()), *(_KINDS if name in _FOLDERS else ())))
    for name, target in _READERS.items()
}


def emptied(folder: Path) -> Path:
    """The folder with nothing in it."""
    for entry in folder.iterdir():
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        else:
            entry.unlink()
    return folder
