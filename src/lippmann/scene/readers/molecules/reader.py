"""Molecules (``.pdb``, ``.cif``, mmJSON) as balls and sticks in the colours of Corey, Pauling and Koltun."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from lippmann.color.transfer import decode_srgb
from lippmann.errors import SceneError
from lippmann.runtime.helper_process import HelperEndedError, HelperProcess
from lippmann.runtime.machine import check_input
from lippmann.scene.parsing.files import read_bytes
from lippmann.scene.values.description import Instance, Material, Matrix, Mesh, SceneDescription

#: Radii of balls over van der Waals radii, and of sticks in angstroms.
BALL, STICK = 0.25, 0.12
#: Two atoms are bonded if they lie less than their covalent radii and so much apart, angstroms.
SLACK = 0.45

#: Atoms that are read.
_MOST_ATOMS = 1 << 20
#: Balls have 20 * 4^n triangles: n for so many atoms.
_DETAIL = ((1_500, 3), (9_000, 2), (40_000, 1))
_SIDES = 16
#: Bytes that atoms and their bonds take.
_BYTES_PER_ATOM = 2_000
_MOST_SECONDS = 120.0

#: Atomic number: sRGB colour, covalent radius (Cordero et al. 2008) and van der Waals radius (Bondi 1964), angstroms.
_ELEMENTS: dict[int, tuple[tuple[int, int, int], float, float]] = {
    1: ((255, 255, 255), 0.31, 1.10),
    5: ((255, 181, 181), 0.84, 1.92),
    6: ((120, 120, 120), 0.76, 1.70),
    7: ((48, 80, 248), 0.71, 1.55),
    8: ((255, 13, 13), 0.66, 1.52),
    9: ((144, 224, 80), 0.57, 1.47),
    11: ((171, 92, 242), 1.66, 2.27),
    12: ((138, 255, 0), 1.41, 1.73),
    14: ((240, 200, 160), 1.11, 2.10),
    15: ((255, 128, 0), 1.07, 1.80),
    16: ((255, 255, 48), 1.05, 1.80),
    17: ((31, 240, 31), 1.02, 1.75),
    19: ((143, 64, 212), 2.03, 2.75),
    20: ((61, 255, 0), 1.76, 2.31),
    26: ((224, 102, 51), 1.32, 2.00),
    29: ((200, 128, 51), 1.32, 1.40),
    30: ((125, 128, 176), 1.22, 1.39),
    35: ((166, 41, 41), 1.20, 1.85),
    53: ((148, 0, 148), 1.39, 1.98),
}
_OTHER = ((255, 20, 147), 1.40, 2.00)

_process = HelperProcess("from lippmann.scene.readers.molecules.child import main; main()", _MOST_SECONDS)


def read_molecule(path: Path) -> SceneDescription:
    """Read a molecule: PDB, mmCIF, mmJSON, or the CIF of a small molecule. A unit is an angstrom.

    The first block with atoms and the first model are shown; of residues and atoms that share a place, the first.
    Balls have a quarter of van der Waals radii. Two atoms that lie within their covalent radii and 0.45 angstroms are
    joined by a stick, each half in its atom's colour.

    Raises
    ------
    SceneError
        ``gemmi`` is not installed; the file is missing or damaged, or holds no atoms or too many.
    """
    read_bytes(path, 64)
    if importlib.util.find_spec("gemmi") is None:
        fix = "install it: pip install 'lippmann[molecules]'"
        raise SceneError("molecules need the library gemmi", where=path.name, fix=fix)
    try:
        arrays = _process.ask_arrays(path)
    except HelperEndedError as error:
        raise SceneError(f"gemmi breaks down at the file ({error})", where=path.name, fix="is it whole?") from None
    if "error" in arrays:
        raise SceneError(f"is no molecule that is understood ({arrays['error']})", where=path.name)
    elements, positions = arrays["elements"].astype(np.int64), arrays["positions"].astype(np.float64)
    notes = arrays["notes"].tolist()
    fit = np.isfinite(positions).all(axis=1) & (np.abs(positions) < 1e6).all(axis=1)
    elements, positions = elements[fit], positions[fit]
    if not 0 < len(elements) <= _MOST_ATOMS:
        raise SceneError(f"holds {len(elements)} atoms", where=path.name, rule=f"1 to {_MOST_ATOMS} are read")
    check_input(_BYTES_PER_ATOM * len(elements), "its atoms", where=path.name)
    description = _description(path.stem, elements, positions)
    return replace(description, notes=[*description.notes, *notes])


def _description(name: str, elements: NDArray[np.int64], positions: NDArray[np.float64]) -> SceneDescription:
    detail = next((level for most, level in _DETAIL if len(elements) <= most), 0)
    ends, others = _half_bonds(elements, positions)
    meshes: list[Mesh] = []
    materials: list[Material] = []
    instances: list[Instance] = []
    for number in np.unique(elements):
        (red, green, blue), _, radius = _ELEMENTS.get(int(number), _OTHER)
        color = decode_srgb(np.array([red, green, blue]) / 255.0)
        material = len(materials)
        materials.append(Material(f"element {number}", base_color=tuple(color.tolist()), roughness=0.4))
        balls = np.tile(np.eye(4), (int((elements == number).sum()), 1, 1))
        balls[:, :3, :3] *= BALL * radius
        balls[:, :3, 3] = positions[elements == number]
        instances.append(Instance(len(meshes), balls))
        meshes.append(_ball(f"balls of element {number}", detail, material))
        own = elements[ends] == number
        if own.any():
            instances.append(Instance(len(meshes), _stick_matrices(positions[ends[own]], positions[others[own]])))
            meshes.append(_stick(f"sticks of element {number}", material))
    bonds = len(ends) // 2
    notes = [f"{len(elements)} atoms, {bonds} bonds by their distance"]
    return SceneDescription(name, meshes, materials, instances, notes=notes)


def _half_bonds(
    elements: NDArray[np.int64], positions: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The atoms at either end of each bond, each bond from both sides."""
    radii = np.array([_ELEMENTS.get(int(number), _OTHER)[1] for number in np.unique(elements)])
    own = radii[np.searchsorted(np.unique(elements), elements)]
    # Hydrogens bond to one atom; a cell of nothing but overlaid atoms would have pairs without number.
    tree = cKDTree(positions)
    _, near = tree.query(positions, k=min(13, len(positions)), distance_upper_bound=2.0 * own.max() + SLACK)
    near = np.reshape(near, (len(positions), -1))
    first = np.repeat(np.arange(len(positions)), near.shape[1])
    second = near.ravel()
    real = (second < len(positions)) & (first != second)
    first, second = first[real], second[real]
    distance = np.linalg.norm(positions[first] - positions[second], axis=1)
    bonded = (distance > 0.4) & (distance < own[first] + own[second] + SLACK)
    bonded &= ~((elements[first] == 1) & (elements[second] == 1))
    pairs = np.unique(np.sort(np.stack([first[bonded], second[bonded]], axis=1), axis=1), axis=0)
    return np.concatenate([pairs[:, 0], pairs[:, 1]]), np.concatenate([pairs[:, 1], pairs[:, 0]])


def _stick_matrices(start: NDArray[np.float64], end: NDArray[np.float64]) -> Matrix:
    """Places ``(k, 4, 4)`` of a stick of radius and length 1 along z: from atoms half-way to their neighbours."""
    axis = (end - start) / 2.0
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    z = axis / length
    least = np.eye(3)[np.argmin(np.abs(z), axis=1)]
    x = np.cross(least, z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    matrices = np.tile(np.eye(4), (len(start), 1, 1))
    matrices[:, :3, 0] = STICK * x
    matrices[:, :3, 1] = STICK * np.cross(z, x)
    matrices[:, :3, 2] = axis
    matrices[:, :3, 3] = start
    return matrices


def _ball(name: str, detail: int, material: int) -> Mesh:
    import trimesh

    sphere = trimesh.creation.icosphere(subdivisions=detail)
    points = np.asarray(sphere.vertices, np.float32)
    faces = np.asarray(sphere.faces, np.uint32)
    return Mesh(name, points, faces, material, normals=points, stands_for="ball")


def _stick(name: str, material: int) -> Mesh:
    angles = np.arange(_SIDES) * (2.0 * np.pi / _SIDES)
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(_SIDES)], axis=1)
    here = np.arange(_SIDES)
    after = (here + 1) % _SIDES
    lower = np.stack([here, after, after + _SIDES], axis=1)
    upper = np.stack([here, after + _SIDES, here + _SIDES], axis=1)
    points = np.concatenate([ring, ring + np.array([0.0, 0.0, 1.0])]).astype(np.float32)
    faces = np.concatenate([lower, upper]).astype(np.uint32)
    normals = np.concatenate([ring, ring]).astype(np.float32)
    return Mesh(name, points, faces, material, normals=normals, stands_for="rod")
