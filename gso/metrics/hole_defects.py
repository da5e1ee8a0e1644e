"""Turning angles of boundary loops, and what holes lack to close in the plane."""

from __future__ import annotations

import numpy as np

from gso import geometry
from gso.mesh import topology
from gso.metrics.surfaces import SurfaceLike, mesh_of
from gso.typing import Array, Ints


def turning(surface: SurfaceLike) -> Array:
    """Return the total turning angle (geodesic curvature) of every boundary loop, (l,), radians.

    It is the sum of pi minus the angles of the triangles at a vertex: 2 pi for the outline of a
    disk in the plane, -2 pi for a hole in it, zero for the end of a cylinder. The loops are those
    of ``Mesh.boundary_loops``.

    >>> square = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> np.degrees(turning(square)).round(6)
    array([360.])
    """
    return _unrolled(surface).defect - 2.0 * np.pi


def inner_outlines(surface: SurfaceLike) -> Ints:
    """Return the numbers of the boundary loops but the outer one of each component, (h,).

    The outer outline is the loop that turns most.
    """
    mesh = mesh_of(surface)
    if not mesh.boundary_loops:
        return np.empty(0, np.int64)
    part = mesh.components[[loop[0] for loop in mesh.boundary_loops]]
    order = np.lexsort((-turning(mesh), part))
    outer = order[np.unique(part[order], return_index=True)[1]]
    return np.setdiff1d(np.arange(len(part)), outer)


def hole_defects(surface: SurfaceLike) -> Array:
    """Return the angle defect of every inner outline, degrees, (h,).

    A loop around a hole closes in the plane if the outline of the hole turns by -2 pi. The
    difference is the holonomy of a loop around it, and the defect of a cone whose tip is in the
    hole. The surface may be developable everywhere, and yet a flat pattern that is not cut at the
    hole strains if the defect is not zero (theorem of Gauss and Bonnet).

    A surface with one outline has no defect. Nor need the defects of a surface that is cut open at
    its holes be zero: take ``pattern.surface(mesh)``, whose cuts join outlines. So a tube, with 360
    degrees, has none once it is cut open along a line.

    Parameters
    ----------
    surface : Mesh or array (H, W, 3)

    Examples
    --------
    A cone whose sides rise at 60 degrees, without its tip: half of the full angle is missing.

    >>> from gso import Mesh
    >>> a = np.linspace(0.0, 2.0 * np.pi, 201)[:-1]
    >>> rings = [np.stack([r * np.cos(a), r * np.sin(a), 0 * a - 3**0.5 * r]).T for r in (1, 2)]
    >>> k = np.arange(200)
    >>> faces = np.stack([k, 200 + k, 200 + (k + 1) % 200, (k + 1) % 200], axis=1)
    >>> hole_defects(Mesh(np.concatenate(rings), faces)).round(1)
    array([180.])
    """
    return np.asarray(np.degrees(_unrolled(surface).defect[inner_outlines(surface)]))


def hole_gaps(surface: SurfaceLike) -> Array:
    """Return the gap of every inner outline that is unrolled into the plane, % of its length, (h,).

    The lengths of its edges and the angles of the surface there are kept, but for an equal share of
    the defect (:func:`hole_defects`) at every vertex. Like a defect, a gap strains a flat pattern
    that is not cut at the hole.

    >>> square = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> hole_gaps(square).size
    0
    """
    mesh, inner = mesh_of(surface), inner_outlines(surface)
    around = [float(_edges(mesh.vertices[mesh.boundary_loops[k]]).sum()) for k in inner.tolist()]
    return np.asarray(100.0 * _unrolled(mesh).gap[inner] / np.array(around))


def holes(surface: SurfaceLike) -> dict[str, float]:
    """Return the largest defect and the largest gap, by metric name; none with one outline.

    >>> holes(np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))]))
    {}
    """
    defects = np.abs(hole_defects(surface))
    if not len(defects):
        return {}
    largest = {"hole_defect_max": defects.max(), "hole_gap_max": hole_gaps(surface).max()}
    return {name: float(value) for name, value in largest.items()}


def _unrolled(surface: SurfaceLike) -> geometry.Closing:
    """Unroll the boundary loops of a surface."""
    mesh = mesh_of(surface)
    loops = mesh.boundary_loops
    fans = topology.boundary_fans(mesh.triangle_edges, loops)
    centre, *ring = geometry.corners(mesh.vertices, fans)
    turn = np.pi - np.asarray(geometry.fan_angle(centre, ring))
    length = np.asarray(geometry.norm(geometry.sub(ring[0], centre)))
    number = np.repeat(np.arange(len(loops)), np.array([len(loop) for loop in loops], int))
    return geometry.closing(turn, length, number)


def _edges(points: Array) -> Array:
    """Return the lengths of the edges of a closed polygon (n, 3)."""
    return np.asarray(np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1))
