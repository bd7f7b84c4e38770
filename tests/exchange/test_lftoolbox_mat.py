"""LFToolbox's ``.mat``: HDF5 with the axes reversed, as MATLAB sees it; older versions; what is none of them."""

from __future__ import annotations

import re

import h5py
import numpy as np
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lippmann.errors import PictureError
from lippmann.exchange.lftoolbox_mat import read_matlab, write_matlab
from lippmann.exchange.light_field import LightField, light_field_of

TYPES = st.sampled_from(["uint8", "uint16", "float32"])


@settings(max_examples=12, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(st.data(), TYPES)
def test_values_come_back_bit_by_bit(random_displays, picture, same, tmp_path_factory, data, stored):
    image = picture(data.draw(random_displays()), data.draw(st.integers(0, 99)), stored=stored)
    path = tmp_path_factory.getbasetemp() / "x.mat"
    write_matlab(light_field_of(image, stored), image.display, path)
    same(read_matlab(path).image(), image)


def test_half_floats_become_single_exactly(display, picture, tmp_path):
    image = picture(display(), stored="float16")
    write_matlab(light_field_of(image, "float16"), image.display, tmp_path / "x.mat")
    np.testing.assert_array_equal(read_matlab(tmp_path / "x.mat").image().pixels, image.pixels)


def test_what_matlab_sees(display, picture, tmp_path):
    image = picture(display("square", lenses=(5, 4), pixels=2), stored="uint8")
    write_matlab(light_field_of(image, "uint8"), image.display, tmp_path / "x.mat")
    head = (tmp_path / "x.mat").read_bytes()[:128]
    assert head.startswith(b"MATLAB 7.3 MAT-file")
    assert head[124:] == b"\x00\x02IM"
    with h5py.File(tmp_path / "x.mat") as file:
        assert file.userblock_size == 512
        # MATLAB's size [2, 2, 4, 5, 3], its first index together in memory.
        assert file["LF"].shape == (3, 5, 4, 2, 2)
        assert file["LF"].attrs["MATLAB_class"] == b"uint8"
        red = file["LF"][0, 0, 0, 0, 0]
    # t = s = v = u = 1 in MATLAB: the top left camera's first pixel, at the far end under the first lens.
    from lippmann.color.transfer import quantize

    assert red == quantize(image.pixels, 8, "srgb")[1, 1, 0]


def test_the_weight_is_the_fourth_colour(display, picture, tmp_path):
    made = display()
    codes = np.random.default_rng(1).integers(0, 255, (9, 12), endpoint=True)
    image = picture(made, stored="uint8", maps={"weight": (codes / 255).astype(np.float32)})
    write_matlab(light_field_of(image, "uint8"), made, tmp_path / "x.mat")
    with h5py.File(tmp_path / "x.mat") as file:
        assert file["LF"].shape[0] == 4
    found = read_matlab(tmp_path / "x.mat").image()
    np.testing.assert_array_equal(found.maps["weight"], image.maps["weight"])
    np.testing.assert_array_equal(found.pixels, image.pixels)


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
def test_older_versions_are_read(tmp_path, dtype, compressed):
    values = np.random.default_rng(0).uniform(0, 200, (2, 3, 4, 5, 3)).astype(dtype)
    scipy.io.savemat(tmp_path / "x.mat", {"LF": values, "LFMetadata": {"a": 1.0}}, do_compression=compressed)
    found = read_matlab(tmp_path / "x.mat")
    assert found.metadata is None
    np.testing.assert_array_equal(found.values, values.astype(np.float32) if dtype == np.float64 else values)


@pytest.mark.parametrize("name", ["LF", "LF/LF"])
def test_another_program_s_version_7_3_is_read(tmp_path, name):
    """The 4D Light Field Benchmark's ``LF.mat`` keeps the views in a structure."""
    values = np.random.default_rng(0).integers(0, 255, (2, 3, 4, 5, 4), dtype=np.uint8)
    with h5py.File(tmp_path / "x.mat", "w", userblock_size=512) as file:
        file[name] = values.transpose()
        file.create_group("#refs#")
    with (tmp_path / "x.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    found = read_matlab(tmp_path / "x.mat")
    np.testing.assert_array_equal(found.values, values[..., :3])
    np.testing.assert_array_equal(found.maps["weight"], (values[..., 3] / 255).astype(np.float32))


@pytest.mark.parametrize("version", [5, 7.3])
def test_grey_is_read_without_a_dimension_of_colours(tmp_path, version):
    """As MATLAB stores it: it drops last dimensions of 1."""
    grey = np.random.default_rng(0).integers(0, 65535, (2, 3, 4, 5), dtype=np.uint16)
    if version == 5:
        scipy.io.savemat(tmp_path / "x.mat", {"LF": grey})
    else:
        with h5py.File(tmp_path / "x.mat", "w", userblock_size=512) as file:
            file["LF"] = grey.transpose()
        with (tmp_path / "x.mat").open("r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    found = read_matlab(tmp_path / "x.mat")
    np.testing.assert_array_equal(found.values, np.repeat(grey[..., None], 3, axis=-1))
    assert "weight" not in found.maps


def refused(path):
    with pytest.raises(PictureError) as error:
        read_matlab(path)
    assert str(error.value).startswith(str(path))
    return str(error.value)


@pytest.mark.parametrize("version", [5, 7.3])
def test_files_without_a_light_field_are_refused(tmp_path, version):
    def write(**variables):
        if version == 5:
            scipy.io.savemat(tmp_path / "x.mat", variables)
            return
        with h5py.File(tmp_path / "x.mat", "w", userblock_size=512) as file:
            for name, values in variables.items():
                file[name] = values.transpose()
        with (tmp_path / "x.mat").open("r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")

    write(A=np.ones((2, 2)), B=np.ones((2, 2)))
    assert "has no variable LF; it holds A, B" in refused(tmp_path / "x.mat")
    write(LF=np.ones((2, 3, 3)))
    assert "LF has the shape (2, 3, 3); it must be [t, s, v, u, c]" in refused(tmp_path / "x.mat")
    write(LF=np.ones((2, 2, 3, 3, 2)))
    assert "LF has the shape" in refused(tmp_path / "x.mat")
    write(LF=np.ones((2, 2, 3, 3, 3), dtype=np.int16))
    assert "holds int16" in refused(tmp_path / "x.mat")


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9, 0.99])
@pytest.mark.parametrize("version", [5, 7.3])
def test_cut_files_are_refused(tmp_path, display, picture, version, share):
    if version == 5:
        scipy.io.savemat(tmp_path / "x.mat", {"LF": np.ones((5, 5, 9, 9, 3), dtype=np.uint8)}, do_compression=True)
    else:
        image = picture(display(), stored="uint8")
        write_matlab(light_field_of(image, "uint8"), image.display, tmp_path / "x.mat")
    content = (tmp_path / "x.mat").read_bytes()
    (tmp_path / "x.mat").write_bytes(content[: int(share * len(content))])
    assert "x.mat: " in refused(tmp_path / "x.mat")


def test_what_is_no_mat_file_is_refused(tmp_path):
    assert "no such file" in refused(tmp_path / "x.mat")
    for content in (b"", b"hello", bytes(200), b"\x89HDF\r\n\x1a\n" + bytes(200)):
        (tmp_path / "x.mat").write_bytes(content)
        assert "is no .mat file; versions 5 to 7.3 are read" in refused(tmp_path / "x.mat")
    (tmp_path / "x.mat").write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(900))
    assert "is damaged" in refused(tmp_path / "x.mat")


def test_only_lenses_in_rows_and_columns(display, picture, tmp_path):
    image = picture(display("hexagonal"))
    with pytest.raises(PictureError, match="hexagonal lenses; LFToolbox takes"):
        write_matlab(light_field_of(image, "uint8"), image.display, tmp_path / "x.mat")


def test_an_enormous_array_is_refused_before_it_is_read(tmp_path):
    with h5py.File(tmp_path / "x.mat", "w", userblock_size=512) as file:
        file.create_dataset("LF", shape=(3, 1 << 10, 1 << 10, 1 << 6, 1 << 6), dtype="u1", chunks=(1, 64, 64, 1, 1))
    with (tmp_path / "x.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    assert "claims 4294967296 pixels" in refused(tmp_path / "x.mat")


def test_a_light_field_that_knows_nothing_of_itself_is_written(display, tmp_path):
    values = np.random.default_rng(0).integers(0, 255, (3, 3, 3, 4, 3), dtype=np.uint8)
    write_matlab(LightField(values), display(), tmp_path / "x.mat")
    found = read_matlab(tmp_path / "x.mat")
    assert found.metadata is None
    np.testing.assert_array_equal(found.values, values)


CHUNK = (3, 4, 3, 2, 2)


@pytest.fixture
def hdf5(tmp_path):
    """``hdf5(write)``: a file of version 7.3 that ``write(file)`` fills, beside one with values that are a secret."""
    (tmp_path / "secret.bin").write_bytes(bytes(range(144)))
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["LF"] = np.arange(144, dtype=np.uint8).reshape(CHUNK)

    def make(write):
        with h5py.File(tmp_path / "x.mat", "w", userblock_size=512) as file:
            write(file)
        with (tmp_path / "x.mat").open("r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
        return tmp_path / "x.mat"

    return make


def raw_file(file, name, folder):
    file.create_dataset(name, shape=CHUNK, dtype="u1", external=[(str(folder / "secret.bin"), 0, 144)])


def virtual(file, name, folder):
    layout = h5py.VirtualLayout(shape=CHUNK, dtype="u1")
    layout[...] = h5py.VirtualSource(folder / "secret.h5", "LF", shape=CHUNK)
    file.create_virtual_dataset(name, layout)


def external_link(file, name, folder):
    file[name] = h5py.ExternalLink(str(folder / "secret.h5"), "/LF")


def soft_link(file, name, folder):
    file["elsewhere"] = h5py.ExternalLink(str(folder / "secret.h5"), "/")
    file[name] = h5py.SoftLink("/elsewhere/LF")


@pytest.mark.parametrize("store", [raw_file, virtual, external_link, soft_link])
@pytest.mark.parametrize("name", ["LF", "lippmann_light_field"])
def test_no_other_file_is_read(tmp_path, hdf5, store, name):
    def write(file):
        if name != "LF":
            file["LF"] = np.zeros(CHUNK, np.uint8)
        store(file, name, tmp_path)

    line = refused(hdf5(write))
    assert re.search(f"{name} (is a link|lies in another file)", line)
    assert "variables must be in the file itself" in line
    assert "secret" not in line


def with_filter(file, name, number):
    """A variable packed by the filter of that number, of which no value is there."""
    how = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    how.set_chunk(CHUNK)
    how.set_filter(number, h5py.h5z.FLAG_OPTIONAL, (1,))
    h5py.h5d.create(file.id, name.encode(), h5py.h5t.NATIVE_UINT8, h5py.h5s.create_simple(CHUNK), how)


@pytest.mark.parametrize("number", [6, 307, 32001, 32015])
@pytest.mark.parametrize("name", ["LF", "lippmann_light_field"])
def test_filters_that_would_be_loaded_are_refused(hdf5, number, name):
    def write(file):
        if name != "LF":
            file["LF"] = np.zeros(CHUNK, np.uint8)
        with_filter(file, name, number)

    line = refused(hdf5(write))
    assert f"{name} is compressed by the HDF5 filter {number}" in line
    assert "accepted are deflate, shuffle, fletcher32, lzf" in line


@pytest.mark.parametrize(
    "options",
    [{"compression": "gzip", "shuffle": True, "fletcher32": True}, {"compression": "lzf"}, {"chunks": True}, {}],
)
def test_the_filters_of_the_list_are_read(hdf5, options):
    values = np.random.default_rng(0).integers(0, 255, CHUNK, dtype=np.uint8)
    path = hdf5(lambda file: file.create_dataset("LF", data=values, **options))
    np.testing.assert_array_equal(read_matlab(path).values, values.transpose())


@pytest.mark.parametrize(
    "kind", [h5py.ref_dtype, h5py.regionref_dtype, h5py.string_dtype(), h5py.vlen_dtype("u1"), np.dtype([("a", "u1")])]
)
@pytest.mark.parametrize("colors", [3, 4])
def test_variables_of_version_7_3_hold_numbers(hdf5, kind, colors):
    line = refused(hdf5(lambda file: file.create_dataset("LF", shape=(colors, *CHUNK[1:]), dtype=kind)))
    assert "LF holds " in line
    assert "a light field holds numbers" in line


@pytest.mark.parametrize("name", ["LF", "lippmann_light_field"])
def test_a_variable_without_a_shape_is_none(hdf5, name):
    def write(file):
        if name != "LF":
            file["LF"] = np.zeros(CHUNK, np.uint8)
        file[name] = h5py.Empty("u1")

    assert "x.mat: " in refused(hdf5(write))


def test_a_note_is_a_short_text(hdf5):
    def write(file, **how):
        file["LF"] = np.zeros(CHUNK, np.uint8)
        file.create_dataset("lippmann_light_field", **how)

    long = refused(hdf5(lambda file: write(file, shape=(1 << 30, 1), dtype="u2", chunks=(1 << 16, 1))))
    assert "lippmann_light_field has the shape (1073741824, 1)" in long
    assert "lippmann_light_field holds " in refused(hdf5(lambda file: write(file, shape=(3,), dtype=h5py.ref_dtype)))


@pytest.mark.parametrize("colors", [3, 4])
@pytest.mark.parametrize("kind", ["cell", "struct", "logical", "complex"])
def test_variables_of_version_5_hold_numbers(tmp_path, kind, colors):
    dtype = {"cell": object, "struct": [("a", "f8")], "logical": bool, "complex": complex}[kind]
    values = np.zeros((2, 2, 3, 4, colors), dtype)
    scipy.io.savemat(tmp_path / "x.mat", {"LF": values})
    assert "LF holds " in (line := refused(tmp_path / "x.mat"))
    assert line.endswith("save('lf.mat', 'LF', '-v7.3')") == (kind == "struct")
