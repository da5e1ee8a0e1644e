"""Large meshes that are not grids, and large grids under constraints: time, memory, energy.

Designs are quad meshes around a vertex of valence 5, and grids. Each is solved in a process of its
own, to measure its memory. At the sizes where that is affordable the solve without coarser meshes
gives the energy to compare with: the ratio is at most 1.01 where nothing is lost.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
from designs.base import refined
from designs.irregular import star
from harness import energy, progress, run_apart, tabulate
from report.measure import peak_mb

import gso
from gso.tasks.developable import Options, levels

#: Heights of the designs over the plane.
SHAPES = {
    "saddle": lambda x, y: 0.35 * (x * x - y * y),
    "dome": lambda x, y: np.sqrt(1.8 - 0.8 * (x * x + y * y)),
    "waves": lambda x, y: 0.15 * np.cos(3 * x + y) + 0.1 * np.sin(2 * y - x),
}


def patches(shape: str, side: int) -> gso.Mesh:
    """Make a mesh of five patches of side x side quads around a vertex."""
    turn, (_, faces) = np.pi * np.arange(10) / 5, star(5)
    rim = np.where(np.arange(10) % 2, 1.15, 1.0) * [np.cos(turn), np.sin(turn)]
    plan, quads = refined(np.c_[np.zeros(2), rim].T, faces, side)
    return gso.Mesh(np.c_[plan, SHAPES[shape](*plan.T)], quads)


def _constraints(kind: str, mesh: gso.Mesh) -> list[Any]:
    grid = mesh.grid_index
    if not kind:
        return []
    if grid is None or kind == "FixedBoundary":
        return [gso.FixedBoundary()]
    side, points = grid[0], mesh.vertices
    centre = grid[grid.shape[0] // 2, grid.shape[1] // 2]
    up = points[[centre]] + [0, 0, 0.1]
    kinds = {
        "Handle": [gso.Fixed(side), gso.Handle([centre], up)],
        "OnCurve": [gso.OnCurve(side, points[side])],
        "SlidingBoundary": [gso.SlidingBoundary()],
        "SymmetryPlane": [gso.SymmetryPlane([0, 0, 0], [1, 0, 0])],
        "PlanarFaces": [gso.PlanarFaces()],
        "FixedLengths": [gso.FixedLengths(np.stack([side[:-1], side[1:]], axis=1))],
    }
    return kinds[kind]


def _solved(design: tuple[str, int], kind: str, full: bool) -> dict[str, float]:
    """Solve one design in this process; `full` without coarser meshes."""
    shape, side = design
    if shape == "grid":
        x, y = np.meshgrid(np.linspace(-1, 1, side), np.linspace(-1, 1, side), indexing="ij")
        mesh = gso.Mesh.from_grid(np.dstack([x, y, 0.3 * np.cos(2 * x) * np.cos(1.5 * y)]))
    else:
        mesh = patches(shape, side)
    options, constraints = Options(), _constraints(kind, mesh)
    if full:
        options = replace(options, coarse_vertices=10**9)
        levels._SHORT = 10**9
    start = time.process_time()
    result = gso.tno.optimize(mesh, options=options, constraints=constraints, verdict=False)
    return {
        "vertices": len(mesh.vertices),
        "s": time.process_time() - start,
        "MB": peak_mb(),
        "energy": energy(result),
        "|K|": result.metrics["loss_gc_worst"],
    }


def _compared(title: str, cases: list[tuple[tuple[str, int], str]], checked: int) -> dict[str, Any]:
    """Measure cases, with the full solve where the side of the design is at most `checked`."""
    rows = {}
    for design, kind in progress(cases, title):
        row = run_apart(_solved, design, kind, False)
        none = dict.fromkeys(("s", "energy", "|K|"), np.nan)
        full = run_apart(_solved, design, kind, True) if design[1] <= checked else none
        ratio = row["energy"] / full["energy"]
        more = {"full s": full["s"], "energy ratio": ratio, "full |K|": full["|K|"]}
        rows[f"{design[0]} {design[1]} {kind}".strip()] = row | more
    return tabulate(title, ["design"], rows)


def _stars(title: str, kind: str, side: int, checked: int) -> dict[str, Any]:
    sizes = sorted({min(checked, side), side})
    return _compared(title, [((shape, k), kind) for shape in SHAPES for k in sizes], checked)


def general(side: int = 200, checked: int = 64) -> dict[str, Any]:
    """Measure quad meshes of 5 side^2 faces, and smaller ones against the full solve."""
    out = _stars("Quad meshes with an irregular vertex", "", side, checked)
    if side > checked:
        small, large = (out[f"waves {k}"] for k in (checked, side))
        grown = np.log(large["vertices"] / small["vertices"])
        print(f"\nexponent of the time: {np.log(large['s'] / small['s']) / grown:.2f}")
    return out


def framed(side: int = 200, checked: int = 110) -> dict[str, Any]:
    """Measure the same with a fixed boundary."""
    return _stars("Quad meshes with a fixed boundary", "FixedBoundary", side, checked)


def constrained(side: int = 128) -> dict[str, Any]:
    """Measure a grid under constraints of every kind."""
    kinds = ("FixedBoundary", "Handle", "OnCurve", "SlidingBoundary", "SymmetryPlane")
    cases = [(("grid", side), kind) for kind in (*kinds, "PlanarFaces", "FixedLengths")]
    return _compared(f"Grid {side} x {side} under constraints", cases, side)


SECTIONS = (general, framed, constrained)
