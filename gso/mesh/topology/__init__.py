"""Connectivity of face arrays: half-edges, grids, stars, polylines, boundary loops.

Faces are integer arrays (m, 3) or (m, 4). In a mixed mesh the rows have four columns
and a triangle ends in -1. Everything is vectorised: Python loops run over the valence of
a vertex or the side of a grid, never over elements.
"""

from __future__ import annotations

from gso.mesh.topology.graph import edge_graph, label_components, neighbour_means
from gso.mesh.topology.grid import grid_faces, recognise_grid
from gso.mesh.topology.half_edges import (
    HalfEdges,
    boundary_edges,
    check_vertices,
    edge_keys,
    edges,
    half_edges,
    orient,
    pair_keys,
    reverse,
    tree_parity,
)
from gso.mesh.topology.polylines import boundary_loops, hinges, polyline_crosses, polyline_triples
from gso.mesh.topology.stars import (
    RING_SIZES,
    Stars,
    boundary_fans,
    face_stars,
    grid_stars,
    vertex_stars,
)
from gso.mesh.topology.triangulation import (
    are_quads,
    by_size,
    corner_triangles,
    four_corners,
    quad_splits,
    triangulate,
)

__all__ = [
    "RING_SIZES",
    "HalfEdges",
    "Stars",
    "are_quads",
    "boundary_edges",
    "boundary_fans",
    "boundary_loops",
    "by_size",
    "check_vertices",
    "corner_triangles",
    "edge_graph",
    "edge_keys",
    "edges",
    "face_stars",
    "four_corners",
    "grid_faces",
    "grid_stars",
    "half_edges",
    "hinges",
    "label_components",
    "neighbour_means",
    "orient",
    "pair_keys",
    "polyline_crosses",
    "polyline_triples",
    "quad_splits",
    "recognise_grid",
    "reverse",
    "tree_parity",
    "triangulate",
    "vertex_stars",
]
