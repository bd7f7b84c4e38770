"""Molecules (PDB, CIF, XYZ, SDF, Mol2, mmJSON) as balls and sticks in the colours of Corey, Pauling and Koltun."""

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
from lippmann.scene.parsing.round_meshes import join_rings
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

#: sRGB colours by atomic number, as Jmol has them but for a darker carbon; first that of what is no element.
_COLORS = bytes.fromhex("""
FF1493 FFFFFF D9FFFF CC80FF C2FF00 FFB5B5 787878 3050F8 FF0D0D 90E050 B3E3F5 AB5CF2 8AFF00 BFA6A6 F0C8A0 FF8000
FFFF30 1FF01F 80D1E3 8F40D4 3DFF00 E6E6E6 BFC2C7 A6A6AB 8A99C7 9C7AC7 E06633 F090A0 50D050 C88033 7D80B0 C28F8F
668F8F BD80E3 FFA100 A62929 5CB8D1 702EB0 00FF00 94FFFF 94E0E0 73C2C9 54B5B5 3B9E9E 248F8F 0A7D8C 006985 C0C0C0
FFD98F A67573 668080 9E63B5 D47A00 940094 429EB0 57178F 00C900 70D4FF FFFFC7 D9FFC7 C7FFC7 A3FFC7 8FFFC7 61FFC7
45FFC7 30FFC7 1FFFC7 00FF9C 00E675 00D452 00BF38 00AB24 4DC2FF 4DA6FF 2194D6 267DAB 266696 175487 D0D0E0 FFD123
B8B8D0 A6544D 575961 9E4FB5 AB5C00 754F45 428296 420066 007D00 70ABFA 00BAFF 00A1FF 008FFF 0080FF 006BFF 545CF2
785CE3 8A4FE3 A136D4 B31FD4 B31FBA B30DA6 BD0D87 C70066 CC0059 D1004F D90045 E00038 E6002E EB0026
""")

_process = HelperProcess("from lippmann.scene.readers.molecules.child import main; main()", _MOST_SECONDS)


def read_molecule(path: Path) -> SceneDescription:
    """Read a molecule: PDB, mmCIF, mmJSON, XYZ, SDF, Mol2, or the CIF of a small molecule. A unit is an angstrom.

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
    elements, positions, radii = elements[fit], positions[fit], arrays["radii"].astype(np.float64)[fit]
    if not 0 < len(elements) <= _MOST_ATOMS:
        raise SceneError(f"holds {len(elements)} atoms", where=path.name, rule=f"1 to {_MOST_ATOMS} are read")
    check_input(_BYTES_PER_ATOM * len(elements), "its atoms", where=path.name)
    description = _description(path.stem, elements, positions, radii)
    return replace(description, notes=[*description.notes, *notes])


def _description(
    name: str, elements: NDArray[np.int64], positions: NDArray[np.float64], radii: NDArray[np.float64]
) -> SceneDescription:
    """The molecule; ``radii`` ``(n, 2)`` are covalent and van der Waals radii."""
    detail = next((level for most, level in _DETAIL if len(elements) <= most), 0)
    ends, others = _half_bonds(elements, positions, radii[:, 0])
    meshes: list[Mesh] = []
    materials: list[Material] = []
    instances: list[Instance] = []
    for number in np.unique(elements):
        own_atoms = elements == number
        code = _COLORS[3 * number :][:3] or _COLORS[:3]
        color = decode_srgb(np.array(list(code)) / 255.0)
        material = len(materials)
        materials.append(Material(f"element {number}", base_color=tuple(color.tolist()), roughness=0.4))
        balls = np.tile(np.eye(4), (int(own_atoms.sum()), 1, 1))
        balls[:, :3, :3] *= BALL * radii[own_atoms][0, 1]
        balls[:, :3, 3] = positions[own_atoms]
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
    elements: NDArray[np.int64], positions: NDArray[np.float64], own: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The atoms at either end of each bond, each bond from both sides; ``own`` are the atoms' covalent radii."""
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
    points = np.concatenate([ring, ring + np.array([0.0, 0.0, 1.0])]).astype(np.float32)
    faces = join_rings(_SIDES).astype(np.uint32)
    normals = np.concatenate([ring, ring]).astype(np.float32)
    return Mesh(name, points, faces, material, normals=normals, stands_for="rod")
