"""Dragging on 64 x 64 grids: frames per second, and the energy once the handle rests.

A vertex is moved in 15 frames, each one move and one iteration. Its handle then rests for ten
more iterations, and the session is settled. Both energies are compared with that of a solve from
the design with the same constraints, in percent above it.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

import numpy as np
from harness import energy, medians, progress, tabulate

import gso
from gso.dataset import bezier
from gso.mesh import Mesh, vertex_normals

#: Task and formulation.
TASKS = (("developable", "curvature"), ("bend", "isometry"), ("developable", "isometry"))
FRAMES, RESTING = 15, 10
#: How far a vertex moves up, and a corner also towards the opposite one, by the diagonal.
_UP, _INWARDS = 0.04, 0.02


def drags(n: int = 64, count: int = 16) -> dict[str, Any]:
    """Drag a corner of each of several surfaces, the opposite border fixed."""
    rows = {}
    for task in TASKS:
        found = []
        for surface in progress(bezier.generate(count, seed=77), " ".join(task)):
            mesh = Mesh.from_grid(surface.sample(n))
            ids, v = mesh.grid_index, mesh.vertices
            corner, inwards = ids[-1, -1], v[ids[0, 0]] - v[ids[-1, -1]]
            way = _INWARDS * inwards + _UP * mesh.diagonal * vertex_normals(mesh)[corner]
            found.append(_dragged(mesh, task, [gso.Fixed(ids[0])], corner, way))
        worst = float(max(f["settled %"] for f in found))
        rows[task] = medians(found) | {"worst settled %": worst}
    title = f"A corner dragged, the opposite border fixed, {n} x {n}, medians of {count} surfaces"
    return tabulate(title, ["task", "formulation"], rows)


def kinds(n: int = 64) -> dict[str, Any]:
    """Drag the middle of a symmetric surface, one border fixed, under each kind of constraint."""
    rows = {}
    for task in TASKS:
        for name, (mesh, more, middle) in progress(_constrained(n).items(), " ".join(task)):
            way = _UP * mesh.diagonal * vertex_normals(mesh)[middle]
            rows[(*task, name)] = _dragged(mesh, task, more, middle, way)
    title = f"The middle dragged under each kind of constraint, {n} x {n}"
    return tabulate(title, ["task", "formulation", "constraint"], rows)


def frames(
    session: gso.tno.Session, ids: Any, places: Iterable[np.ndarray], steps: int = 1
) -> tuple[dict[str, float], np.ndarray]:
    """Move vertices from place to place, a frame each; return the speed, and all vertices then."""
    seconds = []
    for place in places:
        start = time.perf_counter()
        session.move(ids, place)
        vertices = session.step(steps)
        seconds.append(time.perf_counter() - start)
    median, slowest = float(np.median(seconds)), 1e3 * max(seconds)
    return {"frames / s": 1.0 / median, "slowest, ms": slowest}, vertices


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
    left, right = (Mesh.from_grid(part) for part in (grid[:, : n // 2], grid[:, n // 2 - 1 :]))
    count = len(left.vertices)
    faces = np.concatenate([left.faces, right.faces + count])
    joined = gso.Mesh(np.concatenate([left.vertices, right.vertices]), faces)
    one, other = left.grid_index, count + right.grid_index
    seam = gso.Glue(np.stack([one[:, -1], other[:, 0]], axis=1))
    border = gso.Fixed(np.r_[one[0], other[0]])
    out["Glue"] = joined, [border, seam], int(other[n // 2, n // 4])
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
    speed, _ = frames(session, [vertex], (at(k / FRAMES) for k in range(1, FRAMES + 1)))
    for _ in range(RESTING):
        session.step()
    resting = session.result()
    settled = session.settle()
    cold = gso.tno.optimize(mesh, **asked, constraints=[*more, gso.Handle([vertex], at(1.0))])
    own, last, first = map(energy, (cold, resting, settled))
    rest, settled = (100.0 * (value / own - 1.0) for value in (last, first))
    return speed | {"at rest %": rest, "settled %": settled}


SECTIONS = (drags, kinds)
