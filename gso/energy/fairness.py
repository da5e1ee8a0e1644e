"""Fairness: second differences along polylines, or across the edges of triangles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso import geometry
from gso.energy.base import Term
from gso.mesh import Mesh, topology
from gso.typing import Array, B, Ints, S, Vec

#: Translations cancel as the coefficients sum to zero. A target does not rotate with the surface,
#: so rotations are not declared.
INVARIANT = ("translation",)


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return the linear combination of the points minus a target vector.

    Constants: one coefficient per point (they sum to zero), then the target's components.
    """
    k = len(points)
    coefficients, target = constants[:k], constants[k:]
    return tuple(
        sum(c * p[d] for c, p in zip(coefficients, points, strict=True)) - target[d]
        for d in range(len(points[0]))
    )


def differences(mesh: Mesh) -> tuple[Ints, Array]:
    """Return stencils (e, k) and coefficients (k, e) of the second differences of a mesh.

    On quad meshes: ``(1, -2, 1) / h^2`` along polylines. On a grid h is the length of a side
    over its number of cells. If the sides differ by less than a factor of two, both are
    replaced by their geometric mean, which gives the plain second differences of the published
    measure. On other quad meshes h is the root mean square edge length.

    On meshes with triangles: across every interior edge of the triangulation, the combination
    of its four vertices that vanishes on affine functions, scaled like a second derivative
    times the edge's share of the area.
    """
    v = mesh.vertices
    if mesh.has_triangles:
        return hinge_differences(mesh)
    if mesh.grid_index is not None:
        ids = mesh.grid_index
        rows = np.stack([ids[:-2], ids[1:-1], ids[2:]], axis=-1).reshape(-1, 3)
        cols = np.stack([ids[:, :-2], ids[:, 1:-1], ids[:, 2:]], axis=-1).reshape(-1, 3)
        grid = v[ids]
        h = spacing(*geometry.side_lengths(tuple(np.moveaxis(grid, -1, 0))), grid.shape)
        scale = np.r_[np.full(len(rows), h[0] ** -2), np.full(len(cols), h[1] ** -2)]
        stencil = np.concatenate([rows, cols])
    else:
        stencil = topology.polyline_triples(mesh.half_edges, mesh.faces)
        h2 = (mesh.edge_lengths**2).mean()
        scale = np.full(len(stencil), 1.0 / h2)
    return stencil, np.array([[1.0], [-2.0], [1.0]]) * scale


def spacing(along: B, across: B, shape: Sequence[int]) -> tuple[B, B]:
    """Return a grid's spacing from the mean lengths of its sides; for arrays or tensors.

    Sides whose lengths differ by less than a factor of two count as equally long.
    """
    mean = (along * across) ** 0.5
    # Only the part of the ratio beyond a factor of two is used.
    ratio = along / across
    excess = (ratio / ratio.clip(0.5, 2.0)) ** 0.5
    return mean * excess / (shape[0] - 1), mean / excess / (shape[1] - 1)


def hinge_differences(mesh: Mesh) -> tuple[Ints, Array]:
    """Return the second differences across the edges of a triangulation, as :func:`differences`."""
    stencil = topology.hinges(mesh.triangle_edges)
    a, b, c, d = (mesh.vertices[stencil[:, k]] for k in range(4))
    edge = b - a
    length2 = np.maximum((edge**2).sum(axis=1), 1e-300)
    # Unfold the two triangles: positions along the edge and heights over it.
    along_c = ((c - a) * edge).sum(axis=1) / length2
    along_d = ((d - a) * edge).sum(axis=1) / length2
    high_c = np.linalg.norm(c - a - along_c[:, None] * edge, axis=1)
    high_d = np.linalg.norm(d - a - along_d[:, None] * edge, axis=1)
    floor = 1e-3 * np.sqrt(length2)
    high_c, high_d = np.maximum(high_c, floor), np.maximum(high_d, floor)
    wc, wd = 1.0 / high_c, 1.0 / high_d
    wb = -(along_c * wc + along_d * wd)
    wa = -(wc + wd) - wb
    # Jump of the normal derivative, divided by the distance between the midpoints of the heights.
    scale = 2.0 / (high_c + high_d)
    return stencil, np.stack([wa, wb, wc, wd]) * scale


def build(
    mesh: Mesh,
    *,
    block: str = "surface",
    reference: Array | None = None,
    share: Array | None = None,
) -> Term:
    """Build the fairness of a block with the connectivity and spacing of `mesh`.

    Parameters
    ----------
    mesh : Mesh
        The surface.
    block : {"surface", "flat"}
        Block of the points.
    reference : ndarray, (n, dim), optional
        Points whose second differences are the target; the target is zero when not given.
    share : ndarray, (n,), optional
        Factor on the target at every vertex, 0 to 1; one when not given.

    Weights average over the edges on meshes with triangles. On quads they are 2 / (number of
    differences), so that the means of both directions add up.
    """
    stencil, coefficients = differences(mesh)
    dim = 2 if block == "flat" else 3
    wanted = np.zeros((dim, len(stencil)))
    if reference is not None:
        wanted = sum(
            c * reference.T[:, ids] for c, ids in zip(coefficients, stencil.T, strict=True)
        )
        if share is not None:
            wanted *= sum(share[ids] for ids in stencil.T) / stencil.shape[1]
    count = len(stencil) if mesh.has_triangles else len(stencil) / 2
    return Term(
        "fairness",
        residual,
        ((block, stencil),),
        weights=np.full(len(stencil), 1.0 / max(count, 1)),
        constants=np.concatenate([coefficients, wanted]),
        linear=True,
    )
