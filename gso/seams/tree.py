"""Cuts from places of large strain to the boundary: few pieces, with darts.

The place where :class:`~gso.seams.potential.Potential` is farthest from zero is joined to
the boundary, or to an earlier cut, by a path that stays where it is far from zero, until it is
small everywhere. Where the curvature is positive a dart opens when it is flattened. Where it is
negative the sides of a dart would overlap, so the cut goes on to the boundary on the other side.

Source of the principle: Sheffer and Hart 2002, Seamster (cut trees through places of large
curvature).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from gso.mesh import Mesh, Paths
from gso.seams.compact_patches import patches
from gso.seams.estimates import Estimates
from gso.seams.potential import Potential
from gso.typing import Array, Flags, Ints

#: Share of the largest potential that is added to it, so that no edge costs too much.
_FLOOR = 0.05
#: Distance of the two ends of a cut across a saddle, relative to the length of its first part.
_APART = 2.0


def _no_edges() -> Ints:
    return np.empty((0, 2), np.int64)


@dataclass(frozen=True)
class Ground:
    """What a search for seams knows about a design.

    Attributes
    ----------
    mesh : Mesh
    potential : Potential
    paths : Paths
    kept : ndarray of int, (k, 2)
        Edges that are cut in any case.
    mirror : ndarray of int, (n,), optional
        The mirror image of each vertex, for symmetric seams.
    factor : ndarray, (e,), optional
        Factor on the cost of seams along each edge of ``mesh.edges``; ones when not given.
    """

    mesh: Mesh
    potential: Potential
    paths: Paths
    kept: Ints = field(default_factory=_no_edges)
    mirror: Ints | None = None
    factor: Array | None = None

    @classmethod
    def of(
        cls,
        mesh: Mesh,
        factor: Array | None = None,
        kept: Ints | None = None,
        mirror: Ints | None = None,
    ) -> Ground:
        """Prepare a design for the search."""
        own = _no_edges() if kept is None else kept
        return cls(mesh, Potential(mesh), Paths(mesh, factor), own, mirror, factor)

    def moved(self, mesh: Mesh) -> Ground:
        """Return the same for a mesh of another shape, perhaps with vertices inserted on seams."""
        same = len(mesh.faces) == len(self.mesh.faces)
        return Ground.of(mesh, self.factor if same else None, self.kept, self.mirror)

    def factor_of(self, ends: Ints) -> Array | None:
        """Return the factor (k,) of some edges (k, 2) of the mesh; None if all are one."""
        if self.factor is None:
            return None
        return self.factor[self.mesh.edge_numbers(ends[:, 0], ends[:, 1])]

    @cached_property
    def estimates(self) -> Estimates:
        """Estimated strains of sets of faces."""
        return Estimates(self.mesh, self.potential, self.begun)

    @cached_property
    def _patches(self) -> dict[int, Ints]:
        return {}

    def patches(self, count: int) -> Ints:
        """Divide the mesh into about `count` patches, once: the patch of each face (m,)."""
        if count not in self._patches:
            self._patches[count] = patches(self.mesh, count, self.kept)
        return self._patches[count]

    @property
    def begun(self) -> Flags:
        """Vertices (n,) on the boundary or on edges that are cut in any case."""
        out: Flags = self.mesh.half_edges.boundary_vertex.copy()
        out[self.kept] = True
        return out

    def mirrored(self, edges: Ints) -> Ints:
        """Add the mirror images of edges (e, 2)."""
        if self.mirror is None or not len(edges):
            return edges
        return np.concatenate([edges, self.mirror[edges]])


def cut_tree(ground: Ground, strain: float, neck: float = 0.0) -> Ints:
    """Choose the edges to cut so that the estimated strain stays below a bound.

    Parameters
    ----------
    ground : Ground
    strain : float
        Bound on half the largest absolute potential.
    neck : float
        Smallest distance of the end of a dart from other cuts and from the boundary. Darts that
        would come closer are not made, so the bound may be missed.

    Returns
    -------
    ndarray of int, (e, 2)
        Edges to cut, with those that are cut in any case.
    """
    mesh, paths = ground.mesh, ground.paths
    reached = ground.begun
    found = [ground.kept]
    for seed in _seeds(ground, reached):
        reached[seed] = True
    limit = 2.0 * strain
    for _ in range(len(mesh.vertices)):
        scale = ground.potential.solve(reached)
        size = np.abs(scale)
        wanted = size > limit
        if neck > 0 and wanted.any():
            wanted &= paths.distance(np.flatnonzero(reached)) >= neck
        if not wanted.any():
            break
        tip = int(np.where(wanted, size, -1.0).argmax())
        line = paths.cheapest(tip, reached, _weight(paths, size))
        through = scale[tip] > 0
        edges = ground.mirrored(_edges(line))
        if not len(edges):
            break
        reached[edges] = True
        found.append(edges)
        if through:
            found.append(_across(ground, reached, line))
            reached[found[-1]] = True
    return np.unique(np.sort(np.concatenate(found), axis=1), axis=0)


def _across(ground: Ground, reached: Flags, line: Ints) -> Ints:
    """Continue a cut from its tip to the boundary on the other side."""
    size = np.abs(ground.potential.solve(reached))
    goals, closed = reached.copy(), np.zeros(len(reached), bool)
    closed[ground.mirrored(_edges(line))] = True
    goals[closed] = False
    closed[line[0]] = False
    # Not back to where the first part ends, which would cut out a tongue.
    step = np.diff(ground.mesh.vertices[line], axis=0)
    reach = _APART * float(np.linalg.norm(step, axis=1).sum())
    far = goals & ~np.isfinite(ground.paths.distance(line[-1:], reach))
    goals = far if far.any() else goals
    weight = _weight(ground.paths, size)
    return ground.mirrored(_edges(ground.paths.cheapest(int(line[0]), goals, weight, closed)))


def _weight(paths: Paths, size: Array) -> Array:
    """Return the factor on the cost of each edge: low where the potential is large."""
    relative = size / max(float(size.max()), 1e-300)
    return np.asarray(1.0 / (relative[paths.ends].mean(axis=1) + _FLOOR))


def _edges(line: Ints) -> Ints:
    return np.stack([line[:-1], line[1:]], axis=1)


def _seeds(ground: Ground, reached: Flags) -> list[int]:
    """Choose a vertex to begin with in each component without boundary or given cut."""
    label = ground.mesh.components
    out = []
    for own in np.unique(label[ground.mesh.used]):
        ids = np.flatnonzero(label == own)
        if reached[ids].any():
            continue
        density = ground.potential.curvature[ids] / np.maximum(ground.potential.area[ids], 1e-300)
        away = ground.paths.distance(ids[[int(density.argmax())]])
        seed = ids[int(away[ids].argmax())]
        out.append(int(seed))
        if ground.mirror is not None and ground.mirror[seed] != seed:
            out.append(int(ground.mirror[seed]))
    return out
