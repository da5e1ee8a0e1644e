"""Placement of a final plane image by rigid motions, components side by side."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gso import geometry
from gso.mesh import Mesh
from gso.parametrization.embedding import parts
from gso.parametrization.rectangle import rectangle
from gso.typing import Array

#: Ratio of the principal variances above which an image has a long axis.
_OBLONG = 1.1
#: Gap between components, as a share of the largest width.
_GAP = 0.05


def place(mesh: Mesh, flat: Array, target: Array | None = None) -> Array:
    """Place the final image (n, 2) of a mesh by rigid motions.

    With a target, the image is moved as close to it as possible. Otherwise the corner of its
    bounding box is at the origin: grids are rotated like Flatten-init, and other meshes have
    their long axes along x and components side by side. Vertices of no face are put at the
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
    """Move an image rigidly, without reflection, as close as possible to a target (n, 2).

    >>> square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    >>> closest_motion(square @ np.array([[0.0, 1], [-1, 0]]) + 5, square).round(12) + 0.0
    array([[0., 0.],
           [1., 0.],
           [1., 1.],
           [0., 1.]])
    """
    turn, shift = geometry.closest_motion(flat, target)
    return np.asarray(flat @ turn.T + shift)


def upright(flat: Array) -> Array:
    """Rotate an image so that its long axis is along x and vertex numbers grow along x.

    If the image is about as wide as long, only the direction in which the vertex numbers grow
    is used.
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
    """Translate images into a row along x with gaps between them, each with lowest y = 0.

    The lower left corner of the first one's bounding box is at the origin.
    """
    gap = _GAP * max((float(np.ptp(p[:, 0])) for p in parts), default=0.0)
    out, left = [], 0.0
    for p in parts:
        out.append(p - p.min(axis=0) + np.array([left, 0.0]))
        left = float(out[-1][:, 0].max()) + gap
    return out


def _complex(p: Array) -> NDArray[np.complex128]:
    numbers: NDArray[np.complex128] = p @ np.array([1.0, 1j])
    return numbers


def _turned(p: Array, turn: complex) -> Array:
    size = abs(turn)
    if size == 0.0:
        return p
    z = _complex(p) * (turn / size)
    return np.stack([z.real, z.imag], axis=1)
