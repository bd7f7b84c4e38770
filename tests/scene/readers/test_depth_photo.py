"""Photographs with depth: maps of every kind, edges, what is filled behind them, and damaged files."""

import base64
import io
import re

import numpy as np
import pytest
import tifffile
from PIL import Image as Pillow

from lippmann.codecs.exr import write_exr
from lippmann.codecs.icc import rgb_profile
from lippmann.codecs.pfm import write_pfm
from lippmann.codecs.png import encode_png
from lippmann.color.primaries import REC709
from lippmann.display import load_display
from lippmann.errors import SceneError, UsageError
from lippmann.options.placement import PlacementOptions
from lippmann.scene.extent import bounds_of
from lippmann.scene.matrices import transform_points
from lippmann.scene.placement import place
from lippmann.scene.readers.depth_layers import EDGE, split_layers
from lippmann.scene.readers.depth_map import embedded_depth, read_depth_map
from lippmann.scene.readers.load import load_scene

DEPTH = np.array([[1.0, 2.0, 4.0], [2.0, 0.0, np.nan]], np.float32)
INVERSE = np.array([[1.0, 0.5, 0.25], [0.5, np.nan, np.nan]])


def encoded(pixels, kind="PNG", **options):
    held = io.BytesIO()
    Pillow.fromarray(pixels).save(held, kind, **options)
    return held.getvalue()


def saved(path, depth):
    """A depth map in the form that the name's ending says."""
    if path.suffix == ".npy":
        np.save(path, depth.astype(np.float64))
    elif path.suffix == ".pfm":
        write_pfm(path, depth)
    elif path.suffix == ".exr":
        write_exr(path, {"Z": depth}, text={})
    elif path.suffix == ".tif":
        Pillow.fromarray(depth).save(path)
    else:
        Pillow.fromarray(np.nan_to_num(1000 * depth).astype(np.uint16)).save(path)
    return path


@pytest.mark.parametrize("ending", [".npy", ".pfm", ".exr", ".tif", ".png"])
def test_depth_of_every_kind_of_file(tmp_path, ending):
    found = read_depth_map(saved(tmp_path / f"d{ending}", DEPTH)).inverse
    scale = 1000 if ending == ".png" else 1
    assert found * scale == pytest.approx(INVERSE, nan_ok=True)


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.float64, np.uint16])
def test_depth_in_tiff_of_any_kind(tmp_path, kind):
    scale = 1000 if kind is np.uint16 else 1
    tifffile.imwrite(tmp_path / "d.tif", np.nan_to_num(scale * DEPTH).astype(kind), extratags=[(274, 3, 1, 3, True)])
    found = read_depth_map(tmp_path / "d.tif").inverse[::-1, ::-1]  # orientation 3
    assert found * scale == pytest.approx(INVERSE, nan_ok=True)


def test_nearness_in_tiff_whose_0_is_white(tmp_path):
    levels = np.array([[0, 128, 255]], np.uint8)
    tifffile.imwrite(tmp_path / "d.tif", 255 - levels, photometric="miniswhite")
    assert read_depth_map(tmp_path / "d.tif").inverse == pytest.approx(levels, abs=0.5)


def test_the_sky_is_infinitely_far(tmp_path):
    found = read_depth_map(saved(tmp_path / "d.npy", np.array([[np.inf, 1.0]], np.float32)))
    assert found.inverse.tolist() == [[0, 1]]


def test_grey_pictures_tell_what_is_nearer(tmp_path):
    path = tmp_path / "d.png"
    path.write_bytes(encoded(np.array([[0, 128, 255]], np.uint8)))
    assert read_depth_map(path).inverse == pytest.approx(np.array([[0, 128, 255]]), abs=0.5)


@pytest.mark.parametrize(("top", "even"), [(255, 0.6), (20, 0.3)])
def test_a_ramp_of_few_levels_has_no_stairs(tmp_path, top, even):
    """1000 pixels have as many depths, and steps that are near each other, though levels are far fewer."""
    ramp = np.linspace(0, top, 1000)
    path = tmp_path / "d.png"
    path.write_bytes(encoded(np.tile(np.rint(ramp), (8, 1)).astype(np.uint8)))
    found = read_depth_map(path).inverse[4]
    assert np.abs(found - ramp).max() < 1
    assert len(np.unique(found)) > 990
    inner = np.diff(found)[50:-50]
    assert inner == pytest.approx(top / 999, rel=even)


def test_edges_of_few_levels_stay(tmp_path):
    levels = np.full((40, 40), 60, np.uint8)
    levels[:, 20:] = 200
    path = tmp_path / "d.png"
    path.write_bytes(encoded(levels))
    assert np.abs(read_depth_map(path).inverse - levels).max() <= 0.5


@pytest.mark.parametrize(
    ("name", "data", "line"),
    [
        (
            "d.npy",
            b"\x93NUMPY\x01\x00v\x00{'descr': '<f8', 'fortran_order': False, 'shape': (90000, 90000), }\n",
            "d.npy: is no",
        ),
        ("d.npy", b"nothing", "d.npy: is no depth map"),
        ("d.pfm", b"Pf\n3 2\n-1.0\n", "d.pfm: is cut short"),
        ("d.exr", b"v/1\x01", "d.exr: "),
        ("d.png", b"nothing", "d.png: is no depth map"),
    ],
)
def test_damaged_maps_are_refused(tmp_path, name, data, line):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(SceneError) as caught:
        read_depth_map(tmp_path / name)
    assert str(caught.value).startswith(line)


def portrait(shares, *, near=1.0, far=4.0, form="RangeInverse", parts=2):
    """A JPEG file with depth as Android writes it: its picture in an extension of XMP, in parts."""
    picture = encoded(np.full((4, 6, 3), 90, np.uint8), "JPEG")
    depth = base64.b64encode(encoded(np.asarray(shares, np.uint8)))
    plain = f'<x GDepth:Format="{form}" GDepth:Near="{near}" GDepth:Far="{far}"/>'.encode()
    extension = b'<x GDepth:Data="' + depth + b'"/>'
    cut = len(extension) // parts
    pieces = [(start, extension[start : start + cut]) for start in range(0, len(extension), cut)]
    segments = [b"http://ns.adobe.com/xap/1.0/\0" + plain]
    for start, piece in reversed(pieces):  # in any order
        head = bytes(32) + len(extension).to_bytes(4, "big") + start.to_bytes(4, "big")
        segments.append(b"http://ns.adobe.com/xmp/extension/\0" + head + piece)
    blocks = b"".join(b"\xff\xe1" + (len(each) + 2).to_bytes(2, "big") + each for each in segments)
    return picture[:2] + blocks + picture[2:]


@pytest.mark.parametrize("form", ["RangeInverse", "RangeLinear"])
def test_depth_within_a_portrait(form):
    """The formulas of the depth map metadata: share 0.2 of the way from 1 to 4, in depth or its inverse."""
    found = embedded_depth(portrait([[0, 51, 255]], form=form), "p.jpg").inverse
    depth = 1 + 0.2 * 3 if form == "RangeLinear" else 4 * 1 / (4 - 0.2 * 3)
    assert found == pytest.approx(np.array([[1, 1 / depth, 0.25]]), abs=0.01)


@pytest.mark.parametrize("quote", ["'", '"', ""])
@pytest.mark.parametrize("prefix", ["GDepth", "d"])
def test_depth_in_any_form_of_xmp(quote, prefix):
    """Attributes in either quotes, or elements; any prefix of the namespace."""
    space = f'xmlns:{prefix}="http://ns.google.com/photos/1.0/depthmap/"'
    depth = base64.b64encode(encoded(np.array([[0, 51, 255]], np.uint8))).decode()
    values = {"Format": "RangeInverse", "Near": "1", "Far": "4", "Data": depth}
    if quote:
        text = (
            f"<x {space} " + " ".join(f"{prefix}:{key}={quote}{value}{quote}" for key, value in values.items()) + "/>"
        )
    else:
        text = f"<x {space}>" + "".join(f"<{prefix}:{k}>\n {v}\n</{prefix}:{k}>" for k, v in values.items()) + "</x>"
    segment = b"http://ns.adobe.com/xap/1.0/\0" + text.encode()
    picture = encoded(np.full((4, 6, 3), 90, np.uint8), "JPEG")
    data = picture[:2] + b"\xff\xe1" + (len(segment) + 2).to_bytes(2, "big") + segment + picture[2:]
    found = embedded_depth(data, "p.jpg").inverse
    assert found[0] == pytest.approx([1, 1 - 0.2 * 0.75, 0.25], abs=2e-3)


@pytest.mark.parametrize("form", ["attributes", "elements", "uri"])
def test_depth_behind_a_portrait(form):
    """Dynamic Depth 1.0: a gain map, the depth with padding behind it, and its confidence follow the picture."""
    depth, gain = encoded(np.array([[0, 51, 255]], np.uint8)), b"gain map"
    ours = ("Semantic", "Depth") if form != "uri" else ("DataURI", "android/depthmap")
    items = [
        {"Mime": "image/jpeg", "Length": 0, "Semantic": "Primary"},
        {"Mime": "image/jpeg", "Length": len(gain), "Semantic": "GainMap"},
        {"Mime": "image/png", "Length": len(depth), "Padding": 3, ours[0]: ours[1]},
        {"Mime": "image/jpeg", "Length": 4, "Semantic": "Confidence"},
    ]
    values = {"Format": "RangeInverse", "Near": 1, "Far": 4, "DepthURI": "android/depthmap"}

    def element(name, prefix, fields):
        if form == "elements":
            return f"<{name}>" + "".join(f"<{prefix}:{k}>{v}</{prefix}:{k}>" for k, v in fields.items()) + f"</{name}>"
        return f"<{name} " + " ".join(f'{prefix}:{k}="{v}"' for k, v in fields.items()) + "/>"

    listed = "".join(f"<rdf:li>{element('Container:Item', 'Item', each)}</rdf:li>" for each in items)
    space = 'xmlns:DepthMap="http://ns.google.com/photos/dd/1.0/depthmap/"'
    text = f"<x {space}>{listed}{element('Camera:DepthMap', 'DepthMap', values)}</x>"
    segment = b"http://ns.adobe.com/xap/1.0/\0" + text.encode()
    picture = encoded(np.full((4, 6, 3), 90, np.uint8), "JPEG")
    data = picture[:2] + b"\xff\xe1" + (len(segment) + 2).to_bytes(2, "big") + segment + picture[2:]
    found = embedded_depth(data + gain + depth + bytes(3) + b"conf", "p.jpg").inverse
    assert found[0] == pytest.approx([1, 1 - 0.2 * 0.75, 0.25], abs=2e-3)
    assert embedded_depth(data.replace(b"Item", b"Itum"), "p.jpg") is None


@pytest.mark.parametrize(
    "names", [["Z"], ["ViewLayer.Depth.Z"], ["Depth.V"], ["cam.Z"], ["linearDepth"], ["WorldDepth.R"], ["V"], ["R"]]
)
def test_channels_of_depth_by_their_layers(tmp_path, names):
    """Beside a picture in colours and a pass of normals, as renderers write them; a lone value is depth, too."""
    depth = np.array([[1.0, 2.0], [4.0, 8.0]], np.float32)
    other = [] if len(names[0]) == 1 and names != ["Z"] else ["R", "G", "B", "Normal.X", "Normal.Y", "Normal.Z"]
    channels = {name: np.full((2, 2), 7 + number, np.float32) for number, name in enumerate(other)}
    write_exr(tmp_path / "d.exr", {**channels, names[0]: depth}, text={})
    assert read_depth_map(tmp_path / "d.exr").inverse == pytest.approx(1 / depth)


def with_xmp(picture, text):
    """A JPEG file with XMP in its first segment."""
    body = b"http://ns.adobe.com/xap/1.0/\0<x:xmpmeta>" + text + b"</x:xmpmeta>"
    return picture[:2] + b"\xff\xe1" + (len(body) + 2).to_bytes(2, "big") + body + picture[2:]


def test_the_disparity_behind_the_picture_of_an_apple_telephone(tmp_path):
    """Its last pictures are a gain map and a matte, which are no depth."""
    photo = encoded(np.full((16, 32, 3), 90, np.uint8), "JPEG")
    kind = b"<apdi:AuxiliaryImageType>%s</apdi:AuxiliaryImageType>"
    ramp = np.tile(np.repeat(np.array([[40, 200]], np.uint8), 8, axis=1), (8, 1))
    others = (b"urn:com:apple:photo:2020:aux:hdrgainmap", b"portraiteffectsmatte")
    gain, matte = (with_xmp(encoded(np.zeros((8, 16), np.uint8), "JPEG"), kind % each) for each in others)
    disparity = with_xmp(encoded(ramp, "JPEG"), kind % b"disparity")
    found = embedded_depth(photo + gain + disparity + matte, "p.jpg").inverse
    assert found == pytest.approx(ramp.astype(np.float32), abs=3)  # brighter is nearer
    assert embedded_depth(photo + gain + matte, "p.jpg") is None
    turned = embedded_depth(photo + disparity, "p.jpg", 3).inverse
    assert turned == pytest.approx(found[::-1, ::-1])


def test_the_depth_of_samsung_s_telephones_is_named_with_the_tool_that_takes_it_out(tmp_path):
    photo = encoded(np.zeros((4, 4, 3), np.uint8), "JPEG")
    (tmp_path / "p.jpg").write_bytes(photo + b"SEFH....SEFT")
    with pytest.raises(SceneError, match=r"needs a depth map; .*exiftool -b -SingleShotDepthMapTiff"):
        load_scene(tmp_path / "p.jpg")


def test_of_several_parts_the_first_with_depth_counts(tmp_path):
    import OpenEXR

    depth = np.array([[1.0, 2.0], [4.0, 8.0]], np.float32)
    held = {"beauty": {"RGB": np.full((2, 2, 3), 7, np.float32)}, "depth": {"Z": depth}}
    parts = [OpenEXR.Part({"name": name, "type": OpenEXR.scanlineimage}, each) for name, each in held.items()]
    with OpenEXR.File(parts) as file:
        file.write(str(tmp_path / "d.exr"))
    assert read_depth_map(tmp_path / "d.exr").inverse == pytest.approx(1 / depth)


def test_pictures_in_colours_are_no_depth(tmp_path):
    """As programs that estimate depth colour their maps; JPEG's greys and equal channels are grey."""
    ramp = np.tile(np.arange(0, 256, 4, dtype=np.uint8), (8, 1))
    Pillow.fromarray(np.stack([ramp, 255 - ramp, ramp // 2], axis=2)).save(tmp_path / "d.png")
    tifffile.imwrite(tmp_path / "d.tif", np.stack([ramp, 255 - ramp, ramp // 2], axis=2), photometric="rgb")
    colors = {name: np.full((2, 2), 1 + number, np.float32) for number, name in enumerate("RGB")}
    write_exr(tmp_path / "d.exr", colors, text={})
    wide = np.stack([256 * ramp.astype(np.uint16), ramp, ramp], axis=2)
    (tmp_path / "wide.png").write_bytes(encode_png(wide, text={}))
    for name in ("d.png", "d.tif", "d.exr", "wide.png"):
        with pytest.raises(SceneError, match=f"^{name}: is a picture in colours; depth is grey"):
            read_depth_map(tmp_path / name)
    Pillow.fromarray(np.stack([ramp] * 3, axis=2)).save(tmp_path / "d.jpg", quality=60)
    assert read_depth_map(tmp_path / "d.jpg").inverse.shape == (8, 64)
    write_exr(tmp_path / "d.exr", dict.fromkeys("RGB", np.full((2, 2), 2, np.float32)), text={})
    assert read_depth_map(tmp_path / "d.exr").inverse[0, 0] == 0.5
    (tmp_path / "wide.png").write_bytes(encode_png(np.full((2, 2, 3), 2001, np.uint16), text={}))
    assert read_depth_map(tmp_path / "wide.png").inverse[0, 0] == np.float32(1 / 2001)  # mm, in all of their 16 bits


def test_portraits_that_mean_nothing_are_refused():
    with pytest.raises(SceneError, match=r"^p\.jpg: has depth from 5 to 4; near is above 0"):
        embedded_depth(portrait([[0, 255]], near=5), "p.jpg")
    assert embedded_depth(encoded(np.zeros((2, 2, 3), np.uint8), "JPEG"), "p.jpg") is None


@pytest.mark.parametrize("cut", range(0, 500, 50))
def test_portraits_that_are_cut_short_are_refused_or_without_depth(cut):
    data = portrait([[0, 51, 255]])[:cut]
    try:
        found = embedded_depth(data, "p.jpg")
    except SceneError as error:
        found = str(error)
    assert found is None or str(found).startswith("p.jpg: ")


def scene_of(tmp_path, depth, picture=None):
    rows, columns = depth.shape
    picture = np.full((rows, columns, 3), 128, np.uint8) if picture is None else picture
    (tmp_path / "photo.png").write_bytes(encoded(picture))
    saved(tmp_path / "depth.npy", depth)
    return load_scene(tmp_path / "photo.png", depth_map=tmp_path / "depth.npy").description


def step_scene(tmp_path):
    """A near red half before a far green one."""
    depth = np.full((20, 40), 4.0, np.float32)
    depth[:, :20] = 1.0
    picture = np.zeros((20, 40, 3), np.uint8)
    picture[:, :20, 0] = 200
    picture[:, 20:, 1] = 200
    return scene_of(tmp_path, depth, picture)


def test_a_step_is_cut_and_the_far_side_goes_on_behind_it(tmp_path):
    photograph, behind = step_scene(tmp_path).meshes
    corners = photograph.positions[photograph.faces]
    assert (np.ptp(corners[..., 2], axis=1) == 0).all()
    assert set(np.unique(corners[..., 2])) == {0, 0.5}
    # It lies in the plane of the far half, reaches to it, and goes on to the other border.
    assert behind.positions[..., 2] == pytest.approx(0)
    assert behind.positions[:, 0].min() == photograph.positions[:, 0].min()
    # The first pixel of the far half: its middle lies half a pixel of 1/20 right of the picture's own.
    assert behind.positions[:, 0].max() == pytest.approx(0.5 / 20)


def test_what_lies_behind_has_the_far_sides_colour(tmp_path):
    scene = step_scene(tmp_path)
    texels = scene.materials[1].base_color_texture.image.pixels
    assert (texels[..., 0] == 0).all()
    assert (texels[..., 1] == 200).all()
    assert all(material.unlit for material in scene.materials)


def test_colours_mixed_at_an_edge_are_not_those_behind_even_a_low_step():
    inverse, colors = np.zeros((24, 48), np.float32), np.full((24, 48, 3), 60, np.float32)
    inverse[:, :16], inverse[:, 40:] = 0.15, 1.0
    colors[:, 14:18] = 150
    layers = split_layers(inverse, colors, "x")
    assert layers.behind[:, :16].max() == 0
    assert (layers.behind_colors[:, 8:16] == 60).all()


def test_the_front_is_the_photograph(tmp_path):
    """Seen along its axis each point lies where its pixel is; faces look at the viewer."""
    scene = scene_of(tmp_path, np.tile(1 / np.linspace(1, 1.7, 32, dtype=np.float32), (24, 1)))
    (mesh,) = scene.meshes
    u, v = mesh.uvs[0].T
    assert mesh.positions[:, 0] == pytest.approx((u - 0.5) * 32 / 24, abs=1e-6)
    assert mesh.positions[:, 1] == pytest.approx(0.5 - v, abs=1e-6)
    corners = mesh.positions[mesh.faces].astype(float)
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0).all()


def test_nearness_is_linear_in_inverse_depth(tmp_path):
    depth = 1 / np.linspace(0.25, 1.0, 50, dtype=np.float32)
    scene = scene_of(tmp_path, np.tile(depth, (50, 1)))
    order = np.argsort(scene.meshes[0].positions[:, 0], kind="stable")
    heights = scene.meshes[0].positions[order][::50, 2]
    assert heights == pytest.approx(np.linspace(0, 0.5, 50), abs=1e-3)


@pytest.mark.parametrize("name", ["seed-lenticular", "looking-glass-portrait", "mla-square", "mla-hexagonal"])
@pytest.mark.parametrize(
    "options", [PlacementOptions(), PlacementOptions(pop_out=1.0), PlacementOptions(depth_scale=1)]
)
def test_no_view_shows_an_edge(tmp_path, name, options):
    """Every light line of the panel's border crosses the photograph's block within it, at its front and its back."""
    step_scene(tmp_path)
    scene = load_scene(tmp_path / "photo.png", depth_map=tmp_path / "depth.npy")
    display = load_display(name)
    width, height = display.size_mm
    placed = place(scene.bounds, display, options=options, fills_panel=scene.fills_panel)
    assert placed.mode == "fit"
    low, high = transform_points(placed.display_from_world, scene.bounds)
    share = np.linspace(-0.5, 0.5, 4001)
    side = np.full(len(share), 0.5)
    inward = np.linspace(0, display.micro_image_pitch, 9)[:, None]
    x = np.concatenate([(width * side - inward).ravel(), np.tile(width * share, 9)])
    y = np.concatenate([np.tile(height * share, 9), (height * side - inward).ravel()])
    (ox, oy, oz), (dx, dy, dz) = display.light_ray(np.concatenate([x, -x]), np.concatenate([y, -y]))
    reached = []
    for z in (low[2], high[2]):
        along = (oz - z) / -dz
        reached.append((np.abs(ox + along * dx).max(), np.abs(oy + along * dy).max()))
    assert (low[:2] < -np.max(reached, axis=0)).all()
    assert (high[:2] > np.max(reached, axis=0)).all()
    # On one axis it reaches no farther than it must.
    assert (high[:2] / np.max(reached, axis=0)).min() < 1.05


def test_a_photograph_that_cannot_be_large_enough_stays_finite(tmp_path):
    scene = scene_of(tmp_path, np.tile(1 / np.linspace(1, 1.7, 32, dtype=np.float32), (24, 1)))
    placed = place(
        bounds_of(scene), load_display("mla-square"), options=PlacementOptions(depth_scale=50), fills_panel=True
    )
    assert np.isfinite(placed.world_from_display).all()


def test_unknown_depth_is_filled_from_beside(tmp_path):
    depth = np.full((20, 20), 2.0, np.float32)
    depth[:, 10:] = 4.0
    depth[5:8, 2:5] = np.nan
    scene = scene_of(tmp_path, depth)
    assert scene.notes[1:] == ["2.2 % of the depth map have no depth and are filled from beside"]
    left = scene.meshes[0].positions[scene.meshes[0].positions[:, 0] < -0.1]
    assert left[:, 2] == pytest.approx(0.5)


def test_without_any_depth_there_is_no_scene(tmp_path):
    with pytest.raises(SceneError, match="the depth map tells no depth"):
        scene_of(tmp_path, np.zeros((4, 4), np.float32))
    (tmp_path / "photo.png").write_bytes(encoded(np.zeros((4, 4, 3), np.uint8)))
    with pytest.raises(
        SceneError,
        match=r"^photo\.png: needs a depth map; .*quilts.* own; add depth_map=\.\.\., or lay photo_depth\.png",
    ):
        load_scene(tmp_path / "photo.png")
    (tmp_path / "pair.png").write_bytes(encoded(np.zeros((4, 9, 3), np.uint8)))
    with pytest.raises(SceneError, match=r"where its right half is the depth, name it pair_rgbd\.png"):
        load_scene(tmp_path / "pair.png")
    slices = Pillow.new("L", (4, 4))
    slices.save(tmp_path / "cells.tif", save_all=True, append_images=[slices])
    with pytest.raises(SceneError, match=r"^cells\.tif: needs a depth map; .*; slices of a volume are read as \.npz"):
        load_scene(tmp_path / "cells.tif")
    slices.save(tmp_path / "pair.jpg", "MPO", save_all=True, append_images=[slices])
    with pytest.raises(SceneError, match=r"^pair\.jpg: needs a depth map; .* beside it$"):
        load_scene(tmp_path / "pair.jpg")


@pytest.mark.parametrize(
    "name", ["photo_disparity.npy", "disp0GT.pfm", "gt_disp_lowres.pfm", "photo-dpt_large_384.pfm", "photo-disp.png"]
)
def test_a_map_whose_name_says_disparity_is_nearer_where_it_is_larger(tmp_path, name):
    path, photo = tmp_path / name, tmp_path / "photo.png"
    disparity = np.array([[0.0, 8.0, 2.0]] * 3, np.float32)
    if name.endswith(".png"):
        Pillow.fromarray(disparity.astype(np.uint16)).save(path)
        disparity[:, 0] = np.nan  # unknown, as in KITTI's and Cityscapes'
    else:
        disparity[1, 1] = np.inf  # unknown, as in Middlebury's
        saved(path, disparity)
    np.testing.assert_array_equal(read_depth_map(path).inverse, np.where(np.isinf(disparity), np.nan, disparity))
    photo.write_bytes(encoded(np.zeros((3, 3, 3), np.uint8)))
    assert f"{name} is taken for disparity" in " ".join(load_scene(photo, depth_map=path).notes)
    assert "taken for distances" in read_depth_map(saved(tmp_path / "display.npy", DEPTH)).note


@pytest.mark.parametrize("top", [254, 255])
def test_0_of_a_disparity_in_8_bits_is_unknown_where_they_are_not_stretched(tmp_path, top):
    """Middlebury's maps of 8 bits hold 0 where nothing was measured."""
    Pillow.fromarray(np.array([[0, 40, top]] * 3, np.uint8)).save(tmp_path / "disp1.png")
    assert np.isnan(read_depth_map(tmp_path / "disp1.png").inverse[:, 0]).all() == (top < 255)


@pytest.mark.parametrize(
    ("name", "codes", "note"),
    [
        (
            "photo_depth.png",
            [0, 200, 30000, 65400, 65535],
            "spans all of its 16 bits, .* brighter is taken as nearer; if dark is near",
        ),
        ("photo_depth-far.png", [0, 200, 30000, 65400, 65535], "without a unit: larger values are farther"),
        ("photo_depth-far.png", np.array([0, 1, 90, 254, 255], np.uint8), "without a unit: larger values are farther"),
        ("photo_depth.npy", [0.0, 0.002, 0.5, 0.999, 1.0], "without a unit: larger values are farther"),
        ("photo_depth.png", [0, 400, 900, 4000, 65535], "is taken for distances: larger values are farther"),
    ],
)
def test_maps_over_their_whole_range_are_no_distances(tmp_path, name, codes, note):
    """As estimates of depth are written; a depth camera has 0 and 65535 for what it does not know."""
    path, photo = tmp_path / name, tmp_path / "photo.png"
    if name.endswith(".npy"):
        np.save(path, np.array([[codes] * 2], np.float32)[..., None])  # as Marigold's of Diffusers
    else:
        Pillow.fromarray(np.array([codes] * 2, getattr(codes, "dtype", np.uint16))).save(path)
    inverse = read_depth_map(path).inverse[0]
    if "distances" in note:
        assert (np.diff(inverse[1:]) < 0).all()
    else:
        sign = 1 if "brighter" in note else -1
        assert inverse == pytest.approx(sign * np.asarray(codes, np.float32), abs=0.5 * (codes[-1] == 255))
    photo.write_bytes(encoded(np.zeros((2, 5, 3), np.uint8)))
    assert re.search(note, " ".join(load_scene(photo).notes))


def test_the_depth_of_an_archive_of_arrays(tmp_path):
    """As Depth Pro writes it."""
    np.savez_compressed(tmp_path / "a.npz", depth=DEPTH, focal=1.0)
    assert read_depth_map(tmp_path / "a.npz").inverse == pytest.approx(INVERSE, nan_ok=True)
    np.savez(tmp_path / "b.npz", focal=1.0)
    with pytest.raises(SceneError, match=r"^b\.npz: is no depth map .*; .* of \.npz files the one called depth$"):
        read_depth_map(tmp_path / "b.npz")


@pytest.mark.parametrize(
    ("photo", "name"),
    [
        ("photo", "photo_depth.png"),
        ("photo", "photo-Depth.npy"),
        ("photo", "photo depth map.PNG"),
        ("photo", "photo_disparity.png"),
        ("0001_rgb", "0001_depth.png"),
        ("mango-image", "mango-depth.png"),
        ("Color", "Depth.png"),
    ],
)
def test_a_map_that_is_named_like_the_photograph_belongs_to_it(tmp_path, photo, name):
    ramp = np.tile(np.arange(20, dtype=np.uint8) * 9, (20, 1))
    path, beside = tmp_path / f"{photo}.png", tmp_path / name
    path.write_bytes(encoded(np.zeros((20, 20, 3), np.uint8)))
    (tmp_path / "photograph_depth.png").write_bytes(b"of another one")
    if beside.suffix == ".npy":
        saved(beside, 1.0 + ramp)
    else:
        beside.write_bytes(encoded(ramp))
    found, named = load_scene(path), load_scene(path, depth_map=beside)
    assert found.notes == (f"depth from {name}, which lies beside it", *named.notes)
    np.testing.assert_array_equal(found.description.meshes[0].positions, named.description.meshes[0].positions)


def test_maps_of_other_proportions_are_refused(tmp_path):
    (tmp_path / "photo.png").write_bytes(encoded(np.zeros((40, 40, 3), np.uint8)))
    saved(tmp_path / "depth.npy", np.ones((10, 20), np.float32))
    with pytest.raises(
        SceneError, match="the depth map has 20x10 pixels, the picture 40x40; their sides have the same"
    ):
        load_scene(tmp_path / "photo.png", depth_map=tmp_path / "depth.npy")


def test_a_depth_map_is_for_photographs(tmp_path):
    rule = r"for \.jpg, \.jpeg, \.png, \.tif, \.tiff, \.webp, \.heic, \.heif, \.hif files"
    with pytest.raises(UsageError, match=rf"depth_map: teapot is no photograph; {rule}"):
        load_scene("teapot", depth_map=tmp_path / "depth.npy")


def test_no_view_sees_between_the_layers():
    clutter = np.kron(np.random.default_rng(3).random((8, 8)), np.ones((5, 5))).astype(np.float32)
    layers = split_layers(clutter, np.zeros((40, 40, 3), np.float32), "photo.jpg")
    covered = {*map(tuple, layers.faces), *map(tuple, layers.behind_faces)}
    assert len(covered) == 2 * 39 * 39
    assert np.ptp(layers.nearness.ravel()[layers.faces], axis=1).max() <= EDGE


@pytest.mark.parametrize("quality", [95, 75])
def test_ripples_of_jpeg_are_no_edges(tmp_path, quality):
    """Beside its true edges a JPEG depth map has ripples; all of what is near hides the far side nevertheless."""
    y, x = np.mgrid[-1:1:96j, -1:1:96j]
    is_near = x**2 + y**2 < 0.36
    Pillow.fromarray(np.where(is_near, 210, 60).astype(np.uint8)).save(tmp_path / "d.jpg", quality=quality)
    inverse = read_depth_map(tmp_path / "d.jpg").inverse
    layers = split_layers(inverse, np.zeros((96, 96, 3), np.float32), "d.jpg")
    assert layers.behind[x**2 + y**2 < 0.3].max() < 0.1
    sides = is_near.ravel()[layers.faces]
    assert len(layers.faces) > 0.95 * 2 * 95 * 95
    assert (sides.all(axis=1) | ~sides.any(axis=1)).mean() > 0.999


def test_a_flat_map_has_one_layer():
    layers = split_layers(np.full((8, 8), 0.5, np.float32), np.zeros((8, 8, 3), np.float32), "x")
    assert len(layers.behind_faces) == 0
    assert len(layers.faces) == 2 * 49


def test_a_portrait_is_a_scene(tmp_path):
    shares = np.zeros((4, 6), np.uint8)
    shares[:, 3:] = 255
    (tmp_path / "p.jpg").write_bytes(portrait(shares))
    scene = load_scene(tmp_path / "p.jpg")
    assert scene.bounds[:, 2].tolist() == [0, 0.5]
    assert not scene.in_studio


def lying(path, picture, orientation, **options):
    """The picture as a camera stores it that is held so: its pixels turned, and how to turn them back."""
    exif = Pillow.Exif()
    exif[0x112] = orientation
    turns = {1: 0, 3: 2, 6: 1, 8: 3}[orientation]
    Pillow.fromarray(np.rot90(picture, turns).copy()).save(path, exif=exif, **options)
    return path


def half_blue():
    picture = np.full((12, 8, 3), 120, np.uint8)
    picture[:6] = 40, 80, 230
    return picture


@pytest.mark.parametrize("ending", [".png", ".jpg", ".webp"])
@pytest.mark.parametrize("orientation", [1, 3, 6, 8])
def test_photographs_are_upright(tmp_path, ending, orientation):
    photo = lying(tmp_path / f"a{ending}", np.repeat(np.repeat(half_blue(), 8, 0), 8, 1), orientation, quality=95)
    np.save(tmp_path / "d.npy", np.where(np.arange(12) < 6, 4.0, 1.0)[:, None] * np.ones((1, 8)))
    description = load_scene(photo, depth_map=tmp_path / "d.npy").description
    pixels = description.materials[0].base_color_texture.image.pixels
    assert np.abs(pixels[4::8, 4::8].astype(int) - half_blue()).max() < 12
    points = description.meshes[0].positions
    assert points[points[:, 1] < -0.1, 2].min() > points[points[:, 1] > 0.1, 2].max()  # what is near lies below


def test_depth_within_a_photograph_lies_as_its_pixels():
    data = portrait([[0, 255, 255]])
    assert embedded_depth(data, "a", 1).inverse.shape == (1, 3)
    turned = embedded_depth(data, "a", 6).inverse
    assert turned[:, 0] == pytest.approx([1, 0.25, 0.25], rel=0.01)
    assert embedded_depth(data, "a", 3).inverse[0] == pytest.approx([0.25, 0.25, 1], rel=0.01)


def test_a_depth_map_is_turned_by_its_own_tag(tmp_path):
    levels = np.array([[10, 20, 30], [40, 50, 60]], np.uint8)
    found = read_depth_map(lying(tmp_path / "d.png", levels, 6)).inverse
    assert found == pytest.approx(levels, abs=0.5)


def test_a_map_that_lies_as_the_picture_is_stored_is_named(tmp_path):
    photo = lying(tmp_path / "a.jpg", np.repeat(half_blue(), 2, 1)[:, :6], 6)
    np.save(tmp_path / "d.npy", np.ones((6, 12)))
    with pytest.raises(SceneError, match=r"12x6 pixels, the picture 6x12.*turn the map as the picture's EXIF orient"):
        load_scene(photo, depth_map=tmp_path / "d.npy")
    upright = lying(tmp_path / "b.jpg", np.repeat(half_blue(), 2, 1)[:, :6], 1)
    turned = lying(tmp_path / "d.png", np.zeros((6, 12), np.uint8), 1)
    with pytest.raises(
        SceneError, match=r"12x6 pixels, the picture 6x12; their sides have the same proportion; turn one"
    ):
        load_scene(upright, depth_map=turned)


def test_a_photograph_of_another_colour_space_becomes_srgb(tmp_path):
    Pillow.new("RGB", (8, 8), (128, 128, 128)).save(tmp_path / "a.png", icc_profile=rgb_profile(REC709, 1.0))
    np.save(tmp_path / "d.npy", np.ones((8, 8)))
    description = load_scene(tmp_path / "a.png", depth_map=tmp_path / "d.npy").description
    assert description.materials[0].base_color_texture.image.pixels == pytest.approx(188, abs=1)


def test_light_that_changes_nothing_in_a_photograph_is_said(tmp_path):
    Pillow.new("RGB", (8, 8)).save(tmp_path / "a.png")
    np.save(tmp_path / "a-depth.npy", np.ones((8, 8)))
    scene = load_scene(tmp_path / "a.png", light={"light_strength": 2.0}, single_scattering=True)
    assert scene.notes[-1] == (
        "a photograph keeps its own colours, whatever light is given: single_scattering, light_strength"
    )
    assert "whatever light" not in "".join(load_scene(tmp_path / "a.png").notes)
    assert (
        load_scene(tmp_path / "a.png", background=(1.0, 1.0, 1.0))
        .notes[-1]
        .startswith("background: seen beyond the photograph's edge alone")
    )
