"""The strain of a conformal flat image that keeps the lengths of its boundary, and of all cuts.

Let u be the logarithm of the image's scale. It solves ``Laplacian u = K`` with u = 0 on the
boundary, and among all conformal maps the one with constant scale on the boundary has the least
spread of u (Chebyshev's principle). The spread therefore estimates the strain of a piece before it
is flattened: for a strip of width w on a surface of curvature K it is ``K w^2 / 8``, and the least
strain of a flat strip is half of that. The solution is smooth even where K is noisy.

Sources: Sharp and Crane 2018, Variational surface cutting (the energy of u as a measure of a cut);
Springborn, Schroeder and Pinkall 2008, Conformal equivalence of triangle meshes.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix

from gso import geometry
from gso.linalg import spd
from gso.mesh import Mesh
from gso.mesh.topology import are_quads, corner_triangles
from gso.typing import Array, Flags, Ints

#: Angles below this, in radians, count as this large in the cotangent weights.
_SHARP = 1e-2


class Potential:
    """The Poisson problem of a mesh: stiffness, integrated curvature and areas.

    Quads count as the mean of both their triangulations.

    Parameters
    ----------
    mesh : Mesh

    Attributes
    ----------
    area : ndarray, (n,)
        Area of each vertex: a third of its triangles.
    curvature : ndarray, (n,)
        Angle defect of each vertex, in radians; not to be used on the boundary.
    stiffness : csr_matrix, (n, n)
        Cotangent weights: minus the integrated Laplacian.

    Examples
    --------
    >>> import numpy as np
    >>> u, v = np.mgrid[-0.2:0.2:9j, -0.2:0.2:9j]
    >>> ball = Mesh.from_grid(np.dstack([u, v, np.sqrt(1.0 - u**2 - v**2)]))
    >>> field = Potential(ball)
    >>> scale = field.solve(ball.half_edges.boundary_vertex)
    >>> bool(scale.min() < -0.01), bool(abs(scale.max()) < 1e-12)
    (True, True)
    """

    def __init__(self, mesh: Mesh):
        triangles = corner_triangles(mesh.faces)
        count = len(mesh.vertices)
        quads = 4 * int(are_quads(mesh.faces).sum())
        share = np.where(np.arange(len(triangles)) < quads, 0.5, 1.0)
        angles = geometry.corner_angles(mesh.vertices, triangles)
        turn = np.bincount(triangles.ravel(), (angles * share[:, None]).ravel(), count)
        self.curvature = np.where(mesh.used, 2.0 * np.pi - turn, 0.0)
        vectors = geometry.area_vectors(mesh.vertices, triangles)
        size = 0.5 * np.linalg.norm(vectors, axis=1) * share
        self.area = np.bincount(triangles.ravel(), np.repeat(size / 3.0, 3), count)
        weight = 0.5 * share[:, None] / np.tan(np.clip(angles, _SHARP, np.pi - _SHARP))
        a, b = np.roll(triangles, -1, axis=1).ravel(), np.roll(triangles, -2, axis=1).ravel()
        w = weight.ravel()
        rows, columns = np.r_[a, b, a, b], np.r_[b, a, a, b]
        self.stiffness = coo_matrix(
            (np.r_[-w, -w, w, w], (rows, columns)), shape=(count, count)
        ).tocsr()

    @property
    def mass(self) -> Array:
        """The areas (n,), raised where they are almost zero, so that they can be divided by."""
        return np.maximum(self.area, 1e-9 * float(self.area.mean()))

    def solve(self, fixed: Flags, within: Ints | None = None) -> Array:
        """Return u (n,), which is zero at fixed vertices.

        Every component needs a fixed vertex.

        Parameters
        ----------
        fixed : ndarray of bool, (n,)
            Vertices on the boundary and on cuts.
        within : ndarray of int, optional
            Vertices where u is wanted; every vertex next to them must be one of them or fixed.
        """
        out = np.zeros(len(self.area))
        free = np.flatnonzero(~fixed & (self.area > 0)) if within is None else within
        if within is not None:
            free = free[~fixed[free]]
        if free.size:
            own = self.stiffness[free][:, free]
            out[free] = -spd(own)(self.curvature[free])
        return out

    def smoothed(self, inner: Flags, edges: float = 3.0) -> Array:
        """Return the integrated curvature (n,) of some vertices (n,), diffused over some edges."""
        n = len(self.area)
        size = max(float(self.area.sum()) / max(int((self.area > 0).sum()), 1), 1e-300)
        mass = np.maximum(self.area, 1e-9 * size)
        step = 0.5 * edges**2 * size
        system = coo_matrix((mass, (np.arange(n), np.arange(n))), shape=(n, n)) + (
            step * self.stiffness
        )
        return np.asarray(mass * spd(system)(np.where(inner, self.curvature, 0.0)))

    def strain(self, scale: Array, within: Ints | None = None) -> float:
        """Estimate the 99th percentile of the least strain of a flat image from its u (n,).

        Half the spread of u without the lowest and the highest half per cent of the area.
        """
        u = scale if within is None else scale[within]
        weight = self.area if within is None else self.area[within]
        order = np.argsort(u, kind="stable")
        level = np.cumsum(weight[order])
        if not level.size or not level[-1] > 0:
            return 0.0
        low, high = np.searchsorted(level, np.array([0.005, 0.995]) * level[-1])
        return 0.5 * float(u[order[min(high, len(u) - 1)]] - u[order[low]])
