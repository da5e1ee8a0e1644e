"""Parts of a design that are flat or developable as they are, between sharp edges."""

from __future__ import annotations

import numpy as np

from gso import metrics
from gso.geometry import doubled_areas
from gso.mesh import Mesh
from gso.mesh.topology import are_quads, label_components
from gso.quantities import Strain
from gso.recognition import recognise
from gso.typing import Flags

#: Angle in degrees from which on an edge is sharp.
_SHARP = 20.0
#: Shares of the area: of faces of a shape that end at smooth edges, too, and of kept parts.
_LARGE, _LEAST = 0.1, 0.02


def developable_parts(mesh: Mesh, max_strain: Strain = 1e-3) -> Flags:
    """Find the faces of a mesh that need not change, though others must.

    A design is divided along sharp edges, and around large flat, cylindrical and other developable
    faces. Parts of which every face is developable are kept.

    Parameters
    ----------
    mesh : Mesh
        No grid: its faces are divided into triangles in their order.
    max_strain : float or str
        Largest strain of a face that has no equation.

    Returns
    -------
    ndarray of bool, (m,)
        None or all of the faces where it cannot be divided.

    Examples
    --------
    >>> y, x = np.mgrid[-4.0:5, -4.0:13]
    >>> along = np.minimum(x, 4)
    >>> bump = (16 - along**2) * (16 - y * y) / 160
    >>> lid_and_wall = Mesh.from_grid(np.dstack([along, y, bump + along - x]))
    >>> kept = developable_parts(Mesh(lid_and_wall.vertices, lid_and_wall.triangles))
    >>> float(kept.mean())
    0.5
    """
    shape = recognise(mesh, max_strain=max_strain)
    face = np.repeat(np.arange(len(mesh.faces)), 1 + are_quads(mesh.faces))
    area = np.bincount(face, 0.5 * doubled_areas(mesh.vertices, mesh.triangles))
    owner = face[shape.source]
    kept, number = np.ones(len(mesh.faces), bool), np.zeros(len(mesh.faces), np.int64)
    kept[owner[~shape.developable]] = False
    number[owner] = shape.face
    total = np.bincount(number, area, len(shape.faces))
    large = np.array([face.flat is not None for face in shape.faces])
    large &= total >= _LARGE * area.sum()
    he = mesh.half_edges
    one, other = he.face[he.interior], he.face[he.twin[he.interior]]
    divided = (number[one] != number[other]) & (large[number[one]] | large[number[other]])
    joined = ~divided & (metrics.dihedral_angles(mesh) < _SHARP)
    patch = np.unique(
        label_components(len(mesh.faces), one[joined], other[joined]), return_inverse=True
    )[1].ravel()
    whole = np.bincount(patch, ~kept) == 0
    whole &= np.bincount(patch, area) >= _LEAST * area.sum()
    return np.asarray(whole[patch])
