"""Metrics, terms and losses of a quantity call its one definition in :mod:`gso.geometry`."""

from __future__ import annotations

import numpy as np
import pytest

from gso import Mesh, energy, geometry, metrics, parametrization
from gso.mesh import vertex_normals
from gso.parametrization import patch
from tests.conftest import saddle

congruence, curvature, fairness, stretch = map(
    energy.registry().get, ("congruence", "curvature", "fairness", "stretch")
)

MESH = Mesh.from_grid(saddle(7))
FLAT = 1.1 * MESH.vertices[:, :2]


def fresh():
    """The same mesh, of which nothing has been computed yet."""
    return MESH.replaced(MESH.vertices)


def residual(terms, points):
    """All residuals of terms whose only block has vertices `points`."""
    out = []
    for term in terms:
        stencil = np.concatenate([index for _, index in term.stencil], axis=1)
        corners = [tuple(points[stencil[:, k]].T) for k in range(stencil.shape[1])]
        out += [np.ravel(r) for r in term.residual(corners, list(term.constants))]
    return np.concatenate(out)


#: Definition, and what must change when it changes.
USERS = {
    "gaussian_curvature": [
        lambda: metrics.curvature(MESH)[MESH.grid_index[1:-1, 1:-1]],
    ],
    "grid_curvature": [lambda: metrics.loss_gc(fresh()), lambda: metrics.loss_gc_worst(fresh())],
    "second_difference": [lambda: metrics.fairness(MESH)],
    "isometry_defect": [lambda: metrics.loss_iso_cell(MESH, FLAT)],
    "face_products": [
        lambda: metrics.isometry_energy(MESH, FLAT),
        lambda: residual(congruence.build(MESH, "flat"), FLAT),
    ],
    "rest_frame": [
        lambda: metrics.corner_strains(MESH, FLAT),
        lambda: np.concatenate([t.constants.ravel() for t in stretch.build(MESH)]),
    ],
    "doubled_areas": [lambda: metrics.area(MESH), lambda: metrics.area_error(MESH, FLAT)],
    "signed_areas": [lambda: metrics.area_error(MESH, FLAT)],
    "side_lengths": [
        lambda: parametrization.rectangle(MESH.grid),
        lambda: np.concatenate([fairness.build(MESH).constants.ravel()]),
    ],
    "unit_rectangle": [lambda: parametrization.rectangle(MESH.grid)],
    "corner_angles": [lambda: patch._angles(MESH)],
    "quad_area_vectors": [
        lambda: vertex_normals(MESH),
        lambda: stretch.corner_shares(MESH.vertices, MESH.faces),
    ],
    "quad_corner_vectors": [lambda: vertex_normals(MESH)],
}


def changed(value):
    """A quantity that is not the same any more."""
    if isinstance(value, tuple):
        return tuple(changed(v) for v in value)
    shift = np.linspace(0.1, 0.2, np.size(value)).reshape(np.shape(value))
    return 2.0 * value + shift


@pytest.mark.parametrize("name", USERS)
def test_users_follow_the_definition(name, monkeypatch):
    before = [np.asarray(user()) for user in USERS[name]]
    real = getattr(geometry, name)
    monkeypatch.setattr(geometry, name, lambda *a, **k: changed(real(*a, **k)))
    for user, was in zip(USERS[name], before, strict=True):
        assert not np.allclose(np.asarray(user()), was, equal_nan=True)


def test_the_curvature_term_is_made_of_the_definition():
    assert curvature.gaussian_curvature is geometry.gaussian_curvature
