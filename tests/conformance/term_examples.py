"""Examples of every registered term, for the conformance tests."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gso.energy import Term, registry
from gso.mesh import Mesh, Polylines, topology, vertex_normals

(
    barycentric,
    bending,
    christoffel,
    collapse,
    congruence,
    coplanarity,
    curvature,
    curve,
    edges,
    elongation,
    equation,
    facing,
    fairness,
    gauss_image,
    holonomy,
    isometry,
    length,
    planarity,
    position,
    proximity,
    reach,
    scale,
    shear,
    smooth_curve,
    stretch,
) = (
    registry()[name]
    for name in (
        "barycentric",
        "bending",
        "christoffel",
        "collapse",
        "congruence",
        "coplanarity",
        "curvature",
        "curve",
        "edges",
        "elongation",
        "equation",
        "facing",
        "fairness",
        "gauss_image",
        "holonomy",
        "isometry",
        "length",
        "planarity",
        "position",
        "proximity",
        "reach",
        "scale",
        "shear",
        "smooth_curve",
        "stretch",
    )
)


def _congruence(mesh: Mesh) -> list[Term]:
    return [
        *congruence.build(mesh, "surface"),
        *congruence.build(mesh, "flat"),
        *congruence.build(mesh, "surface", counterpart="flat"),
        *congruence.build(mesh, "flat", scale="scale"),
        congruence.edges(mesh, "surface"),
    ]


def _curve(mesh: Mesh) -> list[Term]:
    out = []
    for block, dim in (("surface", 3), ("flat", 2)):
        lines = Polylines.of(mesh.vertices[[0, 5, 11], :dim], closed=False)
        term = curve.build(np.arange(4), lines, block=block, weight=1.0)
        constants = term.refresh({block: mesh.vertices[:, :dim] + 0.01})
        out.append(replace(term, constants=constants, refresh=None))
    return out


def _equation(mesh: Mesh) -> list[Term]:
    ids, out = np.arange(4), []
    for block, dim in (("surface", 3), ("flat", 2)):
        normal = np.full(dim, dim**-0.5)
        plane = np.tile(np.r_[normal, 0.1], (4, 1))
        out.append(equation.build(ids[:, None], plane, block=block))
        mirror = np.tile(np.r_[2.0 * normal[0] * normal, normal, 0.2], (4, 1))
        out.append(equation.build(np.stack([ids, ids + 5], axis=1), mirror, block=block))
    return out


def _holonomy(mesh: Mesh) -> list[Term]:
    return [replace(t, refresh=None) for t in holonomy.build(mesh, mesh.boundary_loops)]


def _length(mesh: Mesh) -> list[Term]:
    lengths = np.full(len(mesh.edges), 0.3)
    return [length.build(mesh.edges, lengths, block=block) for block in ("surface", "flat")]


def _barycentric(mesh: Mesh) -> list[Term]:
    triangles = mesh.triangles[:3]
    shares = np.tile([0.2, 0.5, 0.3], (3, 1))
    targets, normals = mesh.vertices[:3] + 0.1, vertex_normals(mesh)[:3]
    return [
        barycentric.build(triangles, shares, targets, normals, np.ones(3), tangential=t)
        for t in (0.0, 0.5)
    ]


def _coplanarity(mesh: Mesh) -> list[Term]:
    hinges = topology.hinges(mesh.triangle_edges)
    return [coplanarity.build(hinges[:5])]


def _facing(mesh: Mesh) -> list[Term]:
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    scaled = normals / (normals**2).sum(axis=1, keepdims=True)
    count = len(scaled)
    return [facing.build(mesh.triangles, scaled, np.full(count, 1.0 / count), least=1.5)]


def _planarity(mesh: Mesh) -> list[Term]:
    quads = topology.by_size(mesh.faces)[0]
    return [planarity.build(quads)] if len(quads) else []


def _smooth_curve(mesh: Mesh) -> list[Term]:
    if mesh.grid_index is not None:
        triples = mesh.grid_index[0][[[0, 1, 2], [1, 2, 3]]]
    else:
        triples = topology.polyline_triples(mesh.half_edges, mesh.faces)[:2]
        if not len(triples):
            triples = mesh.faces[:2, :3]
    steps = np.tile([1.0, 0.7], (len(triples), 1))
    return [smooth_curve.build(triples, steps, block=block) for block in ("surface", "flat")]


_BUILT: dict[str, Callable[[Mesh], list[Term]]] = {
    "barycentric": _barycentric,
    "bending": lambda mesh: bending.build(mesh, tangential=0.5),
    "christoffel": lambda mesh: [
        *christoffel.build(mesh, "surface", counterpart="flat"),
        *christoffel.build(mesh, "flat"),
    ],
    "collapse": collapse.build,
    "congruence": _congruence,
    "coplanarity": _coplanarity,
    "curvature": curvature.build,
    "curve": _curve,
    "edges": lambda mesh: [edges.build(mesh)],
    "elongation": lambda mesh: [elongation.build(mesh)],
    "equation": _equation,
    "facing": _facing,
    "fairness": lambda mesh: [fairness.build(mesh), fairness.build(mesh, block="flat")],
    "gauss_image": gauss_image.build,
    "holonomy": _holonomy,
    "isometry": isometry.build,
    "length": _length,
    "planarity": _planarity,
    "position": lambda mesh: [
        position.build(np.arange(3), mesh.vertices[:3] + 0.1, np.ones(3)),
    ],
    "proximity": lambda mesh: [proximity.build(mesh, vertex_normals(mesh), tangential=0.5)],
    "reach": lambda mesh: [
        reach.build(
            mesh,
            vertex_normals(mesh),
            np.linspace(0.5, 1.5, len(mesh.vertices)),
            mesh.half_edges.boundary_vertex,
        )
    ],
    "scale": lambda mesh: [scale.build(mesh)],
    "shear": shear.build,
    "smooth_curve": _smooth_curve,
    "stretch": stretch.build,
}


def examples(name: str, mesh: Mesh) -> list[Term]:
    """Return examples of a registered term on a mesh."""
    return _BUILT[name](mesh)
