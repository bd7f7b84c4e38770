import contextlib
import json
import struct
import zlib

import imagecodecs
import numpy as np
import pytest
import tifffile
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from lippmann.codecs.exr import write_exr
from lippmann.codecs.icc import rgb_profile
from lippmann.codecs.png import encode_png, read_png_header
from lippmann.color.primaries import REC709
from lippmann.color.transfer import quantize
from lippmann.errors import DisplayError, LippmannError, PictureError
from lippmann.image import Provenance, open_file, read_metadata, read_picture, write_picture
from lippmann.image.write import write_plain_picture

KINDS = [("a.png", 8), ("a.png", 16), ("a.exr", 16), ("a.exr", 32), ("a.tif", 8), ("a.tiff", 16), ("a.TIF", 32)]


@pytest.mark.parametrize(("name", "bits"), KINDS)
def test_metadata_is_read_without_the_pixels(tmp_path, display, picture, name, bits, monkeypatch):
    image = picture(display("lenticular", distance=600.0))
    path = tmp_path / name
    write_picture(image, path, bits=bits)
    for function in ("png.decode_png", "exr.read_exr", "tiff.TiffPicture.read"):
        monkeypatch.setattr(f"lippmann.codecs.{function}", lambda *_: pytest.fail("pixels were read"))
    metadata, info = read_metadata(path), open_file(path)
    assert metadata.display == image.display
    assert metadata.provenance == image.provenance
    assert (info.width, info.height, info.layers) == (12, 9, ())
    assert info.stored == {8: "uint8", 16: "float16" if name.endswith("exr") else "uint16", 32: "float32"}[bits]


def test_files_may_be_named_by_strings(tmp_path, display, picture):
    image = picture(display("lenticular", lenses=(16, 11)))
    path = tmp_path / "a.png"
    write_picture(image, path)
    name = str(path)
    np.testing.assert_array_equal(read_picture(name).pixels, read_picture(path).pixels)
    assert open_file(name).width == image.display.panel.width
    assert read_metadata(name).display == image.display


def test_a_missing_empty_or_foreign_file(tmp_path):
    for name, content, message in (
        ("missing.png", None, "missing.png: no such file"),
        ("empty.png", b"", "empty.png: is empty"),
        ("text.png", b"hello", "text.png: is no picture that is known here"),
        ("jpeg.png", b"\xff\xd8\xff\xe0" + bytes(100), "PNG, OpenEXR, TIFF and Zarr are read"),
    ):
        if content is not None:
            (tmp_path / name).write_bytes(content)
        with pytest.raises(PictureError, match=message):
            read_picture(tmp_path / name)
    with pytest.raises(PictureError, match="is a folder, no file; name a file in it: 'lippmann weave'"):
        read_picture(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "bits"), KINDS)
def test_a_file_cut_anywhere_is_one_line_of_error(tmp_path, display, picture, capfd, name, bits):
    write_picture(picture(display("lenticular", lenses=(16, 11))), tmp_path / name, bits=bits)
    whole = (tmp_path / name).read_bytes()
    cut = tmp_path / f"cut-{name}"
    for length in [*range(1, 40), *range(40, len(whole) - 1, 97), len(whole) - 5]:
        cut.write_bytes(whole[:length])
        with pytest.raises(PictureError) as caught:
            read_picture(cut)
        assert "\n" not in str(caught.value)
        assert str(cut) in str(caught.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
@settings(
    deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
@given(data=st.data())
@pytest.mark.parametrize("name", ["a.png", "a.exr", "a.tif"])
def test_damage_anywhere_is_refused_or_harmless(tmp_path, display, picture, name, data):
    path = tmp_path / name
    write_picture(picture(display("square")), path)
    damaged = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.integers(0, len(damaged) - 1))
        damaged[place] = data.draw(st.integers(0, 255))
    path.write_bytes(damaged)
    # Any other exception fails the test.
    with contextlib.suppress(PictureError):
        assert read_picture(path).pixels.shape == (9, 12, 3)


def test_a_picture_without_a_display(tmp_path, display, picture):
    array = display("square")
    codes = np.random.default_rng(2).integers(0, 256, (9, 12, 3), dtype=np.uint8)
    path = tmp_path / "foreign.png"
    Image.fromarray(codes).save(path)
    for read in (read_picture, read_metadata):
        with pytest.raises(PictureError, match=r"foreign.png: has no display in it; say display=..."):
            read(path)
    image = read_picture(path, display=array)
    np.testing.assert_array_equal(quantize(image.pixels, 8, "srgb"), codes)
    assert image.display == array
    assert image.provenance == Provenance()
    assert open_file(path).metadata is None
    said = r"foreign.png: has 12 x 9 pixels; the display test-square has 15 x 9; of a quilt, say its columns"
    with pytest.raises(PictureError, match=said):
        read_picture(path, display=display("square", lenses=(5, 3)))


@pytest.mark.parametrize("options", [{}, {"bits": 1}])
def test_pictures_of_one_bit_are_read(tmp_path, options):
    stripes = np.repeat(np.tile(np.repeat([0, 255], 4), 64)[None], 512, axis=0).astype(np.uint8)
    picture = Image.fromarray(stripes)
    picture = picture.convert("P", palette=1, colors=2) if options else picture.convert("1")
    picture.save(tmp_path / "a.png", optimize=True, **options)
    assert (tmp_path / "a.png").stat().st_size < 512 * 512 / 1100
    values, _ = open_file(tmp_path / "a.png").decode()
    np.testing.assert_array_equal(values, np.repeat(stripes[..., None], 3, axis=2))


def test_interlaced_pictures_and_transparent_colours(tmp_path):
    """Two pixels by Adam7: the first lies in pass 1, the second in pass 6. tRNS makes white transparent."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = chunk(b"IHDR", struct.pack(">2I5B", 2, 1, 8, 0, 0, 0, 1))
    body = chunk(b"IDAT", zlib.compress(b"\0\x50\0\xa0")) + chunk(b"IEND", b"")
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + head + body)
    assert open_file(tmp_path / "a.png").decode()[0][..., 0].tolist() == [[0x50, 0xA0]]
    for key, what in ((0x50, "partly transparent"), (0x51, "")):
        (tmp_path / "b.png").write_bytes(b"\x89PNG\r\n\x1a\n" + head + chunk(b"tRNS", struct.pack(">H", key)) + body)
        if what:
            with pytest.raises(PictureError, match="partly transparent"):
                open_file(tmp_path / "b.png").decode()
        else:
            assert open_file(tmp_path / "b.png").decode()[0][..., 0].tolist() == [[0x50, 0xA0]]


@pytest.mark.parametrize("ending", [".png", ".tif"])
def test_native_pictures_are_upright(tmp_path, ending):
    codes = np.random.default_rng(3).integers(0, 256, (9, 12, 3), dtype=np.uint8)
    exif = Image.Exif()
    exif[0x112] = 6
    Image.fromarray(np.rot90(codes).copy()).save(tmp_path / f"a{ending}", exif=exif)
    file = open_file(tmp_path / f"a{ending}")
    assert (file.width, file.height) == (12, 9)
    np.testing.assert_array_equal(file.decode()[0], codes)


def test_codes_of_a_display_stay_and_those_of_a_view_become_srgb(tmp_path):
    codes = np.full((4, 6, 3), 128, np.uint8)
    (tmp_path / "linear.png").write_bytes(encode_png(codes, text={}, icc=rgb_profile(REC709, 1.0)))
    file = open_file(tmp_path / "linear.png")
    assert (file.decode()[0] == 128).all()
    assert file.decode(as_srgb=True)[0] == pytest.approx(188, abs=1)


@pytest.mark.parametrize("kind", [np.float32, np.float16])
def test_exr_chromaticities_are_converted(tmp_path, kind):
    """Rec. 2020, with the matrix of ITU-R BT.2087-0; alpha and other layers stay."""
    names = {"R": 1.0, "G": 0.5, "B": 0.5, "A": 1.0, "depth.V": 7.0}
    planes = {name: np.full((4, 6), value, kind) for name, value in names.items()}
    write_exr(
        tmp_path / "a.exr", planes, text={"chromaticities": (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290)}
    )
    values, layers = open_file(tmp_path / "a.exr").decode()
    assert values.dtype == kind
    to_709 = np.array([[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]])
    assert values[0, 0] == pytest.approx(to_709 @ [1.0, 0.5, 0.5], abs=1e-3)
    assert (layers["depth"] == 7).all()


def test_luminance_and_chroma_are_named(tmp_path):
    planes = {name: np.zeros((4, 6), np.float32) for name in ("Y", "RY", "BY")}
    write_exr(tmp_path / "a.exr", planes, text={})
    data = (tmp_path / "a.exr").read_bytes()
    # Chroma for every second pixel: the last eight bytes of a channel's entry are its steps.
    places = [data.index(name + b"\0" + struct.pack("<iIii", 2, 0, 1, 1)) + len(name) + 9 for name in (b"BY", b"RY")]
    halved = bytearray(data)
    for place in places:
        halved[place : place + 8] = struct.pack("<ii", 2, 2)
    for content in (data, bytes(halved)):
        (tmp_path / "b.exr").write_bytes(content)
        with pytest.raises(
            PictureError, match=r"b\.exr: has luminance and chroma \(Y, RY, BY\); R, G and B are read; conv"
        ):
            open_file(tmp_path / "b.exr")


def test_what_is_not_shown_is_noted(tmp_path):
    codes = np.zeros((4, 6, 3), np.uint8)
    Image.fromarray(codes).save(tmp_path / "a.png", dpi=(100, 200))
    frames = [Image.fromarray(codes), Image.fromarray(codes + 9)]
    frames[0].save(tmp_path / "b.png", save_all=True, append_images=frames[1:])
    tifffile.imwrite(tmp_path / "a.tif", codes, photometric="rgb", resolution=(100, 200), resolutionunit="INCH")
    with tifffile.TiffWriter(tmp_path / "b.tif") as file:
        for _ in range(3):
            file.write(codes, photometric="rgb")
    curve = np.arange(256, dtype=np.uint16)
    tifffile.imwrite(tmp_path / "c.tif", codes, photometric="rgb", extratags=[(301, 3, 256, curve.tolist(), True)])
    plane = {name: np.zeros((4, 6), np.float32) for name in "RGB"}
    write_exr(tmp_path / "a.exr", plane, text={"pixelAspectRatio": 2.0})
    write_exr(tmp_path / "b.exr", plane, text={"whiteLuminance": 100.0})
    wide = "its pixels are 2 times as wide as high: they are shown square"
    for name, note in (
        ("a.png", wide),
        ("b.png", "it holds 2 pictures: the first is shown"),
        ("a.tif", wide),
        ("b.tif", "it holds 3 pictures: the first is shown"),
        ("c.tif", "it has a transfer function of its own: its codes are read as sRGB"),
        ("a.exr", wide),
        ("b.exr", "its attribute whiteLuminance is not used"),
    ):
        assert open_file(tmp_path / name).notes == (note,), name
    write_plain_picture(np.zeros((4, 6, 3), np.float32), tmp_path / "plain.png")
    assert open_file(tmp_path / "plain.png").notes == ()


def test_a_display_may_be_named(tmp_path):
    Image.new("RGB", (512, 512), (255, 0, 0)).save(tmp_path / "a.png")
    assert read_picture(tmp_path / "a.png", display="seed-lenticular").display.name == "seed-lenticular"
    with pytest.raises(DisplayError, match="unknown display 'nothing'"):
        read_metadata(tmp_path / "a.png", display="nothing")


def test_a_display_given_replaces_the_one_in_the_file(tmp_path, display, picture, provenance):
    picture(display("square")).save(tmp_path / "a.png")
    other = display("lenticular")
    image = read_picture(tmp_path / "a.png", display=other)
    assert image.display == other
    assert image.provenance == provenance


def save_with(tmp_path, name, codes):
    path = tmp_path / name
    if name.endswith("png"):
        path.write_bytes(imagecodecs.png_encode(codes.squeeze()))
    elif name.endswith("exr"):
        letters = {1: "Y", 2: "YA", 3: "RGB", 4: "RGBA"}[codes.shape[2]]
        write_exr(path, {letter: codes[..., k] for k, letter in enumerate(letters)}, text={})
    else:
        tifffile.imwrite(path, codes if codes.shape[2] > 1 else codes[..., 0])
    return path


@pytest.mark.parametrize(
    ("name", "dtype", "top"),
    [("a.png", np.uint8, 255), ("a.png", np.uint16, 65535), ("a.exr", np.float32, 1), ("a.tif", np.uint8, 255)],
)
def test_grey_and_opaque_pictures_of_other_programs(tmp_path, display, name, dtype, top):
    grey = (np.random.default_rng(3).random((9, 12)) * top).astype(dtype)
    rgb = np.stack([grey] * 3, axis=-1)
    opaque = np.full_like(grey, top)
    array = display("square")
    pictures = [grey[..., None], rgb, np.dstack([rgb, opaque])] + (
        [np.dstack([grey, opaque])] if name != "a.tif" else []
    )
    results = [read_picture(save_with(tmp_path, name, values), display=array).pixels for values in pictures]
    for result in results:
        np.testing.assert_array_equal(result, results[0])
        np.testing.assert_array_equal(result[..., 0], result[..., 2])
    holes = np.dstack([rgb, opaque])
    holes[4, 4, 3] = 0
    with pytest.raises(PictureError, match="partly transparent"):
        read_picture(save_with(tmp_path, name, holes), display=array)


def test_what_no_panel_shows_is_refused(tmp_path, display):
    array = display("square")
    values = np.zeros((9, 12, 3), dtype=np.uint32)
    tifffile.imwrite(tmp_path / "a.tif", values, photometric="rgb")
    with pytest.raises(PictureError, match=r"a.tif: holds values of the type uint32; tiff is read with uint8"):
        read_picture(tmp_path / "a.tif", display=array)
    tifffile.imwrite(tmp_path / "b.tif", np.zeros((4, 9, 12, 3), dtype=np.uint8), photometric="rgb", planarconfig=1)
    assert read_picture(tmp_path / "b.tif", display=array).pixels.shape == (9, 12, 3)  # the first of four pages
    plane = np.zeros((9, 12), dtype=np.float32)
    write_exr(tmp_path / "a.exr", {"R": plane, "G": plane}, text={})
    with pytest.raises(PictureError, match=r"a.exr: has the channels G, R; R, G and B of one type are needed"):
        read_picture(tmp_path / "a.exr", display=array)
    write_exr(tmp_path / "b.exr", {"R": plane, "G": plane, "B": plane + np.nan}, text={})
    with pytest.raises(PictureError, match=r"b.exr: 108 pixels are not finite, the first in column 0, row 0"):
        read_picture(tmp_path / "b.exr", display=array)
    with pytest.raises(PictureError, match="not finite"):
        write_plain_picture(np.full((2, 2, 3), np.inf, np.float32), tmp_path / "c.png")


def png_claiming(width, height, body=b"\x78\x9c"):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def test_sizes_that_the_file_cannot_hold_are_refused_unread(tmp_path, display):
    path = tmp_path / "bomb.png"
    path.write_bytes(png_claiming(20000, 20000))
    with pytest.raises(PictureError, match=r"claims 20000 x 20000 pixels but has only \d+ bytes"):
        read_picture(path, display=display())
    path.write_bytes(png_claiming(2**31 - 1, 2**31 - 1))
    with pytest.raises(PictureError, match="at most 536870912 pixels"):
        read_picture(path, display=display())
    path.write_bytes(png_claiming(0, 5))
    with pytest.raises(PictureError, match="no proper header"):
        read_picture(path, display=display())


def test_a_text_that_unpacks_to_too_much_is_not_unpacked(tmp_path, display):
    packed = zlib.compress(b"[" * (1 << 26), 9)
    whole = encode_png(np.zeros((9, 12, 3), np.uint8), text={})
    data = b"lippmann\0\1\0\0\0" + packed
    chunk = struct.pack(">I", len(data)) + b"iTXt" + data + struct.pack(">I", zlib.crc32(b"iTXt" + data))
    (tmp_path / "a.png").write_bytes(whole[:33] + chunk + whole[33:])
    assert len(read_png_header(tmp_path / "a.png").text["lippmann"]) == 1 << 24
    with pytest.raises(PictureError, match="has no display in it"):
        read_picture(tmp_path / "a.png")


def test_a_damaged_text_is_noticed(tmp_path, display, picture):
    path = tmp_path / "a.png"
    picture(display("square")).save(path)
    whole = path.read_bytes()
    path.write_bytes(whole.replace(b'"spp":64', b'"spp":46'))
    with pytest.raises(PictureError, match="the check sum of its iTXt chunk is wrong"):
        read_metadata(path)


def test_texts_packed_by_other_programs_are_read(tmp_path, display, picture):
    image = picture(display("square"))
    image.save(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as other:
        from PIL.PngImagePlugin import PngInfo

        info = PngInfo()
        info.add_itxt("lippmann", other.text["lippmann"], zip=True)
        other.save(tmp_path / "b.png", pnginfo=info)
    assert read_picture(tmp_path / "b.png").provenance == image.provenance


GOOD = {"lippmann": 1, "display": ..., "world_from_display": np.eye(4).tolist(), "provenance": {}}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"lippmann": 2}, "version 2; up to 1 is read; get a newer Lippmann"),
        ({"lippmann": "1"}, "version '1'"),
        ({"lippmann": True}, "version True"),
        ({"display": None}, "its metadata makes no sense"),
        ({"display": {"name": "x"}}, "missing"),
        ({"display.name": [1]}, "makes no sense"),
        ({"display.gap": -1}, "gap"),
        ({"display.gap": "6.8"}, "gap"),
        ({"display.panel": {"width": 12, "height": 9}}, "pixel_pitch"),
        ({"display.panel": [12, 9]}, "panel"),
        ({"display.extra": 1}, "extra"),
        ({"world_from_display": [[1, 0], [0, 1]]}, "rotation times a scale"),
        ({"world_from_display": np.diag([1, 2, 1, 1]).tolist()}, "rotation times a scale"),
        ({"world_from_display": np.diag([-1, 1, 1, 1]).tolist()}, "rotation times a scale"),
        ({"world_from_display": np.zeros((4, 4)).tolist()}, "rotation times a scale"),
        ({"world_from_display": [["a"] * 4] * 4}, "no matrix"),
        ({"world_from_display": [[10**400] * 4] * 4}, "no matrix"),
        ({"provenance": 3}, "mapping"),
        ({"provenance": {"spp": "many"}}, "provenance: spp is 'many'"),
        ({"display.panel.width": 13}, "the display test-square has 13 x 9"),
    ],
)
def test_metadata_that_makes_no_sense(tmp_path, display, changes, message):
    values = {**GOOD, "display": display("square").to_dict()}
    for name, value in changes.items():
        *tables, last = name.split(".")
        table = values
        for step in tables:
            table = table[step]
        table[last] = value
    path = tmp_path / "a.png"
    path.write_bytes(encode_png(np.zeros((9, 12, 3), np.uint8), text={"lippmann": json.dumps(values)}))
    with pytest.raises(PictureError, match=message) as caught:
        read_picture(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[1]", "[" * 100000, '{"other": 1}', '{"lippmann": NaN}', "null"])
def test_a_text_of_another_kind_is_no_metadata(tmp_path, display, text):
    path = tmp_path / "a.png"
    path.write_bytes(encode_png(np.zeros((9, 12, 3), np.uint8), text={"lippmann": text}))
    assert open_file(path).metadata is None


def test_all_errors_are_ours(tmp_path):
    path = tmp_path / "a.exr"
    path.write_bytes(b"\x76\x2f\x31\x01\x02\x18\x00\x00" + bytes(64))
    with pytest.raises(LippmannError, match="deep"):
        read_picture(path)
