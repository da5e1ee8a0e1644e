"""Pieces of designs whose shape does not change: few, with short seams and no narrow necks."""

import numpy as np

import gso
from gso.mesh import Mesh


def torus(around, across):
    """Return a torus of radii 1 and 0.4 in triangles."""
    i, j = np.mgrid[:around, :across]
    u, v = 2 * np.pi * i / around, 2 * np.pi * j / across
    radius = 1.0 + 0.4 * np.cos(v)
    points = np.stack([radius * np.cos(u), radius * np.sin(u), 0.4 * np.sin(v)], axis=-1)
    a, b = i * across + j, (i + 1) % around * across + j
    c = (i + 1) % around * across + (j + 1) % across
    d = i * across + (j + 1) % across
    faces = np.concatenate([np.stack(x, axis=-1).reshape(-1, 3) for x in ((a, b, c), (a, c, d))])
    return Mesh(points.reshape(-1, 3), faces)


def bumpy_dome(count):
    """Return a dome with small bumps, whose vertices on top are sharp."""
    u, v = np.meshgrid(*[np.linspace(-1, 1, count)] * 2, indexing="ij")
    height = 0.5 - 0.25 * (u * u + v * v)
    height[count // 3, count // 3] += 0.06
    height[2 * count // 3, count // 2] -= 0.06
    return Mesh.from_grid(np.stack([u, v, height], axis=-1))


def judged(found, strain, seam):
    assert found.usable, [reason.text for reason in found.reasons]
    assert found.metrics["strain_max"] <= strain
    assert found.metrics["neck_share"] >= 0.08
    assert found.seam_length <= seam


def test_a_torus_is_cut_into_long_bands():
    found = gso.pieces(torus(40, 20), max_strain=0.03)
    judged(found, 0.03, 12.0)
    assert len(found) <= 8


def test_seams_pass_through_sharp_bumps():
    mesh = bumpy_dome(25)
    faces = mesh.triangles
    found = gso.pieces(Mesh(mesh.vertices, faces), max_strain=0.02)
    judged(found, 0.02, 6.0)
