"""Molecules: atoms of every kind of file, bonds by distance, colours, damaged files."""

import gzip

import numpy as np
import pytest

from lippmann.errors import LippmannError, SceneError
from lippmann.scene.readers.load import load_scene
from lippmann.scene.readers.molecules import reader as molecule

WATER = """\
HETATM    1  O   HOH A   1       0.000   0.000   0.000  1.00  0.00           O
HETATM    2  H1  HOH A   1       0.957   0.000   0.000  1.00  0.00           H
HETATM    3  H2  HOH A   1      -0.240   0.927   0.000  1.00  0.00           H
HETATM    4  C1 ALIG A   2      20.000   0.000   0.000  0.60  0.00           C
HETATM    5  C1 BLIG A   2      21.000   0.000   0.000  0.40  0.00           C
END
"""

SALT = """\
data_salt
_cell_length_a 10
_cell_length_b 20
_cell_length_c 10
_cell_angle_alpha 90
_cell_angle_beta 90
_cell_angle_gamma 90
_symmetry_space_group_name_H-M 'P 1'
loop_
_atom_site_label
_atom_site_type_symbol
_atom_site_fract_x
_atom_site_fract_y
_atom_site_fract_z
Na1 Na 0.1 0.1 0
Cl1 Cl 0.1 0.225 0
"""


@pytest.fixture
def read(tmp_path):
    pytest.importorskip("gemmi", reason="gemmi is not installed")

    def read(text, name="m.pdb"):
        (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
        return load_scene(tmp_path / name).description

    return read


def places(scene, name):
    """Centres or starts of all copies of a mesh."""
    number = next(number for number, mesh in enumerate(scene.meshes) if mesh.name == name)
    return scene.placements[number][:, :3, 3]


#: As a file of before 1996 has them: the entry's code and the line's number in the columns of element and charge.
OLD = """\
ATOM      1  N   THR     1      17.047  14.099   3.625  1.00 13.79      1CRN1070
ATOM      2  CA  THR     1      16.967  12.784   4.338  1.00 10.80      1CRN1071
HETATM    3 CA    CA     2      26.967  12.784   4.338  1.00 10.80      1CRN1072
"""


@pytest.mark.parametrize("name", ["m.pdb", "m.ent.gz"])
def test_files_of_before_1996(read, name):
    scene = read(gzip.compress(OLD.encode()) if name.endswith("gz") else OLD, name)
    assert scene.notes == ["3 atoms, 1 bonds by their distance"]
    assert places(scene, "balls of element 20") == pytest.approx(np.array([(26.967, 12.784, 4.338)]))


def test_residues_that_share_a_number_are_alternatives_only_where_their_atoms_say_so(read):
    """Waters of a simulation whose last hydrogen is of another residue; a ligand with the number of both."""
    waters = WATER[: WATER.index("HETATM    4")].replace("H2  HOH", "H2  WAT")
    ligand = "HETATM    4  C1  LIG A   1      20.000   0.000   0.000  1.00  0.00           C\n"
    assert read(waters + ligand).notes == ["4 atoms, 2 bonds by their distance"]


def test_atoms_and_bonds_of_water(read):
    scene = read(WATER)
    assert scene.notes == ["4 atoms, 2 bonds by their distance", "1 atoms at alternative places are left out"]
    assert places(scene, "balls of element 8").tolist() == [[0, 0, 0]]
    assert places(scene, "balls of element 1") == pytest.approx(np.array([[0.957, 0, 0], [-0.24, 0.927, 0]]))
    # Of alternative places the first.
    assert places(scene, "balls of element 6").tolist() == [[20, 0, 0]]
    assert len(places(scene, "sticks of element 8")) == 2


def test_sticks_reach_half_way(read):
    scene = read(WATER)
    number = next(number for number, mesh in enumerate(scene.meshes) if mesh.name == "sticks of element 8")
    mesh = scene.meshes[number]
    ends = [world[:3, :3] @ [0, 0, 1] + world[:3, 3] for world in scene.placements[number]]
    assert sorted(np.round(ends, 6).tolist()) == [[-0.12, 0.4635, 0], [0.4785, 0, 0]]
    for world in scene.placements[number]:
        assert np.linalg.norm(world[:3, 0]) == np.linalg.norm(world[:3, 1]) == pytest.approx(molecule.STICK)
        assert np.linalg.det(world[:3, :3]) > 0
    corners = mesh.positions[mesh.faces].astype(float)
    outward = corners.mean(axis=1) * (1, 1, 0)
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", facing, outward) > 0).all()


def test_balls_have_a_quarter_of_the_van_der_waals_radius_and_their_colour(read):
    scene = read(WATER)
    oxygen = next(mesh for mesh in scene.meshes if mesh.name == "balls of element 8")
    assert np.linalg.norm(oxygen.positions, axis=1) == pytest.approx(1)
    red, green, blue = scene.materials[oxygen.material].base_color
    assert red == 1
    assert green == blue < 0.01
    low, high = load_scene(scene).bounds
    assert low[0] == pytest.approx(-0.24 - 0.25 * 1.20, rel=1e-2)
    assert high[0] == pytest.approx(20 + 0.25 * 1.70, rel=1e-3)
    assert low[2] == pytest.approx(-0.25 * 1.70, rel=1e-3)


def test_a_small_molecules_crystal(read):
    scene = read(SALT, "salt.cif")
    assert places(scene, "balls of element 11") == pytest.approx(np.array([[1, 2, 0]]))
    assert places(scene, "balls of element 17") == pytest.approx(np.array([[1, 4.5, 0]]))
    assert scene.notes == ["2 atoms, 1 bonds by their distance"]


def test_mmcif(read, tmp_path):
    import gemmi

    (tmp_path / "w.pdb").write_text(WATER)
    gemmi.read_structure(str(tmp_path / "w.pdb")).make_mmcif_document().write_file(str(tmp_path / "w.cif"))
    document = gemmi.read_structure(str(tmp_path / "w.pdb")).make_mmcif_document()
    (tmp_path / "w.json").write_text(document.as_json(mmjson=True))
    for name in ("w.cif", "w.json"):
        assert load_scene(tmp_path / name).description.notes[0] == "4 atoms, 2 bonds by their distance"


def test_the_first_block_with_atoms_is_shown(read):
    """Journals and refinement programs put blocks without atoms first."""
    head = "data_global\n_journal_name_full 'A journal'\n\n"
    assert read(head + SALT, "salt.cif").notes == ["2 atoms, 1 bonds by their distance"]
    twice = read(SALT + SALT.replace("data_salt", "data_more").replace("Cl1 Cl 0.1 0.225 0\n", ""), "salt.cif")
    assert twice.notes == ["2 atoms, 1 bonds by their distance", "2 blocks hold atoms: the first, 'salt', is shown"]


def test_cartesian_places_of_the_core_dictionary(read):
    """Numbers with uncertainties; elements by type, or else by label."""
    head = "data_x\nloop_\n_atom_site_label\n_atom_site_Cartn_x\n_atom_site_Cartn_y\n_atom_site_Cartn_z\n"
    assert places(read(head + "Cl1 1.5(2) 2 3\n", "m.cif"), "balls of element 17").tolist() == [[1.5, 2, 3]]
    typed = head.replace("_atom_site_label", "_atom_site_label\n_atom_site_type_symbol") + "X1 Fe3+ 1 2 3\n"
    assert places(read(typed, "m.cif"), "balls of element 26").tolist() == [[1, 2, 3]]


@pytest.mark.parametrize("form", ["fractions", "Cartesian"])
def test_of_disordered_groups_the_first_is_shown(read, form):
    """Group -1 lies about a special position, and has no alternative."""
    tag = "fract" if form == "fractions" else "Cartn"
    text = SALT.replace("_fract_z", "_fract_z\n_atom_site_disorder_group").replace("_fract_", f"_{tag}_")
    text = text.replace("0.1 0\n", "0.1 0 .\n").replace(
        "Cl1 Cl 0.1 0.225 0\n", "Cl1 Cl 1 0 0 2\nBr1 Br 2 0 0 1\nO1 O 3 0 0 -1\n"
    )
    scene = read(text, "m.cif")
    assert [mesh.name for mesh in scene.meshes if "balls" in mesh.name] == [
        f"balls of element {n}" for n in (8, 11, 35)
    ]
    assert "1 atoms at alternative places are left out" in scene.notes


def test_of_residues_at_one_place_of_the_sequence_the_first_is_shown(read):
    """Serine in some of the molecules, threonine in the others."""
    residues = """\
ATOM      1  CB ASER A   2       0.000   0.000   0.000  0.60 10.00           C
ATOM      2  OG ASER A   2       1.430   0.000   0.000  0.60 10.00           O
ATOM      3  CB BTHR A   2       0.000   0.120   0.000  0.40 10.00           C
ATOM      4  OG1BTHR A   2       1.430   0.120   0.000  0.40 10.00           O
"""
    scene = read(residues)
    assert places(scene, "balls of element 6").tolist() == [[0, 0, 0]]
    assert scene.notes == ["2 atoms, 1 bonds by their distance", "2 atoms at alternative places are left out"]


@pytest.mark.parametrize("form", ["x y z", "model_Cartn_x model_Cartn_y model_Cartn_z"])
def test_chemical_components(read, form):
    """The wwPDB's files of ligands, and those of refinement programs, whose first block is a list."""
    tags = [f"_chem_comp_atom.{tag}" for tag in ("comp_id", "atom_id", "type_symbol", *form.split())]
    head = "data_comp_list\n_chem_comp.id NIO\n\ndata_comp_NIO\n_chem_comp.id NIO\nloop_\n"
    scene = read(head + "\n".join(tags) + "\nNIO N N 0 0 0\nNIO O O 1.2 0 0\n", "NIO.cif")
    assert places(scene, "balls of element 8") == pytest.approx(np.array([[1.2, 0, 0]]))
    assert scene.notes == ["2 atoms, 1 bonds by their distance"]


def test_packed_files(read):
    assert read(gzip.compress(WATER.encode()), "w.pdb.gz").notes[0] == "4 atoms, 2 bonds by their distance"
    assert read(gzip.compress(SALT.encode()), "salt.cif.gz").notes == ["2 atoms, 1 bonds by their distance"]


def test_of_models_the_first_is_shown(read):
    model = "MODEL        {}\n" + WATER.replace("END\n", "ENDMDL\n")
    assert "2 models: the first is shown" in read(model.format(1) + model.format(2) + "END\n").notes


@pytest.mark.parametrize("copies", [1, 2])
def test_assemblies_are_named_and_the_files_own_atoms_shown(read, copies):
    """REMARK 350: the second operator turns by half and shifts; one of identity alone says nothing."""
    rows = [("1.0 0.0 0.0 0.0", "0.0 1.0 0.0 0.0"), ("-1.0 0.0 0.0 9.0", "0.0 -1.0 0.0 0.0")][:copies]
    head = "REMARK 350 BIOMOLECULE: 1\nREMARK 350 APPLY THE FOLLOWING TO CHAINS: A\n"
    for number, (first, second) in enumerate(rows, 1):
        for axis, row in enumerate((first, second, "0.0 0.0 1.0 0.0"), 1):
            head += f"REMARK 350   BIOMT{axis}   {number} " + "".join(f"{float(x):10.6f}" for x in row.split()) + "\n"
    scene = read(head + WATER)
    told = "the file's own atoms are shown: its assembly '1' has 2 copies of them"
    assert (told in scene.notes) == (copies == 2)
    assert len(places(scene, "balls of element 8")) == 1


def test_the_symmetry_of_a_crystal_is_named(read):
    scene = read(SALT.replace("'P 1'", "'P -1'"), "salt.cif")
    assert "the file's own atoms are shown: the symmetry of its crystal has 2 copies of them" in scene.notes


def test_left_justified_names_of_proteins_are_no_metals(read):
    """``CA`` in column 13 is a calcium by the format; the second is an ion."""
    lines = """\
ATOM      1 CA   ALA A   1       0.000   0.000   0.000  1.00 10.00
HETATM    2 CA    CA A   2       9.000   0.000   0.000  1.00 10.00
ATOM      3 HG   SER A   3       0.000   9.000   0.000  1.00 10.00
"""
    scene = read(lines)
    assert places(scene, "balls of element 6").tolist() == [[0, 0, 0]]
    assert places(scene, "balls of element 20").tolist() == [[9, 0, 0]]
    assert places(scene, "balls of element 1").tolist() == [[0, 9, 0]]


@pytest.mark.parametrize(
    ("name", "element"),
    [(" NA ", 11), (" CL ", 17), ("Cl- ", 17), (" SOD", 11), ("CLA ", 17), (" CAL", 20), ("ZN2 ", 30)],
)
def test_an_atom_alone_in_a_residue_of_its_name_is_an_ion(read, name, element):
    """As GROMACS, AMBER and CHARMM write ions without a column of elements."""
    scene = read(f"HETATM    1 {name} {name.strip():<4s}    2       0.000   0.000   0.000  1.00  0.00\nEND\n")
    assert [mesh.name for mesh in scene.meshes] == [f"balls of element {element}"]


def test_metals_have_their_own_colours_and_radii(read):
    gold, silver = (read(SALT.replace("Na", metal), "m.cif") for metal in ("Au", "Ag"))
    red, green, blue = gold.materials[1].base_color
    assert red == 1
    assert green > 5 * blue
    assert min(silver.materials[1].base_color) > 0.5
    assert load_scene(gold).bounds[0][2] == pytest.approx(-0.25 * 1.75, rel=1e-2)  # chlorine is the larger
    assert load_scene(read(SALT.replace("Na", "Cs"), "m.cif")).bounds[0][2] == pytest.approx(-0.25 * 3.43, rel=1e-2)


def test_hydrogens_do_not_bond_to_each_other(read):
    near = WATER.replace("-0.240   0.927", " 0.900   0.700")
    assert read(near).notes[0] == "4 atoms, 2 bonds by their distance"


@pytest.mark.parametrize(
    ("name", "text", "line"),
    [
        ("m.pdb", "END\n", "m.pdb: holds 0 atoms; 1 to 1048576 are read"),
        ("m.cif", "loop_ nothing", "m.cif: is no molecule that is understood ("),
        ("m.cif", b"data_\xff\xfe_x", "m.cif: is no molecule that is understood ("),
        ("m.cif", "data_x\n_a b\n", "m.cif: holds 0 atoms"),
    ],
)
def test_files_without_atoms_are_refused(read, name, text, line):
    with pytest.raises(SceneError) as caught:
        read(text, name)
    assert str(caught.value).startswith(line)


def test_without_the_library_one_line_says_what_to_install(read, monkeypatch):
    monkeypatch.setattr(molecule.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(SceneError, match=r"molecules need the library gemmi; install it: pip install 'lippmann\[mol"):
        read(WATER)


def test_damaged_molecules_end_in_a_scene_or_one_line(read):
    rng = np.random.default_rng(1)
    outcomes = set()
    for number in range(80):
        data = bytearray((WATER, SALT)[number % 2].encode())
        for place in rng.integers(0, len(data), 3):
            data[place] = rng.integers(256)
        try:
            read(bytes(data), ("m.pdb", "m.cif")[number % 2])
            outcomes.add("read")
        except LippmannError as error:
            outcomes.add(f"refused in {len(str(error).splitlines())} line")
    assert outcomes <= {"read", "refused in 1 line"}
    assert "read" in outcomes


FRAME = "3\nwater\nO 0 0 0\nH1 0.957 0 0\n1 -0.24 0.927 0 0.5 extra\n"


@pytest.mark.parametrize(
    "text",
    [
        FRAME,
        "\ufeff 3 \r\n\r\n o 0 0 0\r\nh 0.957 0 0\r\nh -2.4e-1 0.927 0\r\n",
        '3\nProperties="id:I:1:pos:R:3:species:S:1"\n9 0 0 0 O\n8 0.957 0 0 H\n7 -0.24 0.927 0 H\n',
    ],
)
def test_xyz(read, text):
    scene = read(text, "m.xyz")
    assert places(scene, "balls of element 8").tolist() == [[0, 0, 0]]
    assert places(scene, "balls of element 1").tolist() == [[0.957, 0, 0], [-0.24, 0.927, 0]]
    assert scene.notes == ["3 atoms, 2 bonds by their distance"]


def test_of_a_trajectory_the_first_moment_is_shown(read):
    assert "several molecules or moments: the first is shown" in read(FRAME + FRAME, "m.xyz").notes


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("H 0 0 1\n", "its first line is no number of atoms: save clouds of points as .ply"),
        (FRAME[:-30], "it holds fewer than 3 atoms: is it cut short?"),
        ("2\n\nO 0 0 0\nH 0 0\n", "it holds fewer than 2 atoms"),
        ("1\n\nO 0 0 up\n", "could not convert string to float"),
    ],
)
def test_what_is_no_xyz_file_of_molecules(read, text, line):
    with pytest.raises(SceneError, match=r"^m\.xyz: is no molecule that is understood") as caught:
        read(text, "m.xyz")
    assert line in str(caught.value)


V2000 = """\
water
  by hand 01012600003D

  3  2  0  0  0  0  0  0  0  0999 V2000
    0.0000    0.0000    0.0000 O   0  0  0  0  0  0
    0.9570    0.0000    0.0000 H   0  0  0  0  0  0
   -0.2400    0.9270    0.0000 H   0  0  0  0  0  0
  1  2  1  0
  1  3  1  0
M  END
"""
V3000 = """\
water
  by hand 01012600003D

  0  0  0     0  0            999 V3000
M  V30 BEGIN CTAB
M  V30 COUNTS 3 2 0 0 0
M  V30 BEGIN ATOM
M  V30 1 O 0 0 0 0
M  V30 2 H 0.957 0 0 0
M  V30 3 H -0.24 0.927 0 0
M  V30 END ATOM
M  V30 END CTAB
M  END
"""
MOL2 = """\
# by hand
@<TRIPOS>MOLECULE
water
 3 2

@<TRIPOS>ATOM
 1 O1  0.0    0.0   0.0 O.3 1 HOH 0.0
 2 H1  0.957  0.0   0.0 H
 3 H2 -0.24   0.927 0.0 H
@<TRIPOS>BOND
 1 1 2 1
"""


@pytest.mark.parametrize(("text", "name"), [(V2000, "m.mol"), (V3000, "m.sdf"), (MOL2, "m.mol2")])
def test_files_of_chemists(read, text, name):
    end = "> <name>\nwater\n\n$$$$\n" if name == "m.sdf" else ""
    scene = read(text + end, name)
    assert places(scene, "balls of element 8").tolist() == [[0, 0, 0]]
    assert places(scene, "balls of element 1").tolist() == [[0.957, 0, 0], [-0.24, 0.927, 0]]
    assert scene.notes == ["3 atoms, 2 bonds by their distance"]
    end = end or ("" if name == "m.mol2" else "$$$$\n")
    assert "2 molecules: the first is shown" in read(text + end + text + end, name).notes


def test_a_flat_drawing_is_noted(read):
    (note,) = (line for line in read(V2000.replace("3D", "2D"), "m.mol").notes if "drawing" in line)
    assert note.startswith("it is a flat drawing")


@pytest.mark.parametrize(("text", "name"), [(V2000[:120], "m.mol"), (V3000[:150], "m.sdf"), (MOL2[:120], "m.mol2")])
def test_files_of_chemists_that_are_cut_short_are_refused(read, text, name):
    with pytest.raises(SceneError, match=rf"^{name}: is no molecule that is understood"):
        read(text, name)
