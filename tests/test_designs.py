"""The designs of bench/designs are what their names say."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "bench"))

import designs
from designs import KINDS

import gso
from gso import metrics
from tests.conftest import renumbered

SEEDS = (0, 1)


def valences(mesh) -> np.ndarray:
    """Edges at each interior vertex."""
    count = np.bincount(mesh.edges.ravel(), minlength=len(mesh.vertices))
    return count[~mesh.half_edges.boundary_vertex & mesh.used]


def by_name(kind: str, seed: int) -> list:
    return [pytest.param(d, id=f"{d.name}-{seed}") for d in KINDS[kind](seed)]


def every(*kinds: str) -> list:
    return [d for kind in kinds for seed in SEEDS for d in by_name(kind, seed)]


@pytest.mark.parametrize("design", every(*KINDS))
def test_meshes_come_in_whole_and_of_one_piece(design):
    mesh = design.mesh
    assert mesh.notes == ()
    assert len(np.unique(mesh.components)) == 1
    assert mesh.boundary_loops
    assert 800 <= len(mesh.faces) <= 3000
    edges = np.linalg.norm(np.diff(mesh.vertices[mesh.edges], axis=1), axis=-1)
    assert edges.min() > 0.1 * edges.mean()


@pytest.mark.parametrize("seed", SEEDS)
def test_ten_have_holes(seed):
    meshes = [d.mesh for d in designs.holes(seed)]
    assert len(meshes) == 10
    assert sorted(len(m.boundary_loops) for m in meshes) == [2, 2, 2, 2, 2, 3, 4, 5, 5, 10]
    assert sum(m.is_triangles for m in meshes) == 1


@pytest.mark.parametrize("seed", SEEDS)
def test_ten_quad_meshes_have_irregular_vertices(seed):
    meshes = [d.mesh for d in designs.irregular(seed)]
    assert len(meshes) == 10
    found = [set(np.unique(valences(m)).tolist()) for m in meshes]
    assert all(f - {4} for f in found)
    assert sum(3 in f for f in found) >= 6
    assert sum(5 in f for f in found) >= 2
    assert not any(m.has_triangles or m.grid_index is not None for m in meshes)


@pytest.mark.parametrize("design", every("planar"))
def test_planar_designs_have_planar_quads(design):
    assert metrics.nonplanarity(design.mesh).max() < 1e-9


@pytest.mark.parametrize("seed", SEEDS)
def test_some_planar_designs_are_irregular(seed):
    assert sum((valences(d.mesh) != 4).any() for d in designs.planar(seed)) == 2


@pytest.mark.parametrize("design", every("symmetric"))
def test_symmetric_designs_are_symmetric_to_rounding(design):
    mesh = design.mesh
    assert design.asymmetry() < 1e-14
    faces = np.unique(np.sort(mesh.faces, axis=1), axis=0)
    for symmetry in design.symmetries:
        assert np.array_equal(np.sort(symmetry.image), np.arange(len(mesh.vertices)))
        images = np.unique(np.sort(symmetry.image[mesh.faces], axis=1), axis=0)
        assert np.array_equal(faces, images)


@pytest.mark.parametrize("seed", SEEDS)
def test_one_triangulation_is_symmetric_of_some_of_them(seed):
    splits = {d.name: [s.splits for s in d.symmetries] for d in designs.symmetric(seed)}
    assert all(splits["four mirrors, triangles"])
    assert splits["diagonal mirror, grid"] == [True]
    assert splits["mirror, grid"] == [False]


@pytest.mark.parametrize("design", every("holes", "irregular"))
def test_renumbered_copies_are_the_same_mesh(design):
    copy, new = renumbered(design.mesh, 3)
    np.testing.assert_array_equal(copy.vertices[new], design.mesh.vertices)
    here, there = (
        np.unique(np.sort(f, axis=1), axis=0) for f in (new[design.mesh.faces], copy.faces)
    )
    assert np.array_equal(here, there)
    assert not np.array_equal(new, np.arange(len(new)))


@pytest.mark.parametrize("kind", KINDS)
def test_a_seed_gives_the_same_designs_again(kind):
    first, again, other = (KINDS[kind](seed) for seed in (5, 5, 6))
    assert all(np.array_equal(a.mesh.vertices, b.mesh.vertices) for a, b in zip(first, again))
    assert any(
        a.mesh.vertices.shape != b.mesh.vertices.shape
        or not np.allclose(a.mesh.vertices, b.mesh.vertices)
        for a, b in zip(first, other)
    )


@pytest.mark.slow
def test_isometry_is_no_worse_than_its_start():
    design = designs.holes(0)[6].mesh
    start = gso.tno.optimize(design)
    result = gso.tno.optimize(design, formulation="isometry")
    (strain, less), (curved, flatter) = (
        [r.details["verdict"]["strain_max"] for r in (start, result)],
        [metrics.loss_gc_worst(r.mesh, scale=1.0) for r in (start, result)],
    )
    assert flatter <= 1.5 * curved or less < 0.5 * strain


def test_noise_of_rounding_errors_changes_the_energy_of_results_little():
    (mesh,) = (d.mesh for d in KINDS["irregular"](0) if "inset" in d.name)
    noise = 1e-9 * mesh.size * np.random.default_rng(0).standard_normal(mesh.vertices.shape)
    copies = (mesh, mesh.replaced(mesh.vertices + noise))
    one, two = (sum(gso.tno.optimize(m, verdict=False).energy.values()) for m in copies)
    assert abs(one - two) < 3e-3 * one
