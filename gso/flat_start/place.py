"""Where a finished plane image is put: turned, moved, parts side by side."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gso.flat_start.embed import parts
from gso.flat_start.grid import rectangle
from gso.mesh import Mesh

Array = NDArray[np.float64]

#: Ratio of the principal spreads above which an image counts as longer than wide.
_OBLONG = 1.1
#: Gap between parts, as a share of the widest.
_GAP = 0.05


def place(mesh: Mesh, flat: Array, target: Array | None = None) -> Array:
    """Finished image (n, 2) of a mesh where it is wanted.

    As close as possible to the target, if there is one. Otherwise, with the corner of its
    bounding box at the origin, turned like Flatten-init on grids and with the long axis
    along x on other meshes, components side by side. Vertices of no face are put at the
    origin.
    """
    components = parts(mesh)
    used = np.concatenate(components)
    out = np.zeros_like(flat)
    if target is not None:
        out[used] = closest_motion(flat[used], target[used])
    elif mesh.grid is not None:
        out = beside([closest_motion(flat, rectangle(mesh.grid).reshape(-1, 2))])[0]
    else:
        out[used] = np.concatenate(beside([upright(flat[ids]) for ids in components]))
    return out


def closest_motion(flat: Array, target: Array) -> Array:
    """The image turned and moved, not mirrored, as close as possible to a target (n, 2).

    Least squares over vertices (Procrustes); in the plane the angle has a closed form.

    >>> square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    >>> closest_motion(square @ np.array([[0.0, 1], [-1, 0]]) + 5, square).round(12) + 0.0
    array([[0., 0.],
           [1., 0.],
           [1., 1.],
           [0., 1.]])
    """
    p, q = flat - flat.mean(axis=0), target - target.mean(axis=0)
    turn = _complex(p).conj() @ _complex(q)
    return _turned(p, turn) + target.mean(axis=0)


def upright(flat: Array) -> Array:
    """The image with its long axis along x, vertices numbered from left to right on the whole.

    An image about as wide as long has no long axis to speak of: there the direction in
    which the vertex numbers grow runs along x.
    """
    p = flat - flat.mean(axis=0)
    z = _complex(p)
    number = np.arange(len(z)) - 0.5 * (len(z) - 1)
    forward = number @ z
    spread = z @ z
    total = (np.abs(z) ** 2).sum()
    # Principal variances are (total +- |spread|) / 2.
    oblong = total + abs(spread) > _OBLONG * (total - abs(spread))
    axis = complex(np.sqrt(spread) if oblong else forward)
    if oblong and (axis.conjugate() * forward).real < 0:
        axis = -axis
    return _turned(p, axis.conjugate())


def beside(parts: list[Array]) -> list[Array]:
    """Images moved into a row along x, a gap between them, each standing on y = 0.

    The first one's lower left corner (of its bounding box) is the origin.
    """
    gap = _GAP * max((float(np.ptp(p[:, 0])) for p in parts), default=0.0)
    out, left = [], 0.0
    for p in parts:
        out.append(p - p.min(axis=0) + np.array([left, 0.0]))
        left = float(out[-1][:, 0].max()) + gap
    return out


def _complex(p: Array) -> Array:
    return p @ np.array([1.0, 1j])


def _turned(p: Array, turn: complex) -> Array:
    size = abs(turn)
    if size == 0.0:
        return p
    z = _complex(p) * (turn / size)
    return np.stack([z.real, z.imag], axis=1)
