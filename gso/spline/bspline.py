"""Tensor-product B-spline surfaces, as CAD systems represent them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gso import geometry
from gso.errors import MeshError, OptionError
from gso.short_repr import short_repr
from gso.typing import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

#: Default degree of the splines, in both directions.
DEGREE = 3

#: Orders (du, dv) of the derivatives that Gaussian curvature needs.
_ORDERS = ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


class Gap(NamedTuple):
    """Distances between a spline and a mesh, in the unit of their coordinates.

    `vertices`: from the mesh's vertices to the spline. `between`: from samples of the spline to
    the mesh's triangles.
    """

    vertices_mean: float
    vertices_max: float
    between_mean: float
    between_max: float


def clamped_knots(controls: int) -> Array:
    """Make uniform clamped knots on [0, 1]: the spline interpolates its end control points.

    The degree is three, or one less than the number of control points if that is smaller.

    >>> clamped_knots(6)
    array([0.  , 0.  , 0.  , 0.  , 0.33, 0.67, 1.  , 1.  , 1.  , 1.  ])
    """
    degree = min(DEGREE, controls - 1)
    inner = np.linspace(0.0, 1.0, controls - degree + 1)
    return np.asarray(np.r_[np.zeros(degree), inner, np.ones(degree)])


def basis_matrix(knots: Array, controls: int, t: Array) -> csr_matrix:
    """Evaluate the basis functions at parameters t: a sparse matrix (len(t), controls)."""
    from scipy.interpolate import BSpline

    return BSpline.design_matrix(t, knots, len(knots) - controls - 1).tocsr()


def basis(knots: Array, controls: int, t: Array, order: int = 0) -> Array:
    """Evaluate the basis functions at parameters t, or their derivatives: (len(t), controls)."""
    from scipy.interpolate import BSpline

    degree = len(knots) - controls - 1
    if order > degree:
        return np.zeros((len(t), controls))
    if order == 0:
        values: Array = basis_matrix(knots, controls, t).toarray()
    else:
        values = BSpline(knots, np.eye(controls), degree)(t, nu=order)
    return values


@dataclass(frozen=True, eq=False)
class BSplineSurface:
    """Tensor-product B-spline surface.

    Parameters
    ----------
    net : array_like, (n, m, 3)
        Control points, in any unit of length.
    knots_u, knots_v : array_like, (n + p + 1,), (m + q + 1,)
        Knots along the first and the second index of the net, clamped: the first p + 1 of
        `knots_u` are equal, and so are the last p + 1; the same holds for `knots_v` and q. The
        degrees p and q follow from the numbers of knots.
    gap : Gap, optional
        Distance from the mesh that it was fitted to.

    Raises
    ------
    MeshError
        Arrays of the wrong shape, numbers that are not finite, knots that decrease or are not
        clamped.

    Examples
    --------
    >>> net = np.stack([*np.meshgrid([0, 1, 2, 3], [0, 1, 2, 3], indexing="ij"),
    ...                 np.zeros((4, 4))], axis=-1)
    >>> spline = BSplineSurface(net, clamped_knots(4), clamped_knots(4))
    >>> spline.evaluate(0.5, 1.0)
    array([1.5, 3. , 0. ])
    >>> spline.sample(3, 5).shape
    (3, 5, 3)
    """

    net: Array
    knots_u: Array
    knots_v: Array
    gap: Gap | None = None

    __repr__ = short_repr

    def __post_init__(self) -> None:
        for name in ("net", "knots_u", "knots_v"):
            try:
                value = np.array(getattr(self, name), dtype=np.float64)
            except (TypeError, ValueError):
                raise MeshError(f"{name} of a spline must be an array of numbers") from None
            if not np.isfinite(value).all():
                raise MeshError(f"{name} of a spline has numbers that are not finite")
            value.flags.writeable = False
            object.__setattr__(self, name, value)
        if self.net.ndim != 3 or self.net.shape[2] != 3 or min(self.net.shape[:2]) < 2:
            raise MeshError(f"the control net is an array {self.net.shape}, not (n, m, 3)")
        for name, knots, count in zip(
            ("knots_u", "knots_v"), (self.knots_u, self.knots_v), self.net.shape, strict=False
        ):
            _check_knots(name, knots, count)

    @property
    def degrees(self) -> tuple[int, int]:
        """Polynomial degree along both directions."""
        n, m = self.net.shape[:2]
        return len(self.knots_u) - n - 1, len(self.knots_v) - m - 1

    @property
    def size(self) -> float:
        """Diagonal of the control net's bounding box, which contains the surface."""
        return geometry.box_diagonal(self.net.reshape(-1, 3))

    def evaluate(self, u: ArrayLike, v: ArrayLike, *, du: int = 0, dv: int = 0) -> Array:
        """Evaluate points of the surface, or derivatives.

        Parameters
        ----------
        u, v : array_like
            Parameters between the first and the last knot; they broadcast.
        du, dv : int
            Orders of the derivative with respect to u and v.

        Returns
        -------
        ndarray, (..., 3)

        Raises
        ------
        OptionError
            A parameter is outside the knots, `u` and `v` do not broadcast, or an order is not
            an integer of at least 0.
        """
        _check_count("du", du, 0)
        _check_count("dv", dv, 0)
        u, v = _parameter("u", u, self.knots_u), _parameter("v", v, self.knots_v)
        try:
            a, b = np.broadcast_arrays(u, v)
        except ValueError:
            raise OptionError(
                f"u is an array {u.shape} and v an array {v.shape}, which do not broadcast"
            ) from None
        n, m = self.net.shape[:2]
        rows = np.tensordot(basis(self.knots_u, n, a.ravel(), du), self.net, axes=1)
        points = np.einsum("pj,pjk->pk", basis(self.knots_v, m, b.ravel(), dv), rows)
        return np.asarray(points.reshape(*a.shape, 3))

    def sample(self, height: int, width: int) -> Array:
        """Sample points at uniform parameters, both ends included, (height, width, 3).

        Raises
        ------
        OptionError
            A number of points is not an integer of at least 1.
        """
        _check_count("height", height, 1)
        _check_count("width", width, 1)
        u, v = self.knots_u, self.knots_v
        return self._lattice(np.linspace(u[0], u[-1], height), np.linspace(v[0], v[-1], width))

    def normals(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Return unit normals (..., 3) along the cross product of the u and v derivatives.

        Zero where the parametrisation degenerates.
        """
        n = np.cross(self.evaluate(u, v, du=1), self.evaluate(u, v, dv=1))
        length = np.linalg.norm(n, axis=-1, keepdims=True)
        return np.asarray(np.divide(n, length, out=np.zeros_like(n), where=length > 0))

    def gaussian_curvature(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Return the Gaussian curvature of the smooth surface at parameters, 1 / length^2."""
        return _curvature([self.evaluate(u, v, du=i, dv=j) for i, j in _ORDERS])

    def mean_gaussian_curvature(self, per_span: int = 4) -> float:
        """Return the mean of |K|, the absolute Gaussian curvature, over the area, 1 / length^2.

        It is integrated by Gauss quadrature with `per_span` points in every knot interval and
        direction. The metric ``mean_abs_K`` of a mesh approximates it under refinement.

        Raises
        ------
        OptionError
            `per_span` is not an integer of at least 1.
        """
        _check_count("per_span", per_span, 1)
        (u, wu), (v, wv) = (_quadrature(k, per_span) for k in (self.knots_u, self.knots_v))
        d = [self._lattice(u, v, *order) for order in _ORDERS]
        area = np.linalg.norm(np.cross(d[0], d[1]), axis=-1) * wu[:, None] * wv
        total = float(area.sum())
        return float((np.abs(_curvature(d)) * area).sum()) / total if total > 0 else 0.0

    def arrays(self) -> dict[str, Array]:
        """Convert to arrays, from which :meth:`from_arrays` restores the surface."""
        out = {"spline_net": self.net, "knots_u": self.knots_u, "knots_v": self.knots_v}
        return out if self.gap is None else {**out, "spline_gap": np.array(self.gap)}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array]) -> BSplineSurface | None:
        """Restore a surface from the output of :meth:`arrays`; None if `arrays` has none."""
        if "spline_net" not in arrays:
            return None
        found = arrays.get("spline_gap")
        gap = None if found is None else Gap(*(float(f) for f in found))
        return cls(arrays["spline_net"], arrays["knots_u"], arrays["knots_v"], gap)

    def moved(self, scale: float, shift: ArrayLike = 0.0) -> BSplineSurface:
        """Copy the surface with every point multiplied by `scale`, then moved by `shift`."""
        gap = None if self.gap is None else Gap(*(scale * g for g in self.gap))
        net = self.net * scale + np.asarray(shift, dtype=np.float64)
        return BSplineSurface(net, self.knots_u, self.knots_v, gap)

    def _lattice(self, u: Array, v: Array, du: int = 0, dv: int = 0) -> Array:
        """Evaluate points or derivatives at all pairs of parameters, (len(u), len(v), 3)."""
        n, m = self.net.shape[:2]
        a, b = basis(self.knots_u, n, u, du), basis(self.knots_v, m, v, dv)
        return np.asarray(np.einsum("ia,jb,abk->ijk", a, b, self.net, optimize=True))


def _curvature(derivatives: list[Array]) -> Array:
    parts = [tuple(np.moveaxis(d, -1, 0)) for d in derivatives]
    return np.asarray(geometry.smooth_gaussian_curvature(*parts))


def _quadrature(knots: Array, per_span: int) -> tuple[Array, Array]:
    """Return the Gauss points and weights of all knot intervals."""
    ends = np.unique(knots)
    points, weights = np.polynomial.legendre.leggauss(per_span)
    half = 0.5 * np.diff(ends)[:, None]
    at = ends[:-1, None] + half * (1.0 + points)
    return at.ravel(), (half * weights).ravel()


def _parameter(name: str, given: ArrayLike, knots: Array) -> Array:
    try:
        t = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise OptionError(f"{name} must be a number or an array of numbers") from None
    if not ((t >= knots[0]) & (t <= knots[-1])).all():
        raise OptionError(f"{name} must be between {knots[0]:g} and {knots[-1]:g}")
    return t


def _check_count(name: str, given: int, least: int) -> None:
    if isinstance(given, bool) or not isinstance(given, int | np.integer) or given < least:
        raise OptionError(f"{name} is {given!r}; it must be an integer, {least} or more")


def _check_knots(name: str, knots: Array, count: int) -> None:
    degree = len(knots) - count - 1
    if knots.ndim != 1 or not 1 <= degree < count:
        raise MeshError(
            f"{name} has {knots.size} knots for {count} control points; it must have the "
            f"degree + 1 more, {count + DEGREE + 1} for a cubic spline"
        )
    _, times = np.unique(knots, return_counts=True)
    clamped = times[0] == times[-1] == degree + 1 and (times[1:-1] <= degree).all()
    if (np.diff(knots) < 0).any() or len(times) < 2 or not clamped:
        raise MeshError(
            f"{name} must rise; the first and the last are there {degree + 1} times each, others "
            f"{degree} times at most"
        )
