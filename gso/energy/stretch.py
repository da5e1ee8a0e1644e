"""Membrane strain of the flat image, corner triangle by corner triangle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gso import geometry
from gso.energy.base import Residual, Term, Vectors
from gso.geometry import ops
from gso.mesh import Mesh, topology
from gso.typing import Array, B, Ints, S, Vec

#: Rigid motions of the flat image change no strain.
INVARIANT = ("translation", "rotation")

_CORNERS = ((0, 1, 3), (1, 2, 0), (2, 3, 1), (3, 0, 2))
_ROOT2 = 2.0**0.5
#: Corners with a smaller ratio of doubled area to the sum of squared sides count as degenerate:
#: they have no usable rest frame.
FLAT_CORNER = 1e-6
#: Multiple of the knee beyond which the loss continues quadratically in the strain.
_STEEPEST = 1.3
#: Strain level above which the knee is lowered.
_LARGE_STRAIN = 0.03


def corners_of(size: int) -> tuple[tuple[int, int, int], ...]:
    """Return the corner triangles (corner, next, previous) of a face with 3 or 4 corners."""
    return _CORNERS if size == 4 else ((0, 1, 2),)


def _maps(points: Sequence[Vec[S]], constants: Sequence[S]) -> list[tuple[Vec[S], S, S]]:
    out = []
    for n, corner in enumerate(corners_of(len(points))):
        p, q, r = (points[k] for k in corner)
        m11, m12, m22 = constants[3 * n : 3 * n + 3]
        out.append(geometry.turn_and_shear(p, q, r, (m11, m12, m22)))
    return out


def residual(points: Sequence[Vec[S]], constants: Sequence[S]) -> Vec[S]:
    """Return ``sqrt(2) (Q - 1)`` of each corner triangle, then all sqrt(2) c, all sqrt(2) d.

    Half the sum of squares of a corner's three numbers is
    ``((s1 - 1)^2 + (s2 - 1)^2) / 2``. Constants: the three numbers of
    :func:`gso.geometry.rest_frame` per corner triangle.
    """
    maps = _maps(points, constants)
    return (
        *(_ROOT2 * (geometry.norm(turn) - 1.0) for turn, _, _ in maps),
        *(_ROOT2 * c for _, c, _ in maps),
        *(_ROOT2 * d for _, _, d in maps),
    )


def vectors(points: Sequence[Vec[S]], constants: Sequence[S]) -> tuple[Vec[S], ...]:
    """Return the plane vectors whose lengths are ``sqrt(2) Q``."""
    return tuple((_ROOT2 * q[0], _ROOT2 * q[1]) for q, _, _ in _maps(points, constants))


@dataclass(frozen=True)
class TwoPowerLoss:
    """Loss of a corner's strain s: a low power for the mean, a high power for the peaks.

    ``level^2 ((2/p) u^p + (2/q) knee^(p-q) u^q)`` with ``u = s / level``. A power `p` below two
    lowers the mean strain; the power `q` limits the largest strains. Far beyond the knee the
    loss continues quadratically, so that a few iterations reduce the peaks. On random surfaces
    mean, 99th percentile and maximum are lower than with the squared loss.

    Attributes
    ----------
    level : float
        Typical strain of the surface.
    p, q : float
        Powers of small and of large strains.
    knee : float
        Multiple of the level from which on the second power dominates; infinite without it.
    eps : float
        Smoothing of the first power, relative to `level`.
    """

    level: float
    p: float = 1.0
    q: float = 10.0
    knee: float = 2.2
    eps: float = 0.1

    @property
    def peak(self) -> float:
        """Factor on the second power."""
        peak: float = self.knee ** (self.p - self.q)
        return peak

    def _squares(self, r: B) -> tuple[B, B]:
        parts = r.reshape(3, -1, *r.shape[1:])
        return parts, 0.5 / self.level**2 * (parts * parts).sum(0)

    def of_squares(self, squares: B) -> tuple[B, B]:
        """Return the loss of mean squared strains ``((s1 - 1)^2 + (s2 - 1)^2) / 2``, and its slope.

        >>> loss, slope = TwoPowerLoss(0.01).of_squares(np.array([0.0, 1e-4]))
        >>> [round(float(x), 3) for x in slope]
        [10.0, 0.996]
        """
        y = squares / self.level**2
        e, half = self.eps**2, 0.5 * self.p
        root, rise, held = self._powers(y)
        value = (root - e**half) / half + rise * (2.0 / self.q * held + y - held)
        return self.level**2 * value, root / (y + e) + rise

    def _powers(self, y: B) -> tuple[B, B, B]:
        """Return the first power of y, the second one's slope, and y where that still grows."""
        held = ops.minimum(y, (_STEEPEST * self.knee) ** 2)
        rise = self.peak * ops.power(held, 0.5 * self.q - 1.0)
        return ops.power(y + self.eps**2, 0.5 * self.p), rise, held

    def value(self, r: B) -> B:
        """Return the loss of each corner."""
        return self.of_squares(self.level**2 * self._squares(r)[1])[0]

    def weights(self, r: B) -> tuple[B, B]:
        """Return the derivative, and the curvature without negative part and cross terms."""
        parts, y = self._squares(r)
        root, rise, held = self._powers(y)
        low = root / (y + self.eps**2)
        first = low + rise
        growth = (0.5 * self.p - 1.0) * low / (y + self.eps**2)
        rising = (0.5 * self.q - 1.0) * self.peak * ops.power(held, 0.5 * self.q - 2.0)
        growth = ops.maximum(growth + ops.where(y > held, 0.0, rising), 0.0) / self.level**2
        return (first * parts).reshape(*r.shape), (first + growth * parts**2).reshape(*r.shape)


def lowered(knee: float, level: B) -> B:
    """Return the knee of a :class:`TwoPowerLoss`, lower where the strain level is large.

    Large strains then cost more.

    >>> [round(float(lowered(2.0, np.float64(level))), 2) for level in (0.01, 0.06)]
    [2.0, 1.59]
    """
    return knee * ((_LARGE_STRAIN / level) ** (1 / 3)).clip(0.68, 1.0)


@dataclass(frozen=True)
class PowerLoss:
    """A power of a corner's strain s: ``scale^2 (2/q) (s / scale)^q``.

    With a high power the sum over the corners approaches the largest strain.

    Attributes
    ----------
    scale : float
        Strain at which the loss is as steep as the squared one.
    q : float
        The power, 2 or more.
    """

    scale: float
    q: float

    def _squares(self, r: B) -> tuple[B, B]:
        parts = r.reshape(3, -1, *r.shape[1:])
        return parts, 0.5 / self.scale**2 * (parts * parts).sum(0)

    def value(self, r: B) -> B:
        """Return the loss of each corner."""
        return self.scale**2 * 2.0 / self.q * self._squares(r)[1] ** (0.5 * self.q)

    def weights(self, r: B) -> tuple[B, B]:
        """Return the derivative, and the curvature without cross terms."""
        parts, y = self._squares(r)
        first = y ** (0.5 * self.q - 1.0)
        growth = (0.5 * self.q - 1.0) * y ** max(0.5 * self.q - 2.0, 0.0) / self.scale**2
        return (first * parts).reshape(*r.shape), (first + growth * parts**2).reshape(*r.shape)


def cells(mesh: Mesh) -> list[Ints]:
    """List the faces that must not be inverted in the plane, by size: (e, 4) and (e, 3).

    A quad with a corner without area, or with a concave corner, is split there into two
    triangles.
    """
    quads, triangles = topology.by_size(mesh.faces)
    if len(quads):
        share = corner_shares(mesh.vertices, quads)
        worst = share.argmin(axis=0)
        bad = share.min(axis=0) <= FLAT_CORNER
        turned = np.take_along_axis(quads[bad], (worst[bad, None] + np.arange(4)) % 4, axis=1)
        quads = quads[~bad]
        triangles = np.concatenate([triangles, turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])
    return [f for f in (quads, triangles) if len(f)]


def pieces(mesh: Mesh) -> list[Ints]:
    """List the :func:`cells` that carry strain: all but triangles without area."""
    out = []
    for faces in cells(mesh):
        if faces.shape[1] == 3:
            p, q, r = (mesh.vertices[faces[:, k]] for k in range(3))
            sides = ((q - p) ** 2).sum(axis=1) + ((r - p) ** 2).sum(axis=1)
            faces = faces[geometry.doubled_areas(mesh.vertices, faces) > FLAT_CORNER * sides]
        out.append(faces)
    return [f for f in out if len(f)]


def corner_shares(vertices: Array, quads: Ints) -> Array:
    """Return the doubled signed corner areas (4, e) of quads over the sums of squared sides.

    The sign is relative to the normal of the face.
    """
    normal = tuple(geometry.quad_area_vectors(vertices, quads).T)
    length = np.maximum(geometry.norm(normal), 1e-300)
    v = geometry.corners(vertices, quads)
    side2 = [geometry.norm2(geometry.sub(v[(k + 1) % 4], v[k])) for k in range(4)]
    return np.stack(
        [
            geometry.dot(tuple(corner), normal)
            / (length * np.maximum(side2[k] + side2[k - 1], 1e-300))
            for k, corner in enumerate(geometry.quad_corner_vectors(vertices, quads))
        ]
    )


def rest_constants(vertices: Array, faces: Ints) -> Array:
    """Return the rest frames of the corner triangles of faces, (12 or 3, e)."""
    points = [tuple(np.ascontiguousarray(vertices[faces[:, k]].T)) for k in range(faces.shape[1])]
    rows = [
        geometry.rest_frame(*(points[k] for k in corner)) for corner in corners_of(faces.shape[1])
    ]
    return np.stack([x for frame in rows for x in frame])


def per_corner(
    mesh: Mesh,
    name: str,
    residual: Residual,
    constants: Callable[[Array, Ints], Array],
    *,
    linear: bool = False,
    vectors: Vectors | None = None,
) -> list[Term]:
    """Build terms on the corner triangles of a flat image, averaged over the triangles.

    Parameters
    ----------
    mesh : Mesh
        The surface in space.
    name, residual, linear, vectors
        As for :class:`gso.energy.Term`.
    constants : callable
        Constants (c, e) of faces from the vertices in space and the faces.
    """
    groups = pieces(mesh)
    count = sum(len(corners_of(f.shape[1])) * len(f) for f in groups)
    return [
        Term(
            name,
            residual,
            (("flat", faces),),
            weights=np.full(len(faces), 1.0 / count),
            constants=constants(mesh.vertices, faces),
            linear=linear,
            vectors=vectors,
        )
        for faces in groups
    ]


def build(mesh: Mesh) -> list[Term]:
    """Build the strain of all corner triangles; weights average over triangles.

    With the squared loss the energy is the mean of ``((s1 - 1)^2 + (s2 - 1)^2) / 2``, the
    as-rigid-as-possible energy of Liu et al. 2008 with equal weights.
    """
    return per_corner(mesh, "strain", residual, rest_constants, vectors=vectors)
