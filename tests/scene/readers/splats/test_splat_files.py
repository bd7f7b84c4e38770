"""Files of splats, held against gsply, another program's reader and writer; and files that are damaged."""

import base64
import gzip
import io
import json
import struct
import zipfile

import gsply
import imagecodecs
import numpy as np
import pytest
from gsply.spz import write_spz
from PIL import Image
from scipy.spatial.transform import Rotation

from lippmann.errors import LippmannError, SceneError
from lippmann.runtime import machine
from lippmann.scene.readers.load import load_scene

COUNT = 600


def trained(degree, seed=0, count=COUNT):
    """What trainers optimize: means, log scales, quaternions (w first), logits, colours and coefficients."""
    random = np.random.default_rng(seed)
    turns = Rotation.random(count, rng=random).as_quat()
    return [
        random.normal(size=(count, 3)).astype(np.float32),
        random.normal(-4, 1, (count, 3)).astype(np.float32),
        np.roll(turns, 1, axis=1).astype(np.float32),
        random.normal(size=count).astype(np.float32),
        (0.5 * random.normal(size=(count, 3))).astype(np.float32),
        (0.2 * random.normal(size=(count, (degree + 1) ** 2 - 1, 3))).astype(np.float32),
    ]


def splats_of(path, **options):
    return load_scene(path, **{"up": "y", **options}).description.splats


def check_same(splats, data, *, exact=False):
    """Whether splats are what gsply read, in its order."""
    near = {"atol": 1e-6 if exact else 1e-5, "rtol": 1e-5}
    np.testing.assert_allclose(splats.centers, data.means, **near)
    np.testing.assert_allclose(splats.scales, np.exp(data.scales), **near)
    np.testing.assert_allclose(splats.opacities, 1 / (1 + np.exp(-data.opacities.ravel())), atol=2e-5)
    turns = np.roll(data.quats / np.linalg.norm(data.quats, axis=1, keepdims=True), -1, axis=1)
    np.testing.assert_allclose(np.abs((turns * splats.rotations).sum(axis=1)), 1, atol=1e-5)
    np.testing.assert_allclose(splats.harmonics[:, 0], data.sh0, **near)
    if splats.degree:
        np.testing.assert_allclose(splats.harmonics[:, 1:], data.shN, **near)


def name_of(value):
    """Of a parameter, for the test's name: packed files hold the time at which they are made."""
    return "bytes" if isinstance(value, bytes) else None


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_ply_of_trainers_is_read_as_gsply_reads_it(tmp_path, degree):
    gsply.plywrite(tmp_path / "a.ply", *trained(degree))
    splats = splats_of(tmp_path / "a.ply")
    assert splats.degree == degree
    check_same(splats, gsply.plyread(tmp_path / "a.ply"), exact=True)


@pytest.mark.long
@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_packed_ply_is_read_as_gsply_reads_it(tmp_path, degree):
    gsply.plywrite(tmp_path / "a.ply", *trained(degree), compressed=True)
    path = next(tmp_path.iterdir())
    splats = splats_of(path)
    assert (splats.count, splats.degree) == (COUNT, degree)
    check_same(splats, gsply.plyread(path))


@pytest.mark.long
@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_spz_is_read_as_gsply_reads_it(tmp_path, degree):
    gsply.plywrite(tmp_path / "a.ply", *trained(degree))
    write_spz(tmp_path / "a.spz", gsply.plyread(tmp_path / "a.ply"), version=3)
    splats = splats_of(tmp_path / "a.spz")
    assert splats.degree == degree
    check_same(splats, gsply.read_spz(tmp_path / "a.spz"))


def spz(version, body, count=1, degree=0, fraction=12):
    return gzip.compress(struct.pack("<4sIIBBBB", b"NGSP", version, count, degree, fraction, 0, 0) + body)


def spz_4(count, sections, degree=0, records=b"", table=None):
    """SPZ of version 4, each section a Zstandard stream, by the description of the format's own library."""
    packed = [imagecodecs.zstd_encode(section) for section in sections]
    head = struct.pack("<4sIIBBBB", b"NGSP", 4, count, degree, 12, 2 if records else 0, len(sections))
    head += struct.pack("<I12x", 32 + len(records) if table is None else table) + records
    sizes = [struct.pack("<QQ", len(p), len(s)) for p, s in zip(packed, sections, strict=True)]
    return head + b"".join(sizes) + b"".join(packed)


#: A splat at (1.5, -0.25, 2), of opacity 1/5, grey, e^-3 thick, not turned.
PLAIN = [
    b"".join(int(v * 4096).to_bytes(3, "little", signed=True) for v in (1.5, -0.25, 2.0)),
    bytes([51]),
    bytes([128, 128, 128]),
    bytes([112, 112, 112]),
    struct.pack("<I", 3 << 30),
]


#: Three splats of degree 4, as the format's own library writes them (npm: @adobe/spz 0.2.3, with 8 bits everywhere).
WRITTEN_BY_THE_LIBRARY = """
TkdTUAQAAAADAAAABAwABiAAAAAAAAAAAAAAAAAAAAAkAAAAAAAAABsAAAAAAAAADAAAAAAAAAADAAAAAAAAABIAAAAAAAAACQAAAAAAAAASAAAAAAAAAAkA
AAAAAAAAFQAAAAAAAAAMAAAAAAAAAHYAAAAAAAAA2AAAAAAAAAAotS/9IBvZAAAAEAAAIAAAMAAA8P8ACAAAIAAAAAAAAAAA8P8otS/9IAMZAACAukUotS/9
IAlJAACTgGympqZZgKYotS/9IAlJAABwcHBwcHBwcHAotS/9IAxhAAAAAADAaaWVFv8BAAAotS/9INhtAwBEBkBvn059rVyMu2qaSXioV4a2ZZREc6NSgbFg
j79unU18rFuKummYSHemVoW0ZJNDcqFRgK9fjr1tnEx7qlqJuGiXRnalVISzY5JBcaBPf65djbxsm0p6qViIt2aWRXSkU4OyYZEBAGQ80xAF
"""


def test_spz_of_version_4_by_the_format_s_own_library(tmp_path):
    (tmp_path / "a.spz").write_bytes(base64.b64decode(WRITTEN_BY_THE_LIBRARY))
    splats = splats_of(tmp_path / "a.spz")
    np.testing.assert_allclose(splats.centers, [[1, 2, 3], [-1, 0.5, 2], [0, 0, -1]], atol=2**-13)
    np.testing.assert_allclose(splats.scales, np.full((3, 3), np.exp(-3)), rtol=0.04)
    turns = [[0, 0, 0, 1], [0.5, 0.5, 0.5, 0.5], [0.70710678, 0, 0, 0.70710678]]
    np.testing.assert_allclose(splats.rotations, turns, atol=2e-3)
    np.testing.assert_allclose(splats.opacities, 1 / (1 + np.exp([0, -1, 1])), atol=2 / 255)
    np.testing.assert_allclose(splats.harmonics[:, 0], [[0.5, 0, -0.5], [1, 1, 1], [-1, 0, 1]], atol=0.014)
    rest = (np.arange(216).reshape(3, 24, 3) * 37 % 100 - 50) / 100
    np.testing.assert_allclose(splats.harmonics[:, 1:], rest, atol=1 / 256)


def test_spz_of_degree_4_in_a_box_of_version_4_and_in_gzip(tmp_path):
    rest = bytes(range(90, 162))
    (tmp_path / "four.spz").write_bytes(spz_4(1, [*PLAIN, rest], degree=4))
    (tmp_path / "three.spz").write_bytes(spz(3, b"".join([*PLAIN, rest]), degree=4))
    for name in ("four.spz", "three.spz"):
        splats = splats_of(tmp_path / name)
        assert splats.degree == 4
        np.testing.assert_array_equal(splats.centers, [[1.5, -0.25, 2.0]])
        np.testing.assert_array_equal(splats.rotations, [[0, 0, 0, 1]])
        np.testing.assert_allclose(splats.harmonics[0, 24], (np.arange(159, 162) - 128) / 128)  # colours side by side


@pytest.mark.parametrize(
    ("number", "place"),
    # Letters tell where x, y and z point: right, up, back is 4; right, down, front 6; left, front, up 11.
    [(4, [1.5, -0.25, 2]), (6, [1.5, 0.25, -2]), (7, [-1.5, -0.25, -2]), (11, [-1.5, 2, 0.25]), (8, [1.5, -0.25, -2])],
)
def test_spz_that_says_its_axes_is_turned_to_ours(tmp_path, number, place):
    records = struct.pack("<IIfff", 0xADBE0002, 12, 0, 1, 2) + struct.pack("<III", 0xADBE0003, 4, number)
    gzipped = gzip.compress(struct.pack("<4sIIBBBB", b"NGSP", 3, 1, 0, 12, 2, 0) + b"".join(PLAIN) + records)
    for data in (spz_4(1, PLAIN, records=records), gzipped):
        (tmp_path / "a.spz").write_bytes(data)
        scene = load_scene(tmp_path / "a.spz")
        np.testing.assert_allclose(scene.description.splats.centers, [place], atol=1e-6)
        assert not any("up is taken" in note or "extension" in note for note in scene.notes)
    (tmp_path / "a.spz").write_bytes(spz_4(1, PLAIN, records=struct.pack("<IIB", 0x12340001, 1, 0)))
    assert any("extension 0x12340001 is not read" in note for note in load_scene(tmp_path / "a.spz").notes)


def test_spz_of_older_versions_by_hand(tmp_path):
    # 1.5, -0.25 and 2 in 24 bits, of which 12 are behind the point; opacity 1/5; grey; e^-3; turned 90 degrees about x.
    place = b"".join(int(v * 4096).to_bytes(3, "little", signed=True) for v in (1.5, -0.25, 2.0))
    rest = bytes([51, 128, 128, 128, 112, 112, 112, 218, 128, 128])
    (tmp_path / "two.spz").write_bytes(spz(2, place + rest))
    (tmp_path / "one.spz").write_bytes(spz(1, np.array([1.5, -0.25, 2.0], "<f2").tobytes() + rest))
    for name in ("two.spz", "one.spz"):
        splats = splats_of(tmp_path / name)
        np.testing.assert_array_equal(splats.centers, [[1.5, -0.25, 2.0]])
        assert splats.opacities == pytest.approx([0.2])
        np.testing.assert_allclose(splats.scales, np.full((1, 3), np.exp(-3.0)), rtol=1e-6)
        np.testing.assert_allclose(splats.rotations, [[np.sqrt(0.5), 0, 0, np.sqrt(0.5)]], atol=0.005)


def sog(degree=0, version=2, seed=0, count=COUNT, told=None, told_version=2, **changes):
    """A SOG file of random pixels, as a zip."""
    random = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(count)))
    files = {}

    def picture(name, width=side, height=side, most=256, alpha=None):
        pixels = random.integers(0, most, (height, width, 4), dtype=np.uint8)
        pixels[..., 3] = 255 if alpha is None else random.choice(alpha, (height, width))
        stream = io.BytesIO()
        Image.fromarray(pixels).save(stream, "WEBP", lossless=True, exact=True)
        files[name] = stream.getvalue()
        return name

    book = {"codebook": random.normal(-4, 1, 256).tolist()}
    colors = {"codebook": random.normal(0, 1, 256).tolist()}
    rest = {"codebook": random.normal(0, 0.1, 256).tolist()}
    if version == 1:
        book, colors = {"mins": [-6, -7, -8], "maxs": [-1, -2, -3]}, {"mins": [-1, -2, -3, -4], "maxs": [1, 2, 3, 4]}
        rest = {"mins": -0.5, "maxs": 0.75, "quantization": 8}
    shape = {"shape": [count, 3]} if version == 1 else {}
    meta = {
        "means": {"mins": [-1, -2, -3], "maxs": [1, 2, 3], "files": [picture("l.webp"), picture("u.webp")], **shape},
        "scales": {**book, "files": [picture("s.webp")]},
        "quats": {"files": [picture("q.webp", alpha=[252, 253, 254, 255])]},
        "sh0": {**colors, "files": [picture("c.webp", alpha=range(256))]},
    }
    meta |= {"version": told_version, "count": told or count} if version == 2 else {}
    if degree:
        own = (degree + 1) ** 2 - 1
        labels = picture("n.webp", most=1)
        palette = {"count": 64, "bands": degree} if version == 2 else {"shape": [count, 3 * own]}
        meta["shN"] = {**palette, **rest, "files": [picture("p.webp", 64 * own, 1), labels]}
    for name, value in changes.items():
        where, _, key = name.rpartition("__")
        (meta[where] if where else meta)[key] = value
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("meta.json", json.dumps(meta))
        for name, data in files.items():
            archive.writestr(name, data)
    return stream.getvalue()


@pytest.mark.long
@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("degree", [0, 1, 3])
def test_sog_is_read_as_gsply_reads_it(tmp_path, degree, version):
    (tmp_path / "a.sog").write_bytes(sog(degree, version))
    splats = splats_of(tmp_path / "a.sog")
    assert (splats.count, splats.degree) == (COUNT, degree)
    check_same(splats, gsply.sogread(tmp_path / "a.sog"))


@pytest.mark.parametrize(
    ("name", "data", "usual"),
    [("a.ply", None, "-y"), ("a.sog", sog(), "-y"), ("a.spz", spz(2, bytes(9) + bytes([51] + [128] * 9)), "y")],
    ids=name_of,
)
def test_up_is_what_trainers_mostly_have(tmp_path, name, data, usual):
    path = tmp_path / name
    if data is None:
        gsply.plywrite(path, *trained(1))
    else:
        path.write_bytes(data)
    scene = load_scene(path)
    np.testing.assert_array_equal(scene.description.splats.centers, splats_of(path, up=usual).centers)
    assert any(f"up is taken as {'+y' if usual == 'y' else usual}" in note for note in scene.notes)
    straight = splats_of(path)
    np.testing.assert_array_equal(splats_of(path, up="-y").centers, straight.centers * np.float32([1, -1, -1]))


def test_sog_that_is_not_bundled(tmp_path):
    folder = tmp_path / "scan"
    with zipfile.ZipFile(io.BytesIO(sog(1))) as archive:
        archive.extractall(folder)
    (tmp_path / "a.sog").write_bytes(sog(1))
    true = splats_of(tmp_path / "a.sog")
    for path in (folder, folder / "meta.json"):
        scene = load_scene(path)
        assert scene.name == "scan"
        assert any("up is taken as -y" in note for note in scene.notes)
        np.testing.assert_array_equal(splats_of(path).harmonics, true.harmonics)
    (folder / "u.webp").unlink()
    with pytest.raises(LippmannError, match=r"picture 'u\.webp' not found"):
        load_scene(folder)
    meta = (folder / "meta.json").read_text().replace("u.webp", "../u.webp")
    (folder / "meta.json").write_text(meta)
    with pytest.raises(LippmannError, match=r"meta\.json: .*u\.webp"):
        load_scene(folder / "meta.json")


def header(properties, count=1, form="binary_little_endian"):
    lines = [f"property {kind} {name}" for name, kind in properties]
    return "\n".join(["ply", f"format {form} 1.0", f"element vertex {count}", *lines, "end_header\n"]).encode()


NAMES = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2"]
NAMES += ["rot_0", "rot_1", "rot_2", "rot_3"]
ROW = np.float32([1, 2, 3, 0, 0, 0, 0, -1, -1, -1, 2, 0, 0, 0])


def test_text_and_doubles_and_other_orders_are_read(tmp_path):
    text = header([(name, "float") for name in NAMES], form="ascii") + " ".join(map(str, ROW)).encode()
    doubles = header([(name, "double") for name in NAMES]) + ROW.astype("<f8").tobytes()
    big = header([(name, "float") for name in NAMES], form="binary_big_endian") + ROW.astype(">f4").tobytes()
    turned = header([(name, "float") for name in reversed(NAMES)]) + ROW[::-1].astype("<f4").tobytes()
    faces = b"element face 0\nproperty list uchar int vertex_indices\nend_header"
    with_no_faces = turned.replace(b"end_header", faces, 1)  # as mesh libraries write
    for number, data in enumerate((text, doubles, big, turned, with_no_faces)):
        path = tmp_path / f"{number}.ply"
        path.write_bytes(data)
        splats = splats_of(path)
        np.testing.assert_array_equal(splats.centers, [[1, 2, 3]])
        np.testing.assert_array_equal(splats.rotations, [[0, 0, 0, 1]])
        assert splats.opacities == pytest.approx([0.5])


def test_splats_that_are_no_numbers_are_left_out(tmp_path):
    rows = np.stack([ROW, ROW])
    rows[1, 8] = np.nan
    path = tmp_path / "a.ply"
    path.write_bytes(header([(name, "float") for name in NAMES], 2) + rows.tobytes())
    scene = load_scene(path)
    assert scene.description.splats.count == 1
    assert any("1 of 2 splats have numbers that are out of range" in note for note in scene.notes)
    path.write_bytes(header([(name, "float") for name in NAMES], 1) + rows[1].tobytes())
    with pytest.raises(SceneError, match=r"a\.ply: holds no Gaussian splat whose numbers are all finite"):
        load_scene(path)


@pytest.mark.parametrize("length", [1e-30, 1e30])
def test_quaternions_of_any_length_are_read(tmp_path, length):
    row = ROW.copy()
    row[10:] = np.float32(length) * np.float32([0.5, -0.5, 0.5, 0.5])
    path = tmp_path / "a.ply"
    path.write_bytes(header([(name, "float") for name in NAMES]) + row.tobytes())
    np.testing.assert_allclose(splats_of(path).rotations, [[-0.5, 0.5, 0.5, 0.5]], atol=1e-6)


FLOATS = [(name, "float") for name in NAMES]


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.ply", header(FLOATS, 2) + ROW.tobytes(), "ends after 1 of 2 entries of 'vertex'"),
        ("a.ply", header([*FLOATS, ("f_rest_0", "float")]) + bytes(60), "has 1 properties f_rest_"),
        ("a.ply", header([*FLOATS, *[(f"f_rest_{2 * n}", "float") for n in range(9)]]) + bytes(92), "count from 0"),
        ("a.ply", header([*FLOATS, ("opacity", "float")]) + bytes(60), "a property twice"),
        ("a.ply", header(FLOATS, form="ascii") + b"x " * 14, "numbers only"),
        (
            "a.ply",
            header([(f"packed_{n}", "uint") for n in ("position", "rotation", "scale", "color")]) + bytes(16),
            "bounds",
        ),
        ("a.spz", b"\x1f\x8b" + bytes(20), "a.spz: is damaged"),
        ("a.spz", b"NGSP" + bytes(20), "is cut short: 24 of 32 bytes"),
        ("a.spz", b"NGSP" + bytes(28), "SPZ of version 0"),
        ("a.spz", spz_4(1, PLAIN)[:-3], "section 4 holds 13 bytes for 4 of 4; is it cut short"),
        ("a.spz", spz_4(2, PLAIN), "section 0 holds 18 bytes for 9 of 18"),
        ("a.spz", spz_4(1, PLAIN[:4]), "has 4 streams"),
        ("a.spz", spz_4(1, PLAIN, table=9), "has its table of sizes at byte 9 of"),
        ("a.spz", spz_4(1, PLAIN).replace(b"\x28\xb5\x2f\xfd", b"none"), "is damaged"),
        ("a.spz", b"text", "is no SPZ file"),
        ("a.spz", spz(9, b""), "SPZ of version 9"),
        ("a.spz", spz(3, b"", degree=5), "harmonics of degree 5"),
        ("a.spz", spz(3, bytes(10), count=5), "is cut short: 10 of 100 bytes"),
        ("a.spz", gzip.compress(bytes(16)), "is no SPZ file"),
        ("a.sog", b"text", "is no SOG file"),
        ("a.sog", sog(version=2, count=600)[:-40], "is no SOG file"),
        ("a.sog", sog(count=10, told=50), "16 pixels for 50 splats"),
        ("a.sog", sog(count=10, told_version=3), "SOG of version 3"),
        ("a.sog", sog(count=10, told=-1), "'count' is missing or wrong"),
        ("a.sog", sog(count=10, means__files=["no.webp", "l.webp"]), "holds no 'no.webp'"),
        ("a.sog", sog(count=10, means__files=["meta.json", "l.webp"]), "cannot be decoded"),
        ("a.sog", sog(count=10, scales__codebook=[1.0]), "'codebook' is missing or wrong"),
        ("a.sog", sog(1, count=10, shN__bands=2), "a palette 192 pixels wide"),
        ("a.sog", sog(count=10, means=[]), "'means' is missing or wrong"),
    ],
    ids=name_of,
)
def test_damaged_files_are_refused_in_one_line(tmp_path, name, data, said):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(LippmannError, match=said) as refusal:
        load_scene(tmp_path / name)
    assert "\n" not in str(refusal.value)
    assert name in str(refusal.value)


def test_what_unpacks_to_gigabytes_is_refused_before(tmp_path):
    bomb = gzip.compress(struct.pack("<4sIIBBBB", b"NGSP", 3, 2**31, 3, 12, 0, 0) + bytes(1 << 20))
    (tmp_path / "bomb.spz").write_bytes(bomb)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("meta.json", json.dumps({"version": 2, "count": 10, "means": {"files": ["a", "a"]}}))
        archive.writestr("a", bytes(100 << 20))
    (tmp_path / "bomb.sog").write_bytes(stream.getvalue())
    (tmp_path / "bomb.ply").write_bytes(header(FLOATS, 10**12) + ROW.tobytes())
    with machine.limit_inputs(64 << 20):
        for name in ("bomb.spz", "bomb.sog", "bomb.ply"):
            with pytest.raises(LippmannError, match=name):
                load_scene(tmp_path / name)
