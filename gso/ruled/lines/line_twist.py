"""How far rulings across a family of lines are from conjugate to them.

Straight rulings straight across a strip twist with the surface. Conjugate ones do not, but where
lines hardly bend along the normal, as on a saddle along its straight lines, conjugate rulings run
along the strip and are of no use.
"""

from __future__ import annotations

import numpy as np

from gso.geometry.vectors import cross, lengths, unit
from gso.mesh import vertex_normals
from gso.ruled.lines.line_families import Family
from gso.typing import Array

#: Power of the mean over faces, as for sagittas.
_POWER = 4


def twist(family: Family) -> tuple[float, float]:
    """Return the curvature that rulings conjugate to the lines add, and the width of all rows.

    With the second fundamental form (L, M; M, N) along and straight across the lines, rulings
    conjugate to them have the normal curvature N - M^2 / L per squared width of the strip. The
    curvature added is the mean of M^2 / L, or of M where that is smaller, of fourth powers as for
    sagittas.

    Parameters
    ----------
    family : Family

    Returns
    -------
    curvature : float
    width : float
    """
    a, b = _steps(family, family.mesh.vertices)
    da, db = _steps(family, vertex_normals(family.mesh))
    length, area = lengths(a), lengths(cross(a, b))
    good = (length > 0) & (area > 0)
    a, b, da, db, length, area = (x[good] for x in (a, b, da, db, length, area))
    way = unit(a)
    slope = np.einsum("kd,kd->k", b, way)
    high = area / length
    aa = np.einsum("kd,kd->k", way, da) / length
    ab = np.einsum("kd,kd->k", way, db)
    # The mixed derivative straight across: that along b, less what is along the line.
    mixed = (ab - slope * aa) / high
    added = mixed**2 / np.maximum(np.maximum(np.abs(aa), np.abs(mixed)), 1e-300)
    curvature = float((area @ added**_POWER / area.sum()) ** (1.0 / _POWER))
    rows = int(family.row.max()) + 1
    return curvature, float(area.sum() / (length.sum() / rows))


def alignment(family: Family, directions: Array) -> float:
    """Return the mean cosine of the angles between lines and directions (m, 3) at the faces."""
    a, b = _steps(family, family.mesh.vertices)
    normal = cross(a, b)
    area, upright = lengths(normal), unit(normal)
    inside = directions - np.einsum("kd,kd->k", directions, upright)[:, None] * upright
    cosine = np.abs(np.einsum("kd,kd->k", unit(inside), unit(a)))
    # Where a direction is along the normal, no line follows it.
    weight = area * lengths(inside)
    return float(weight @ cosine / max(weight.sum(), 1e-300))


def _steps(family: Family, values: Array) -> tuple[Array, Array]:
    """Return the steps (m, d) of values (n, d) along the strips and across them, in each face."""
    faces = family.mesh.faces
    # The first edge of each face is along the strips.
    x = values[np.where(family.along[:, None] == 0, faces, np.roll(faces, -1, axis=1))]
    return 0.5 * (x[:, 1] + x[:, 2] - x[:, 0] - x[:, 3]), 0.5 * (
        x[:, 3] + x[:, 2] - x[:, 0] - x[:, 1]
    )
