"""Borders, edges, symmetry and folds of developable results, on designs of our own.

    python bench/borders.py                       balanced, all designs (a minute)
    python bench/borders.py holes symmetric       some of them
    python bench/borders.py --preset accurate     fast, balanced, accurate or isometry
    python bench/borders.py --seed 1              surfaces of another seed

Loops and edges are ratios of lengths, result over design: the smallest and the largest ratio of
the boundary loops, and the smallest of the edges. Asymmetry is a share of the diagonal, distances
are percent of the diagonal, and folds the largest angle between two faces that share an edge, in
degrees. The solver minimises none of folds, asymmetry and distances directly.
"""

from __future__ import annotations

import argparse
import os
import time
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import designs
import numpy as np
from tno import progress, table

import gso
from gso import metrics

KINDS = {
    "holes": designs.with_holes,
    "irregular": designs.irregular,
    "planar": designs.planar,
    "symmetric": designs.symmetric,
    "curved": designs.curved,
}
PRESETS = ("fast", "balanced", "accurate", "isometry")
COLUMNS = (
    *("loops", "to", "edges", "asymmetry", "one way %", "both ways %", "mean %"),
    *("fold in", "fold", "|K| in", "|K|", "fairness", "s"),
)


def solved(mesh: gso.Mesh, preset: str) -> gso.Mesh:
    """The result with a preset, or with the formulation "isometry"."""
    if preset == "isometry":
        return gso.tno.optimize(mesh, formulation="isometry").mesh
    return gso.tno.optimize(mesh, options=preset).mesh


def figures(design: designs.Design, after: gso.Mesh) -> list[Any]:
    """Figures of a table row, without the time."""
    before = design.mesh
    loops, edges = metrics.loop_ratios(before, after), metrics.edge_ratios(before, after)
    true = metrics.surface_distance(before, after)
    percent = 100.0 / before.diagonal
    there, both = true.there_max, max(true.there_max, true.back_max)
    return [
        loops.min(),
        loops.max(),
        edges.min(),
        design.asymmetry(after.vertices) if design.symmetries else "",
        *(percent * x for x in (there, both, 0.5 * (true.there_mean + true.back_mean))),
        *(metrics.dihedral_angles(m).max() for m in (before, after)),
        metrics.loss_gc_worst(before),
        metrics.loss_gc_worst(after, scale=metrics.unit(before)),
        metrics.fairness_ratio(before, after),
    ]


def borders(kind: str, preset: str, seed: int) -> list[list[Any]]:
    """Print the table of one kind of design and return its rows."""
    rows: list[list[Any]] = []
    for design in progress(KINDS[kind](seed), f"{kind} {preset}"):
        start = time.perf_counter()
        after = solved(design.mesh, preset)
        spent = time.perf_counter() - start
        rows.append([design.name, *figures(design, after), spent])
    table(f"{kind}, {preset}, seed {seed}", ["design", *COLUMNS], rows)
    return rows


def main() -> None:
    """Print the tables that the command line asks for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("kinds", nargs="*", choices=[*KINDS, []], help="default: all")
    parser.add_argument("--preset", choices=PRESETS, default="balanced")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    every = [
        row
        for kind in arguments.kinds or KINDS
        for row in borders(kind, arguments.preset, arguments.seed)
    ]
    loops = np.array([row[1:3] for row in every])
    print(
        f"\nof {len(every)} designs: loops {loops.min():.3f} to {loops.max():.3f}, "
        f"edges from {min(row[3] for row in every):.3f}"
    )


if __name__ == "__main__":
    main()
