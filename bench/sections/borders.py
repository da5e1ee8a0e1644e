"""Borders, edges, symmetry and folds of developable results, on designs of our own.

Loops and edges are ratios of lengths, result over design: the smallest and the largest ratio of
the boundary loops, and the smallest of the edges. Asymmetry is a share of the diagonal, distances
are percent of the diagonal, and folds the largest angle between two faces that share an edge, in
degrees. The solver minimises none of folds, asymmetry and distances directly.
"""

from __future__ import annotations

from typing import Any

import designs
from designs import KINDS
from harness import progress, solver, tabulate, timed

import gso
from gso import metrics


def _figures(design: designs.Design, after: gso.Mesh) -> dict[str, Any]:
    before = design.mesh
    loops = metrics.loop_ratios(before, after)
    true = metrics.surface_distance(before, after)
    percent = 100.0 / before.diagonal
    both = true.largest
    return {
        "loops": loops.min(),
        "to": loops.max(),
        "edges": metrics.edge_ratios(before, after).min(),
        "asymmetry": design.asymmetry(after.vertices) if design.symmetries else "",
        "one way %": percent * true.there_max,
        "both ways %": percent * both,
        "mean %": percent * 0.5 * (true.there_mean + true.back_mean),
        "fold in": metrics.dihedral_angles(before).max(),
        "fold": metrics.dihedral_angles(after).max(),
        "|K| in": metrics.loss_gc_worst(before),
        "|K|": metrics.loss_gc_worst(after, scale=metrics.unit(before)),
        "fairness": metrics.fairness_ratio(before, after),
    }


def borders(kind: str = "", preset: str = "balanced", seed: int = 0) -> dict[str, Any]:
    """Measure one kind of designs or all; the preset may also be "isometry"."""
    keywords = {"formulation": preset} if preset == "isometry" else {"options": preset}
    out: dict[str, Any] = {}
    for name in [kind] if kind else KINDS:
        found = {}
        for design in progress(KINDS[name](seed), f"{name} {preset}"):
            result, spent = timed(solver(**keywords), design.mesh)
            found[design.name] = _figures(design, result.mesh) | {"s": spent}
        rows = tabulate(f"{name}, {preset}, seed {seed}", ["design"], found)
        out |= {f"{name} {design}": row for design, row in rows.items()}
    loops = [row[k] for row in out.values() for k in ("loops", "to")]
    print(f"\nof {len(out)} designs: loops {min(loops):.3f} to {max(loops):.3f}, ", end="")
    print(f"edges from {min(row['edges'] for row in out.values()):.3f}")
    return out


SECTIONS = (borders,)
