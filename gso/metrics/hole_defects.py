"""Holonomy: turning angles of boundary loops, and what holes lack to close in the plane."""

from __future__ import annotations

import numpy as np

from gso import geometry
from gso.mesh import topology
from gso.metrics.surfaces import SurfaceLike, mesh_of
from gso.typing import Array


def turning(surface: SurfaceLike) -> Array:
    """Return the total turning angle (geodesic curvature) of every boundary loop, (l,), radians.

    It is the sum of pi minus the angles of the triangles at a vertex: 2 pi for the outline of a
    disk in the plane, -2 pi for a hole in it, zero for the end of a cylinder. The loops are those
    of ``Mesh.boundary_loops``.

    >>> square = np.dstack([*np.mgrid[:3.0, :3.0], np.zeros((3, 3))])
    >>> np.degrees(turning(square)).round(6)
    array([360.])
    """
    mesh = mesh_of(surface)
    loops = mesh.boundary_loops
    fans = topology.boundary_fans(mesh.triangle_edges, loops)
    centre, *ring = geometry.corners(mesh.vertices, fans)
    number = np.repeat(np.arange(len(loops)), [len(loop) for loop in loops])
    turns = np.pi - np.asarray(geometry.fan_angle(centre, ring))
    return np.bincount(number, turns, len(loops)).astype(float)


def hole_defects(surface: SurfaceLike) -> Array:
    """Return the angle defect of every inner outline, degrees, (h,).

    A loop around a hole closes in the plane if the outline of the hole turns by -2 pi. What it
    turns less is the holonomy of a loop around it: the defect is that of a cone whose tip is in
    the hole. The surface may be developable everywhere, and yet a flat pattern that is not cut at
    the hole strains if the defect is not zero (theorem of Gauss and Bonnet).

    Of every component the loop that turns most is the outer outline. A surface with one outline
    has no defect. Nor need that of a surface that is cut open at its holes be zero: take
    ``pattern.surface(mesh)``, whose cuts join outlines. So a tube, with 360 degrees, has none once
    it is cut open along a line.

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
    mesh = mesh_of(surface)
    if not mesh.boundary_loops:
        return np.zeros(0)
    turns = turning(mesh)
    part = mesh.components[[loop[0] for loop in mesh.boundary_loops]]
    order = np.lexsort((-turns, part))
    inner = np.ones(len(turns), bool)
    inner[order[np.unique(part[order], return_index=True)[1]]] = False
    return np.asarray(np.degrees(2.0 * np.pi + turns[inner]))
