"""Division of a mesh into compact patches."""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import connected_components, dijkstra

from gso.mesh import Mesh
from gso.mesh.separation import centres
from gso.mesh.topology import edge_graph
from gso.typing import Ints


def patches(mesh: Mesh, count: int, kept: Ints) -> Ints:
    """Divide a mesh into about `count` compact patches; return the patch of each face (m,).

    The Voronoi cells of farthest points, by distances between the centres of faces. No patch
    reaches across an edge of `kept` (k, 2).
    """
    he = mesh.half_edges
    k = he.interior
    k = k[~he.on(kept)[k]]
    centre = centres(mesh)
    f, g = he.face[k], he.face[he.twin[k]]
    length = np.linalg.norm(centre[f] - centre[g], axis=1)
    graph = edge_graph(len(centre), f, g, length)
    middle = centre.mean(axis=0)
    seed = int(np.linalg.norm(centre - middle, axis=1).argmax())
    best, owner = np.full(len(centre), np.inf), np.zeros(len(centre), np.int64)
    least = connected_components(graph, directed=False)[0]
    for number in range(min(max(count, least), len(centre))):
        away = dijkstra(graph, directed=False, indices=seed, limit=float(best.max()))
        closer = away < best
        best[closer], owner[closer] = away[closer], number
        seed = int(np.where(np.isinf(best), np.inf, best).argmax())
        if best[seed] == 0.0:
            break
    return owner
