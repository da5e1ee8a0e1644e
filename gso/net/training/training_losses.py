"""The published losses (Wang et al. 2024), and further losses that equal metrics of results.

All use the package's own geometry, take grids (B, H, W, d) and return one number per surface,
(B,). None runs in less than single precision.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn.functional import pad

from gso import geometry
from gso.net.models import grid_geometry
from gso.net.models.grid_geometry import Planes, planes
from gso.net.training.solver_energy import LEAST_CURVATURE, Strain
from gso.tasks import flatten

#: Search radius for the nearest vertex, in steps along the grid.
_REACH = 2
#: Lower bound on a design's sum of squared second differences, for `fair_ratio`.
_LEAST_FAIR = 1e-4


def inside(result: Tensor, target: Tensor) -> Tensor:
    """Compute ``in``, the sum of the squared distances between vertices."""
    return (result - target).square().sum(dim=(1, 2, 3))


def fair(result: Tensor) -> Tensor:
    """Compute ``fair``, the sum of the squared second differences in both directions."""
    x = planes(result)
    total = torch.zeros(len(result), device=result.device)
    for axis in (1, 2):
        n = x[0].shape[axis] - 2
        triple = [tuple(c.narrow(axis, k, n) for c in x) for k in range(3)]
        total = total + geometry.norm2(geometry.second_difference(*triple)).sum(dim=(1, 2))
    return total


def fair_ratio(result: Tensor, design: Tensor) -> Tensor:
    """Compute ``fair_ratio``, the value of ``fair`` divided by that of the design.

    Not a published loss. It gives gently and strongly bent designs equal weight, except for
    those whose ``fair`` is below `_LEAST_FAIR`.
    """
    return fair(result) / fair(design).clamp_min(_LEAST_FAIR)


def gc(result: Tensor) -> Tensor:
    """Compute ``gc``, the mean absolute Gaussian curvature over both triangulations."""
    return grid_geometry.absolute_curvature(planes(result)).mean(dim=(1, 2))


def loss_gc(result: Tensor) -> Tensor:
    """Compute ``loss_gc``, the mean absolute Gaussian curvature in the published triangulation.

    It is the published loss. A net can lower it by crumpling cells along the other diagonals.
    """
    return grid_geometry.curvature(planes(result)).abs().mean(dim=(1, 2))


def k_left(result: Tensor, design: Tensor) -> Tensor:
    """Compute ``k_left``, the remaining fraction of the design's mean absolute curvature.

    This is 1 - K_A_r, averaged over both triangulations. Not a published loss. It gives curved
    and nearly flat designs equal weight, except for those flatter than `LEAST_CURVATURE`.
    """
    return gc(result) / gc(design).clamp_min(LEAST_CURVATURE)


def d_h(result: Tensor, design: Tensor) -> Tensor:
    """Compute ``d_h``, the mean distance to the nearest design vertex, percent of the diagonal.

    Not a published loss; the published ``in`` uses squares. The nearest vertex is searched
    within `_REACH` steps of the corresponding vertex; ``d_H`` is smaller if it is farther.
    """
    there, here = result.movedim(-1, 0), design.movedim(-1, 0)
    distance = geometry.norm(tuple(there - _nearest(there.detach(), here)))
    diagonal = geometry.norm(tuple(here.amax(dim=(2, 3)) - here.amin(dim=(2, 3))))
    percent: Tensor = 100.0 * distance.mean(dim=(1, 2)) / diagonal
    return percent


def _nearest(points: Tensor, vertices: Tensor) -> Tensor:
    """Find the vertex (3, B, H, W) nearest to each point, near the corresponding vertex."""
    h, w = vertices.shape[2:]
    framed = pad(vertices, (_REACH,) * 4, mode="replicate")
    best = vertices
    least = (points - vertices).square().sum(dim=0)
    for i in range(2 * _REACH + 1):
        for j in range(2 * _REACH + 1):
            other = framed[:, :, i : i + h, j : j + w]
            square = (points - other).square().sum(dim=0)
            best = torch.where(square < least, other, best)
            least = torch.minimum(square, least)
    return best


def iso(surface: Tensor, flat: Tensor, weights: Tensor | None = None) -> Tensor:
    """Compute ``iso``, the mean over cells of the squared isometry defect.

    With `weights` (B, H-1, W-1) of the cells it is the weighted sum (Eq. 13, for Net-W).
    """
    return _over_cells(_defects(surface, flat).square(), weights)


def iso_cell(surface: Tensor, flat: Tensor, weights: Tensor | None = None) -> Tensor:
    """Compute ``iso_cell``, the mean over cells of the isometry defect (``loss_iso-cell``).

    In the paper this is a metric of flat images, and only its squares are minimised.
    `weights` are those of :func:`iso`.
    """
    return _over_cells(_defects(surface, flat).abs(), weights)


def strain(surface: Tensor, flat: Tensor) -> Tensor:
    """Compute ``strain``, the mean of the larger principal strain (``strain_mean``)."""
    return Strain(surface, flatten.Options()).mean(flat)


def _defects(surface: Tensor, flat: Tensor) -> Tensor:
    """Compute the three parts of every cell's isometry defect, (3, B, H-1, W-1)."""
    (a, b), (a2, b2) = (
        geometry.diagonals(*geometry.cell_corners(planes(x))) for x in (surface, flat)
    )
    return torch.stack(geometry.isometry_defect(a, b, a2, b2))


def _over_cells(parts: Tensor, weights: Tensor | None) -> Tensor:
    cells = parts.sum(dim=0)
    return cells.mean(dim=(1, 2)) if weights is None else (weights * cells).sum(dim=(1, 2))


def iso_weights(surface: Tensor) -> Tensor:
    r"""Compute ``w_iso`` (B, H-1, W-1): one minus a cell's curvature over the largest one.

    The curvature of a cell is the mean of \|K\| over its corners at interior vertices.
    """
    p = planes(surface)
    k = grid_geometry.curvature(p).abs()
    ones = torch.ones_like(k)
    total, count = (
        torch.stack([c for (c,) in geometry.cell_corners((pad(x, (1, 1, 1, 1)),))]).sum(dim=0)
        for x in (k, ones)
    )
    mean = total / count.clamp_min(1.0)
    return 1.0 - mean / mean.amax(dim=(1, 2), keepdim=True).clamp_min(1e-12)


def normal_angles(clean: Planes, result: Planes) -> Tensor:
    """Compute the mean angle (B,) between the normals of the cells, in radians."""
    first, second = (
        geometry.cross(*geometry.diagonals(*geometry.cell_corners(p))) for p in (clean, result)
    )
    return geometry.angle(first, second).mean(dim=(1, 2))
