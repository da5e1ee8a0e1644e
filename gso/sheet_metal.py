"""Solids of sheet metal: their thickness, and the faces of one side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gso.errors import MeshError
from gso.mesh import GivenSurfaces, Mesh
from gso.mesh.topology import edge_keys, label_components
from gso.recognition import Recognised, recognise
from gso.typing import Array, Flags, Ints

#: Thickness up to which a solid counts as a sheet, relative to the root of the area of one side,
#: and the share of its area that both sides have to have.
_THIN, _SIDES = 0.125, 0.5
#: How much the thickness may vary, relative to it: by equations, and where there is none.
_SAME, _ABOUT = 1e-3, 2e-2
#: Number of triangles of a face from which the opposite face is looked for, and of all faces.
_SAMPLES, _RAYS = 4, 4_000
#: Number of pairs of rays and triangles that are intersected at once.
_BLOCK = 2_000_000


@dataclass(frozen=True, eq=False)
class SheetSolid:
    """A solid of sheet metal.

    Attributes
    ----------
    side : Mesh
        The faces of one side, seen from outside.
    thickness : float
        In the unit of the mesh.
    """

    side: Mesh
    thickness: float


def sheet_solid(mesh: Mesh) -> SheetSolid | None:
    """Find the thickness of a solid, and the faces of one of its sides, the larger one.

    A face belongs to a side if the face opposite is at the same distance everywhere: two planes,
    or two coaxial cylinders or cones. The narrow faces between both sides are left out.

    Parameters
    ----------
    mesh : Mesh
        One component.

    Returns
    -------
    SheetSolid or None
        None if the mesh is open, or if the solid is no thin sheet: thicker than an eighth of the
        root of a side's area.

    Raises
    ------
    MeshError
        It is a thin sheet whose thickness is not the same everywhere, or that has faces which are
        curved in two directions. The message has the place.

    Examples
    --------
    A plate of 60 x 40 x 2:

    >>> box = [[x, y, z] for z in (0, 2) for x, y in ((0, 0), (60, 0), (60, 40), (0, 40))]
    >>> around = [[k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4] for k in range(4)]
    >>> found = sheet_solid(Mesh(box, [*around, [3, 2, 1, 0], [4, 5, 6, 7]]))
    >>> found.thickness, len(found.side.faces)
    (2.0, 2)
    """
    if len(mesh.boundary_loops):
        return None
    shape = recognise(mesh)
    points, triangles = shape.vertices, shape.triangles
    a, b, c = (points - points.mean(axis=0))[triangles].transpose(1, 0, 2)
    turns = np.arange(3)
    if np.einsum("td,td->", a, np.cross(b, c)) < 0:
        # Faces are seen from inside.
        turns = turns[::-1]
    triangles = triangles[:, turns]
    areas, normals = _areas(points, triangles)
    found = _opposite(shape, triangles, areas, normals)
    if not len(found.face):
        return None
    weight: Array = np.bincount(shape.face, areas, len(shape.faces)).astype(float)
    thickness = _most(found.distance, weight[found.face])
    near = np.abs(found.distance - thickness) <= np.where(found.exact, _SAME, _ABOUT) * thickness
    skin = np.zeros(len(shape.faces), bool)
    skin[found.face[near]] = True
    own = skin[shape.face]
    total = float(areas[own].sum())
    if thickness > _THIN * np.sqrt(0.5 * total) or total < _SIDES * areas.sum():
        return None
    exact = near & found.exact
    if exact.any():
        thickness = float(np.median(found.distance[exact]))
    sides = _two_sides(points, triangles, own, areas, normals)
    said = None if mesh.attributes is None or not mesh.is_triangles else mesh.attributes
    _check_faces(shape, triangles, sides, thickness, None if said is None else said.surfaces)
    chosen = np.flatnonzero(sides == 0)
    used, compact = np.unique(triangles[chosen], return_inverse=True)
    if said is not None:
        said = said.taken(shape.source[chosen], np.broadcast_to(turns, (len(chosen), 3)))
    return SheetSolid(Mesh(points[used], compact.reshape(-1, 3), attributes=said), thickness)


def _areas(points: Array, triangles: Ints) -> tuple[Array, Array]:
    a, b, c = points[triangles].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    double = np.linalg.norm(normal, axis=1)
    return 0.5 * double, normal / np.maximum(double, 1e-300)[:, None]


@dataclass(frozen=True, eq=False)
class _Opposite:
    """Faces with the distance to the face opposite, and whether it is by equations."""

    face: Ints
    distance: Array
    exact: Flags


def _opposite(shape: Recognised, triangles: Ints, areas: Array, normals: Array) -> _Opposite:
    """Look inwards from some triangles of each face."""
    # The largest triangles of each face.
    order = np.lexsort((-areas, shape.face))
    first = np.flatnonzero(np.diff(shape.face[order], prepend=-1))
    rank = np.arange(len(order)) - np.repeat(first, np.diff(np.append(first, len(order))))
    chosen = order[rank < np.clip(_RAYS // len(shape.faces), 1, _SAMPLES)]
    hit, far = _inwards(shape, triangles, chosen, normals)
    keep = hit >= 0
    # The face opposite is seen from inside.
    toward = np.einsum("kd,kd->k", normals[chosen], normals[hit])
    keep &= toward < -0.9
    chosen, hit, far = chosen[keep], hit[keep], far[keep]
    one, other = shape.face[chosen], shape.face[hit]
    apart, exact = far.copy(), np.zeros(len(far), bool)
    pairs, which = np.unique(np.stack([one, other], axis=1), axis=0, return_inverse=True)
    for k, (i, j) in enumerate(pairs.tolist()):
        known = _distance(shape, triangles, normals, i, j)
        if known is not None:
            apart[which.ravel() == k], exact[which.ravel() == k] = known, True
    return _Opposite(one, apart, exact)


def _distance(shape: Recognised, triangles: Ints, normals: Array, i: int, j: int) -> float | None:
    """Return the distance of two faces that have equations, if it is the same everywhere."""
    one, other = shape.faces[i], shape.faces[j]
    points = shape.vertices[np.unique(triangles[other.triangles])]
    if one.kind == other.kind == "plane":
        normal = normals[one.triangles[0]]
        away = (points - shape.vertices[triangles[one.triangles[0], 0]]) @ normal
    elif one.surface is not None and other.surface is not None:
        away = one.surface.distances(points)
    else:
        return None
    mean = float(np.abs(away.mean()))
    return mean if np.ptp(away) <= _SAME * mean else None


def _inwards(
    shape: Recognised, triangles: Ints, chosen: Ints, normals: Array
) -> tuple[Ints, Array]:
    """Return the first triangle that the inward normal at the middle of some triangles meets.

    By the algorithm of Moeller and Trumbore (1997), of all rays and triangles.
    """
    p = shape.vertices
    a, b, c = p[triangles].transpose(1, 0, 2)
    e, f = b - a, c - a
    hit, far = np.full(len(chosen), -1), np.full(len(chosen), np.inf)
    step = max(1, _BLOCK // len(triangles))
    for start in range(0, len(chosen), step):
        rays = chosen[start : start + step]
        origin, way = p[triangles[rays]].mean(axis=1)[:, None], -normals[rays][:, None]
        cross = np.cross(way, f)
        det = np.einsum("ktd,td->kt", cross, e)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = origin - a
            u = np.einsum("ktd,ktd->kt", s, cross) / det
            q = np.cross(s, e)
            v = np.einsum("ktd,kzd->kt", q, way) / det
            t = np.einsum("ktd,td->kt", q, f) / det
            inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9)
        good = inside & (t > 0) & np.isfinite(t)
        good &= shape.face[None, :] != shape.face[rays][:, None]
        t = np.where(good, t, np.inf)
        best = t.argmin(axis=1)
        near = t[np.arange(len(rays)), best]
        hit[start : start + step] = np.where(np.isfinite(near), best, -1)
        far[start : start + step] = near
    return hit, far


def _most(distance: Array, weight: Array) -> float:
    """Return the distance that most of the area has."""
    order = np.argsort(distance)
    group = np.cumsum(np.diff(distance[order], prepend=-np.inf) > _SAME * distance[order])
    total = np.bincount(group, weight[order])
    return float(np.median(distance[order][group == total.argmax()]))


def _two_sides(points: Array, triangles: Ints, own: Flags, areas: Array, normals: Array) -> Ints:
    """Return 0 or 1 for the triangles of the larger and the smaller side, -1 for the others."""
    count = len(points)
    keys = edge_keys(triangles, np.roll(triangles, -1, axis=1), count).ravel()
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(np.diff(keys[order]) == 0)
    one, other = order[same] // 3, order[same + 1] // 3
    both = own[one] & own[other]
    smooth = np.einsum("kd,kd->k", normals[one], normals[other]) > np.cos(np.radians(30.0))
    for linked in (both, both & smooth):
        label = label_components(len(triangles), one[linked], other[linked])
        size = np.bincount(label, np.where(own, areas, 0.0))
        # Of two sides of the same area, the one with the first triangle.
        largest = np.lexsort((np.arange(len(size)), -size.round(9)))[:2]
        if len(largest) == 2 and size[largest[1]] > 0.5 * size[largest[0]]:
            return np.select([label == largest[0], label == largest[1]], [0, 1], -1)
    at = int(np.argmax(np.where(own, areas, 0.0)))
    raise MeshError(
        f"{_place(points[triangles[at]])}: the solid is thin there but has no second side of "
        "about the same area; sheets need two"
    )


def _check_faces(
    shape: Recognised,
    triangles: Ints,
    sides: Ints,
    thickness: float,
    given: GivenSurfaces | None,
) -> None:
    """Raise an error if a face is neither on a side nor reaches from one to the other.

    Or if it is curved in two directions.
    """
    count = len(shape.vertices)
    on = [np.isin(np.arange(count), triangles[sides == k]) for k in (0, 1)]
    rim = np.unique(shape.face[sides < 0])
    for number in rim.tolist():
        corners = np.unique(triangles[shape.faces[number].triangles])
        odd = corners[~(on[0] | on[1])[corners]]
        if len(odd) or not all(some[corners].any() for some in on):
            place = shape.vertices[odd if len(odd) else corners]
            if shape.faces[number].kind == "free":
                names = _names(shape, shape.faces[number].triangles, given)
                raise MeshError(_curved(place, thickness, names))
            raise MeshError(
                f"{_place(place)}: the sheet is not {thickness:.6g} thick there, as it is "
                "elsewhere; leave out ribs, pockets, chamfers and countersinks"
            )
    free = np.flatnonzero(~shape.developable & (sides >= 0))
    if len(free):
        names = _names(shape, free, given)
        raise MeshError(_curved(shape.vertices[triangles[free]], thickness, names))


def _names(shape: Recognised, triangles: Ints, given: GivenSurfaces | None) -> str:
    """Name the faces of a CAD file that triangles are on, in brackets; "" for a mesh."""
    if given is None:
        return ""
    numbers = np.unique(given.of_face[shape.source[triangles]])
    return f" ({', '.join(given.surfaces[k].name for k in numbers.tolist())})"


def _curved(points: Array, thickness: float, names: str) -> str:
    return (
        f"{_place(points)}{names}: the sheet of {thickness:.6g} is curved in two directions "
        "there, like a sphere; it cannot be unfolded, only pressed"
    )


def _place(points: Array) -> str:
    """Say where some points are."""
    said = ", ".join(f"{x:.6g}" for x in points.reshape(-1, 3).mean(axis=0))
    return f"near ({said})"
