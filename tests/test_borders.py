"""Borders, edges and symmetries of developable results, on the designs of bench/designs."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import gso
from gso import energy, metrics
from gso.mesh import vertex_normals
from tests.conftest import meshes, renumbered, rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "bench"))

import designs

elongation = energy.registry()["elongation"]

BALANCED = partial(gso.tno.optimize, options="balanced")
ACCURATE = partial(gso.tno.optimize, options="accurate")
ISOMETRY = partial(gso.tno.optimize, formulation="isometry")


def named(kind, *some: str) -> list:
    return [pytest.param(d, id=d.name) for d in kind(0) if not some or d.name in some]


def keeps_its_borders(design, solve) -> None:
    result = solve(design.mesh)
    loops = metrics.loop_ratios(design.mesh, result.mesh)
    assert loops.min() >= 0.85
    assert loops.max() <= 1.15
    assert metrics.edge_ratios(design.mesh, result.mesh).min() >= 0.3


@pytest.mark.parametrize("design", named(designs.holes))
def test_holes_and_edges_stay_open(design):
    keeps_its_borders(design, BALANCED)


@pytest.mark.parametrize("solve", [ACCURATE, ISOMETRY], ids=["accurate", "isometry"])
@pytest.mark.parametrize("design", named(designs.holes, "dome with an oculus"))
def test_free_vertices_do_not_close_an_oculus(design, solve):
    keeps_its_borders(design, solve)


@pytest.mark.parametrize("design", named(designs.symmetric))
def test_symmetric_designs_give_symmetric_results(design):
    first = gso.tno.optimize(design.mesh, verdict=False)
    # Holes are closed to first order, which depends a little on where their outlines begin.
    holes = len(design.mesh.boundary_loops) > 1
    assert design.asymmetry(first.mesh.vertices) < (1e-5 if holes else 1e-6)
    # Other solves, by isometry too, have more iterations, over which rounding grows.
    result = gso.tno.optimize(design.mesh)
    assert design.asymmetry(result.mesh.vertices) < 1e-4
    moved = np.linalg.norm(result.mesh.vertices - design.mesh.vertices, axis=1)
    assert moved.max() > 1e-3 * design.mesh.diagonal


def energy(term, points) -> float:
    """Sum of a term's weighted squares at points."""
    ((_, stencil),) = term.stencil
    corners = [tuple(points[stencil[:, k]].T) for k in range(2)]
    (r,) = term.residual(corners, list(term.constants))
    return float((r * r) @ term.weights)


@pytest.mark.parametrize("mesh", [pytest.param(m, id=k) for k, m in meshes().items()])
def test_elongation_is_free_between_its_bounds_and_grows_beyond(mesh):
    term = elongation.build(mesh)
    for factor in (elongation.BOUNDARY[0] + 0.01, 1.0, elongation.BOUNDARY[1] - 0.01):
        assert energy(term, factor * mesh.vertices) == 0.0
    shrunk = [energy(term, f * mesh.vertices) for f in (0.9, 0.4, 0.1, 0.01)]
    grown = [energy(term, f * mesh.vertices) for f in (1.1, 2.0, 4.0)]
    assert shrunk[0] > 0.0
    assert shrunk == sorted(shrunk)
    assert grown[0] > 0.0
    assert grown == sorted(grown)


def test_elongation_has_nothing_to_do_with_numbering():
    mesh = designs.irregular(0)[0].mesh
    copy, new = renumbered(mesh, 7)
    points = mesh.vertices * [0.5, 1.0, 1.3]
    other = np.empty_like(points)
    other[new] = points
    here, there = (energy(elongation.build(m), p) for m, p in ((mesh, points), (copy, other)))
    assert there == pytest.approx(here, rel=1e-12)


@pytest.mark.parametrize("design", named(designs.symmetric))
def test_normals_are_as_symmetric_as_the_surface(design):
    normals = vertex_normals(design.mesh)
    for symmetry in design.symmetries:
        turned = normals @ symmetry.motion.T
        sign = np.sign((normals[symmetry.image] * turned).sum(axis=1, keepdims=True))
        np.testing.assert_allclose(sign * normals[symmetry.image], turned, atol=1e-12)


@pytest.mark.parametrize("mesh", [pytest.param(m, id=k) for k, m in meshes().items()])
def test_normals_do_not_depend_on_numbering(mesh):
    copy, new = renumbered(mesh, 2)
    here, there = vertex_normals(mesh), vertex_normals(copy)[new]
    there *= np.sign((here[0] * there[0]).sum())
    np.testing.assert_allclose(there, here, atol=1e-12)


def test_ratios_and_folds_of_a_folded_sheet():
    sheet = gso.Mesh.from_grid(np.dstack([*np.mgrid[:5.0, :5.0], np.zeros((5, 5))]))
    folded = sheet.vertices.copy()
    beyond = folded[:, 0] > 2.0
    folded[beyond] = np.c_[np.full(beyond.sum(), 2.0), folded[beyond, 1], folded[beyond, 0] - 2.0]
    after = sheet.replaced(folded @ rotation(0).T)
    np.testing.assert_allclose(metrics.edge_ratios(sheet, after), 1.0)
    np.testing.assert_allclose(metrics.loop_ratios(sheet, after), [1.0])
    angles = metrics.dihedral_angles(after)
    assert np.count_nonzero(angles > 1e-6) == 4
    assert angles.max() == pytest.approx(90.0)


def test_results_say_what_became_of_their_borders():
    design = designs.holes(0)[0]
    found = gso.tno.optimize(design.mesh).metrics
    assert found["loop_ratio_min"] <= found["loop_ratio_max"]
    assert 0.0 < found["edge_ratio_min"] <= 1.01
    assert found["distance_max"] >= found["distance_mean"]
    assert found["fold_max_before"] > 0.0
