"""Files that Tachyon scenes name: includes, pictures, triangle files."""

import numpy as np
import pytest
from PIL import Image

from lippmann.errors import SceneError
from lippmann.scene.parsing.files import NamedFiles
from lippmann.scene.readers.tachyon.reader import read_tachyon

TEXTURE = "TEXTURE AMBIENT 0 DIFFUSE 1 SPECULAR 0 OPACITY 1 COLOR 1 0 0 TEXFUNC {}"
SPHERE = f"SPHERE CENTER 0 0 0 RAD 1 {TEXTURE.format(0)}\n"
PLANAR = TEXTURE.format("9 {} CENTER 0 0 0 ROTATE 0 0 0 SCALE 1 1 1 UAXIS 1 0 0 VAXIS 0 1 0")


def write(folder, name: str, items: str):
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(items)
    return path


def scene(folder, items: str, name: str = "scene.dat"):
    return write(folder, name, f"BEGIN_SCENE RESOLUTION 8 6\n{items}\nEND_SCENE\n")


def picture(path, **options) -> np.ndarray:
    """A picture whose top row is red, whose bottom row is blue; returns (2, 3, 3) with the top row first."""
    texels = np.array([[[250, 0, 0]] * 3, [[0, 0, 250]] * 3], np.uint8)
    Image.fromarray(texels).save(path, **options)
    return texels


def test_include_counts_from_the_including_file_then_from_the_scene(tmp_path):
    write(tmp_path, "parts/all.inc", f"TEXDEF a {TEXTURE.format(0)[8:]}\nINCLUDE more.inc\nINCLUDE top.inc")
    write(tmp_path, "parts/more.inc", "SPHERE CENTER 1 0 0 RAD 1 a")
    write(tmp_path, "top.inc", "SPHERE CENTER 2 0 0 RAD 1 a END_SCENE not read")
    path = scene(tmp_path, "INCLUDE parts/all.inc\nSPHERE CENTER 3 0 0 RAD 1 a")
    result = read_tachyon(path)
    assert result.spheres.centers[:, 0].tolist() == [1, 2, 3]
    assert len(result.materials) == 1


def test_errors_in_included_files_name_them(tmp_path):
    write(tmp_path, "parts/bad.inc", "\nSPHERE CENTRE 0 0 0")
    with pytest.raises(SceneError, match=r"^parts/bad\.inc:2: found 'CENTRE'; expected CENTER$"):
        read_tachyon(scene(tmp_path, "INCLUDE parts/bad.inc"))


@pytest.mark.parametrize("inner", ["INCLUDE scene.dat", "INCLUDE b.inc"])
def test_include_cycles_are_refused(tmp_path, inner):
    write(tmp_path, "a.inc", inner)
    write(tmp_path, "b.inc", "INCLUDE ./a.inc")
    with pytest.raises(SceneError, match="includes itself; includes may not run in a circle"):
        read_tachyon(scene(tmp_path, "INCLUDE a.inc"))


@pytest.mark.slow
def test_includes_that_double_at_every_level_end_in_time(tmp_path):
    for level in range(30):
        write(tmp_path, f"{level}.inc", f"INCLUDE {level + 1}.inc INCLUDE {level + 1}.inc")
    write(tmp_path, "30.inc", SPHERE)
    with pytest.raises(SceneError, match="one include too many; at most 32 deep and 1000 in all"):
        read_tachyon(scene(tmp_path, "INCLUDE 0.inc"))


def test_includes_that_go_too_deep(tmp_path):
    for level in range(40):
        write(tmp_path, f"{level}.inc", f"INCLUDE {level + 1}.inc")
    with pytest.raises(SceneError, match="one include too many"):
        read_tachyon(scene(tmp_path, "INCLUDE 0.inc"))


@pytest.mark.parametrize("item", ["INCLUDE {}", f"{SPHERE}PLANE CENTER 0 0 0 NORMAL 0 0 1 {PLANAR}"])
def test_files_outside_the_folder_need_permission(tmp_path, item):
    picture(tmp_path / "secret.ppm")
    path = scene(tmp_path, item.format("../secret.ppm"), "inner/scene.dat")
    with pytest.raises(SceneError, match="lies outside the scene's folder"):
        read_tachyon(path)
    if "PLANE" in item:
        assert len(read_tachyon(path, files=NamedFiles(path.parent, True)).images) == 1


@pytest.mark.parametrize("item", ["INCLUDE nix.inc", f"PLANE CENTER 0 0 0 NORMAL 0 0 1 {PLANAR.format('nix.inc')}"])
def test_files_that_are_not_there(tmp_path, item):
    with pytest.raises(SceneError, match=r"^scene\.dat:2: .*'nix\.inc' not found$"):
        read_tachyon(scene(tmp_path, item))


@pytest.mark.parametrize(
    ("suffix", "options", "top_first"),
    [("ppm", {}, True), ("jpg", {"quality": 100, "subsampling": 0}, True), ("png", {}, False), ("tga", {}, False)],
)
def test_first_row_of_pictures(tmp_path, suffix, options, top_first):
    texels = picture(tmp_path / f"p.{suffix}", **options)
    result = read_tachyon(scene(tmp_path, f"PLANE CENTER 0 0 0 NORMAL 0 0 1 {PLANAR.format(f'p.{suffix}')}"))
    (image,) = result.images
    assert image.texels.shape == (1, 2, 3, 3)
    np.testing.assert_allclose(image.texels[0], texels if top_first else texels[::-1], atol=3)
    assert result.materials[0].texture.image == 0


def test_plain_and_grey_and_deep_pictures(tmp_path):
    (tmp_path / "plain.ppm").write_text("P3\n# text\n2 1\n255\n1 2 3  4 5 6\n")
    Image.fromarray(np.array([[7, 8]], np.uint8)).save(tmp_path / "grey.png")
    Image.fromarray(np.array([[65535, 0]], np.uint16)).save(tmp_path / "deep.png")
    Image.fromarray(np.array([[[9, 8, 7, 0]]], np.uint8)).save(tmp_path / "clear.png")
    names = ("plain.ppm", "grey.png", "deep.png", "clear.png")
    items = "\n".join(f"PLANE CENTER 0 0 0 NORMAL 0 0 1 {PLANAR.format(name)}" for name in names)
    images = [image.texels[0, 0].tolist() for image in read_tachyon(scene(tmp_path, items)).images]
    assert images == [[[1, 2, 3], [4, 5, 6]], [[7] * 3, [8] * 3], [[255] * 3, [0] * 3], [[9, 8, 7]]]


def test_picture_is_read_once(tmp_path):
    picture(tmp_path / "p.ppm")
    items = f"PLANE CENTER 0 0 0 NORMAL 0 0 1 {PLANAR.format('p.ppm')}\n" * 3
    result = read_tachyon(scene(tmp_path, items))
    assert (len(result.images), len(result.materials), result.counts()["plane"]) == (1, 1, 3)


def test_foreign_and_damaged_pictures_are_refused(tmp_path):
    picture(tmp_path / "p.bmp")
    picture(tmp_path / "good.ppm")
    (tmp_path / "cut.ppm").write_bytes((tmp_path / "good.ppm").read_bytes()[:-5])
    for name, message in (("p.bmp", "PPM, TGA, JPEG or PNG"), ("cut.ppm", "cut.ppm")):
        with pytest.raises(SceneError, match=rf"^scene\.dat:2: .*{message}"):
            read_tachyon(scene(tmp_path, f"PLANE CENTER 0 0 0 NORMAL 0 0 1 {PLANAR.format(name)}"))


def test_triangle_file(tmp_path):
    write(tmp_path, "t.tri", "3 0 0 0 1 0 0 0 1 0\n3 0 0 1 1 0 1 0 1 1\n")
    item = f"TPOLYFILE SCALE 2 3 4 ROT 0 0 90 CENTER 10 0 0 FILE {{}} {TEXTURE.format(0)}"
    triangles = read_tachyon(scene(tmp_path, item.format("t.tri"))).triangles
    np.testing.assert_allclose(triangles.positions[0], [[10, 2, 0], [10, 0, 0], [7, 0, 0]], atol=1e-6)
    assert triangles.positions[1, 0, 2] == pytest.approx(4)
    write(tmp_path, "u.tri", "3 0 0 0 1 0 0 0 1 0\n4 0 0 1")
    with pytest.raises(SceneError, match=r"^u\.tri:2: found '4'; expected a whole number from 3 to 3"):
        read_tachyon(scene(tmp_path, item.format("u.tri")))


def test_a_long_file_named_many_times_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("lippmann.scene.readers.tachyon.files._MOST_WORDS", 50)
    write(tmp_path, "t.tri", "3 0 0 0 1 0 0 0 1 0\n" * 3)
    item = f"TPOLYFILE SCALE 2 3 4 ROT 0 0 90 CENTER 10 0 0 FILE t.tri {TEXTURE.format(0)}\n"
    assert read_tachyon(scene(tmp_path, item)).counts()["triangle"] == 3
    with pytest.raises(SceneError, match=r"^scene\.dat:3: 't\.tri' is one file too many; at most 50 words in all$"):
        read_tachyon(scene(tmp_path, item * 2))


def test_too_many_texels_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("lippmann.scene.readers.tachyon.files._MOST_TEXELS", 6)
    picture(tmp_path / "p.ppm")
    item = f"PLANE CENTER 0 0 0 NORMAL 0 0 1 {PLANAR}\n"
    assert len(read_tachyon(scene(tmp_path, item.format("p.ppm"))).images) == 1
    with pytest.raises(SceneError, match=r"^scene\.dat:3: picture '\./p\.ppm' is one too many; at most 6 texels"):
        read_tachyon(scene(tmp_path, item.format("p.ppm") + item.format("./p.ppm")))
