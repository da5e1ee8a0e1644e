"""Dragging on 64 x 64 grids: frames per second, and the energy once the handle rests.

A vertex is moved in 15 frames, each one move and one iteration. Its handle then rests for ten
more iterations, and the session is settled. Both energies are compared with that of a solve from
the design with the same constraints, in percent above it.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from harness import progress, table

import gso
from gso.dataset import bezier
from gso.mesh import Mesh
from gso.mesh.normals import vertex_normals

#: Task and formulation.
TASKS = (("developable", "curvature"), ("bend", "isometry"), ("developable", "isometry"))
FRAMES, RESTING = 15, 10
#: How far a vertex moves up, and a corner also towards the opposite one, by the diagonal.
_UP, _INWARDS = 0.04, 0.02


def drags(n: int = 64, count: int = 16) -> dict[str, Any]:
    """Drag a corner of each of several surfaces, the opposite border fixed."""
    out, rows = {}, []
    for task in TASKS:
        found = []
        for surface in progress(bezier.generate(count, seed=77), " ".join(task)):
            mesh = Mesh.from_grid(surface.sample(n))
            ids, v = mesh.grid_index, mesh.vertices
            corner, inwards = ids[-1, -1], v[ids[0, 0]] - v[ids[-1, -1]]
            way = _INWARDS * inwards + _UP * mesh.diagonal * vertex_normals(mesh)[corner]
            found.append(_dragged(mesh, task, [gso.Fixed(ids[0])], corner, way))
        middle = {name: float(np.median([f[name] for f in found])) for name in found[0]}
        rows.append([*task, *middle.values(), float(max(f["settled"] for f in found))])
        out[" ".join(task)] = middle
    title = f"A corner dragged, the opposite border fixed, {n} x {n}, medians of {count} surfaces"
    table(title, ["task", "formulation", *_COLUMNS, "worst settled %"], rows)
    return out


def kinds(n: int = 64) -> dict[str, Any]:
    """Drag the middle of a symmetric surface, one border fixed, under each kind of constraint."""
    out, rows = {}, []
    for task in TASKS:
        for name, (mesh, more, middle) in progress(_constrained(n).items(), " ".join(task)):
            way = _UP * mesh.diagonal * vertex_normals(mesh)[middle]
            found = _dragged(mesh, task, more, middle, way)
            rows.append([*task, name, *found.values()])
            out[" ".join((*task, name))] = found
    title = f"The middle dragged under each kind of constraint, {n} x {n}"
    table(title, ["task", "formulation", "constraint", *_COLUMNS], rows)
    return out


_COLUMNS = ["frames / s", "slowest, ms", "at rest %", "settled %"]


def _constrained(n: int) -> dict[str, tuple[Mesh, list[Any], int]]:
    """Return a mesh, its constraints, and the vertex to drag, by kind of constraint."""
    u, w = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    grid = np.dstack([u, w, 0.25 * u**2 - 0.2 * w**2 + 0.1 * u * w**2])
    mesh = Mesh.from_grid(grid)
    ids, v = np.arange(n * n).reshape(n, n), mesh.vertices
    middle, side = int(ids[n // 2, n // 2]), ids[:, 0]
    held = gso.Fixed(ids[0])
    apart = int(ids[n // 2, n // 4])
    more = {
        "Fixed": [],
        "soft Handle": [gso.Handle([apart], v[[apart]], weight=0.1)],
        "OnCurve": [gso.OnCurve(side, v[side])],
        "SlidingBoundary": [gso.SlidingBoundary()],
        "SymmetryPlane": [gso.SymmetryPlane([0, 0, 0], [0, 1, 0])],
        "SmoothCurves": [gso.SmoothCurves([ids[n // 4]])],
        "PlanarFaces": [gso.PlanarFaces()],
        "FixedLengths": [gso.FixedLengths(mesh.edges[:n])],
    }
    out = {name: (mesh, [held, *own], middle) for name, own in more.items()}
    out["FixedBoundary"] = mesh, [gso.FixedBoundary()], middle
    halves = [Mesh.from_grid(part) for part in (grid[:, : n // 2], grid[:, n // 2 - 1 :])]
    joined = gso.Mesh(
        np.concatenate([half.vertices for half in halves]),
        np.concatenate([halves[0].faces, halves[1].faces + len(halves[0].vertices)]),
    )
    left = np.arange(n * (n // 2)).reshape(n, -1)
    right = len(halves[0].vertices) + np.arange(len(halves[1].vertices)).reshape(n, -1)
    seam = gso.Glue(np.stack([left[:, -1], right[:, 0]], axis=1))
    border = gso.Fixed(np.r_[left[0], right[0]])
    out["Glue"] = joined, [border, seam], int(right[n // 2, n // 4])
    return out


def _dragged(
    mesh: Mesh, task: tuple[str, str], more: list[Any], vertex: int, way: np.ndarray
) -> dict[str, float]:
    """Drag a vertex by `way`, let it rest, and settle."""

    def at(share: float) -> np.ndarray:
        return mesh.vertices[[vertex]] + share * way

    asked: dict[str, Any] = {"task": task[0], "formulation": task[1]}
    session = gso.tno.Session(mesh, **asked, constraints=[*more, gso.Handle([vertex], at(0.0))])
    session.settle()
    seconds = []
    for k in range(1, FRAMES + 1):
        start = time.perf_counter()
        session.move([vertex], at(k / FRAMES))
        session.step()
        seconds.append(time.perf_counter() - start)
    for _ in range(RESTING):
        session.step()
    resting = session.result()
    settled = session.settle()
    cold = gso.tno.optimize(mesh, **asked, constraints=[*more, gso.Handle([vertex], at(1.0))])
    own, last, first = (sum(r.energy.values()) for r in (cold, resting, settled))
    return {
        "fps": 1.0 / float(np.median(seconds)),
        "slowest": 1e3 * max(seconds),
        "resting": 100.0 * (last / own - 1.0),
        "settled": 100.0 * (first / own - 1.0),
    }


SECTIONS = (drags, kinds)
