"""The developable loft: a strip of planar faces between two curves."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gso.errors import MeshError, OptionError
from gso.geometry.polygon import points_at
from gso.geometry.vectors import cross, lengths, unit
from gso.mesh import Mesh, Nearest
from gso.ruled.descent import planarised
from gso.ruled.diagonal_gap import planarity
from gso.ruled.fold_lines import folds
from gso.ruled.ruled_surface import RuledSurface
from gso.ruled.sheet import unrolled_pattern
from gso.ruled.strip_layout import Strips
from gso.ruled.system import System
from gso.ruled.unroll import Unrolled
from gso.ruled.untrimmed import Untrimmed
from gso.typing import Array, Ints

#: Points on each curve between which first rulings are found.
_COUNT = 129
#: Cost of moving one end of a ruling only, relative to that of a right angle between the planes.
_FAN = 1e-4
#: Newton steps, the weight of second differences in them, and the distance between the diagonals
#: of a quad, relative to the size, at which they end.
_STEPS, _SMOOTH, _PLANAR = 40, 10.0, 1e-14
#: Largest share of the distance between rulings that a step moves an end.
_REACH = 0.4


def loft(one: ArrayLike, other: ArrayLike, *, rulings: int = 33) -> RuledSurface:
    """Join two curves by a developable strip: each face between two rulings is planar.

    The ends of the rulings are on the curves, which are interpolated by cubic splines. First
    rulings are those along which both tangents are in one plane, found by a dynamic program
    [1]_. Then their ends slide along the curves until all faces are planar.

    Parameters
    ----------
    one, other : array_like, (n, 3), (m, 3)
        Points on the curves, both from the same end.
    rulings : int
        Number of rulings.

    Returns
    -------
    RuledSurface
        Its attribute `moved` has the points of both curves, moved to the nearest points of the
        strip. The distance that they are moved is that of the strip to the curves. Use it only
        if it is :attr:`~RuledSurface.sound`.

    Raises
    ------
    MeshError
        A curve has no four different points, or they are not finite.
    OptionError
        There are fewer than three rulings.

    References
    ----------
    .. [1] Wang, C. C. L. & Tang, K. (2005). Optimal boundary triangulations of an interpolating
       ruled surface. Journal of Computing and Information Science in Engineering, 5(4).

    Examples
    --------
    A strip between two circles of a cone is part of the cone.

    >>> import numpy as np
    >>> t = np.linspace(0.0, 1.0, 50)
    >>> circle = np.stack([np.cos(t), np.sin(t), 0.0 * t], axis=1)
    >>> strip = loft(circle, 2.0 * circle + [0.0, 0.0, 1.0])
    >>> strip.sound, len(strip.rulings.edges)
    (True, 31)
    """
    if rulings < 3:
        raise OptionError(f"rulings is {rulings}; it must be 3 or more")
    points = [_checked(x, name) for x, name in ((one, "one"), (other, "other"))]
    curves = [_Curve(x) for x in points]
    at = _with_cones(_slid(curves, _first(curves, rulings)))
    rows = []
    count, places = 0, []
    for curve, t in zip(curves, at.T, strict=True):
        distinct, which = np.unique(t, return_inverse=True)
        rows.append(count + which.ravel())
        places.append(curve.at(distinct))
        count += len(distinct)
    strips = Strips((np.stack(rows, axis=1),))
    # Only moves vertices off the curves where no strip of planar faces is between these.
    vertices = planarised(System(strips), np.concatenate(places))
    return _built(strips, vertices, np.concatenate(points))


class _Curve:
    """A cubic spline through points, with the parameter from 0 to 1 by the chords' lengths."""

    def __init__(self, points: Array):
        from scipy.interpolate import CubicSpline

        along = np.r_[0.0, np.cumsum(lengths(np.diff(points, axis=0)))]
        self._spline = CubicSpline(along / along[-1], points)

    def at(self, t: Array) -> Array:
        """Return points (k, 3)."""
        return np.asarray(self._spline(t))

    def tangent(self, t: Array) -> Array:
        """Return derivatives (k, 3)."""
        return np.asarray(self._spline(t, 1))


def _checked(curve: ArrayLike, name: str) -> Array:
    points = np.asarray(curve, np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise MeshError(
            f"curve `{name}` is an array {points.shape}; it must be finite points (n, 3)"
        )
    kept = np.r_[True, lengths(np.diff(points, axis=0)) > 0]
    if kept.sum() < 4:
        raise MeshError(f"curve `{name}` has {kept.sum()} different points; it needs 4 or more")
    return points[kept]


def _first(curves: list[_Curve], rulings: int) -> Array:
    """Find parameters (rulings, 2) of the ends of rulings by a dynamic program."""
    t = np.linspace(0.0, 1.0, _COUNT)
    (a, b), (u, v) = (
        [f(t) for f in fs] for fs in ([c.at for c in curves], [c.tangent for c in curves])
    )
    way = unit(b[None] - a[:, None])
    normals = unit(cross(u[:, None], way)), unit(cross(v[None], way))
    # Half of one minus the cosine: planes that face each other are the worst.
    price = 0.5 * (1.0 - np.einsum("ijd,ijd->ij", *normals))
    total = np.full((_COUNT, _COUNT), np.inf)
    choice = np.zeros((_COUNT, _COUNT), np.int64)
    total[0, 0] = price[0, 0]
    # Moves of both ends, of the first, and of the second; all states of a diagonal at once.
    moves = np.array([(1, 1), (1, 0), (0, 1)])
    extra = np.array([0.0, _FAN, _FAN])
    for sum_ in range(1, 2 * _COUNT - 1):
        i = np.arange(max(0, sum_ - _COUNT + 1), min(sum_, _COUNT - 1) + 1)
        j = sum_ - i
        costs = []
        for (di, dj), more in zip(moves.tolist(), extra, strict=True):
            inside = (i >= di) & (j >= dj)
            before = np.where(inside, total[np.maximum(i - di, 0), np.maximum(j - dj, 0)], np.inf)
            costs.append(before + more + 0.5 * (di + dj) * price[i, j])
        choice[i, j] = np.argmin(costs, axis=0)
        total[i, j] = np.min(costs, axis=0)
    path = [(_COUNT - 1, _COUNT - 1)]
    while path[-1] != (0, 0):
        row, column = path[-1]
        di, dj = moves[choice[row, column]].tolist()
        path.append((row - di, column - dj))
    ends = np.array(path[::-1]) / (_COUNT - 1.0)
    ends = np.array(path[::-1])
    # Runs of rulings with a common end at the beginning and at the end are cones: left out here.
    moving = np.flatnonzero((np.diff(ends, axis=0) > 0).all(axis=1))
    kept = ends[moving[0] : moving[-1] + 2] if moving.size else ends
    ends = kept / (_COUNT - 1.0)
    # Smoothed, and evenly spread by the mean of both parameters.
    padded = np.pad(ends, ((4, 4), (0, 0)), mode="reflect", reflect_type="odd")
    ends = np.stack([np.convolve(x, np.ones(9) / 9.0, mode="valid") for x in padded.T], axis=1)
    mean = ends.mean(axis=1)
    at = np.linspace(mean[0], mean[-1], rulings)
    return points_at(at, mean, ends)


def _slid(curves: list[_Curve], at: Array) -> Array:
    """Slide the ends (r, 2) of rulings along curves until the faces between them are planar.

    The first and the last ruling keep one end each, at an end of its curve.
    """
    first, last = at[0].argmin(), at[-1].argmax()
    for _ in range(4):
        start = at.copy()
        start[0, first], start[-1, last] = 0.0, 1.0
        found = _torsal(curves, start, (int(first), int(last)))
        # The other end must not leave its curve.
        short, long = found[0, 1 - first] < 0.0, found[-1, 1 - last] > 1.0
        if not (short or long):
            break
        first, last = (1 - first if short else first), (1 - last if long else last)
    return np.clip(found, 0.0, 1.0)


def _torsal(curves: list[_Curve], at: Array, held: tuple[int, int]) -> Array:
    """Make faces planar by Newton steps, each the smoothest one that solves the linear problem."""
    from scipy.sparse import bmat, csc_matrix, diags, identity
    from scipy.sparse.linalg import splu

    r = len(at)
    corners = Strips.sequence(r).corners
    free = np.setdiff1d(np.arange(2 * r), [held[0], 2 * r - 2 + held[1]])
    second = diags([1.0, -2.0, 1.0], [0, 2, 4], shape=(2 * r - 4, 2 * r))
    mass = (identity(2 * r) + _SMOOTH * r * (second.T @ second)).tocsc()[free][:, free]
    for _ in range(_STEPS):
        ends, tangent = (
            np.stack([f(t) for f, t in zip(fs, at.T, strict=True)], axis=1).reshape(-1, 3)
            for fs in ([c.at for c in curves], [c.tangent for c in curves])
        )
        value, slope = planarity(ends[corners])
        if np.abs(value).max() <= _PLANAR * np.ptp(ends, axis=0).max():
            break
        by = np.einsum("qcd,qcd->qc", slope, tangent[corners])
        rows = np.repeat(np.arange(r - 1), 4)
        jacobian = csc_matrix((by.ravel(), (rows, corners.ravel())), (r - 1, 2 * r))[:, free]
        weak = 1e-12 * float(np.abs(by).max()) ** 2
        matrix = bmat([[mass, jacobian.T], [jacobian, -weak * identity(r - 1)]], format="csc")
        step = np.zeros(2 * r)
        step[free] = splu(matrix).solve(np.r_[np.zeros(len(free)), -value])[: len(free)]
        closing = np.maximum(-np.diff(step.reshape(r, 2), axis=0), 1e-300)
        gap = np.maximum(np.diff(at, axis=0), 0.0)
        at = at + min(1.0, float((_REACH * gap / closing).min())) * step.reshape(r, 2)
    return at


def _with_cones(at: Array) -> Array:
    """Add rulings from the ends of the curves to what the first and the last one leave out."""
    step = np.abs(np.diff(at, axis=0)).mean()
    parts = [at]
    for row, corner in ((0, 0.0), (-1, 1.0)):
        gap = np.abs(at[row] - corner)
        if gap.max() > 1e-9:
            count = int(np.ceil(gap.max() / step))
            share = np.arange(1, count + 1)[:, None] / count
            more = at[row] + share * (corner - at[row])
            parts = [more[::-1], *parts] if row == 0 else [*parts, more]
    return np.concatenate(parts)


def _built(strips: Strips, vertices: Array, points: Array) -> RuledSurface:
    p, q, p1, q1 = vertices[strips.corners].transpose(1, 0, 2)
    up = unit(cross(q1 - p, q - p1))
    unrolled = Unrolled(strips, vertices, up)
    mesh = Mesh(vertices, _faces(strips.corners))
    owner: Ints = np.arange(len(mesh.faces))
    part = np.zeros(len(owner), np.int64)
    rulings, creases = folds(strips, vertices, unrolled, mesh, owner)
    return RuledSurface(
        mesh=mesh,
        strip=part,
        flat=np.zeros(len(owner), bool),
        rulings=rulings,
        creases=creases,
        pattern=unrolled_pattern(mesh, owner, part, unrolled),
        moved=Nearest.of(vertices, strips.divided(vertices)[0]).locate(points)[2],
        crossed=int(strips.tangled(vertices).sum()),
        untrimmed=Untrimmed(strips, vertices, owner),
    )


def _faces(corners: Ints) -> Ints:
    """Return the faces (f, 4) of corners, anticlockwise in the pattern; -1 ends a triangle."""
    faces = corners[:, [2, 3, 1, 0]]
    one, other = faces[:, 0] == faces[:, 3], faces[:, 1] == faces[:, 2]
    out: Ints = faces.copy()
    out[one, 3] = -1
    out[other] = np.column_stack([faces[other][:, [0, 1, 3]], np.full(other.sum(), -1)])
    return out
