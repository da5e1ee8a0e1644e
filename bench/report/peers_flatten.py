"""libigl's parametrizations on the inputs of the flatten task.

Their only parameter is a number of iterations. It is so large that more iterations do not change
the figures of the tables.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gso.mesh import Mesh
from report.method import Array, Method, Solved
from report.surfaces import Case

ARAP_ITERATIONS, SLIM_ITERATIONS = 100, 20


def harmonic(mesh: Mesh) -> tuple[Array, np.ndarray, Array]:
    """Return vertices, triangles, and their harmonic map to a circle, scaled to equal area."""
    import igl

    v, f = np.asarray(mesh.vertices), np.ascontiguousarray(mesh.triangles)
    rim = mesh.boundary_loops[0]
    return v, f, scaled(v, f, igl.harmonic(v, f, rim, igl.map_vertices_to_circle(v, rim), 1))


def scaled(vertices: Array, triangles: np.ndarray, flat: Array) -> Array:
    """Scale a flat image (n, 2) to the area of the surface."""
    e, g = (vertices[triangles[:, k]] - vertices[triangles[:, 0]] for k in (1, 2))
    a, b = (flat[triangles[:, k]] - flat[triangles[:, 0]] for k in (1, 2))
    area = np.linalg.norm(np.cross(e, g), axis=1).sum()
    return flat * np.sqrt(area / np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())


def arap(mesh: Mesh, iterations: int = ARAP_ITERATIONS) -> Array:
    """Compute an as-rigid-as-possible parametrization (Liu et al. 2008), (n, 2).

    It starts from a harmonic map.
    """
    import igl

    v, f, start = harmonic(mesh)
    solver = igl.ARAPData()
    solver.max_iter = iterations
    # One vertex is fixed, so that the pattern cannot drift.
    held = np.array([len(v) // 2], np.int32)
    start = np.ascontiguousarray(start)
    igl.arap_precomputation(v, f, 2, held, solver)
    flat = igl.arap_solve(np.ascontiguousarray(start[held]), solver, start)
    return np.asarray(flat)[:, :2]


def slim(mesh: Mesh, iterations: int = SLIM_ITERATIONS) -> Array:
    """Minimise the symmetric Dirichlet energy by SLIM (Rabinovich et al. 2017), (n, 2)."""
    import igl

    v, f, start = harmonic(mesh)
    energy = igl.MappingEnergyType.SYMMETRIC_DIRICHLET
    nobody, nowhere = np.empty(0, np.int32), np.empty((0, 2), order="F")
    arrays = map(np.asfortranarray, (v, f.astype(np.int32), start))
    data = igl.slim_precompute(*arrays, energy, nobody, nowhere, 0.0)
    return np.asarray(igl.slim_solve(data, iterations))[:, :2]


def lscm(mesh: Mesh) -> Array:
    """Compute a least-squares conformal map (Levy et al. 2002), (n, 2).

    Two boundary vertices that are far apart are fixed; the map is scaled to equal area.
    """
    import igl

    loop = mesh.boundary_loops[0]
    p = mesh.vertices[loop]
    far = int(np.linalg.norm(p - p[0], axis=1).argmax())
    pins = np.array([[0.0, 0.0], [np.linalg.norm(p[far] - p[0]), 0.0]])
    held = np.array([loop[0], loop[far]])
    v, f = mesh.vertices.copy(), mesh.triangles.copy()
    return scaled(v, f, igl.lscm(v, f, held, pins)[0])


def _peer(name: str, map_of: Callable[[Mesh], Array], note: str, pace: str = "fast") -> Method:
    def run(case: Case) -> Solved:
        flat = map_of(case.mesh)
        return Solved(flat.reshape(*case.given.shape[:2], 2))

    return Method(name, "flatten", run, peer=True, pace=pace, note=note)


METHODS = [
    _peer("libigl LSCM", lscm, "conformal, scaled to the surface's area"),
    _peer("libigl ARAP", arap, f"{ARAP_ITERATIONS} iterations"),
    _peer("libigl SLIM", slim, f"{SLIM_ITERATIONS} iterations", "slow"),
]
