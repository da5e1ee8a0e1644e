"""Torsal faces whose edges do not follow their rulings: flat images of low strain, ruling lines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso import geometry
from gso.errors import MeshError
from gso.mesh import Mesh, topology
from gso.recognition.bend_lines import BendLine
from gso.rulings import shape_operator, trace
from gso.typing import Array, Flags, Ints

#: Triangles of a face, at least and at most, whose flat image is tried.
_FEWEST, _MOST = 2, 20_000
#: Sum of the absolute curvatures, smoothed, above which no image of low strain exists, in radians.
_CURVED = 1.0
#: Angle between bend lines, in radians, and their largest number.
_STEP, _LINES = np.radians(6.0), 120
#: Height of a vertex over its neighbours on a ruling, relative to their distance.
_STRAIGHT = 1e-4
#: Share of the vertices inside that must be on straight lines of edges for these to be rulings.
_COVERED = 0.9


@dataclass(frozen=True)
class SmoothImage:
    """Flat image of a face whose surface has no equation.

    Attributes
    ----------
    flat : ndarray, (k, 3, 2)
        Corners of the triangles.
    strain : float
        Largest strain.
    bend_lines : tuple of BendLine
    """

    flat: Array
    strain: float
    bend_lines: tuple[BendLine, ...]


def smooth_image(points: Array, triangles: Ints, limit: float) -> SmoothImage | None:
    """Lay a face flat if its strain stays below a limit.

    Parameters
    ----------
    points : ndarray, (n, 3)
    triangles : ndarray of int, (k, 3)
    limit : float
        Largest strain.

    Returns
    -------
    SmoothImage or None
        None for closed faces, those that close around themselves, and those that are not
        developable within the limit.
    """
    if not _FEWEST <= len(triangles) <= _MOST:
        return None
    ids, local = np.unique(triangles, return_inverse=True)
    try:
        mesh = Mesh(points[ids], local.reshape(-1, 3))
    except MeshError:
        # A face may touch itself in a vertex.
        return None
    loops = len(mesh.boundary_loops)
    if not loops or mesh.euler_characteristic != 2 - loops or _total_curvature(mesh) > _CURVED:
        return None
    # Most designs have no such face.
    from gso.parametrization import low_strain

    flat = low_strain(mesh).flat
    areas = geometry.signed_areas(flat, mesh.triangles)
    strain = _largest_strain(mesh, flat)
    if strain > limit or (areas <= 0).any():
        return None
    return SmoothImage(flat[local.reshape(-1, 3)], strain, _lines(mesh, flat))


def _total_curvature(mesh: Mesh) -> float:
    """Sum of absolute angle defects, of means over the neighbours of neighbours."""
    n, t = len(mesh.vertices), mesh.triangles
    angles = geometry.corner_angles(mesh.vertices, t)
    defect = 2 * np.pi - np.bincount(t.ravel(), angles.ravel(), n)
    inside = ~mesh.half_edges.boundary_vertex
    defect[~inside] = 0.0
    a, b = mesh.edges.T
    graph = topology.edge_graph(
        n, np.concatenate([a, b, np.arange(n)]), np.concatenate([b, a, np.arange(n)])
    )
    weight = np.maximum(graph @ inside.astype(float), 1.0)
    for _ in range(2):
        defect = np.where(inside, (graph @ defect) / weight, 0.0)
    return float(np.abs(defect).sum())


def _largest_strain(mesh: Mesh, flat: Array) -> float:
    t = mesh.triangles
    rest = geometry.first_form(*geometry.corners(mesh.vertices, t))
    image = geometry.first_form(*geometry.corners(flat, t))
    most, least = geometry.principal_stretches(rest, image)
    return float(np.nanmax([np.abs(most - 1.0).max(), np.abs(least - 1.0).max()]))


def _lines(mesh: Mesh, flat: Array) -> tuple[BendLine, ...]:
    """Make bend lines along straight rows of edges, or else along traced rulings."""
    operator = shape_operator(mesh)
    bend = operator.curvatures[:, 1]
    total = float((np.abs(bend) * operator.areas).sum())
    span = float(np.sqrt(operator.areas.sum()))
    rows = _straight_rows(mesh)
    if rows is not None:
        lines = [flat[row] for row in rows]
        middles = [mesh.vertices[row[[0, -1]]] for row in rows]
    else:
        count = int(np.clip(np.ceil(total / span / _STEP), 4, _LINES))
        rulings = trace(mesh, count=count)
        lines = [line for line in rulings.on(flat) if len(line) > 1]
        middles = [line[[0, -1]] for line in rulings.lines if len(line) > 1]
    if not lines:
        return ()
    from scipy.spatial import cKDTree

    ends = np.stack(middles)
    # Curvatures at the ends are means of the nearest faces'.
    _, near = cKDTree(operator.points).query(ends.reshape(-1, 3), k=min(3, len(bend)))
    curvature = bend[near].reshape(len(lines), 2, -1).mean(axis=2)
    length = np.array([np.linalg.norm(line[-1] - line[0]) for line in lines])
    width = operator.areas.sum() / max(float(length.sum()), 1e-300)
    found = []
    for line, (first, last) in zip(lines, curvature, strict=True):
        one, two = (float(1 / max(abs(c), 1e-12)) for c in (first, last))
        # Along a ruling the radius grows linearly, and the width with it.
        angle = float(2 * width / (one + two))
        found.append(BendLine(line[0], line[-1], one, two, angle, bool(first + last < 0)))
    return tuple(found)


def _straight_rows(mesh: Mesh) -> list[Ints] | None:
    """Return rows of edges that run straight from outline to outline through all vertices inside.

    None if there are not such rows through nine of ten vertices inside.
    """
    n = len(mesh.vertices)
    inside = ~mesh.half_edges.boundary_vertex
    a, b = mesh.edges.T
    at, to = np.concatenate([a, b]), np.concatenate([b, a])
    order = np.argsort(at, kind="stable")
    at, to = at[order], to[order]
    along = mesh.vertices[to] - mesh.vertices[at]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    start = np.searchsorted(at, np.arange(n + 1))
    valence = np.diff(start)
    best, pair = np.full(n, np.inf), np.full((n, 2), -1)
    most = int(valence.max())
    for i in range(most):
        for j in range(i + 1, most):
            both = np.flatnonzero(inside & (valence > j))
            p, q = start[both] + i, start[both] + j
            off = np.linalg.norm(along[p] + along[q], axis=1)
            less = off < best[both]
            best[both[less]] = off[less]
            pair[both[less]] = np.stack([to[p[less]], to[q[less]]], axis=1)
    straight = inside & (best < 2 * _STRAIGHT)
    if not inside.any() or straight.sum() < _COVERED * inside.sum():
        return None
    return _chains(pair, straight, n)


def _chains(pair: Ints, straight: Flags, n: int) -> list[Ints]:
    """Join vertices with their two neighbours on straight lines to rows, from end to end."""
    ids = np.flatnonzero(straight)
    # Ends on the outline may belong to several rows; rows are told apart by vertices inside.
    joined = straight[pair[ids]]
    a = np.concatenate([ids[joined[:, 0]], ids[joined[:, 1]]])
    b = np.concatenate([pair[ids[joined[:, 0]], 0], pair[ids[joined[:, 1]], 1]])
    label = topology.label_components(n, a, b)
    rows = []
    for members in np.split(ids[np.argsort(label[ids], kind="stable")], _steps(label[ids])):
        reached = np.concatenate([members, pair[members].ravel()])
        values, counts = np.unique(reached, return_counts=True)
        ends = values[~straight[values]]
        if len(ends) == 2 and counts.max() <= 3:
            rows.append(np.array([ends[0], *members, ends[1]]))
    return rows


def _steps(label: Ints) -> Ints:
    return np.asarray(np.flatnonzero(np.diff(np.sort(label))) + 1)
