"""Splitting a mesh into its connected components, and combining their metrics."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeVar, cast

import numpy as np

from gso import metrics as measure
from gso.mesh import Mesh
from gso.mesh.topology import label_components
from gso.metrics import INFO, Info
from gso.typing import Array, Ints

T = TypeVar("T", bound=float | tuple[float, ...])

_JOINED: dict[str, Callable[[Array], float]] = {"sum": np.sum, "max": np.max, "min": np.min}


@dataclass(frozen=True)
class Component:
    """One component of a mesh, as a separate mesh.

    Attributes
    ----------
    mesh : Mesh
        The component; vertices and faces keep their order. A grid where it is one.
    vertices, faces : ndarray of int
        Indices of its vertices and faces in the whole mesh.
    """

    mesh: Mesh
    vertices: Ints
    faces: Ints

    @property
    def area(self) -> float:
        """Area of the surface."""
        return measure.area(self.mesh)

    def of(self, other: Mesh) -> Mesh:
        """Extract the same component from another mesh with the same faces."""
        return self.mesh.replaced(other.vertices[self.vertices])


def labels(mesh: Mesh, links: Iterable[tuple[int, int]] | Ints = ()) -> Ints:
    """Number the component of each vertex (n,).

    Components are numbered in the order of their smallest vertex. Vertices that belong to no
    face get -1.

    Parameters
    ----------
    mesh : Mesh
    links : array_like of int, (k, 2)
        Pairs of vertices whose components are merged into one.

    Examples
    --------
    >>> mesh = Mesh(np.tile(np.eye(3), (2, 1)), [[0, 1, 2], [3, 4, 5]])
    >>> labels(mesh).tolist(), labels(mesh, [(1, 5)]).tolist()
    ([0, 0, 0, 1, 1, 1], [0, 0, 0, 0, 0, 0])
    """
    own = mesh.components
    pairs = np.asarray(links, np.int64).reshape(-1, 2)
    if len(pairs):
        a, b = own[pairs.T]
        count = int(own.max()) + 1
        own = label_components(count, a, b)[own]
    out = np.full(len(own), -1)
    used = mesh.used
    found, first, number = np.unique(own[used], return_index=True, return_inverse=True)
    rank = np.empty(len(found), np.int64)
    rank[np.argsort(first)] = np.arange(len(found))
    out[used] = rank[number]
    return out


def several(mesh: Mesh) -> bool:
    """Tell whether a mesh has more than one component."""
    return mesh.grid_index is None and bool(labels(mesh).max() > 0)


def split(mesh: Mesh, label: Ints | None = None) -> list[Component]:
    """Split a mesh into its components; vertices of no face are dropped.

    Parameters
    ----------
    mesh : Mesh
    label : ndarray of int, (n,), optional
        Part of each vertex, numbered as by :func:`labels`; every connected component is a part
        of its own when not given.

    Examples
    --------
    >>> mesh = Mesh(np.tile(np.eye(3), (2, 1)), [[0, 1, 2], [5, 4, 3]])
    >>> [part.mesh.faces.tolist() for part in split(mesh)]
    [[[0, 1, 2]], [[2, 1, 0]]]
    """
    label = labels(mesh) if label is None else label
    of_face = label[mesh.faces[:, 0]]
    vertices, faces = _grouped(label), _grouped(of_face)
    local = np.empty(len(label), np.int64)
    out = []
    for ids, which in zip(vertices, faces, strict=True):
        local[ids] = np.arange(len(ids))
        table = mesh.faces[which]
        said = None if mesh.attributes is None else mesh.attributes.taken(which)
        own = Mesh(mesh.vertices[ids], np.where(table < 0, -1, local[table]), attributes=said)
        out.append(Component(own, ids, which))
    return out


def _grouped(label: Ints) -> list[Ints]:
    """Group the indices by label 0, 1 ..., in ascending order."""
    order = np.argsort(label, kind="stable")
    ends = np.searchsorted(label[order], np.arange(label.max() + 2))
    return [order[a:b] for a, b in pairwise(ends)]


def largest_first(mesh: Mesh) -> list[Component]:
    """Split a mesh into its components, the one with the largest area first.

    Parts of patterns are numbered in this order.
    """
    return sorted(split(mesh), key=lambda part: -part.area)


def combined(
    several: Sequence[Mapping[str, float]], areas: Sequence[float], info: Mapping[str, Info] = INFO
) -> dict[str, float]:
    """Combine the metrics of the components into those of the whole mesh.

    Means are weighted by the components' areas; see :attr:`gso.metrics.Info.aggregation`.
    Components that lack a metric are left out of its mean, maximum, minimum or sum.

    Parameters
    ----------
    several : sequence of dict
        Metrics by name, of each component.
    areas : sequence of float
        Their areas.

    Examples
    --------
    >>> parts = [{"d_H": 1.0, "strain_max": 0.1}, {"d_H": 2.0, "strain_max": 0.3}]
    >>> combined(parts, [3.0, 1.0])
    {'d_H': 1.25, 'strain_max': 0.3}
    """
    names = dict.fromkeys(name for metrics in several for name in metrics)
    out = {}
    for name in names:
        have = [k for k, metrics in enumerate(several) if name in metrics]
        values = np.array([several[k][name] for k in have])
        how = info[name].aggregation if name in info else "mean"
        if how == "mean":
            out[name] = mean(values, np.array([areas[k] for k in have]))
        else:
            out[name] = float(_JOINED[how](values))
    return out


def average(function: Callable[..., T], mesh: Mesh, *others: Mesh) -> T:
    """Average a function over the components of a mesh, weighted by area.

    Parameters
    ----------
    function : callable
        ``function(mesh, *others)`` for one component returns a number or a tuple of numbers.
    mesh : Mesh
    *others : Mesh
        Meshes with the same faces; the function gets the same component of each.

    Examples
    --------
    >>> mesh = Mesh(np.tile(np.eye(3), (2, 1)), [[0, 1, 2], [3, 4, 5]])
    >>> float(average(lambda part: len(part.faces), mesh))
    1.0
    """
    if not several(mesh):
        return function(mesh, *others)
    parts = split(mesh)
    found: Any = [function(part.mesh, *map(part.of, others)) for part in parts]
    return cast(T, np.average(found, axis=0, weights=[part.area for part in parts]))


def sizes(mesh: Mesh) -> Array:
    """Return the size of each vertex's component (n,): its largest distance from the centroid."""
    out = np.full(len(mesh.vertices), mesh.frame.scale)
    if several(mesh):
        for part in split(mesh):
            out[part.vertices] = part.mesh.frame.scale
    return out


def mean(values: Array, weights: Array) -> float:
    """Return the weighted mean; exact, without rounding, when all values are equal."""
    if (values == values[0]).all():
        return float(values[0])
    return float(np.average(values, weights=weights))
