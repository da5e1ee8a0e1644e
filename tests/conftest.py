"""Surfaces that many tests use."""

from __future__ import annotations

import os
from collections.abc import Iterable

import numpy as np
import pytest

from gso.dataset import generate
from gso.mesh import Mesh, topology
from gso.mesh.topology import reverse
from gso.verdict import Code, Reason

#: Whether every case of tests that have very many of one kind is wanted, not a sample of them.
EXHAUSTIVE = bool(os.environ.get("GSO_EXHAUSTIVE"))


def is_disk(mesh: Mesh) -> bool:
    """Whether a mesh is a disk: one component, one boundary loop, no handles."""
    return mesh.euler_characteristic == 1 and len(mesh.boundary_loops) == 1


def codes(reasons: Iterable[Reason]) -> list[Code]:
    """Codes of reasons, in their order."""
    return [reason.code for reason in reasons]


def saddle(height: int = 9, width: int | None = None, strength: float = 0.4) -> np.ndarray:
    """A smooth saddle over the square [-1, 1]^2, (height, width, 3)."""
    u, v = np.meshgrid(
        np.linspace(-1, 1, height), np.linspace(-1, 1, width or height), indexing="ij"
    )
    return np.stack([u, v, strength * (u * u - v * v + 0.3 * u * v)], axis=-1)


def rotation(seed: int) -> np.ndarray:
    """A random rotation (3, 3)."""
    turn = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
    return turn * np.sign(np.linalg.det(turn))


def cylinder(n: int = 33, turn: float = 0.4, radius: float = 0.8) -> np.ndarray:
    """A patch of a cylinder whose rulings cross the grid lines at an angle, (n, n, 3)."""
    u, v = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    s, t = u * np.cos(turn) - v * np.sin(turn), u * np.sin(turn) + v * np.cos(turn)
    return np.stack([radius * np.sin(s / radius), t, radius * np.cos(s / radius)], axis=-1)


def sphere_cap(n: int = 33, radius: float = 2.0) -> np.ndarray:
    """A cap of a sphere as a graph over the square, (n, n, 3)."""
    u, v = np.meshgrid(np.linspace(-0.5, 0.5, n), np.linspace(-0.5, 0.5, n), indexing="ij")
    return np.stack([u, v, np.sqrt(radius**2 - u * u - v * v)], axis=-1)


def shuffled(mesh: Mesh, seed: int = 0) -> Mesh:
    """The same quads with vertices and faces in random order."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(mesh.vertices))
    new = np.argsort(order)
    return Mesh(mesh.vertices[order], new[mesh.faces][rng.permutation(len(mesh.faces))])


def renumbered(mesh: Mesh, seed: int) -> tuple[Mesh, np.ndarray]:
    """The same mesh with vertices and faces in random order and other first corners.

    Returns
    -------
    mesh : Mesh
    new : ndarray of int, (n,)
        Number of each vertex now: ``copy.vertices[new]`` are the vertices of `mesh`.
    """
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(mesh.vertices))
    new = np.argsort(order)
    faces = mesh.faces[rng.permutation(len(mesh.faces))]
    size = np.where(topology.are_quads(faces), 4, 3)
    corner = np.arange(faces.shape[1])
    turn = rng.integers(0, 4, len(faces))
    pick = np.where(corner < size[:, None], (corner + turn[:, None]) % size[:, None], corner)
    turned = np.take_along_axis(faces, pick, axis=1)
    return Mesh(mesh.vertices[order], np.where(turned < 0, -1, new[turned])), new


def meshes() -> dict[str, Mesh]:
    """One mesh of every kind: grid, triangles, quads in disorder, quads with a pole."""
    grid = Mesh.from_grid(saddle(7, 6))
    pole = saddle(7, 6)
    pole[0] = pole[0].mean(axis=0)
    quads = Mesh(grid.vertices, reverse(grid.faces[1:]))
    return {
        "grid": grid,
        "triangles": Mesh(grid.vertices, grid.triangles),
        "quads": quads,
        "pole": Mesh.from_grid(pole),
    }


@pytest.fixture(scope="session")
def surfaces() -> list[np.ndarray]:
    """Four random Bezier surfaces at 32 x 32."""
    return [s.sample(32) for s in generate(4, seed=11)]
