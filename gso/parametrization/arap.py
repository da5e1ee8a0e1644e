"""As-rigid-as-possible relaxation: cheap iterations with one constant scalar matrix."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gso import geometry
from gso.linalg import spd
from gso.parametrization.orientation import orientation
from gso.typing import Array, Ints
from gso.unknowns import Layout


class Relaxed(NamedTuple):
    """A plane image and its root-mean-square strain."""

    flat: Array
    level: float


class _Gradients:
    """Gradients of functions on the triangles of a surface, as a complex matrix.

    With z = x + iy the image of the vertices, ``matrix @ z`` is twice the conformal part
    (rotation and scale) of each triangle's map (see :mod:`gso.geometry.strain`), and
    ``conjugate @ z`` twice its anticonformal part (shear).
    """

    def __init__(self, vertices: Array, triangles: Ints):
        from scipy.sparse import csr_matrix

        p, q, r = (tuple(vertices[triangles[:, k]].T) for k in range(3))
        m11, m12, m22 = geometry.rest_frame(p, q, r)
        to_q, to_r = m11 - 1j * m12, -1j * m22
        count = len(triangles)
        self.matrix = csr_matrix(
            (
                np.stack([-to_q - to_r, to_q, to_r], axis=1).ravel(),
                triangles.ravel(),
                3 * np.arange(count + 1),
            ),
            shape=(count, len(vertices)),
        )
        self.conjugate = self.matrix.conj()

    def energy(self, z: Array) -> tuple[float, Array, Array]:
        """Compute the mean of ``((s1 - 1)^2 + (s2 - 1)^2) / 2``, ``matrix @ z`` and its modulus."""
        turn, shear = self.matrix @ z, self.conjugate @ z
        size = np.abs(turn)
        both = (0.5 * size - 1.0) ** 2 + (0.5 * np.abs(shear)) ** 2
        return float(both.mean()), turn, size


def strain_level(vertices: Array, triangles: Ints, flat: Array) -> float:
    """Compute the root mean square of both principal strains of triangles mapped to the plane."""
    return float(_Gradients(vertices, triangles).energy(flat @ np.array([1.0, 1j]))[0] ** 0.5)


def relax(
    vertices: Array,
    triangles: Ints,
    flat: Array,
    *,
    oriented: Ints | None = None,
    iterations: int = 100,
    tolerance: float = 1e-3,
) -> Relaxed:
    """Lower the as-rigid-as-possible energy of a plane image by local and global steps.

    The local step finds the rotation closest to each triangle's map. The global step solves a
    linear system, with the same matrix in every iteration, for the image that fits the
    rotations best (Sorkine and Alexa 2007; Liu et al. 2008, section 4). All triangles have equal
    weight. A step ends before a triangle is inverted; the energy still decreases, as the global
    energy is convex along the step.

    Parameters
    ----------
    vertices, triangles : ndarray, (n, 3)
        The surface; its triangles must have an area. Vertices of no triangle do not move.
    flat : ndarray, (n, 2)
        The initial image.
    oriented : ndarray of int, (u, 3), optional
        Triangles that must not be inverted, if different from `triangles`.
    iterations, tolerance : int, float
        Largest number of iterations, and relative decrease of the energy at which to stop.
    """
    from scipy.sparse import identity

    gradients = _Gradients(vertices, triangles)
    m = gradients.matrix
    adjoint = m.conj().T.tocsr()
    laplacian = (adjoint @ m).real.tocsc()
    # Translations of each component are a null space; a little damping makes it regular.
    damping = 1e-9 * laplacian.diagonal().max()
    solve = spd(laplacian + damping * identity(len(vertices)))
    kept = triangles if oriented is None else oriented
    limit = orientation(kept, Layout((("flat", len(vertices), 2),)))
    z = np.ascontiguousarray(flat) @ np.array([1.0, 1j])
    energy, turn, size = gradients.energy(z)
    for _ in range(iterations):
        rotation = turn / np.maximum(size, 1e-300)
        pull = adjoint @ rotation - laplacian @ z
        step = solve(np.stack([pull.real, pull.imag], axis=1))
        z = z + limit(_pairs(z), step.ravel()) * (step @ np.array([1.0, 1j]))
        before = energy
        energy, turn, size = gradients.energy(z)
        if before - energy <= tolerance * before:
            break
    return Relaxed(_pairs(z).reshape(-1, 2), float(np.sqrt(energy)))


def _pairs(z: Array) -> Array:
    return np.ascontiguousarray(z).view(np.float64)
