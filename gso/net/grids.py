"""Quantities of batches of grids, (B, H, W, 3) tensors, by the package's one definition of each.

Inside they are component tuples of planes (B, H, W), on which :mod:`gso.geometry` works.
"""

from __future__ import annotations

from operator import add
from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn.functional import pad

from gso import geometry

Planes = tuple[Tensor, ...]

#: Shortest vector that is divided by: lengths of the unit ball are far above it.
_SHORTEST = 1e-12
#: Least length, in the unit ball, of mean directions that make axes, and of their difference.
_DISTINCT = 1e-5


def planes(points: Tensor) -> Planes:
    """Contiguous components, (B, H, W) each, of points (B, H, W, d)."""
    return tuple(points.movedim(-1, 0).contiguous())


def points(components: Planes) -> Tensor:
    """Points (B, H, W, d) of their components."""
    return torch.stack(components, dim=-1)


def ball(grids: Tensor) -> tuple[Tensor, Tensor]:
    """Centroids (B, 1, 1, 3) of grids (B, H, W, 3), and radii (B, 1, 1, 1) about them."""
    centre = grids.mean(dim=(1, 2), keepdim=True)
    far = (grids - centre).square().sum(dim=-1).amax(dim=(1, 2)).sqrt()
    return centre, far.clamp_min(_SHORTEST)[:, None, None, None]


def normalise(grids: Tensor) -> Tensor:
    """Grids (B, H, W, 3) moved and scaled to the unit ball, each by itself."""
    return normalise_with(grids)[0]


def normalise_with(grids: Tensor, *others: Tensor) -> tuple[Tensor, ...]:
    """The same, and others that lie to the results as they lay to the grids."""
    centre, radius = ball(grids)
    return tuple((x - centre) / radius for x in (grids, *others))


def axes(grids: Tensor) -> Tensor:
    """Rotations (B, 3, 3) whose columns are the axes that grids (B, H, W, 3) themselves give.

    x and y lie as near as two orthogonal vectors can to the mean directions of both families
    of grid lines, by linear regression; z is across both. The unit matrix where these
    directions are one, or none.

    >>> u, v = torch.meshgrid(torch.linspace(0, 1, 4), torch.linspace(0, 1, 5), indexing="ij")
    >>> axes(torch.stack([v, u, 0 * u], dim=-1)[None])[0].round() + 0.0
    tensor([[ 0.,  1.,  0.],
            [ 1.,  0.,  0.],
            [ 0.,  0., -1.]])
    """
    height, width = grids.shape[1:3]
    rows, columns = (
        torch.linspace(-1.0, 1.0, n, dtype=grids.dtype, device=grids.device)
        for n in (height, width)
    )
    slopes: list[Planes] = [
        tuple(torch.einsum("bhwi,h->ib", grids, rows) / (height * width)),
        tuple(torch.einsum("bhwi,w->ib", grids, columns) / (height * width)),
    ]
    along, across = (unit(slope) for slope in slopes)
    between = tuple(a + b for a, b in zip(along, across, strict=True))
    beside = geometry.sub(along, across)
    lengths = [geometry.norm(v) for v in (*slopes, between, beside)]
    least = torch.stack(lengths).amin(dim=0)
    between, beside = unit(between), unit(beside)
    x = tuple((a + b) * 0.5**0.5 for a, b in zip(between, beside, strict=True))
    y = tuple((a - b) * 0.5**0.5 for a, b in zip(between, beside, strict=True))
    found = torch.stack([points(v) for v in (x, y, geometry.cross(x, y))], dim=-1)
    none = torch.eye(3, dtype=grids.dtype, device=grids.device)
    return torch.where((least > _DISTINCT)[:, None, None], found, none)


def curvature(p: Planes) -> Tensor:
    """Gaussian curvature (B, H-2, W-2) of the interior vertices, 1 / length^2."""
    return geometry.grid_curvature(p)


def absolute_curvature(p: Planes) -> Tensor:
    r"""\|K\| (B, H-2, W-2) of the interior vertices, mean over both triangulations of the cells."""
    splits = range(len(geometry.GRID_RINGS))
    return sum(geometry.grid_curvature(p, k).abs() for k in splits) / len(splits)


def to_border(inner: Tensor) -> Tensor:
    """Values (B, H-2, W-2) of interior vertices, and of the nearest one on the border."""
    return pad(inner[:, None], (1, 1, 1, 1), mode="replicate")[:, 0]


def unit(v: Planes) -> Planes:
    """Vectors of length one; zero where there is none."""
    scale = 1.0 / geometry.norm(v).clamp_min(_SHORTEST)
    return tuple(c * scale for c in v)


def corners(p: Planes) -> tuple[Planes, Planes, Planes, Planes]:
    """The corners (i, j), (i+1, j), (i+1, j+1), (i, j+1) of all cells."""
    low, high = slice(None, -1), slice(1, None)
    where = ((low, low), (high, low), (high, high), (low, high))
    v0, v1, v2, v3 = (tuple(c[:, i, j] for c in p) for i, j in where)
    return v0, v1, v2, v3


def normals(p: Planes) -> Planes:
    """Area-weighted unit normals of the vertices, as :func:`gso.variables.vertex_normals`."""
    v0, v1, v2, v3 = corners(p)
    whole = geometry.cross(geometry.sub(v2, v0), geometry.sub(v3, v1))
    at = [
        geometry.cross(geometry.sub(b, a), geometry.sub(c, a))
        for a, b, c in ((v0, v1, v3), (v1, v2, v0), (v2, v3, v1), (v3, v0, v2))
    ]
    return unit(_gathered([tuple(map(add, whole, corner)) for corner in at]))


def split_normals(p: Planes) -> Planes:
    """The same of one triangulation, the published one: what the nets measure along."""
    v0, v1, v2, v3 = corners(p)
    diagonal = geometry.sub(v2, v0)
    lower = geometry.cross(geometry.sub(v1, v0), diagonal)
    upper = geometry.cross(diagonal, geometry.sub(v3, v0))
    whole = tuple(map(add, lower, upper))
    return unit(_gathered([whole, lower, whole, upper]))


def _gathered(at: list[Planes]) -> Planes:
    """Sums at the vertices of what the cells have at their four corners."""
    sides = ((0, 1, 0, 1), (0, 1, 1, 0), (1, 0, 1, 0), (1, 0, 0, 1))
    placed = [[pad(c, side) for c in corner] for corner, side in zip(at, sides, strict=True)]
    return tuple(a + b + c + d for a, b, c, d in zip(*placed, strict=True))


def _slopes(x: Tensor, *axes: int) -> list[Tensor]:
    """Derivatives along axes whose ends are one apart."""
    spacing = [1.0 / (x.shape[axis] - 1) for axis in axes]
    return list(torch.gradient(x, dim=axes, spacing=spacing))


def _bend(x: Tensor, axis: int) -> Tensor:
    """Second derivative along an axis; at the ends that of their neighbours."""
    n = x.shape[axis]
    inner = torch.diff(x, n=2, dim=axis) * (n - 1) ** 2
    first, last = inner.narrow(axis, 0, 1), inner.narrow(axis, n - 3, 1)
    return torch.cat([first, inner, last], dim=axis)


class Frame(NamedTuple):
    """Derivatives of grids by their parameters in [0, 1]^2, and vectors to measure along.

    `along` and `across` are unit tangents of the grid lines, `normal` the unit normal: they
    turn with the surface, so that what is measured along them does not depend on its pose.
    """

    du: Planes
    dv: Planes
    along: Planes
    across: Planes
    normal: Planes

    @classmethod
    def of(cls, p: Planes) -> Frame:
        """Frame of grids."""
        du, dv = (d.unbind() for d in _slopes(torch.stack(p), -2, -1))
        return cls(du, dv, unit(du), unit(dv), split_normals(p))

    def combine(self, shares: Tensor) -> Tensor:
        """Vectors (B, H, W, 3) with shares (B, 3, H, W) of normal, along and across."""
        n, a, b = shares.unbind(1)
        axes = zip(self.normal, self.along, self.across, strict=True)
        return points(tuple(n * x + a * y + b * z for x, y, z in axes))


def first_form(frame: Frame) -> Planes:
    """Logarithms of the parameter lines' lengths, and the cosine between them."""
    lengths = [geometry.norm(d).clamp_min(1e-6).log() for d in (frame.du, frame.dv)]
    return (*lengths, geometry.dot(frame.along, frame.across))


def normal_curvatures(p: Planes, frame: Frame) -> Tensor:
    """Curvature along both parameter lines, and the twist between them, (3, B, H, W)."""
    x = torch.stack(p)
    (twist,) = _slopes(torch.stack(frame.du), -1)
    bends = torch.stack([_bend(x, -2), _bend(x, -1), twist], dim=1)
    u, v = (geometry.norm(d).clamp_min(1e-6) for d in (frame.du, frame.dv))
    shares = geometry.dot(bends.unbind(), frame.normal)
    return shares / torch.stack([u * u, v * v, u * v])


def side_lengths(p: Planes) -> tuple[Tensor, Tensor]:
    """Mean polyline lengths (B,) along both grid directions."""
    return tuple(
        geometry.norm(tuple(torch.diff(c, dim=axis) for c in p)).sum(dim=axis).mean(dim=1)
        for axis in (1, 2)
    )


def rectangle(p: Planes) -> Tensor:
    """Flatten-init (B, H, W, 2): regular rectangles with the grids' mean side lengths.

    As :func:`gso.flat_start.rectangle`, but with the centre at the origin.
    """
    along, across = side_lengths(p)
    count, height, width = p[0].shape
    x, y = (
        torch.linspace(-0.5, 0.5, n, dtype=along.dtype, device=along.device)
        for n in (height, width)
    )
    rows = (along[:, None] * x)[:, :, None].expand(count, height, width)
    columns = (across[:, None] * y)[:, None, :].expand(count, height, width)
    return torch.stack([rows, columns], dim=-1)
