"""Jobs that travel in parts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lippmann.cluster.job_pickle import SMALLEST_PART, content_name, pack, unpack
from lippmann.display import load_display
from lippmann.errors import ClusterError, UsageError
from lippmann.rendering.request.render_request import RenderRequest
from lippmann.scene.readers.load import load_scene
from lippmann.sequences.cuts import Moment
from lippmann.sequences.forms import INTEGRAL
from lippmann.sequences.windows import Window
from lippmann.tiles.job import make_job

XML = """<scene version="3.0.0">
<shape type="obj"><string name="filename" value="parts/box.obj"/></shape><emitter type="constant"/></scene>"""


def job_of(scene, **settings):
    chosen = RenderRequest(**{"integrator": "direct", "spp": 2} | settings)
    return make_job(load_scene(scene), load_display("seed-lenticular"), chosen, stored="uint8")


def unpacked(parcel, folder):
    return unpack(parcel.key, parcel.outline, parcel.names, [parcel.parts[name] for name in parcel.names], folder)


@pytest.fixture
def xml(tmp_path):
    import trimesh

    (tmp_path / "scene" / "parts").mkdir(parents=True)
    trimesh.creation.box().export(tmp_path / "scene" / "parts" / "box.obj")
    path = tmp_path / "scene" / "scene.xml"
    path.write_text(XML)
    return path


@pytest.mark.parametrize("scene", ["teapot", "primitives", "small-balls"])
def test_a_job_comes_out_as_it_went_in(scene, tmp_path):
    job = job_of(scene)
    again = unpacked(pack(job), tmp_path)
    assert again.scene_hash == job.scene_hash
    assert again.fingerprint("cpu") == job.fingerprint("cpu")
    assert list(again.grid) == list(job.grid)


def test_large_arrays_travel_by_themselves_and_once():
    parcel = pack(job_of("teapot"))
    assert all(part.nbytes >= SMALLEST_PART for part in parcel.parts.values())
    assert all(content_name(part) == name for name, part in parcel.parts.items())
    positions = load_scene("teapot").description.meshes[0].positions
    assert content_name(positions) in parcel.names
    assert parcel.outline.nbytes < 100_000


def test_jobs_share_the_parts_that_are_equal():
    first, second = pack(job_of("teapot")), pack(job_of("teapot", seed=5))
    assert first.names == second.names
    assert first.key != second.key


def test_equal_jobs_are_one():
    job = job_of("teapot")
    _ = job.scene.bounds, job.scene_hash  # what is worked out on the way makes no difference
    assert pack(job).key == pack(job_of("teapot")).key


def test_the_files_of_a_mitsuba_scene_travel_too(xml, tmp_path):
    job = job_of(xml)
    folder = tmp_path / "there"
    folder.mkdir()
    again = unpacked(pack(job), folder)
    assert dict(again.scene.description.content.files) == {"parts/box.obj": folder / "parts" / "box.obj"}
    assert str(xml.parent) not in again.scene.description.content.text()
    assert (folder / "parts" / "box.obj").read_bytes() == (xml.parent / "parts" / "box.obj").read_bytes()
    assert again.scene_hash == job.scene_hash


def test_frames_share_what_their_scenes_share_and_read_its_files_at_once(engine, xml, tmp_path, monkeypatch):
    folder, scene, loaded = tmp_path / "there", load_scene(xml), []
    moments = {frame: Moment(frame, scene.with_light_moved(np.eye(4)), None) for frame in (0, 1)}
    request = RenderRequest(device="cpu")
    window = Window((0, 1), {}, moments, load_display("seed-lenticular"), request, INTEGRAL, None, None)
    again = unpacked(pack(window), folder)
    first, second = (again.moments[frame].scene.description for frame in (0, 1))
    assert first is second
    assert dict(first.content.files) == {"parts/box.obj": folder / "parts" / "box.obj"}
    monkeypatch.setattr(type(first), "scene", lambda source: loaded.append(source))
    again.open(None)
    assert loaded[0] is first


@pytest.mark.parametrize(
    "body",
    [
        '<path value="parts"/>' + XML.partition("\n")[2].replace("parts/box.obj", "box.obj"),
        '<default name="d" value="parts"/>' + XML.partition("\n")[2].replace("parts/box.obj", "$d/box.obj"),
        '<include filename="inner.xml"/></scene>',
    ],
    ids=["search path", "parameter", "include"],
)
def test_files_travel_however_they_are_named(xml, tmp_path, body):
    (xml.parent / "inner.xml").write_text(XML)
    xml.write_text('<scene version="3.0.0">' + body)
    folder = tmp_path / "there"
    folder.mkdir()
    again = unpacked(pack(job_of(xml)), folder)
    assert dict(again.scene.description.content.files) == {"parts/box.obj": folder / "parts" / "box.obj"}
    assert (folder / "parts" / "box.obj").read_bytes() == (xml.parent / "parts" / "box.obj").read_bytes()


def test_files_outside_the_scenes_folder_do_not_travel(xml):
    (xml.parent / "parts" / "box.obj").rename(xml.parent.parent / "box.obj")
    xml.write_text(XML.replace("parts/box.obj", "../box.obj"))
    job = make_job(
        load_scene(xml, allow_outside=True),
        load_display("seed-lenticular"),
        RenderRequest(integrator="direct", spp=2),
        stored="uint8",
    )
    object.__setattr__(job, "scene_hash", "known")
    with pytest.raises(UsageError, match="lies outside its folder"):
        pack(job)


def test_a_part_that_was_changed_on_the_way_is_found(tmp_path):
    parcel = pack(job_of("teapot"))
    parts = [parcel.parts[name] for name in parcel.names]
    parts[0] = np.array(parts[0])
    parts[0].ravel()[3] += 1
    with pytest.raises(ClusterError, match="damaged in transit"):
        unpack(parcel.key, parcel.outline, parcel.names, parts, tmp_path)


@pytest.mark.parametrize("place", [0, 0.3, 0.9])
def test_an_outline_that_was_changed_on_the_way_is_never_restored(tmp_path, place):
    parcel = pack(job_of("teapot"))
    outline = parcel.outline.copy()
    outline[int(place * len(outline))] ^= 1
    parts = [parcel.parts[name] for name in parcel.names]
    with pytest.raises(ClusterError, match="damaged in transit"):
        unpack(parcel.key, outline, parcel.names, parts, tmp_path)
    with pytest.raises(ClusterError, match="damaged in transit"):
        unpack(parcel.key, parcel.outline, parcel.names, parts[:-1], tmp_path)


@pytest.mark.parametrize("of_file", [False, True])
def test_a_part_that_did_not_arrive_is_missed(xml, tmp_path, of_file):
    parcel = pack(job_of(xml if of_file else "teapot"))
    names = parcel.names[1:]
    with pytest.raises(ClusterError, match="lost in transit"):
        unpack(parcel.key, parcel.outline, names, [parcel.parts[name] for name in names], tmp_path)


def test_content_is_more_than_bytes():
    flat = np.zeros(8, np.float32)
    assert content_name(flat) != content_name(flat.reshape(2, 4))
    assert content_name(flat) != content_name(flat.view(np.int32))
    assert content_name(flat) == content_name(flat.copy())


def test_objects_of_mitsuba_are_refused(engine, xml):
    scene = load_scene(xml)
    broken = replace(scene, description=replace(scene.description, content={"type": "scene"}))
    job = replace(job_of("teapot"), scene=broken)
    with pytest.raises(UsageError, match="an object of Mitsuba's"):
        pack(job)
