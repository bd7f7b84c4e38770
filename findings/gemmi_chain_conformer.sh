#!/usr/bin/env bash
# gemmi: Chain.first_conformer() drops residues that are no alternatives to anything: ligands and atoms of waters.
#
# Versions: gemmi 0.7.5, Python 3.
# Believed: of a chain, chain.first_conformer() leaves out alternatives, which PDB files mark in the column of alternative
#   locations; a chain without such marks comes back whole.
# What happens: of neighbouring residues with one number all but the first are left out, marked or not. Docking programs
#   and builders give a ligand the number of the residue before it; simulations write waters as "SOL" with a last hydrogen
#   of "WAT". Here the file has 3 atoms, none of them marked; 2 come back.
# Who is hurt: whoever draws or measures one conformer: a ligand, or a third of the waters' atoms, is missing, and nothing
#   is reported.
# Seen: "atoms 3, marked as alternatives 0, of the first conformer 2"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check gemmi==0.7.5
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import gemmi

LINE = "HETATM{:5d}  {:<3s} {} A   1    {:8.3f}{:8.3f}   0.000  1.00 10.00           {}"
ATOMS = [("OW", "SOL", 0.0, 0.0, "O"), ("HW1", "SOL", 0.957, 0.0, "H"), ("HW2", "WAT", -0.24, 0.927, "H")]

lines = [LINE.format(number, *atom) for number, atom in enumerate(ATOMS, 1)]
chain = gemmi.read_pdb_string("\n".join([*lines, "END", ""]))[0]["A"]
atoms = [atom for residue in chain for atom in residue]
marked = sum(atom.has_altloc() for atom in atoms)
kept = sum(len(residue) for residue in chain.first_conformer())
print(f"atoms {len(atoms)}, marked as alternatives {marked}, of the first conformer {kept}")
sys.exit(0 if (len(atoms), marked, kept) == (3, 0, 2) else 1)
PYTHON
