"""Designs that are symmetric as surfaces, whose vertices need not correspond: regions alike.

The plane is found by closest points. Regions of one half are mirrored to the other, and diffused
indicator functions become means of both halves, so that boundaries are symmetric wherever the
vertices are.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

from gso import geometry
from gso.errors import OptionError
from gso.geometry.plane import Plane
from gso.mesh import Mesh, Nearest
from gso.mesh.separation import centres
from gso.mesh.topology import label_components
from gso.seams.mirror_plane import directions
from gso.seams.regions import Regions, numbered
from gso.typing import Array, Flags, Ints
from gso.wording import percent

#: Largest distance of the mirrored design from itself over the diagonal, for this share of points.
_LARGEST, _QUANTILE = 0.01, 0.98
#: Number of faces whose centres are mirrored, and of steps that move the plane.
_POINTS, _STEPS = 2000, 8
#: How far points next to creases are moved into their faces.
_INSIDE = 0.05


def plane_of(mesh: Mesh) -> Plane:
    """Find the plane that maps a surface to itself.

    It begins at the centroid with the principal axes, the coordinate axes and their diagonals, and
    moves so that mirrored points come closest to the surface.

    Raises
    ------
    OptionError
        No plane does.

    Examples
    --------
    >>> y, x = np.mgrid[-1:1:20j, -2:2:33j]
    >>> arch = Mesh.from_grid(np.dstack([x, y, 0.1 * y - x * x]))
    >>> abs(plane_of(arch).normal).round(3).tolist()
    [1.0, 0.0, 0.0]
    """
    triangles = Mesh(mesh.vertices, mesh.triangles)
    area = np.linalg.norm(geometry.area_vectors(triangles.vertices, triangles.faces), axis=1)
    middle = centres(triangles)
    centroid = area @ middle / area.sum()
    root = np.sqrt(area / area.sum())[:, None]
    axes = np.linalg.eigh((root * (middle - centroid)).T @ (root * (middle - centroid)))[1]
    some = middle[:: max(len(middle) // _POINTS, 1)]
    near = Nearest(triangles)
    best, least = None, np.inf
    for normal in directions(axes):
        plane = Plane(normal, float(normal @ centroid))
        for _ in range(_STEPS):
            plane = _moved(plane, some, near.locate(plane.image(some))[2])
        away = float(np.quantile(near.distances(plane.image(some)), _QUANTILE))
        if away < least:
            best, least = plane, away
    if best is None or least > _LARGEST * mesh.diagonal:
        raise OptionError(
            "symmetric: no plane of symmetry was found; the best one misses the design by "
            f"{percent(least / mesh.diagonal)} of its diagonal, more than {percent(_LARGEST)}; "
            "leave symmetric out"
        )
    return best


def _moved(plane: Plane, points: Array, images: Array) -> Plane:
    """Return the plane that maps points to their images best."""
    x, y = points - points.mean(axis=0), images - images.mean(axis=0)
    both = x.T @ y
    normal = np.linalg.eigh(both + both.T)[1][:, 0]
    normal *= np.sign(normal @ plane.normal) or 1.0
    return Plane(normal, float(normal @ (points.mean(axis=0) + images.mean(axis=0)) / 2.0))


def symmetric_points(mesh: Mesh, points: Array, plane: Plane) -> Array:
    """Return points (n, 3) for a mesh, displaced by the mean of both halves."""
    moved = points - mesh.vertices
    face, share, _ = Nearest(mesh).locate(plane.image(mesh.vertices))
    image = plane.image_of_vectors(np.einsum("nk,nkd->nd", share, moved[mesh.faces[face]]))
    return np.asarray(mesh.vertices + 0.5 * (moved + image))


@dataclass(frozen=True, eq=False)
class Mirror:
    """A plane of symmetry of a mesh in regions.

    Attributes
    ----------
    regions : Regions
    plane : Plane
    """

    regions: Regions
    plane: Plane

    @cached_property
    def _half(self) -> Flags:
        """The faces on the positive side."""
        return self.plane.height(centres(self.regions.mesh)) >= 0.0

    @cached_property
    def _image(self) -> Ints:
        """The face of the other side that each face (m,) is mirrored to."""
        middle, half = centres(self.regions.mesh), self._half
        out = np.arange(len(middle))
        for side in (half, ~half):
            goal = np.flatnonzero(~side)
            if len(goal) and side.any():
                found = cKDTree(middle[goal]).query(self.plane.image(middle[side]))[1]
                out[side] = goal[found]
        return out

    @cached_property
    def _values(self) -> csr_matrix:
        """Take values at the vertices of the opened mesh to their mirror images (p, p)."""
        mesh, opened = self.regions.mesh, self.regions.opened.mesh
        corners, count = opened.faces, len(opened.vertices)
        # Next to a crease the point is inside a face of its own side.
        middle = np.repeat(centres(mesh), 3, axis=0)
        number = np.maximum(np.bincount(corners.ravel(), minlength=count), 1)
        inner = [np.bincount(corners.ravel(), x, count) / number for x in middle.T]
        points = (1.0 - _INSIDE) * opened.vertices + _INSIDE * np.stack(inner, axis=1)
        face, share, _ = Nearest(mesh).locate(self.plane.image(points))
        rows = np.repeat(np.arange(count), 3)
        return csr_matrix((share.ravel(), (rows, corners[face].ravel())), (count, count))

    def partners(self, label: Ints) -> Ints:
        """Return the region that each region (k,) is mirrored to: most of its area."""
        count = int(label.max()) + 1
        area = np.zeros((count, count))
        np.add.at(area, (label, label[self._image]), self.regions.face_area)
        return np.asarray(area.argmax(axis=1))

    def alike(self, label: Ints) -> Ints:
        """Mirror the regions of the positive side to the other (m,).

        A region goes on across the plane if it did so along most of its contact with it. Parts that
        are only connected on the other side become regions of their own.
        """
        he, half = self.regions.mesh.half_edges, self._half
        k = he.interior
        f, g = he.face[k], he.face[he.twin[k]]
        across, inside = half[f] & ~half[g], half[f] & half[g] & (label[f] == label[g])
        part = label_components(len(label), f[inside], g[inside])
        same = across & (label[f] == label[g])
        label = numbered(part)
        count = int(label.max()) + 1
        contact = np.bincount(label[f[across]], minlength=count)
        common = np.bincount(label[f[same]], minlength=count)
        own = 2 * common > contact
        image = label[self._image]
        return numbered(np.where(half, label, np.where(own[image], image, image + count)))

    def symmetric(self, fields: Array, partner: Ints) -> Array:
        """Return the means of fields (p, k) and their mirror images.

        Regions without a partner that is mirrored back to them keep theirs.
        """
        back = partner[partner] == np.arange(len(partner))
        mirrored = np.asarray(self._values @ fields)[:, partner]
        return np.where(back, 0.5 * (fields + mirrored), fields)
