"""The process that reads molecules by ``gemmi``: native code, with nothing else in it."""

from __future__ import annotations

import gzip
import itertools
import re
from collections.abc import Iterator
from typing import Any

import gemmi
import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.helper_process import serve_arrays

#: Atoms of a molecule.
MOST_ATOMS = 1 << 20
#: Places of atoms in mmCIF, in fractions of a crystal's cell, and in the core dictionary's Cartesian form.
_PLACE_TAGS = ("_atom_site.Cartn_x", "_atom_site_fract_x", "_atom_site_Cartn_x")
#: Places of atoms of a chemical component (ligand): of refinement programs' libraries, measured, and ideal.
_COMPONENT_TAGS = (
    *("_chem_comp_atom.x", "_chem_comp_atom.model_Cartn_x"),
    "_chem_comp_atom.pdbx_model_Cartn_x_ideal",
)

#: Files of chemists: MDL's molfiles, several of them one after another, and Tripos's.
_TABLES = (".sdf", ".sd", ".mol", ".mol2")
_PDB = (".pdb", ".ent", ".pdb.gz", ".ent.gz")
#: CHARMM's names of ions, whose first letters mean other elements.
_IONS = {
    "SOD": "Na",
    "POT": "K",
    "CLA": "Cl",
    "CAL": "Ca",
    "CES": "Cs",
    "LIT": "Li",
    "RUB": "Rb",
    "BAR": "Ba",
    "CAD": "Cd",
}
#: Columns of extended XYZ, as ``species:S:1:pos:R:3``.
_PROPERTIES = re.compile(r"\bProperties=\"?([^\s\"]+)", re.IGNORECASE)
#: Columns 73 to 80 of a file's lines before 1996: the entry's code and the number of the line.
_ENTRY = re.compile(rb"[0-9][0-9A-Z]{3}[ 0-9]{3}[0-9]")


def main() -> None:
    """Answer requests by positions, elements, notes, and covalent and van der Waals radii (n, 2) of the elements."""
    serve_arrays(_read)


def _read(request: dict[str, Any]) -> dict[str, NDArray[np.generic]]:
    notes: list[str] = []
    elements, positions = _atoms(request["path"], notes)
    numbers, of_atoms = np.unique(elements, return_inverse=True)
    kinds = [gemmi.Element(int(number)) for number in numbers]
    radii = np.array([(each.covalent_r, each.vdw_r) for each in kinds], np.float64).reshape(-1, 2)[of_atoms]
    return {"elements": elements, "positions": positions, "radii": radii, "notes": np.array(notes, np.str_)}


def _atoms(path: str, notes: list[str]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Atomic numbers ``(n,)`` and positions ``(n, 3)``, angstroms, of the first model and first of alternatives."""
    if path.lower().endswith(_PDB):
        return _of_structure(gemmi.read_pdb(path, max_line_length=_columns(path)), notes)
    if path.lower().endswith(".xyz"):
        return _of_xyz(path, notes)
    if path.lower().endswith(_TABLES):
        return _of_table(path, notes)
    if not path.lower().endswith((".cif", ".cif.gz")):
        return _of_structure(gemmi.read_structure(path), notes)
    document = gemmi.cif.read(path)
    with_atoms = [block for block in document if any(map(block.find_values, _PLACE_TAGS))]
    if not with_atoms:
        with_atoms = [block for block in document if any(map(block.find_values, _COMPONENT_TAGS))]
    block = (with_atoms or document)[0]
    if len(with_atoms) > 1:
        notes.append(f"{len(with_atoms)} blocks hold atoms: the first, '{block.name}', is shown")
    if block.find_values(_PLACE_TAGS[0]):
        return _of_structure(gemmi.make_structure_from_block(block), notes)
    if block.find_values(_PLACE_TAGS[1]):
        return _of_crystal(gemmi.make_small_structure_from_block(block), notes)
    if block.find_values(_PLACE_TAGS[2]):
        return _of_cartesian(block, notes)
    return _of_structure(gemmi.make_structure_from_chemcomp_block(block), notes)


def _of_xyz(path: str, notes: list[str]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Atoms of an XYZ file: their number, a line of text, then a symbol or number of an element and its place a line.

    Extended files may say in the second line which columns hold these.
    """
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        first, comment = file.readline(), file.readline()
        if not first.strip().isdecimal():
            fix = "save clouds of points as .ply, in CloudCompare for instance"
            raise ValueError(f"its first line is no number of atoms: {fix}")
        count = int(first)
        rows = [line.split() for line in itertools.islice(file, min(count, MOST_ATOMS + 1))]
        if any(line.strip().isdecimal() for line in file):
            notes.append("several molecules or moments: the first is shown")
    at = {"species": 0, "pos": 1}
    if columns := _PROPERTIES.search(comment):
        fields = columns[1].split(":")
        widths = [int(width) for width in fields[2::3]]
        at |= dict(zip(fields[::3], itertools.accumulate(widths, initial=0), strict=False))
    if len(rows) < min(count, MOST_ATOMS + 1) or any(len(row) < at["pos"] + 3 for row in rows):
        raise ValueError(f"it holds fewer than {count} atoms: is it cut short?")
    names = [row[at["species"]] for row in rows]
    elements = [
        gemmi.Element(int(name) if name.isdecimal() else "".join(itertools.takewhile(str.isalpha, name)))
        for name in names
    ]
    places = [gemmi.Position(*(float(word) for word in row[at["pos"] : at["pos"] + 3])) for row in rows]
    return _arrays(elements, places)


def _of_table(path: str, notes: list[str]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Atoms of the first molecule of an MDL file (V2000 and V3000, CTfile Formats, Biovia 2020) or Tripos Mol2."""
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        lines = file.read().splitlines()
    is_tripos = path.lower().endswith(".mol2")
    mark = "@<TRIPOS>MOLECULE" if is_tripos else "$$$$"
    ends = [number for number, line in enumerate(lines) if line.startswith(mark)]
    if is_tripos:
        molecules, lines = len(ends), lines[ends[0] : (*ends[1:], None)[0]]
        first = lines.index("@<TRIPOS>ATOM") + 1
        count = next((n for n, line in enumerate(lines[first:]) if line.startswith("@")), len(lines) - first)
        rows = [line.split() for line in lines[first : first + count] if line.strip()]
        atoms = [(row[5].partition(".")[0], row[2:5]) for row in rows]
    else:
        molecules = sum(any(line.strip() for line in lines[end + 1 :]) for end in ends[:-1]) + 1
        lines = lines[: (*ends, None)[0]]
        if lines[1][20:22] == "2D":
            notes.append("it is a flat drawing: a data bank's file of a conformer (3D) has places in space")
        if lines[3].rstrip().endswith("V3000"):
            first = lines.index("M  V30 BEGIN ATOM") + 1
            rows = [line.split() for line in lines[first : lines.index("M  V30 END ATOM")]]
            atoms = [(row[3], row[4:7]) for row in rows]
        else:
            count = int(lines[3][:3])
            rows = [[line[31:34], line[:10], line[10:20], line[20:30]] for line in lines[4 : 4 + count]]
            if len(rows) < count:
                raise ValueError(f"it holds fewer than {count} atoms: is it cut short?")
            atoms = [(row[0].strip(), row[1:]) for row in rows]
    if molecules > 1:
        notes.append(f"{molecules} molecules: the first is shown")
    places = [gemmi.Position(*map(float, place)) for _, place in atoms[: MOST_ATOMS + 1]]
    return _arrays([gemmi.Element(name) for name, _ in atoms[: MOST_ATOMS + 1]], places)


def _columns(path: str) -> int:
    """How many columns of a PDB file's lines count: 0 for all, 72 where code and number of the entry follow (to 1996).

    Later files have the element and the charge there, as which gemmi would take them.
    """
    with gzip.open(path) if path.lower().endswith(".gz") else open(path, "rb") as file:
        first = next((line for line in file if line.startswith((b"ATOM", b"HETATM"))), b"")
    return 72 if _ENTRY.fullmatch(first[72:].rstrip()) else 0


def _of_structure(structure: gemmi.Structure, notes: list[str]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    if not len(structure):
        return _arrays([], [])
    if len(structure) > 1:
        notes.append(f"{len(structure)} models: the first is shown")
    for assembly in structure.assemblies[:1]:
        copies = max((len(each.operators) for each in assembly.generators), default=1)
        if any(not placed.transform.is_identity() for each in assembly.generators for placed in each.operators):
            notes.append(f"the file's own atoms are shown: its assembly '{assembly.name}' has {copies} copies of them")
    elements, places = [], []
    for chain in structure[0]:
        for residue in _first_residues(chain):
            first = next((atom.altloc for atom in residue if atom.altloc != "\0"), "\0")
            for atom in residue:  # its own first_conformer() keeps alternatives that stand apart
                if atom.altloc in ("\0", first):
                    elements.append(_element(atom, residue))
                    places.append(atom.pos)
        if len(elements) > MOST_ATOMS:
            break
    _note_alternatives(structure[0].count_atom_sites() - len(elements), notes)
    return _arrays(elements, places)


def _first_residues(chain: gemmi.Chain) -> Iterator[gemmi.Residue]:
    """Residues but for the alternatives to one at the same place of the sequence, whose atoms say that they are such.

    Gemmi's own ``first_conformer()`` leaves out all residues that share a number: ligands, and waters of simulations.
    """
    first = None
    for residue in chain:
        shares = first is not None and residue.seqid == first.seqid
        if shares and any(atom.altloc != "\0" for atom in residue):
            continue
        first = residue
        yield residue


def _element(atom: gemmi.Atom, residue: gemmi.Residue) -> gemmi.Element:
    """The element of an atom; a carbon that a name such as ``CA`` in the first column makes a calcium.

    Files without an element column tell the two apart by the column in which the name begins, which many programs get
    wrong. The residues of proteins and nucleic acids hold no such metals; an atom that is alone in a residue of its own
    name is an ion.
    """
    if len(residue) == 1 and atom.name == residue.name:
        symbol = "".join(itertools.takewhile(str.isalpha, atom.name)).upper()
        ion = gemmi.Element(_IONS.get(symbol, symbol))
        return ion if ion.atomic_number else atom.element
    tabulated = gemmi.find_tabulated_residue(residue.name)
    biopolymer = tabulated.is_standard() and (tabulated.is_amino_acid() or tabulated.is_nucleic_acid())
    return gemmi.Element(atom.name[0]) if biopolymer and len(atom.element.name) == 2 else atom.element


def _of_crystal(crystal: gemmi.SmallStructure, notes: list[str]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    sites = list(crystal.sites)[: MOST_ATOMS + 1]
    symmetry = len(crystal.symops) or (len(crystal.spacegroup.operations()) if crystal.spacegroup else 1)
    if symmetry > 1:
        notes.append(f"the file's own atoms are shown: the symmetry of its crystal has {symmetry} copies of them")
    chosen = [sites[row] for row in _first_of_disorder([site.disorder_group for site in sites], notes)]
    return _arrays([site.element for site in chosen], [crystal.cell.orthogonalize(site.fract) for site in chosen])


def _of_cartesian(block: gemmi.cif.Block, notes: list[str]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Atoms of the core dictionary's Cartesian places, which gemmi does not read; each element by type or label."""
    tags = ["label", "Cartn_x", "Cartn_y", "Cartn_z", "?type_symbol", "?disorder_group"]
    rows = list(block.find("_atom_site_", tags))[: MOST_ATOMS + 1]
    groups = [gemmi.cif.as_int(row[5], 0) if row.has(5) else 0 for row in rows]
    chosen = [rows[number] for number in _first_of_disorder(groups, notes)]
    names = [gemmi.cif.as_string(row[4] if row.has(4) else row[0]) for row in chosen]
    symbols = ["".join(itertools.takewhile(str.isalpha, name)) for name in names]
    places = [gemmi.Position(*(gemmi.cif.as_number(row[axis]) for axis in (1, 2, 3))) for row in chosen]
    return _arrays([gemmi.Element(symbol) for symbol in symbols], places)


def _first_of_disorder(groups: list[int], notes: list[str]) -> list[int]:
    """Rows of the atoms that are ordered (0), lie about a special position (< 0), or belong to the first group."""
    first = min((group for group in groups if group > 0), default=0)
    chosen = [row for row, group in enumerate(groups) if group <= 0 or group == first]
    _note_alternatives(len(groups) - len(chosen), notes)
    return chosen


def _note_alternatives(count: int, notes: list[str]) -> None:
    if count > 0:
        notes.append(f"{count} atoms at alternative places are left out")


def _arrays(
    elements: list[gemmi.Element], places: list[gemmi.Position]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    numbers = np.array([element.atomic_number for element in elements], np.int64)
    return numbers, np.array([place.tolist() for place in places], np.float64).reshape(-1, 3)
