"""Rulings and creases: edges along which planar faces meet, with angles and radii."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.geometry import chain_turns
from gso.geometry.vectors import lengths, unit
from gso.mesh import Mesh
from gso.mesh.topology import edge_keys
from gso.ruled.strip_layout import Strips
from gso.ruled.unroll import Unrolled
from gso.short_repr import short_repr
from gso.typing import Array, Ints


@dataclass(frozen=True)
class Folds:
    """Edges along which planar faces meet.

    Attributes
    ----------
    edges : ndarray of int, (r, 2)
        Their ends, as vertices of the mesh.
    angles : ndarray, (r,)
        Angles between the faces in radians: positive for mountain folds, which are convex on
        the outside of the surface, negative for valley folds.
    radii : ndarray, (r,)
        Radius of the bend that a fold stands for, at the end where it is smaller, in the
        mesh's unit; infinite where there is no fold.
    """

    edges: Ints
    angles: Array
    radii: Array

    __repr__ = short_repr

    @property
    def smallest_radius(self) -> float:
        """The smallest radius; infinite without folds."""
        return float(self.radii.min(initial=np.inf))

    @property
    def largest_angle(self) -> float:
        """The largest angle, regardless of its sign, in radians."""
        return float(np.abs(self.angles).max(initial=0.0))

    def turns(self, vertices: Array) -> Array:
        """Return the angles in radians by which chains of the edges turn where two of them meet.

        Parameters
        ----------
        vertices : ndarray, (n, 3)
            The mesh's vertices.
        """
        return chain_turns(self.edges, vertices)


def bend_radii(ends: Ints, widths: Array, angles: Array) -> Array:
    """Return the radii (r,) of bends, at the ends where they are smaller; infinite for flat ones.

    Where several rulings of a strip meet in a point, the sheet turns there by all of their angles,
    on the way from the ruling before them to the one after them.

    Parameters
    ----------
    ends : ndarray of int, (r, 2)
        Labels of the ends of rulings, equal where rulings of one strip meet.
    widths : ndarray, (r, 2)
        Mean distances of the ends from the rulings before and after; zero where these meet.
    angles : ndarray, (r,)
        In radians, with any sign.
    """
    _, at = np.unique(ends, return_inverse=True)
    width = np.bincount(at.ravel(), widths.ravel())
    turn = np.minimum(np.bincount(at.ravel(), np.repeat(np.abs(angles), 2)), np.pi)
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = (width / (2.0 * np.sin(0.5 * turn)))[at.reshape(-1, 2)].min(axis=1)
    radius[angles == 0.0] = np.inf
    return np.asarray(radius)


def folds(
    strips: Strips, vertices: Array, unrolled: Unrolled, mesh: Mesh, owner: Ints
) -> tuple[Folds, Folds]:
    """Return the rulings and the creases of trimmed strips, whose faces have `owner` before."""
    he = mesh.half_edges
    k = np.flatnonzero((he.twin >= 0) & (he.origin < he.dest))
    one, two = owner[he.face[k]], owner[he.face[he.twin[k]]]
    k, one, two = k[one != two], one[one != two], two[one != two]
    edges = np.stack([he.origin[k], he.dest[k]], axis=1)
    n = unrolled.normals
    sine = lengths(n[one] - n[two])
    angle = 2.0 * np.arcsin(np.clip(0.5 * sine, 0.0, 1.0))
    middle = vertices[strips.corners].mean(axis=1)
    away = middle[two] - middle[one]
    angle = np.where(np.einsum("kd,kd->k", n[two] - n[one], away) < 0, -angle, angle)
    width = 0.5 * sum(_widths(strips, vertices, mesh.vertices[edges], face) for face in (one, two))
    # Rulings of strips side by side share their ends, but not their bends.
    ends = strips.column[one][:, None] * len(mesh.vertices) + edges
    radius = np.zeros(len(edges))
    a, b, _ = strips.creases
    size = len(strips.corners)
    crease = np.isin(edge_keys(one, two, size), edge_keys(a, b, size))
    radius[~crease] = bend_radii(ends[~crease], np.asarray(width)[~crease], angle[~crease])
    rulings, creases = (Folds(edges[at], angle[at], radius[at]) for at in (~crease, crease))
    return rulings, creases


def _widths(strips: Strips, vertices: Array, ends: Array, face: Ints) -> Array:
    """Return the distances (r, 2) of the ends of rulings from the other ruling of a face."""
    p, q, p1, q1 = vertices[strips.corners[face]].transpose(1, 0, 2)
    found = []
    for a, b in ((p, q), (p1, q1)):
        way = unit(b - a)
        off = ends - a[:, None]
        off = off - np.einsum("red,rd->re", off, way)[:, :, None] * way[:, None]
        found.append(lengths(off))
    # The ruling itself is at no distance.
    own = found[0].max(axis=1) < found[1].max(axis=1)
    return np.where(own[:, None], found[1], found[0])
