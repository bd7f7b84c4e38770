#!/usr/bin/env bash
# gemmi: Residue.first_conformer() keeps every alternative atom of a residue whose conformers are listed one after the
# other.
#
# Versions: gemmi 0.7.5, Python 3.
# Believed: of a residue with atoms at alternative places, residue.first_conformer() gives one atom for each name, as its
#   own name says.
# What happens: it does so only where the alternatives of an atom stand beside each other (N/A, N/B, CA/A, CA/B). Where
#   the whole of conformer A comes before the whole of B, as several refinement programs write it, all atoms come back:
#   here 4 for 2 names. Chain.first_conformer(), over residues, takes both orders.
# Who is hurt: whoever draws or measures one conformer: atoms lie on top of each other, with bonds between them, and
#   nothing is reported.
# Seen: "beside each other: ['N', 'CA']; one after the other: ['N', 'CA', 'N', 'CA']"
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check gemmi==0.7.5
"$folder/venv/bin/python" - <<'PYTHON'
import sys

import gemmi

LINE = "ATOM  {:5d}  {:<3s}{}SER A   2    {:8.3f}{:8.3f}{:8.3f}{:6.2f} 10.00           {}"
ATOMS = [("N", "N", 0.0), ("CA", "C", 1.46)]


def names(order):
    lines = [LINE.format(n, name, alt, x, 0.1 * (alt == "B"), 0, 0.5, e) for n, ((name, e, x), alt) in enumerate(order, 1)]
    structure = gemmi.read_pdb_string("\n".join([*lines, "END", ""]))
    return [atom.name for atom in structure[0]["A"][0].first_conformer()]


beside = names([(atom, alt) for atom in ATOMS for alt in "AB"])
after = names([(atom, alt) for alt in "AB" for atom in ATOMS])
print(f"beside each other: {beside}; one after the other: {after}")
sys.exit(0 if (beside, after) == (["N", "CA"], ["N", "CA", "N", "CA"]) else 1)
PYTHON
