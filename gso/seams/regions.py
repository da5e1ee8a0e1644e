"""Regions of a surface with fair boundaries, and cuts along them through triangles.

The indicator functions of the regions are diffused, and each point goes to the region whose
function is largest there. A boundary becomes shorter and straighter at the scale of the diffusion;
three regions meet at about equal angles, and necks that are narrower disappear. Little diffuses
across creases, so that boundaries stay on them.

Source: Merriman, Bence and Osher 1992, Diffusion generated motion by mean curvature.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, diags

from gso import geometry, metrics
from gso.linalg import spd
from gso.mesh import Cut, Mesh
from gso.mesh.cut import cut
from gso.mesh.slicing import followed, parts_of, with_points
from gso.mesh.topology import edge_keys, label_components, pair_keys
from gso.seams.potential import Potential
from gso.typing import Array, Flags, Ints

#: Conductance across creases, relative to that of a strip as wide as an edge is long.
_ACROSS = 0.05
#: Conductance along edges between vertices that seams avoid, relative to that of equilateral
#: triangles.
_AVOIDED = 4.0
#: Shares of an edge next to its ends in which a boundary goes through the end.
_SNAP = 0.2
#: Cosine between normals, and smallest angle in radians, of triangles of a flipped edge.
_ALIKE, _THIN = 0.5, 0.06
#: Largest width of the diffusion over the area of a region by the length of its boundary.
_THIN_REGION = 0.6
#: Rounds in which fragments of regions go to their neighbours.
_ROUNDS = 8


class Divided(NamedTuple):
    """A mesh whose triangles are divided along the boundaries between regions.

    Attributes
    ----------
    mesh : Mesh
        New vertices on edges come after the others.
    label : ndarray of int, (m,)
        The region of each face.
    ends : ndarray of int, (k, 2)
        The edge on which each new vertex lies.
    shares : ndarray, (k,)
        Its place on it, 0 to 1.
    """

    mesh: Mesh
    label: Ints
    ends: Ints
    shares: Array

    def moved(self, points: Array) -> Array:
        """Return points (n + k, 3) for those of the mesh that was divided (n, 3)."""
        return with_points(points, self.ends, self.shares)

    def moved_as(self, before: Divided, points: Array) -> Array:
        """Return points (n + k, 3) for those (n + b, 3) of another division of the same mesh.

        New vertices at the same places of the same edges keep their points.
        """
        count = len(self.mesh.vertices) - len(self.ends)
        out = self.moved(points[:count])
        own, other = (pair_keys(one.ends, count) for one in (self, before))
        _, k, b = np.intersect1d(own, other, return_indices=True)
        same = np.abs(self.shares[k] - before.shares[b]) < _SNAP
        out[count + k[same]] = points[count + b[same]]
        return out

    def lines(self, lines: Ints) -> Ints:
        """Return edges for lines (k, 2) of the mesh that was divided."""
        return followed(lines, self.ends, len(self.mesh.vertices) - len(self.ends))

    def along(self, lines: Ints, least: float) -> Divided:
        """Move boundaries to lines (k, 2) of the mesh that was divided, close to which they run.

        What is between both, and less than the `least` share of the area, goes to the region on the
        other side of the boundary.
        """
        if not len(lines):
            return self
        mesh, he, label = self.mesh, self.mesh.half_edges, self.label.copy()
        k = he.interior
        f, g = he.face[k], he.face[he.twin[k]]
        fixed = he.on(self.lines(lines))[k]
        same = ~fixed & (label[f] == label[g])
        part = label_components(len(mesh.faces), f[same], g[same])
        area = geometry.doubled_areas(mesh.vertices, mesh.faces)
        small = np.bincount(part, area)[part] < least * area.sum()
        across = ~fixed & (label[f] != label[g])
        f, g = np.r_[f[across], g[across]], np.r_[g[across], f[across]]
        some = small[f] & ~small[g]
        other = np.full(int(part.max()) + 1, -1)
        other[part[f[some]]] = label[g[some]]
        label[small] = np.where(other[part[small]] >= 0, other[part[small]], label[small])
        return self._replace(label=label)


@dataclass(frozen=True, eq=False)
class Regions:
    """Diffusion on a triangle mesh with creases.

    Attributes
    ----------
    mesh : Mesh
    creases : ndarray of int, (k, 2)
        Edges that boundaries prefer.
    avoided : ndarray of bool, (n,), optional
        Vertices between which they should not run.
    """

    mesh: Mesh
    creases: Ints
    avoided: Flags | None = None

    @cached_property
    def opened(self) -> Cut:
        """The mesh cut open along the creases."""
        return cut(self.mesh, self.creases)

    @cached_property
    def potential(self) -> Potential:
        """Areas and stiffness of the opened mesh."""
        return Potential(self.opened.mesh)

    @cached_property
    def face_area(self) -> Array:
        """Area of each face (m,)."""
        return metrics.face_areas(self.mesh)

    @cached_property
    def beside(self) -> tuple[Ints, Array]:
        """Faces (e, 2) on both sides of each inner edge, and its length (e,)."""
        mesh, he = self.mesh, self.mesh.half_edges
        k = he.interior
        length = np.linalg.norm(mesh.vertices[he.origin[k]] - mesh.vertices[he.dest[k]], axis=1)
        return np.stack([he.face[k], he.face[he.twin[k]]], axis=1), length

    @cached_property
    def _stiffness(self) -> csr_matrix:
        pairs = self.opened.seams.transpose(0, 2, 1).reshape(-1, 2)
        w = np.full(len(pairs), 0.5 * _ACROSS)
        if self.avoided is not None and self.avoided.any():
            edges = self.opened.mesh.edges
            edges = edges[self.avoided[self.opened.vertex[edges]].all(axis=1)]
            pairs = np.concatenate([pairs, edges])
            w = np.concatenate([w, np.full(len(edges), _AVOIDED / np.sqrt(3.0))])
        if not len(pairs):
            return self.potential.stiffness
        i, j = pairs.T
        n = len(self.opened.vertex)
        links = coo_matrix(
            (np.r_[w, w, -w, -w], (np.r_[i, j, i, j], np.r_[i, j, j, i])), shape=(n, n)
        )
        return self.potential.stiffness + links

    def diffused(self, masses: Array, widths: Array) -> Array:
        """Diffuse masses (p, k) at the vertices of the opened mesh over widths (p,)."""
        size = 1.0 / np.square(widths)
        solve = spd(diags(self.potential.mass * size) + self._stiffness)
        return np.stack([solve(column * size) for column in masses.T], axis=1)

    def widths(self, label: Ints, width: float) -> Array:
        """Return the width (p,) at vertices of the opened mesh: less where regions are thin."""
        sides, length = self.beside
        (a, b), count = label[sides].T, int(label.max()) + 1
        around = np.bincount(np.r_[a, b], np.tile(length * (a != b), 2), count)
        area = np.bincount(label, self.face_area, count)
        own = np.minimum(width, _THIN_REGION * area / np.maximum(around, 1e-300))[label]
        out = np.full(len(self.opened.vertex), width)
        np.minimum.at(out, self.opened.mesh.faces, own[:, None])
        return out

    def masses(self, label: Ints) -> Array:
        """Return the area (p, k) of each region at the vertices of the opened mesh."""
        faces, count = self.opened.mesh.faces, int(label.max()) + 1
        third = np.repeat(self.face_area / 3.0, 3)
        places = faces.ravel(), np.repeat(label, 3)
        sums = coo_matrix((third, places), shape=(len(self.opened.vertex), count))
        return np.asarray(sums.toarray())

    def fields(self, label: Ints, width: float) -> Array:
        """Return the diffused indicator functions (p, k) of regions, labels of faces (m,)."""
        return self.diffused(self.masses(label), self.widths(label, width))

    def fair(self, label: Ints, width: float, rounds: int = 2) -> Ints:
        """Make boundaries between regions fair; return the region of each face (m,).

        Parts that are cut off go to other regions; regions that vanish are left out.
        """
        for _ in range(rounds):
            value = self.fields(label, width)[self.opened.mesh.faces].sum(axis=1)
            label = value.argmax(axis=1)
        return numbered(connected(self.mesh, label, value))

    def connected(self, label: Ints) -> Ints:
        """Give all but the largest part of each region (m,) to neighbours."""
        return connected(self.mesh, label)

    def cut_between(self, fields: Array) -> Divided:
        """Divide triangles along the boundaries between regions.

        Parameters
        ----------
        fields : ndarray, (p, k)
            Values of each region at the vertices of the opened mesh.
        """
        mesh, corner = self.mesh, self.opened.mesh.faces
        best = fields.argmax(axis=1)
        # Each half-edge with the copies of its ends.
        i, j = corner.ravel(), np.roll(corner, -1, axis=1).ravel()
        origin, dest = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
        a, b = best[i], best[j]
        first = fields[i, a] - fields[i, b]
        share = first / np.maximum(first + fields[j, b] - fields[j, a], 1e-300)
        second = _second(len(best), i, j, a, b, share)
        s, t = second[i], second[j]
        crossed = (a != b) & (s != b) & (t != a) & ~((s == t) & (s >= 0))
        forward = origin < dest
        key = np.minimum(origin, dest) * len(mesh.vertices) + np.maximum(origin, dest)
        share = np.where(forward, share, 1.0 - share)
        edges, which = np.unique(key[crossed], return_inverse=True)
        if not len(edges):
            ends, place = np.empty((0, 2), np.int64), np.empty(0)
            label = self._labels(mesh.faces, np.arange(len(mesh.faces)), fields, ends, place)
            return Divided(mesh, label, ends, place)
        place = np.bincount(which, share[crossed]) / np.bincount(which)
        place = np.clip(place, _SNAP / 2, 1.0 - _SNAP / 2)
        ends = np.stack(np.divmod(edges, len(mesh.vertices)), axis=1)
        finer, owner = parts_of(mesh, ends, place)
        fields = fields.copy()
        tied = np.flatnonzero(second >= 0)
        fields[tied, second[tied]] = fields[tied, best[tied]]
        label = connected(finer, self._labels(finer.faces, owner, fields, ends, place))
        out = Divided(finer, label, ends, place)
        return out._replace(mesh=_without_ears(finer, label, out.lines(self.creases)))

    def _labels(self, faces: Ints, owner: Ints, fields: Array, ends: Ints, shares: Array) -> Ints:
        """Return the region with the largest value in each part of a triangle."""
        n = len(self.mesh.vertices)
        own, copies = self.mesh.faces[owner], self.opened.mesh.faces[owner]
        value = np.zeros((len(faces), fields.shape[1]))

        def at(vertex: Ints) -> Array:
            place = (own == vertex[:, None]).argmax(axis=1)
            return np.asarray(fields[copies[np.arange(len(own)), place]])

        for corner in faces.T:
            old = corner < n
            if old.all():
                value += at(corner)
                continue
            k = np.where(old, 0, corner - n)
            one, two = (np.where(old, corner, ends[k, side]) for side in (0, 1))
            part = np.where(old, 0.0, shares[k])[:, None]
            value += (1.0 - part) * at(one) + part * at(two)
        return np.asarray(value.argmax(axis=1))


def _without_ears(mesh: Mesh, label: Ints, creases: Ints) -> Mesh:
    """Flip the inner edge of triangles with two sides on seams, which could fold freely.

    Creases (k, 2) stay.
    """
    he = mesh.half_edges
    inside = he.twin >= 0
    inside[inside] = label[he.face[inside]] == label[he.face[he.twin[inside]]]
    number = np.bincount(he.face[inside], minlength=len(mesh.faces))
    k = np.flatnonzero(inside & (number[he.face] == 1))
    k = k[number[he.face[he.twin[k]]] > 1]
    return with_flips(mesh, k[~he.on(creases)[k]])


def with_flips(mesh: Mesh, half_edges: Ints) -> Mesh:
    """Flip edges (k,) of a triangle mesh where both new triangles have a good shape.

    Their normals are to be nearly those of the old ones. No triangle takes part in two flips.
    """
    he, n, k = mesh.half_edges, len(mesh.vertices), half_edges
    one, two = he.face[k], he.face[he.twin[k]]
    faces = mesh.faces.copy()
    a, b = he.origin[k], he.dest[k]
    c = faces[one].sum(axis=1) - a - b
    d = faces[two].sum(axis=1) - a - b
    new = np.stack([np.stack([c, a, d], axis=1), np.stack([d, b, c], axis=1)], axis=1)
    normal = geometry.area_vectors(mesh.vertices, faces[one])
    normal += geometry.area_vectors(mesh.vertices, faces[two])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    fine = np.ones(len(k), bool)
    for side in (0, 1):
        own = geometry.area_vectors(mesh.vertices, new[:, side])
        size = np.linalg.norm(own, axis=1)
        fine &= np.einsum("kd,kd->k", own, normal) > _ALIKE * size
        angle = geometry.corner_angles(mesh.vertices, new[:, side]).min(axis=1)
        fine &= angle > _THIN
    taken = edge_keys(np.minimum(c, d), np.maximum(c, d), n)
    fine &= ~np.isin(taken, pair_keys(mesh.edges, n))
    used: set[int] = set()
    made: set[int] = set()
    chosen = []
    for i in np.flatnonzero(fine).tolist():
        own_faces = {int(one[i]), int(two[i])}
        if not used & own_faces and int(taken[i]) not in made:
            used |= own_faces
            made.add(int(taken[i]))
            chosen.append(i)
    faces[one[chosen]], faces[two[chosen]] = new[chosen, 0], new[chosen, 1]
    return Mesh(mesh.vertices, faces, attributes=mesh.attributes)


def numbered(label: Ints) -> Ints:
    """Number regions from 0 on without gaps."""
    return np.unique(label, return_inverse=True)[1].reshape(-1).astype(np.int64)


def connected(mesh: Mesh, label: Ints, value: Array | None = None) -> Ints:
    """Give all but the largest part of each region to other regions.

    Each face of such a part goes to the region with the next largest value (m, k) if these are
    given, or else to that of a neighbour.
    """
    he, label = mesh.half_edges, label.copy()
    k = he.interior
    f, g = he.face[k], he.face[he.twin[k]]
    f, g = np.r_[f, g], np.r_[g, f]
    for number in range(_ROUNDS):
        bad = _fragments(label, f, g)
        if not bad.any():
            break
        if value is not None and number < _ROUNDS // 2:
            # What is left after some rounds goes to neighbours.
            value = np.where(value > 0.0, value, -np.inf)
            value[np.flatnonzero(bad), label[bad]] = -np.inf
            other = value[bad].argmax(axis=1)
            known = np.isfinite(value[bad].max(axis=1))
            label[np.flatnonzero(bad)[known]] = other[known]
            continue
        while bad.any():
            front = bad[f] & ~bad[g]
            if not front.any():
                break
            label[f[front]] = label[g[front]]
            bad[f[front]] = False
    return label


def _fragments(label: Ints, f: Ints, g: Ints) -> Flags:
    """Mark the faces that are not in the largest part of their region."""
    same = label[f] == label[g]
    part = label_components(len(label), f[same], g[same])
    size = np.bincount(part)
    first = np.unique(part, return_index=True)[1]
    order = np.lexsort((-size, label[first]))
    _, largest = np.unique(label[first][order], return_index=True)
    whole = np.zeros(len(size), bool)
    whole[order[largest]] = True
    # A whole component has no neighbour to go to.
    alone = np.ones(len(size), bool)
    alone[part[f[~same]]] = False
    return ~(whole | alone)[part]


def _second(count: int, i: Ints, j: Ints, a: Ints, b: Ints, share: Array) -> Ints:
    """Return a second region (p,) of vertices through which a boundary goes, -1 for the others."""
    vertex = np.r_[i, j]
    other = np.r_[b, a]
    near = np.r_[share, 1.0 - share]
    some = np.flatnonzero((np.r_[a, b] != other) & (near < _SNAP))
    some = some[np.argsort(-near[some], kind="stable")]
    out = np.full(count, -1)
    out[vertex[some]] = other[some]
    return out
