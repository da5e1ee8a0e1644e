"""Figures of the isometric mappings of Jiang et al. 2020: developable, bend, conformal, sessions.

    python bench/jiang.py                  everything (about six minutes on two cores)
    python bench/jiang.py interactive      one section
    python bench/jiang.py --json out.json  the figures as JSON, with machine and versions

Times are medians, one process, BLAS on one thread.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from report.peers_flatten import lscm
from tno import progress, quality, reference, run, table, timed

import gso
from gso import metrics
from gso.dataset import bezier
from gso.mesh import Mesh

#: Frames of a drag.
FRAMES = 40


def sheet(size: int) -> np.ndarray:
    """Return a flat square grid of side two."""
    u = np.linspace(-1.0, 1.0, size)
    return np.stack([*np.meshgrid(u, u, indexing="ij"), np.zeros((size, size))], axis=-1)


def rolled(points: np.ndarray, angle: float) -> np.ndarray:
    """Map points of the sheet (k, 3) to a cylinder; the side at x = -1 stays fixed."""
    radius = 2.0 / angle
    s = (points[:, 0] + 1.0) / radius
    x, z = radius * np.sin(s) - 1.0, radius * (1.0 - np.cos(s))
    return np.stack([x, points[:, 1], z], axis=1)


#: Formulation and preset of the rows of the section "developable".
SOLVES = {
    "jiang2020": ("isometry", "jiang2020"),
    "isometry fast": ("isometry", "fast"),
    "isometry balanced": ("isometry", "balanced"),
    "isometry accurate": ("isometry", "accurate"),
    "curvature balanced": ("curvature", "balanced"),
}


def developable() -> dict[str, Any]:
    """Compare the classical reference with the package's default, on the reference surfaces."""
    surfaces, _ = reference()
    rows, out = [], {}
    for name, (formulation, options) in SOLVES.items():
        figures, flat, seconds = [], [], []
        for points in progress(surfaces, name):
            result, spent = timed(
                lambda p=points, f=formulation, o=options: gso.tno.optimize(
                    p, formulation=f, options=o
                )
            )
            m = result.metrics
            figures.append(quality(points, result.grid))
            flat.append([m.get(k, np.nan) for k in ("parallelogram_strain", "strain_mean")])
            flat[-1].append(m.get("flipped_cells", np.nan))
            seconds.append(spent)
        mean, image = np.mean(figures, axis=0), np.mean(flat, axis=0)
        time_spent = [float(np.median(seconds)), float(np.max(seconds))]
        rows.append([name, *mean, *image[:2], image[2] * len(flat), *time_spent])
        out[name] = dict(zip(_COLUMNS, map(float, rows[-1][1:]), strict=True))
    table(
        "Developable, 24 surfaces (published: loss_gc 0.0283, K_A-r 0.8888, d_H 0.823 %, 38 s). "
        "Strains of the flat image that comes with the surface",
        ["preset", *_COLUMNS],
        rows,
    )
    return out


_COLUMNS = ("loss_gc", "K_A-r", "d_H %", "fairness", "parallelogram strain", "strain", "flipped")
_COLUMNS += ("median s", "max s")


def tradeoff() -> dict[str, Any]:
    """Vary the weights of isometry and fairness in solves with the isometry energy alone.

    The surfaces have another seed, the start is cold, and the other weights are those of
    ``jiang2020``.
    """
    surfaces = [s.sample(64) for s in bezier.generate(8, seed=2002)]
    frozen = gso.IsometryOptions.preset("jiang2020")
    rows, out = [], {}
    for factor in (0.1, 0.3, 1.0, 3.0):
        for fairness in (3e-5, 1e-4, 3e-4):
            options = replace(
                frozen,
                w_isometry=factor * frozen.w_isometry,
                w_mapping=factor * frozen.w_mapping,
                w_fairness=fairness,
            )
            name = f"isometry x {factor:g}, fairness {fairness:.0e}"
            figures = [
                quality(p, gso.tno.optimize(p, options=options).grid)
                for p in progress(surfaces, name)
            ]
            mean, worst = np.mean(figures, axis=0), np.max(figures, axis=0)[0]
            rows.append([name, *mean, worst])
            out[name] = [*map(float, mean), float(worst)]
    table(
        "Isometry alone, 8 surfaces of seed 2002",
        ["weights", "loss_gc", "K_A-r", "d_H %", "fairness", "worst loss_gc"],
        rows,
    )
    return out


def interactive() -> dict[str, Any]:
    """Measure frames per second while handles are dragged, and the lag of the surface."""
    rows, out = [], {}
    for name, drag in _drags().items():
        for steps in (1, 2):
            figures = _dragged(*drag, steps)
            rows.append([name, str(steps), *figures.values()])
            out[f"{name}, {steps}"] = figures
    columns = ["task", "iterations", "frames / s", "slowest, ms", "lag %", "lag / frame", "backend"]
    columns += ["analyses"]
    table(
        "Dragging (aim: 10 frames / s). Lag: largest distance from the settled surface, percent "
        "of its diagonal, and relative to what the handle moves in a frame",
        columns,
        rows,
    )
    return out


def _drags() -> dict[str, tuple[gso.tno.Session, Any, Any]]:
    """Return sessions, their dragged vertices, and the positions of these at a share of the way."""
    flat = sheet(64)
    v = flat.reshape(-1, 3)
    first, last = np.arange(128), np.arange(64 * 62, 64 * 64)
    held = [gso.Fixed(first), gso.Handle(last, v[last])]
    bend = gso.tno.Session(flat, constraints=held)
    found = {"bend 64 x 64, rolled up": (bend, last, lambda s: rolled(v[last], max(3.0 * s, 1e-9)))}
    curved = bezier.generate(1, seed=77)[0]
    # Share of the distance to the opposite corner by which a corner is moved towards it, and up.
    # The handles of developable solves are soft, because the shape of the corners must change.
    for task, formulation, size, reach, weight in (
        ("bend", "isometry", 64, 0.15, None),
        ("developable", "curvature", 64, 0.05, 0.1),
        ("developable", "isometry", 32, 0.05, 0.1),
    ):
        mesh = Mesh.from_grid(curved.sample(size))
        p, grid = mesh.vertices, mesh.grid_index
        corners = [grid[a, b].ravel() for a in (_HEAD, _TAIL) for b in (_HEAD, _TAIL)]
        ids = np.concatenate(corners)
        session = gso.tno.Session(
            mesh,
            task=task,
            formulation=formulation,
            constraints=[gso.Handle(ids, p[ids], weight=weight)],
        )
        along = p[grid[0, 0]] - p[grid[-1, -1]]
        way = reach * (along + np.linalg.norm(along) * _normal(mesh))
        moved = np.isin(ids, corners[3])[:, None]
        name = f"{task}, {formulation}, {size} x {size}, a corner"
        found[name] = session, ids, _straight(p[ids], moved * way)
    return found


#: Rows or columns of the grid in a corner.
_HEAD, _TAIL = slice(0, 3), slice(-3, None)


def _straight(start: np.ndarray, way: np.ndarray) -> Callable[[float], np.ndarray]:
    return lambda share: start + share * way


def _normal(mesh: Mesh) -> np.ndarray:
    mean = metrics.face_normals(mesh).mean(axis=0)
    return mean / np.linalg.norm(mean)


def _dragged(session: gso.tno.Session, ids: Any, place: Any, steps: int) -> dict[str, Any]:
    """Settle a session at the start, drag its handles to the end, and measure."""
    session.move(ids, place(0.0))
    session.settle()
    seconds = []
    for k in progress(range(1, FRAMES + 1), "drag"):
        start = time.perf_counter()
        session.move(ids, place(k / FRAMES))
        vertices = session.step(steps)
        seconds.append(time.perf_counter() - start)
    moved = np.linalg.norm(place(1.0) - place(1.0 - 1.0 / FRAMES), axis=1).max()
    result = session.settle()
    lag = np.linalg.norm(result.mesh.vertices - vertices, axis=1).max()
    return {
        "fps": 1.0 / float(np.median(seconds)),
        "slowest": 1e3 * max(seconds),
        "lag": 100.0 * lag / result.design.diagonal,
        "lag_frames": lag / moved,
        "backend": result.backend,
        "analyses": float(session.analyses),
    }


def bend() -> dict[str, Any]:
    """Roll up sheets by their ends: length errors, and the distance from the cylinder."""
    rows, out = [], {}
    for size in (32, 64):
        v = sheet(size).reshape(-1, 3)
        ids = np.r_[: 2 * size, size * (size - 2) : size * size]
        for preset in ("fast", "balanced", "accurate"):
            for turn in (0.5, 1.0, 1.6):
                wanted = rolled(v, turn * np.pi)
                handles = [gso.Handle(ids, wanted[ids])]
                result, seconds = timed(
                    lambda s=size, p=preset, h=handles: gso.tno.optimize(
                        sheet(s), task="bend", options=p, constraints=h
                    )
                )
                m = result.metrics
                far = np.linalg.norm(result.mesh.vertices - wanted, axis=1).max()
                rows.append(
                    [
                        f"{size} x {size}, {preset}, {turn * 180:.0f} degrees",
                        m["edge_length_error"],
                        m["strain_max"],
                        m["loss_gc"],
                        far / 2.0,
                        float(result.iterations),
                        seconds,
                    ]
                )
                out[rows[-1][0]] = rows[-1][1:]
    table(
        "A sheet rolled up; its handles are on a smooth cylinder, whose chords are shorter",
        ["sheet", "edges", "strain max", "loss_gc", "from cylinder", "iterations", "s"],
        rows,
    )
    return out


def conformal() -> dict[str, Any]:
    """Compare angle distortion on the 24 surfaces with libigl's least-squares conformal map."""
    surfaces = [Mesh.from_grid(s) for s in reference()[0]]
    rows, out = [], {}
    for name in ("fast", "balanced", "accurate", "libigl LSCM"):
        figures, seconds = [], []
        for mesh in progress(surfaces, name):
            if name == "libigl LSCM":
                flat, spent = timed(lambda m=mesh: lscm(m))
            else:
                result, spent = timed(
                    lambda m=mesh, o=name: gso.tno.optimize(m, task="conformal", options=o)
                )
                flat = result.flat
            seconds.append(spent)
            figures.append(_rated(mesh, flat))
        rows.append([name, *np.mean(figures, axis=0), float(np.median(seconds))])
        out[name] = rows[-1][1:]
    table(
        "Conformal maps of the 24 surfaces: s1/s2 - 1 of the cells, lengths flat / surface",
        ["map", "mean", "p99", "max", "scale min", "scale max", "flipped", "median s"],
        rows,
    )
    return out


def _rated(mesh: Mesh, flat: np.ndarray) -> tuple[float, ...]:
    distortion = metrics.quasi_conformal(mesh, flat) - 1.0
    scale = np.sqrt(np.prod(metrics.stretches(mesh, flat), axis=0))
    scale /= np.sqrt((scale**2).mean())
    return (
        float(distortion.mean()),
        float(np.percentile(distortion, 99)),
        float(distortion.max()),
        float(scale.min()),
        float(scale.max()),
        float(metrics.flips(mesh, flat)),
    )


if __name__ == "__main__":
    sections = (developable, tradeoff, bend, conformal, interactive)
    run({section.__name__: section for section in sections}, __doc__)
