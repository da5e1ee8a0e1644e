"""Equations of the faces of a B-rep: planes, cylinders and cones, and torsal surfaces unrolled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.GeomAbs import GeomAbs_SurfaceType
from OCP.gp import gp_Ax1, gp_Pnt, gp_Vec
from OCP.TopAbs import TopAbs_Orientation
from OCP.TopoDS import TopoDS, TopoDS_Shape

from gso.geometry.vectors import unit
from gso.mesh import GivenSurface
from gso.typing import Array, Ints

_KINDS = {
    GeomAbs_SurfaceType.GeomAbs_Plane: "plane",
    GeomAbs_SurfaceType.GeomAbs_Cylinder: "cylinder",
    GeomAbs_SurfaceType.GeomAbs_Cone: "cone",
    GeomAbs_SurfaceType.GeomAbs_Sphere: "sphere",
    GeomAbs_SurfaceType.GeomAbs_Torus: "torus",
}
#: Distance from a straight line, relative to its length, and angle between normals along it, in
#: radians, up to which an isoparametric line is a ruling.
_STRAIGHT, _CONSTANT = 1e-8, 1e-5
#: Number of rulings that are tested and of those that are kept, points of each, and least
#: quotient of |x_u x x_v| and its largest value: less is an apex.
_TESTED, _KEPT, _POINTS, _APEX = 17, 257, 5, 1e-6
#: Points and weights of a quadrature on [0, 1], and the integrals of the interpolating polynomials
#: from 0 to each point.
_GAUSS = 6
_AT, _WEIGHT = (x / 2 for x in np.polynomial.legendre.leggauss(_GAUSS))
_AT = _AT + 0.5
_POWERS = np.arange(_GAUSS)
_INTEGRALS = (_AT[:, None] ** (_POWERS + 1) / (_POWERS + 1)) @ np.linalg.inv(
    _AT[:, None] ** _POWERS
)


def surface_of(shape: TopoDS_Shape, number: int, nodes: Array) -> tuple[GivenSurface, Array | None]:
    """Return the surface of a face; if it is unrolled here, its nodes in the plane, and normals.

    Parameters
    ----------
    shape : TopoDS_Shape
        A face.
    number : int
        Its number in the file.
    nodes : ndarray, (n, 2)
        Parameters of points on it.

    Notes
    -----
    In a torsal surface x(u, v) the lines of constant u (or v) are straight, and the normal is
    constant along each. Let c(u) be one of the other lines, r(u) the unit vector of the ruling, n
    the normal and t = n x r. In the plane the ruling turns by the integral of r' . t, and c is the
    integral of c' in that frame. Both are found by Gauss's quadrature between knots.
    """
    face = BRepAdaptor_Surface(TopoDS.Face(shape))
    kind = _KINDS.get(face.GetType(), "surface")
    name = f"face {number} ({kind})"
    if kind == "cylinder":
        surface = face.Cylinder()
        return GivenSurface(name, kind, _round(surface.Axis(), surface.Radius(), 0.0)), None
    if kind == "cone":
        cone = face.Cone()
        slope = float(np.tan(cone.SemiAngle()))
        return GivenSurface(name, kind, _round(cone.Axis(), cone.RefRadius(), slope)), None
    if kind == "surface":
        for swapped in (False, True):
            torsal = _Torsal(face, swapped)
            if torsal.is_torsal():
                inner = nodes[:, ::-1] if swapped else nodes
                flat, rulings = torsal.unrolled(inner)
                if shape.Orientation() == TopAbs_Orientation.TopAbs_REVERSED:
                    # It is seen from the other side.
                    flat, rulings = flat * [1, -1], rulings * [1, -1, 1, -1, 1, -1, 1, 1]
                image = np.concatenate([flat, torsal.normals(inner[:, 0])], axis=1)
                return GivenSurface(name, kind, rulings=rulings), image
    return GivenSurface(name, kind), None


def _round(axis: gp_Ax1, radius: float, slope: float) -> Array:
    place, way = axis.Location(), axis.Direction()
    sign = -1.0 if slope < 0 else 1.0
    along = sign * np.array([way.X(), way.Y(), way.Z()])
    return np.array([place.X(), place.Y(), place.Z(), *along, radius, abs(slope)])


@dataclass(frozen=True, eq=False)
class _Torsal:
    """A face as a surface x(u, v) whose lines of constant u may be rulings."""

    face: BRepAdaptor_Surface
    swapped: bool

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        f = self.face
        u = f.FirstUParameter(), f.LastUParameter()
        v = f.FirstVParameter(), f.LastVParameter()
        return (*v, *u) if self.swapped else (*u, *v)

    def at(self, u: Array, v: Array) -> Array:
        """Return x, x_u, x_v, x_uu, x_vv, x_uv at parameters (k,); (6, k, 3)."""
        out = np.empty((len(u), 6, 3))
        p, d = gp_Pnt(), [gp_Vec() for _ in range(5)]
        for k, (a, b) in enumerate(zip(u.tolist(), v.tolist(), strict=True)):
            self.face.D2(*((b, a) if self.swapped else (a, b)), p, *d)
            out[k] = [[w.X(), w.Y(), w.Z()] for w in (p, *d)]
        order = [0, 2, 1, 4, 3, 5] if self.swapped else list(range(6))
        return np.asarray(out.transpose(1, 0, 2)[order])

    def is_torsal(self) -> bool:
        """Whether lines of constant u are straight, and the normal is constant along each."""
        a, b, c, d = self.bounds
        if not np.isfinite([a, b, c, d]).all() or max(map(abs, (a, b, c, d))) > 1e50:
            return False
        u, v = np.linspace(a, b, _TESTED), np.linspace(c, d, _POINTS)
        grid = [x.ravel() for x in np.meshgrid(u, v, indexing="ij")]
        x, xu, xv = self.at(*grid)[:3].reshape(3, _TESTED, _POINTS, 3)
        way = x[:, -1] - x[:, 0]
        length = np.linalg.norm(way, axis=1)
        if length.min() <= _STRAIGHT * length.max():
            return False
        off = np.linalg.norm(np.cross(x - x[:, :1], (way / length[:, None])[:, None]), axis=2)
        if (off > _STRAIGHT * length[:, None]).any():
            return False
        normal = np.cross(xu, xv)
        size = np.linalg.norm(normal, axis=2)
        known = size > _APEX * size.max()
        normal = normal / np.where(known, size, 1.0)[..., None]
        turned = np.linalg.norm(np.cross(normal, normal[:, _POINTS // 2, None]), axis=2)
        return bool(known[:, _POINTS // 2].all() and (turned[known] <= _CONSTANT).all())

    def normals(self, u: Array) -> Array:
        """Return unit normals at u (k,)."""
        _, _, c, d = self.bounds
        _, xu, xv = self.at(u, np.full(len(u), (c + d) / 2))[:3]
        return unit(np.cross(xu, xv))

    def frame(self, u: Array) -> tuple[Array, ...]:
        """Return c, r, c' along r and t, and how fast r turns and the normal, at u (k,)."""
        _, _, c, d = self.bounds
        x, xu, xv, xuu, _, xuv = self.at(u, np.full(len(u), (c + d) / 2))
        length = np.linalg.norm(xv, axis=1)
        r, cross = xv / length[:, None], np.cross(xu, xv)
        n = unit(cross)
        t = np.cross(n, r)
        turn = np.einsum("kd,kd->k", xuv, t) / length
        # x_uu x x_v + x_u x x_uv is the derivative of the cross product.
        bent = np.einsum("kd,kd->k", np.cross(xuu, xv) + np.cross(xu, xuv), t)
        bent /= np.linalg.norm(cross, axis=1)
        along = np.stack([np.einsum("kd,kd->k", xu, e) for e in (r, t)], axis=1)
        return x, r, along, turn, bent

    def unrolled(self, nodes: Array) -> tuple[Array, Array]:
        """Return points (n, 2) of the plane for parameters, and the rulings."""
        a, b, c, d = self.bounds
        kept = np.linspace(a, b, _KEPT)
        u = np.unique(np.concatenate([kept, np.clip(nodes[:, 0], a, b), self._knots()]))
        step = np.diff(u)
        _, _, along, turn, bent = (
            value.reshape(len(step), _GAUSS, *value.shape[1:])
            for value in self.frame((u[:-1, None] + step[:, None] * _AT).ravel())
        )
        ahead = np.append(0.0, np.cumsum(step * (turn @ _WEIGHT)))
        angle = ahead[:-1, None] + step[:, None] * (turn @ _INTEGRALS.T)
        moved = (along @ [1, 1j]) * np.exp(1j * angle) @ _WEIGHT
        place = np.append(0.0, np.cumsum(step * moved))
        turned = np.append(0.0, np.cumsum(step * (np.abs(bent) @ _WEIGHT)))
        x, r, along, turn, bent = self.frame(u)

        def laid(which: Ints, points: Array) -> tuple[Array, Array]:
            reach = np.einsum("kd,kd->k", points - x[which], r[which])
            z = place[which] + reach * np.exp(1j * ahead[which])
            return np.stack([z.real, z.imag], axis=1), reach

        own = np.searchsorted(u, np.clip(nodes[:, 0], a, b))
        flat, _ = laid(own, self.at(nodes[:, 0], nodes[:, 1])[0])
        rows = np.searchsorted(u, kept)
        ends, radii = [], []
        for at in (c, d):
            point, reach = laid(rows, self.at(kept, np.full(_KEPT, at))[0])
            ends.append(point)
            across = along[rows, 1] + reach * turn[rows]
            with np.errstate(divide="ignore"):
                radii.append(np.abs(across) / np.abs(bent[rows]))
        convex = np.where(bent[rows] * along[rows, 1] >= 0, 1.0, -1.0)
        return flat, np.column_stack([*ends, turned[rows], convex, *radii])

    def _knots(self) -> Array:
        """Return the parameters at which derivatives may jump."""
        from OCP.collections import Array1_double
        from OCP.GeomAbs import GeomAbs_Shape

        count, ends = (
            (self.face.NbVIntervals, self.face.VIntervals)
            if self.swapped
            else (self.face.NbUIntervals, self.face.UIntervals)
        )
        number = count(GeomAbs_Shape.GeomAbs_C2)
        found = Array1_double(1, number + 1)
        ends(found, GeomAbs_Shape.GeomAbs_C2)
        return np.array([found.Value(k) for k in range(1, number + 2)])
