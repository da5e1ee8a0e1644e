"""A design as a function on its flat image, continued beyond the outline."""

from __future__ import annotations

from copy import copy
from functools import cached_property, partial
from typing import Any

import numpy as np

from gso.geometry.polygon import anticlockwise, signed_area
from gso.geometry.steady import steady
from gso.geometry.vectors import lengths, unit
from gso.mesh import Mesh, Nearest, vertex_normals
from gso.ruled.polygon import resampled, turning
from gso.typing import Array, Flags, Ints

#: Width of the continuation, relative to the length of the outline.
_MARGIN = 0.018
#: Turning angles that differ by less are the same.
_ALIKE = 1e-3
#: Largest number of points of a lattice around the outline, relative to those wanted inside.
_SPARSE = 16.0
#: Area of a slot, by the square of the margin, from which on rulings may cross it.
_SLOT = 1.0
#: Distances below this share of the margin are rounding errors.
_TINY = 1e-9


class Domain:
    """Positions and normals of a design as functions on the plane.

    Parameters
    ----------
    mesh : Mesh
        The design: a disk, possibly with holes.
    flat : ndarray, (n, 2)
        Its flat image, without inverted triangles.

    Attributes
    ----------
    normals : ndarray, (n, 3)
        Unit normals at the vertices.
    outline : ndarray of int
        Vertices of the outer boundary, anticlockwise in the plane, from its sharpest corner.
    margin : float
        Width of the continuation.
    """

    def __init__(self, mesh: Mesh, flat: Array):
        self.mesh, self.flat = mesh, flat
        self.normals = vertex_normals(mesh)
        self._nearest = Nearest.of(np.pad(flat, ((0, 0), (0, 1))), mesh.triangles)
        areas = [signed_area(flat[loop]) for loop in mesh.boundary_loops]
        largest = int(np.abs(areas).argmax())
        loop = mesh.boundary_loops[largest]
        loop = loop if areas[largest] > 0 else loop[::-1]
        self.outline: Ints = np.roll(loop, -_start(flat[loop]))
        way = np.roll(flat[loop], -1, axis=0) - flat[loop]
        self.margin = _MARGIN * float(lengths(way).sum())

    @cached_property
    def around(self) -> Array:
        """Outline (m, 2) in the plane, without narrow slots, which rulings may cross."""
        import shapely

        own = shapely.Polygon(self.flat[self.outline])
        if not own.is_valid:
            return self.flat[self.outline]
        # Mitred corners stay as they are; what is narrower than twice the margin is filled.
        wider = partial(shapely.buffer, distance=self.margin, join_style="mitre")
        narrower = partial(shapely.buffer, distance=-self.margin, join_style="mitre")
        filled = steady(narrower, steady(wider, own))
        more = shapely.get_parts(steady(shapely.difference, filled, own))
        slots = more[shapely.area(more) > _SLOT * self.margin**2]
        whole = steady(shapely.union_all, [own, *slots])
        if not len(slots) or whole.geom_type != "Polygon":
            return self.flat[self.outline]
        loop = np.asarray(shapely.normalize(whole).exterior.coords)[:-1]
        loop = anticlockwise(loop)
        return np.roll(loop, -_start(loop), axis=0)

    def encloses(self, places: Array) -> Flags:
        """Return which places (k, 2) of the plane are inside :attr:`around`."""
        import shapely

        return np.asarray(shapely.contains_xy(self._enclosed, places))

    @cached_property
    def _enclosed(self) -> Any:
        """The polygon of :attr:`around`, prepared for many points."""
        import shapely

        own = shapely.Polygon(self.around)
        shapely.prepare(own)
        return own

    def with_normals(self, normals: Array) -> Domain:
        """Return the same domain with other normals (n, 3) at the vertices."""
        other = copy(self)
        other.normals = normals
        return other

    def sample(self, values: Array, places: Array) -> tuple[Array, Array]:
        """Interpolate values (n, d) of the vertices at the nearest points to places (k, 2).

        Returns
        -------
        values : ndarray, (k, d)
        feet : ndarray, (k, 2)
            The nearest points of the flat image.
        """
        triangle, shares, feet = self._nearest.locate(np.pad(places, ((0, 0), (0, 1))))
        found = np.einsum("kj,kjd->kd", shares, values[self.mesh.triangles[triangle]])
        return found, feet[:, :2]

    def lattice(self, count: int) -> Array:
        """Return about `count` points (k, 3) of the design, evenly spread, and its outline.

        They are a square lattice on the flat image, and points on the outline at the same
        distance from each other, its sharp corners among them.
        """
        # The axes do not depend on how the flat image is turned.
        loop = self.flat[self.outline]
        x, y = unit(loop[0] - loop.mean(axis=0))
        frame = np.array([[x, -y], [y, x]])
        turned = self.flat @ frame
        low, high = turned.min(axis=0), turned.max(axis=0)
        area = abs(signed_area(self.flat[self.outline]))
        box = high - low
        # Of a sliver, the lattice is coarser.
        least = max(np.sqrt(box.prod() / (_SPARSE * count)), box.max() / count)
        step = max(float(np.sqrt(area / count)), float(least))
        axes = [np.arange(a + 0.5 * step, b, step) for a, b in zip(low, high, strict=True)]
        places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2) @ frame.T
        points, feet = self.sample(self.mesh.vertices, places)
        inside = np.linalg.norm(feet - places, axis=1) < _TINY * self.margin
        around = float(lengths(np.roll(loop, -1, axis=0) - loop).sum())
        on, _ = resampled(loop, min(max(int(around / step), 8), 4 * count))
        return np.concatenate([points[inside], self.sample(self.mesh.vertices, on)[0]])

    def points(self, places: Array) -> Array:
        """Return positions (k, 3); beyond the outline by quadratic extrapolation.

        The parabola goes through the foot and two points at one and two margins behind it.
        """
        out, foot = self.sample(self.mesh.vertices, places)
        away = places - foot
        length = np.linalg.norm(away, axis=1, keepdims=True)
        beyond = np.flatnonzero(length > _TINY * self.margin)
        if beyond.size:
            back = away[beyond] / length[beyond] * self.margin
            x = length[beyond] / self.margin
            here = out[beyond]
            one, two = (
                self.sample(self.mesh.vertices, foot[beyond] - k * back)[0] for k in (1.0, 2.0)
            )
            slope, bend = 0.5 * (3.0 * here - 4.0 * one + two), 0.5 * (here - 2.0 * one + two)
            out[beyond] = here + x * slope + x * x * bend
        return out


def _start(loop: Array) -> int:
    """Return the number of the sharpest corner of a polygon, or of the farthest of several."""
    turn = turning(loop)
    far = lengths(loop - loop.mean(axis=0))
    return int(np.where(turn > turn.max() - _ALIKE, far, 0.0).argmax())
