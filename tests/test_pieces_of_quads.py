"""Pieces of fine quad designs within a distance: seams along edge rows."""

from __future__ import annotations

import numpy as np
import pytest

import gso
from gso import metrics
from gso.mesh import Mesh
from gso.seams import Segmentation


def dome(side: int, wide: float = 1.0) -> Mesh:
    x, y = np.meshgrid(np.linspace(-1, 1, side), wide * np.linspace(-1, 1, side), indexing="ij")
    return Mesh.from_grid(np.dstack([x, y, 0.6 * np.sqrt(2.6 + wide**2 - x * x - y * y)]))


@pytest.fixture(scope="module")
def design() -> Mesh:
    # Without symmetry: divisions of symmetric designs that are alike depend on the last bit.
    x, y = np.meshgrid(np.linspace(-1, 1, 34), np.linspace(-1, 1, 34), indexing="ij")
    height = 4.2 - (x - 0.15) ** 2 - 1.3 * (y + 0.1) ** 2 + 0.2 * x * y
    return Mesh.from_grid(np.dstack([x, y, 0.6 * np.sqrt(height)]))


@pytest.fixture(scope="module")
def found(design) -> Segmentation:
    return gso.pieces(design, max_deviation="2%", workers=0, effort="draft")


def test_seams_are_edges_of_the_design(design, found):
    assert found.usable and 1 < len(found) <= 3
    np.testing.assert_array_equal(found.design.faces, design.faces)
    ends = {tuple(sorted(edge)) for edge in design.edges.tolist()}
    assert {tuple(sorted(edge)) for edge in found.edges.tolist()} <= ends


def test_seams_have_few_corners(found):
    # Steps would turn by a right angle at every vertex.
    way = found.design.vertices[found.edges]
    way = np.abs(way[:, 1] - way[:, 0])
    along = way[:, :2].max(axis=1) > 3 * way[:, :2].min(axis=1)
    assert along.mean() > 0.9
    assert found.metrics["seam_turn"] < 12.0


def test_random_points_are_within_the_distance(design, found):
    rng = np.random.default_rng(3)
    for one, two in ((found.design, design), (design, found.design)):
        face, share = rng.integers(len(one.triangles), size=3000), rng.dirichlet(np.ones(3), 3000)
        points = np.einsum("nk,nkd->nd", share, one.vertices[one.triangles[face]])
        assert metrics.point_to_surface(points, two).max() <= 0.02 * design.diagonal
    assert found.metrics["strain_max"] <= 1e-3


def test_where_rows_are_no_good_seams_cross_faces():
    # The fair seams of a saddle run across the rows.
    y, x = np.mgrid[-1:1:33j, -1:1:33j]
    saddle = Mesh.from_grid(np.dstack([x, y, 0.35 * (x * x - y * y)]))
    out = gso.pieces(saddle, max_deviation="2.5%", workers=0, effort="draft")
    assert out.usable and out.design.is_triangles
    assert any("seams cross faces" in note for note in out.notes)


def test_symmetric_seams_follow_rows_of_symmetric_faces():
    mesh = dome(34, 1.3)
    out = gso.pieces(mesh, max_deviation="2.5%", symmetric=True, workers=0, effort="draft")
    assert out.usable
    if not len(out.edges):
        return
    middle = np.round(mesh.vertices[out.edges].mean(axis=1), 9) + 0.0
    assert not out.design.is_triangles
    own = set(map(tuple, middle.tolist()))
    mirrored = [
        set(map(tuple, (np.round(middle * turn, 9) + 0.0).tolist()))
        for turn in ([-1, 1, 1], [1, -1, 1])
    ]
    assert own in mirrored
