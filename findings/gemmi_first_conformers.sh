#!/usr/bin/env bash
# gemmi: the two methods first_conformer() leave atoms twice, or leave out atoms that have no alternative.
#
# Versions: gemmi 0.7.5, Python 3.
# Believed: of atoms at alternative places, which PDB files mark in a column of their own, residue.first_conformer() and
#   chain.first_conformer() give one atom for each name, and all that is not marked.
# What happens: (1) A residue's gives one only where the alternatives of an atom stand beside each other (N/A, N/B, CA/A,
#   CA/B). Where the whole of conformer A comes before the whole of B, as several refinement programs write it, all atoms
#   come back: here 4 for 2 names. (2) A chain's leaves out all but the first of neighbouring residues with one number,
#   marked or not. Docking programs give a ligand the number of the residue before it; simulations write waters as "SOL"
#   with a last hydrogen of "WAT". Here 2 of 3 atoms come back, none of which is marked.
# Who is hurt: whoever draws or measures one conformer: atoms lie on top of each other, with bonds between them; or a
#   ligand, or a third of the waters' atoms, is missing. Nothing is reported.
# Seen: "residue, beside each other: ['N', 'CA']; one after the other: ['N', 'CA', 'N', 'CA']"
#   "chain: atoms 3, marked as alternatives 0, of the first conformer 2"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check gemmi==0.7.5
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import gemmi

LINE = "HETATM{:5d}  {:<3s}{}{} A   1    {:8.3f}{:8.3f}   0.000  1.00 10.00           {}"
SERINE = [("N", "SER", 0.0, 0.0, "N"), ("CA", "SER", 1.46, 0.0, "C")]
WATER = [("OW", "SOL", 0.0, 0.0, "O"), ("HW1", "SOL", 0.957, 0.0, "H"), ("HW2", "WAT", -0.24, 0.927, "H")]


def chain_of(atoms):
    lines = [LINE.format(k, name, mark, *atom) for k, (mark, (name, *atom)) in enumerate(atoms, 1)]
    return gemmi.read_pdb_string("\n".join([*lines, "END", ""]))[0]["A"]


def names_of_residue(atoms):
    return [atom.name for atom in chain_of(atoms)[0].first_conformer()]


beside = names_of_residue([(mark, atom) for atom in SERINE for mark in "AB"])
after = names_of_residue([(mark, atom) for mark in "AB" for atom in SERINE])
print(f"residue, beside each other: {beside}; one after the other: {after}")
chain = chain_of([(" ", atom) for atom in WATER])
atoms = [atom for residue in chain for atom in residue]
marked = sum(atom.has_altloc() for atom in atoms)
left = sum(len(residue) for residue in chain.first_conformer())
print(f"chain: atoms {len(atoms)}, marked as alternatives {marked}, of the first conformer {left}")
expected = ["N", "CA"], ["N", "CA", "N", "CA"], (3, 0, 2)
sys.exit(0 if (beside, after, (len(atoms), marked, left)) == expected else 1)
PYTHON
