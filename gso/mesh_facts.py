"""Properties of a mesh in words: size, connectivity, curvature."""

from __future__ import annotations

import numpy as np

from gso import metrics as measure
from gso.components import average, several, split
from gso.mesh import Mesh
from gso.typing import Array, Json
from gso.wording import listed


def facts(mesh: Mesh, unit: str = "") -> list[tuple[str, str]]:
    """Return names and values of the properties of a mesh, as texts.

    Parameters
    ----------
    mesh : Mesh
    unit : str
        Name of the unit of its coordinates, which lengths are given with; empty if not known.

    Examples
    --------
    >>> from gso.mesh import Mesh
    >>> known = dict(facts(Mesh([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]]), "cm"))
    >>> known["kind"], known["diagonal"]
    ('triangles', '5 cm')
    """
    own = f" {unit}" if unit else ""
    used = mesh.used
    points = mesh.vertices[used]
    length = mesh.edge_lengths
    loops = [len(loop) for loop in mesh.boundary_loops]
    rows = [
        ("kind", _kind(mesh)),
        ("vertices", str(len(mesh.vertices))),
        ("faces", str(len(mesh.faces))),
        ("edges", str(len(mesh.edges))),
        ("components", str(np.unique(mesh.components[used]).size)),
        ("boundary loops", f"{len(loops)}" + (f" ({listed(loops)} vertices)" if loops else "")),
        ("Euler characteristic", str(mesh.euler_characteristic)),
        ("bounding box", " x ".join(f"{side:.6g}" for side in np.ptp(points, axis=0)) + own),
        ("from, to", " ".join(map(_point, (points.min(axis=0), points.max(axis=0)))) + own),
        ("diagonal", f"{mesh.diagonal:.6g}{own}"),
        ("size", f"{_sizes(mesh)}{own} (farthest vertex from the centroid)"),
        (
            "edge length",
            f"{length.min():.4g} to {length.max():.4g}{own}, mean {length.mean():.4g}{own}",
        ),
    ]
    if mesh.stars:
        positive, negative, absolute = average(measure.curvature_features, mesh)
        rows += [
            (
                "mean |K|",
                f"{average(measure.mean_abs_K, mesh):.4g} 1/size^2 (1 on a unit sphere)",
            ),
            ("loss_gc_worst", f"{average(measure.loss_gc_worst, mesh):.4g} 1/size^2"),
            ("loss_gc", f"{absolute:.4g} 1/size^2 (published: one triangulation)"),
            ("K_P, K_N", f"{positive:.4g}, {negative:.4g} 1/size^2 (mean K > 0, mean K < 0)"),
        ]
    else:
        rows.append(("loss_gc", "- (no interior vertex)"))
    if mesh.attributes is not None:
        rows.append(("attributes", str(mesh.attributes)))
    return rows + [("note", note) for note in mesh.notes]


def facts_record(rows: list[tuple[str, str]]) -> Json:
    """Return such properties by name, and their notes as a list.

    >>> facts_record([("kind", "triangles"), ("note", "2 vertices are not used")])
    {'kind': 'triangles', 'notes': ['2 vertices are not used']}
    """
    notes = [value for name, value in rows if name == "note"]
    return {**{name: value for name, value in rows if name != "note"}, "notes": notes}


def _sizes(mesh: Mesh) -> str:
    """Format the size of a mesh, or the range of sizes of its components."""
    if not several(mesh):
        return f"{mesh.frame.scale:.6g}"
    found = [part.mesh.frame.scale for part in split(mesh)]
    return f"components of {min(found):.6g} to {max(found):.6g}"


def _kind(mesh: Mesh) -> str:
    if mesh.grid_shape is not None:
        return f"grid {mesh.grid_shape[0]} x {mesh.grid_shape[1]}"
    if mesh.is_triangles:
        return "triangles"
    return "quads and triangles" if (mesh.faces < 0).any() else "quads"


def _point(point: Array) -> str:
    return f"({', '.join(f'{c:.6g}' for c in point)})"
