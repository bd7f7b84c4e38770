"""Catmull-Clark subdivision of polygons, with creases, corners and boundaries (Catmull and Clark 1978; DeRose 1998).

A level is a set of sparse matrices: one takes positions (and what is interpolated as they are) from the cage's points,
one takes values that stand at the corners of faces. After the last level, points are moved to where the surface comes
to in the limit (Halstead, Kass and DeRose 1993).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]
Sparse = Any

_SMOOTH_VALENCE = 3  # of a vertex's edges so many may be sharp before it is a corner


@dataclass(frozen=True, eq=False)
class Cage:
    """Polygons to be refined.

    Attributes
    ----------
    points:
        How many points there are.
    counts, indices:
        Corners of each face, 3 or more, and their points, ``(c,)``.
    edges, sharpness:
        ``(e, 2)`` points and ``(e,)`` sharpness of creases.
    corners:
        ``(points,)`` sharpness of points.
    """

    points: int
    counts: Integers
    indices: Integers
    edges: Integers
    sharpness: Floats
    corners: Floats


@dataclass(frozen=True, eq=False)
class Refined:
    """A refined cage.

    Attributes
    ----------
    cage:
        The faces, all quadrilaterals.
    from_points:
        Sparse ``(n, points)``: the refined points of those of the first cage.
    from_points_linear:
        The same without smoothing, for values that vary linearly.
    from_corners:
        Sparse ``(4 m, c)``: values at the refined corners of those at the first cage's.
    faces:
        ``(m,)`` the face of the first cage that each comes from.
    corner_groups:
        ``(4 m,)`` :func:`smooth_groups` of the refined cage.
    """

    cage: Cage
    from_points: Sparse
    from_points_linear: Sparse
    from_corners: Sparse
    faces: Integers
    corner_groups: Integers


def refine_each(cages: Sequence[Cage], levels: int, *, sharp_corners: bool = True) -> list[Refined]:
    """Refine each cage as :func:`refine` does; joined, as SciPy takes nearly as long for few rows as for many."""
    if len(cages) == 1:
        return [refine(cages[0], levels, sharp_corners=sharp_corners)]
    points, faces, corners = (
        np.array(sizes)
        for sizes in zip(*((each.points, len(each.counts), len(each.indices)) for each in cages), strict=True)
    )
    from_point, from_face, from_corner = (np.cumsum(sizes) - sizes for sizes in (points, faces, corners))
    joined = refine(
        Cage(
            int(points.sum()),
            np.concatenate([each.counts for each in cages]),
            np.concatenate([each.indices + start for each, start in zip(cages, from_point, strict=True)]),
            np.concatenate([each.edges + start for each, start in zip(cages, from_point, strict=True)]),
            np.concatenate([each.sharpness for each in cages]),
            np.concatenate([each.corners for each in cages]),
        ),
        levels,
        sharp_corners=sharp_corners,
    )
    # Faces lie cage after cage, points level after level: those of a cage are brought together, in their own order.
    numbers = np.arange(len(cages))
    quads = corners * 4 ** (levels - 1)
    owners = np.repeat(numbers, points)
    owners = np.concatenate([owners, np.zeros(joined.cage.points - len(owners), np.int64)])
    owners[joined.cage.indices] = np.repeat(numbers, 4 * quads)
    order = np.argsort(owners, kind="stable")
    places = np.argsort(order)
    from_points, linear = joined.from_points[order], joined.from_points_linear[order]
    ends = np.cumsum(np.bincount(owners, minlength=len(cages)))
    creased = owners[joined.cage.edges[:, 0]]
    parts = []
    for number, (end, last) in enumerate(zip(ends, np.cumsum(quads), strict=True)):
        rows = slice(ends[number - 1] if number else 0, end)
        mine = slice(last - quads[number], last)
        of_corners = slice(4 * mine.start, 4 * mine.stop)
        sharp = creased == number
        columns = slice(from_point[number], from_point[number] + points[number])
        cage = Cage(
            int(end - rows.start),
            joined.cage.counts[mine],
            places[joined.cage.indices[of_corners]] - rows.start,
            places[joined.cage.edges[sharp]] - rows.start,
            joined.cage.sharpness[sharp],
            joined.cage.corners[order[rows]],
        )
        groups = joined.corner_groups[of_corners]
        parts.append(
            Refined(
                cage,
                _block(from_points, rows, columns),
                _block(linear, rows, columns),
                _block(
                    joined.from_corners, of_corners, slice(from_corner[number], from_corner[number] + corners[number])
                ),
                joined.faces[mine] - from_face[number],
                groups - groups.min(),
            )
        )
    return parts


def _block(matrix: Sparse, rows: slice, columns: slice) -> Sparse:
    """Rows that have entries in these columns alone."""
    starts = matrix.indptr[rows.start : rows.stop + 1]
    held = slice(starts[0], starts[-1])
    shape = (rows.stop - rows.start, columns.stop - columns.start)
    return sparse.csr_matrix((matrix.data[held], matrix.indices[held] - columns.start, starts - starts[0]), shape=shape)


def refine(cage: Cage, levels: int, *, sharp_corners: bool = True) -> Refined:
    """Refine a cage ``levels`` times, and move its points to the limit surface.

    Parameters
    ----------
    sharp_corners:
        Whether points that one face alone uses keep their place (``edgeAndCorner``).
    """
    if sharp_corners:
        alone = np.bincount(cage.indices, minlength=cage.points) == 1
        cage = replace(cage, corners=np.where(alone, np.inf, cage.corners))
    from_points = from_points_linear = sparse.identity(cage.points, format="csr")
    from_corners = sparse.identity(len(cage.indices), format="csr")
    faces = np.arange(len(cage.counts))
    topology = _Topology(cage)
    for _ in range(levels):
        cage, smooth, linear = _refine_once(topology)
        from_points, from_points_linear = smooth @ from_points, linear @ from_points_linear
        from_corners = _corner_values(topology) @ from_corners
        faces = faces[topology.face_of_corner]
        topology = _Topology(cage)
    from_points = topology.limit() @ from_points
    return Refined(cage, from_points, from_points_linear, from_corners, faces, topology.smooth_groups())


def smooth_groups(cage: Cage) -> Integers:
    """A number ``(c,)`` for each corner of faces: corners at one point share it where no sharp edge parts them."""
    return _Topology(cage).smooth_groups()


class _Topology:
    """Edges of a cage, and sums over what meets at each."""

    def __init__(self, cage: Cage) -> None:
        self.cage = cage
        counts, indices = cage.counts, cage.indices
        corners = np.arange(len(indices))
        ends = np.cumsum(counts)
        self.face_of_corner = np.repeat(np.arange(len(counts)), counts)
        self.next_corner = corners + 1
        self.next_corner[ends - 1] = ends - counts
        self.previous_corner = np.empty_like(corners)
        self.previous_corner[self.next_corner] = corners
        pairs = np.sort(np.stack([indices, indices[self.next_corner]], axis=1), axis=1)
        keys, self.edge_of_corner = np.unique(pairs[:, 0] * cage.points + pairs[:, 1], return_inverse=True)
        self.edges = np.stack(np.divmod(keys, max(cage.points, 1)), axis=1)
        faces_at_edge = np.bincount(self.edge_of_corner, minlength=len(keys))
        self.sharpness = np.where(faces_at_edge == 2, 0.0, np.inf)
        if len(cage.edges):
            creases = np.sort(cage.edges, axis=1)
            edges = creases[:, 0] * cage.points + creases[:, 1]
            places = np.minimum(np.searchsorted(keys, edges), len(keys) - 1)
            known = keys[places] == edges
            np.maximum.at(self.sharpness, places[known], cage.sharpness[known])

    def matrix(self, rows: Integers, columns: Integers, values: Floats | float, shape: tuple[int, int]) -> Sparse:
        data = np.broadcast_to(np.asarray(values, np.float64), rows.shape)
        return sparse.csr_matrix((data, (rows, columns)), shape=shape)

    @property
    def face_centers(self) -> Sparse:
        """``(faces, points)``: means of corners."""
        counts, indices = self.cage.counts, self.cage.indices
        shares = 1.0 / counts[self.face_of_corner]
        return self.matrix(self.face_of_corner, indices, shares, (len(counts), self.cage.points))

    @property
    def edge_centers(self) -> Sparse:
        """``(edges, points)``."""
        rows = np.repeat(np.arange(len(self.edges)), 2)
        return self.matrix(rows, self.edges.ravel(), 0.5, (len(self.edges), self.cage.points))

    def sharp_at_points(self) -> tuple[Integers, Floats, Sparse]:
        """Sharp edges at each point: how many, their mean sharpness, and ``(points, edges)`` of ones."""
        points = self.cage.points
        sharp = np.flatnonzero(self.sharpness > 0.0)
        rows, columns = self.edges[sharp].ravel(), np.repeat(sharp, 2)
        count = np.bincount(rows, minlength=points)
        strength = np.bincount(rows, np.minimum(self.sharpness[columns], 1e3), minlength=points)
        at = self.matrix(rows, columns, 1.0, (points, len(self.edges)))
        return count, strength / np.maximum(count, 1), at

    def smooth_groups(self) -> Integers:
        """See :func:`smooth_groups`."""
        cage = self.cage
        corners = len(cage.indices)
        soft = self.sharpness[self.edge_of_corner] < 1.0
        # The two faces at an edge hold it in opposite directions: its start in one is its end in the other.
        pairs = []
        order = np.argsort(self.edge_of_corner, kind="stable")
        edges = self.edge_of_corner[order]
        same = np.flatnonzero((edges[1:] == edges[:-1]) & soft[order[1:]])
        one, other = order[same], order[same + 1]
        for first, second in ((one, self.next_corner[other]), (self.next_corner[one], other)):
            meets = cage.indices[first] == cage.indices[second]
            pairs.append(np.stack([first[meets], second[meets]]))
            flipped = ~meets  # faces that turn the other way round
            pairs.append(np.stack([one[flipped], other[flipped]]))
        start, end = np.concatenate(pairs, axis=1)
        same_point = cage.indices[start] == cage.indices[end]
        start, end = start[same_point], end[same_point]
        graph = sparse.coo_matrix((np.ones(len(start)), (start, end)), shape=(corners, corners))
        return np.asarray(connected_components(graph, directed=False)[1], np.int64)

    def limit(self) -> Sparse:
        """``(points, points)``: where points of quadrilaterals come to in the limit."""
        points, indices = self.cage.points, self.cage.indices
        if (self.cage.counts != 4).any():
            return sparse.identity(points, format="csr")
        opposite = indices[self.next_corner[self.next_corner]]
        across = self.matrix(indices, opposite, 1.0, (points, points))
        start, end = self.edges.T
        beside = self.matrix(np.concatenate([start, end]), np.concatenate([end, start]), 1.0, (points, points))
        valence = np.bincount(self.edges.ravel(), minlength=points)
        n = np.maximum(valence, 1).astype(np.float64)
        smooth = sparse.diags(n / (n + 5.0)) + sparse.diags(1.0 / (n * (n + 5.0))) @ (4.0 * beside + across)
        count = self.sharp_at_points()[0]
        sharp = self.sharpness > 0.0
        ends = np.concatenate([start[sharp], end[sharp]])
        others = np.concatenate([end[sharp], start[sharp]])
        along = self.matrix(ends, others, 1.0 / 6.0, (points, points))
        crease = sparse.identity(points, format="csr") * (4.0 / 6.0) + along
        fixed = (count > 2) | (self.cage.corners > 0.0) | (valence == 0)
        is_crease = ~fixed & (count == 2)
        is_smooth = ~fixed & ~is_crease
        pick = [sparse.diags(mask.astype(np.float64)) for mask in (is_smooth, is_crease, fixed)]
        return (pick[0] @ smooth + pick[1] @ crease + pick[2]).tocsr()


def _refine_once(topology: _Topology) -> tuple[Cage, Sparse, Sparse]:
    """The next cage, and its points of this one's: smoothed, and linear."""
    cage = topology.cage
    points, edges, faces = cage.points, len(topology.edges), len(cage.counts)
    centers, middles = topology.face_centers, topology.edge_centers
    # Edges: the mean of their ends and of the faces beside them, or their middle where they are sharp.
    beside = topology.matrix(topology.edge_of_corner, topology.face_of_corner, 0.25, (edges, faces))
    keen = np.clip(topology.sharpness, 0.0, 1.0)
    edge_points = sparse.diags(1.0 - keen) @ (0.5 * middles + beside @ centers) + sparse.diags(keen) @ middles
    from_points = sparse.vstack([_moved_points(topology, centers, middles), edge_points, centers], format="csr")
    linear = sparse.vstack([sparse.identity(points), middles, centers], format="csr")
    # Each corner of a face becomes a quadrilateral: point, edge after, face, edge before.
    after, before = topology.edge_of_corner, topology.edge_of_corner[topology.previous_corner]
    quads = np.stack([cage.indices, points + after, points + edges + topology.face_of_corner, points + before], axis=1)
    fades = np.maximum(topology.sharpness - 1.0, 0.0)
    sharp = np.flatnonzero((fades > 0.0) & np.isfinite(fades))
    halves = np.stack([topology.edges[sharp], np.repeat(points + sharp[:, None], 2, axis=1)], axis=2).reshape(-1, 2)
    refined = Cage(
        points + edges + faces,
        np.full(len(quads), 4),
        quads.ravel(),
        halves,
        np.repeat(fades[sharp], 2),
        np.concatenate([np.maximum(cage.corners - 1.0, 0.0), np.zeros(edges + faces)]),
    )
    return refined, from_points, linear


def _moved_points(topology: _Topology, centers: Sparse, middles: Sparse) -> Sparse:
    """``(points, points)``: where the cage's own points go."""
    cage, points = topology.cage, topology.cage.points
    faces = np.bincount(cage.indices, minlength=points)
    valence = np.bincount(topology.edges.ravel(), minlength=points)
    n, m = np.maximum(valence, 1).astype(np.float64), np.maximum(faces, 1)
    at_faces = topology.matrix(cage.indices, topology.face_of_corner, 1.0, (points, len(cage.counts)))
    rows = topology.edges.ravel()
    at_edges = topology.matrix(rows, np.repeat(np.arange(len(topology.edges)), 2), 1.0, (points, len(topology.edges)))
    smooth = (
        sparse.diags(1.0 / (n * m)) @ at_faces @ centers
        + sparse.diags(2.0 / (n * n)) @ at_edges @ middles
        + sparse.diags((n - 3.0) / n)
    )
    count, strength, sharp_edges = topology.sharp_at_points()
    crease = 0.5 * sparse.identity(points) + 0.25 * (sharp_edges @ middles)
    corner = np.maximum(np.clip(cage.corners, 0.0, 1.0), (count >= _SMOOTH_VALENCE) * np.clip(strength, 0.0, 1.0))
    corner = np.where(valence == 0, 1.0, corner)
    keen = np.where(count == 2, np.clip(strength, 0.0, 1.0), 0.0) * (1.0 - corner)
    return (sparse.diags(1.0 - keen - corner) @ smooth + sparse.diags(keen) @ crease + sparse.diags(corner)).tocsr()


def _corner_values(topology: _Topology) -> Sparse:
    """``(4 c, c)``: values at the corners of the quadrilaterals, linear over each face."""
    corners = len(topology.cage.indices)
    own = np.arange(corners)
    shares = 1.0 / topology.cage.counts[topology.face_of_corner]
    start = np.cumsum(topology.cage.counts) - topology.cage.counts
    counts = topology.cage.counts[topology.face_of_corner]
    rows = [4 * own, 4 * own + 1, 4 * own + 1, 4 * own + 3, 4 * own + 3]
    columns = [own, own, topology.next_corner, topology.previous_corner, own]
    values = [np.ones(corners), *[np.full(corners, 0.5)] * 4]
    # The face's own point: the mean of all its corners.
    offsets = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    rows.append(np.repeat(4 * own + 2, counts))
    columns.append(np.repeat(start[topology.face_of_corner], counts) + offsets)
    values.append(np.repeat(shares, counts))
    place = (np.concatenate(rows), np.concatenate(columns))
    return sparse.csr_matrix((np.concatenate(values), place), shape=(4 * corners, corners))
