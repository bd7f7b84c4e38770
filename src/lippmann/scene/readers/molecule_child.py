"""The process that reads molecules by ``gemmi``: native code, with nothing else in it."""

from __future__ import annotations

import io
import json
import os

import gemmi
import numpy as np
from numpy.typing import NDArray

from lippmann.runtime.helper_process import limit_memory, serve

#: Atoms of a molecule.
MOST_ATOMS = 1 << 20


def main() -> None:
    """Answer requests, JSON with ``path`` and ``memory``, by ``.npz``: ``positions``, ``elements``, or an ``error``."""
    serve(_answer)


def _answer(data: bytes) -> bytes:
    request = json.loads(data)
    limit_memory(request["memory"])
    try:
        elements, positions = _atoms(request["path"])
        found: dict[str, NDArray[np.generic]] = {"elements": elements, "positions": positions}
    except Exception as error:  # noqa: BLE001  # it raises errors of many kinds
        found = {"error": np.array(_words(error, request["path"]))}
    written = io.BytesIO()
    np.savez(written, **found)  # type: ignore[arg-type]  # names are free
    return written.getvalue()


def _words(error: Exception, path: str) -> str:
    if isinstance(error, MemoryError):
        return "it takes more memory than is left"
    try:
        said = " ".join(str(error).split())
    except UnicodeDecodeError:  # it quotes the file
        return "it holds text that is not UTF-8"
    return said.replace(os.path.join(os.path.dirname(path), ""), "")[:300] or type(error).__name__


def _atoms(path: str) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Atomic numbers ``(n,)`` and positions ``(n, 3)``, angstroms, of the first model and first of alternatives."""
    if path.lower().endswith(".cif"):
        block = gemmi.cif.read(path)[0]
        if block.find_values("_atom_site_fract_x"):
            crystal = gemmi.make_small_structure_from_block(block)
            sites = list(crystal.sites)[: MOST_ATOMS + 1]
            places = [crystal.cell.orthogonalize(site.fract) for site in sites]
            return _arrays([site.element for site in sites], places)
        structure = gemmi.make_structure_from_block(block)
    else:
        structure = gemmi.read_structure(path)
    if not len(structure):
        return _arrays([], [])
    elements, places = [], []
    for chain in structure[0]:
        for residue in chain:
            first = next((atom.altloc for atom in residue if atom.altloc != "\0"), "\0")
            for atom in residue:
                if atom.altloc in ("\0", first):
                    elements.append(atom.element)
                    places.append(atom.pos)
        if len(elements) > MOST_ATOMS:
            break
    return _arrays(elements, places)


def _arrays(
    elements: list[gemmi.Element], places: list[gemmi.Position]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    numbers = np.array([element.atomic_number for element in elements], np.int64)
    return numbers, np.array([place.tolist() for place in places], np.float64).reshape(-1, 3)
