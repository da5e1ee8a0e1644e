"""Geometric quantities of batches of grids (B, H, W, 3), by the package's own definitions.

Internally, points are tuples of components ("planes") of shape (B, H, W), as
:mod:`gso.geometry` takes them.
"""

from __future__ import annotations

from operator import add

import torch
from torch import Tensor
from torch.nn.functional import pad

from gso import geometry
from gso.geometry import GridFrame

Planes = tuple[Tensor, ...]
Frame = GridFrame[Tensor]

#: Lower bound on lengths in denominators, far below the lengths of grids in the unit ball.
_SHORTEST = 1e-12
#: Smallest length, in the unit ball, of the mean directions that define axes, and smallest
#: norm of the sum and difference of their unit vectors.
_DISTINCT = 1e-5


def planes(points: Tensor) -> Planes:
    """Split points (B, H, W, d) into contiguous components, (B, H, W) each."""
    return tuple(points.movedim(-1, 0).contiguous())


def points(components: Planes) -> Tensor:
    """Stack components to points (B, H, W, d)."""
    return torch.stack(components, dim=-1)


def ball(grids: Tensor) -> tuple[Tensor, Tensor]:
    """Compute centroids (B, 1, 1, 3) and radii (B, 1, 1, 1) of grids (B, H, W, 3)."""
    centre = grids.mean(dim=(1, 2), keepdim=True)
    far = (grids - centre).square().sum(dim=-1).amax(dim=(1, 2)).sqrt()
    return centre, far.clamp_min(_SHORTEST)[:, None, None, None]


def normalise(grids: Tensor) -> Tensor:
    """Translate and scale grids (B, H, W, 3) to the unit ball, each independently."""
    return normalise_with(grids)[0]


def normalise_with(grids: Tensor, *others: Tensor) -> tuple[Tensor, ...]:
    """Normalise grids to the unit ball; `others` undergo the same similarity transform."""
    centre, radius = ball(grids)
    return tuple((x - centre) / radius for x in (grids, *others))


def axes(grids: Tensor) -> Tensor:
    """Compute rotations (B, 3, 3) whose columns are axes defined by grids (B, H, W, 3).

    The x and y axes are the orthogonal unit vectors closest to the mean directions of the two
    families of grid lines, which linear regression gives; z is their cross product. The result
    is the identity if these directions are parallel or undefined.

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
    along, across = (geometry.unit(slope) for slope in slopes)
    between = tuple(a + b for a, b in zip(along, across, strict=True))
    beside = geometry.sub(along, across)
    lengths = [geometry.norm(v) for v in (*slopes, between, beside)]
    least = torch.stack(lengths).amin(dim=0)
    between, beside = geometry.unit(between), geometry.unit(beside)
    x = tuple((a + b) * 0.5**0.5 for a, b in zip(between, beside, strict=True))
    y = tuple((a - b) * 0.5**0.5 for a, b in zip(between, beside, strict=True))
    found = torch.stack([points(v) for v in (x, y, geometry.cross(x, y))], dim=-1)
    none = torch.eye(3, dtype=grids.dtype, device=grids.device)
    return torch.where((least > _DISTINCT)[:, None, None], found, none)


def curvature(p: Planes) -> Tensor:
    """Compute the Gaussian curvature (B, H-2, W-2) of the interior vertices, 1 / length^2."""
    return geometry.grid_curvature(p)


def absolute_curvature(p: Planes) -> Tensor:
    r"""Compute \|K\| (B, H-2, W-2) of interior vertices, averaged over both triangulations."""
    both = [geometry.grid_curvature(p, k).abs() for k in range(len(geometry.GRID_RINGS))]
    return torch.stack(both).mean(0)


def to_border(inner: Tensor) -> Tensor:
    """Extend values (B, H-2, W-2) of interior vertices to the border by nearest neighbour."""
    return pad(inner[:, None], (1, 1, 1, 1), mode="replicate")[:, 0]


def normals(p: Planes) -> Planes:
    """Compute area-weighted unit vertex normals as :func:`gso.unknowns.vertex_normals` does."""
    v0, v1, v2, v3 = geometry.cell_corners(p)
    whole = geometry.cross(geometry.sub(v2, v0), geometry.sub(v3, v1))
    at = [
        geometry.cross(geometry.sub(b, a), geometry.sub(c, a))
        for a, b, c in ((v0, v1, v3), (v1, v2, v0), (v2, v3, v1), (v3, v0, v2))
    ]
    return geometry.unit(geometry.at_vertices([tuple(map(add, whole, corner)) for corner in at]))


def _bend(x: Tensor, axis: int) -> Tensor:
    """Compute the second derivative along an axis over [0, 1]; the ends copy their neighbours."""
    n = x.shape[axis]
    inner = torch.diff(x, n=2, dim=axis) * (n - 1) ** 2
    first, last = inner.narrow(axis, 0, 1), inner.narrow(axis, n - 3, 1)
    return torch.cat([first, inner, last], dim=axis)


def first_form(frame: Frame) -> Planes:
    """Compute the logarithms of the norms of du and dv, and the cosine of their angle."""
    lengths = [geometry.norm(d).clamp_min(1e-6).log() for d in (frame.du, frame.dv)]
    return (*lengths, geometry.dot(frame.along, frame.across))


def normal_curvatures(p: Planes, frame: Frame) -> Tensor:
    """Compute the normal curvatures of both parameter lines, and the twist, (3, B, H, W)."""
    x = torch.stack(p)
    twist = torch.stack([geometry.grid_slope(c, -1) for c in frame.du])
    bends = torch.stack([_bend(x, -2), _bend(x, -1), twist], dim=1)
    u, v = (geometry.norm(d).clamp_min(1e-6) for d in (frame.du, frame.dv))
    shares = geometry.dot(bends.unbind(), frame.normal)
    return shares / torch.stack([u * u, v * v, u * v])


def rectangle(p: Planes) -> Tensor:
    """Compute Flatten-init (B, H, W, 2): regular rectangles with the grids' mean side lengths.

    As :func:`gso.parametrization.rectangle`, but centred at the origin.
    """
    sides = torch.stack(geometry.side_lengths(p), dim=-1)
    unit = torch.as_tensor(geometry.unit_rectangle(*p[0].shape[1:]) - 0.5).to(sides)
    return unit * sides[:, None, None]
