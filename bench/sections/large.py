"""Large meshes that are not grids, and large grids under constraints: time, memory, energy.

Designs are quad meshes around a vertex of valence 5, and grids. Each is solved in a process of its
own, to measure its memory. At the sizes where that is affordable the solve without coarser meshes
gives the energy to compare with: the ratio is at most 1.01 where nothing is lost.
"""

from __future__ import annotations

import resource
import sys
import time
from dataclasses import replace
from multiprocessing import get_context
from typing import Any

import numpy as np
from harness import progress, table

import gso
from gso.tasks.developable import levels
from gso.tasks.developable.options import Options

#: Heights of the designs over the plane.
SHAPES = {
    "saddle": lambda x, y: 0.35 * (x * x - y * y),
    "dome": lambda x, y: np.sqrt(1.8 - 0.8 * (x * x + y * y)),
    "waves": lambda x, y: 0.15 * np.cos(3 * x + y) + 0.1 * np.sin(2 * y - x),
}


def star(shape: str, side: int, valence: int = 5) -> gso.Mesh:
    """Make a mesh of patches of side x side quads around a vertex of a given valence."""
    t = np.linspace(0, 1, side + 1)
    u, v = (x[..., None] for x in np.meshgrid(t, t, indexing="ij"))
    ids = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    quads = np.stack([ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]], axis=-1)
    points, faces = [], []
    for k in range(valence):
        turn = 2 * np.pi * (k + np.array([0, 0.5, 1])) / valence
        a, b, c = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        points.append((u * (1 - v) * a + v * (1 - u) * c + 1.15 * u * v * b).reshape(-1, 2))
        faces.append(quads.reshape(-1, 4) + k * ids.size)
    flat = np.concatenate(points)
    _, first, inverse = np.unique(
        np.round(flat * 1e7).astype(int), axis=0, return_index=True, return_inverse=True
    )
    x, y = flat[first].T
    plane = np.stack([x, y, SHAPES[shape](x, y)], axis=1)
    return gso.Mesh(plane, inverse.ravel()[np.concatenate(faces)])


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
        mesh = star(shape, side)
    options = Options()
    if full:
        options = replace(options, coarse_vertices=10**9)
        levels._SHORT = 10**9
    start = time.process_time()
    result = gso.tno.optimize(
        mesh, options=options, constraints=_constraints(kind, mesh), verdict=False
    )
    spent = time.process_time() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (
        1024.0 if sys.platform != "darwin" else 1024.0**2
    )
    return {
        "vertices": len(mesh.vertices),
        "s": spent,
        "MB": peak,
        "energy": sum(result.energy.values()),
        "|K|": result.metrics["loss_gc_worst"],
    }


def _measured(design: tuple[str, int], kind: str, full: bool) -> dict[str, float]:
    """Solve one design in a process of its own."""
    with get_context("spawn").Pool(1) as pool:
        return pool.apply(_solved, (design, kind, full))


def _compared(title: str, cases: list[tuple[tuple[str, int], str]], checked: int) -> dict[str, Any]:
    """Measure cases, with the full solve where the side of the design is at most `checked`."""
    out: dict[str, dict[str, float]] = {}
    for design, kind in progress(cases, title):
        row = _measured(design, kind, False)
        full = _measured(design, kind, True) if design[1] <= checked else None
        row["full s"] = full["s"] if full else np.nan
        row["energy ratio"] = row["energy"] / full["energy"] if full else np.nan
        row["full |K|"] = full["|K|"] if full else np.nan
        out[f"{design[0]} {design[1]} {kind}".strip()] = row
    rows = [[name, *row.values()] for name, row in out.items()]
    table(title, ["design", *next(iter(out.values()))], rows)
    return out


def general(side: int = 200, checked: int = 64) -> dict[str, Any]:
    """Measure quad meshes of 5 side^2 faces, and smaller ones against the full solve."""
    sizes = sorted({min(checked, side), side})
    cases = [((shape, k), "") for shape in SHAPES for k in sizes]
    out = _compared("Quad meshes with an irregular vertex", cases, checked)
    if len(sizes) > 1:
        small, large = (out[f"waves {k}"] for k in sizes)
        grown = np.log(large["vertices"] / small["vertices"])
        print(f"\nexponent of the time: {np.log(large['s'] / small['s']) / grown:.2f}")
    return out


def framed(side: int = 200, checked: int = 110) -> dict[str, Any]:
    """Measure the same with a fixed boundary."""
    sizes = sorted({min(checked, side), side})
    cases = [((shape, k), "FixedBoundary") for shape in SHAPES for k in sizes]
    return _compared("Quad meshes with a fixed boundary", cases, checked)


def constrained(side: int = 128) -> dict[str, Any]:
    """Measure a grid under constraints of every kind."""
    kinds = (
        "FixedBoundary",
        "Handle",
        "OnCurve",
        "SlidingBoundary",
        "SymmetryPlane",
        "PlanarFaces",
        "FixedLengths",
    )
    cases = [(("grid", side), kind) for kind in kinds]
    return _compared(f"Grid {side} x {side} under constraints", cases, side)


SECTIONS = (general, framed, constrained)
