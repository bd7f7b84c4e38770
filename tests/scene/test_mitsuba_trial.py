"""Scenes that would bring Mitsuba down, or mislead it, are told from sound ones before this process loads them."""

import struct
import zlib

import pytest

from lippmann.errors import SceneError
from lippmann.scene import mitsuba_trial
from lippmann.scene.mitsuba_trial import try_scene
from lippmann.scene.readers.load import load_scene

GROUP = '<shape type="shapegroup" id="g">{}</shape><shape type="instance"><ref id="g"/></shape>'


def triangle(third, vertices=3):
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    places = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    return head.encode() + places + struct.pack("<B3i", 3, 0, 1, third)


def serialized(third):
    mesh = struct.pack("<I", 0x1000) + b"m\0" + struct.pack("<QQ", 3, 1)
    mesh += struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) + struct.pack("<3I", 0, 1, third)
    return struct.pack("<HH", 0x041C, 4) + zlib.compress(mesh) + struct.pack("<QI", 0, 1)


def shape(kind):
    return f'<shape type="{kind}"><string name="filename" value="m.{kind}"/></shape>'


@pytest.fixture
def scene(tmp_path, engine):
    def save(body, **files):
        for name, data in files.items():
            (tmp_path / name.replace("_", ".")).write_bytes(data)
        (tmp_path / "room.xml").write_text(f'<scene version="3.0.0">{body}</scene>')
        return load_scene(tmp_path / "room.xml")

    return save


def test_sound_meshes_are_read(scene):
    found = scene(
        shape("ply") + shape("serialized") + GROUP.format(shape("ply")), m_ply=triangle(2), m_serialized=serialized(2)
    )
    assert found.bounds.tolist() == [[0, 0, 0], [1, 1, 0]]


@pytest.mark.parametrize("body", [shape("ply"), GROUP.format(shape("ply"))], ids=["shape", "group"])
def test_a_triangle_beyond_the_vertices_is_refused(scene, body):
    """Mitsuba itself reads what lies behind the vertices in memory, and shows it."""
    with pytest.raises(SceneError) as caught:
        _ = scene(body, m_ply=triangle(5)).bounds
    assert str(caught.value) == (
        "room: Mitsuba would be misled: a mesh names vertex 5; it has 3; are all files whole that the scene names?"
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "data"),
    [("ply", triangle(900_000_000)), ("serialized", serialized(900_000_000))],
    ids=["ply", "serialized"],
)
def test_what_kills_mitsuba_is_one_line(scene, kind, data):
    with pytest.raises(SceneError, match=r"^room: Mitsuba (breaks down at the scene \(signal 11\)|would be misled)"):
        _ = scene(shape(kind), **{f"m_{kind}": data}).bounds


def test_more_memory_than_there_is_is_refused(scene, monkeypatch):
    """A header of some bytes asks for a grid of gigabytes."""
    monkeypatch.setattr(mitsuba_trial, "input_memory_left", lambda: 1 << 30)
    grid = b"VOL\x03" + struct.pack("<5i6f", 1, 1500, 1500, 1500, 1, 0, 0, 0, 1, 1, 1)
    body = (
        '<shape type="cube"><medium type="heterogeneous" name="interior"><volume type="gridvolume" name="sigma_t">'
        '<string name="filename" value="m.vol"/></volume></medium></shape>'
    )
    with pytest.raises(SceneError, match=r"^room: Mitsuba ") as caught:
        _ = scene(body, m_vol=grid).bounds
    assert "\n" not in str(caught.value)


def test_a_scene_that_takes_too_long_is_given_up(engine, monkeypatch):
    monkeypatch.setattr(mitsuba_trial._process, "_most_seconds", 0.0)
    with pytest.raises(SceneError, match=r"breaks down at the scene \(it takes more than 0 s\)"):
        try_scene('<scene version="3.0.0"/>', engine.variant, "room")


def test_a_sky_keeps_shape_groups(scene):
    """A group without lights beside it is lit by the studio, and its instance still finds it."""
    found = scene(GROUP.format(shape("ply")), m_ply=triangle(2))
    assert found.in_studio
    import mitsuba as mi

    from lippmann.scene.mitsuba_source import with_sky

    lit = with_sky(found.description.scene(), mi.load_dict({"type": "constant"}))
    assert len(lit.shapes()) == 1
