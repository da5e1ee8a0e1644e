"""The isometric mappings of Jiang et al. 2020: developable, bend, conformal, sessions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from harness import PRESETS, compare, progress, quality, reference, solver, tabulate
from report.peers_flatten import lscm

import gso
from gso import metrics
from gso.dataset import bezier
from gso.mesh import Mesh
from sections.session import frames

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
    **{f"isometry {preset}": ("isometry", preset) for preset in PRESETS},
    "curvature balanced": ("curvature", "balanced"),
}
_QUALITY = ("loss_gc", "worse", "K_A-r", "d_H %", "fairness")


def developable() -> dict[str, Any]:
    """Compare the classical reference with the package's default, on the reference surfaces."""
    flat = ("parallelogram_strain", "strain_mean", "flipped_cells")

    def rated(points: np.ndarray, result: gso.Result) -> dict[str, float]:
        return quality(points, result.grid) | {k: result.metrics.get(k, np.nan) for k in flat}

    return compare(
        "Developable, 24 surfaces (published: loss_gc 0.0283, K_A-r 0.8888, d_H 0.823 %, 38 s). "
        "Strains of the flat image that comes with the surface",
        {name: solver(formulation=f, options=o) for name, (f, o) in SOLVES.items()},
        reference()[0],
        rated,
        [*_QUALITY, *flat[:2], ("flipped", flat[2], np.sum)],
        head="preset",
    )


def tradeoff() -> dict[str, Any]:
    """Vary the weights of isometry and fairness in solves with the isometry energy alone.

    The surfaces have another seed, the start is cold, and the other weights are those of
    ``jiang2020``.
    """
    frozen, runs = gso.IsometryOptions.preset("jiang2020"), {}
    for factor, fairness in product((0.1, 0.3, 1.0, 3.0), (3e-5, 1e-4, 3e-4)):
        weights = {k: factor * getattr(frozen, k) for k in ("w_isometry", "w_mapping")}
        options = replace(frozen, **weights, w_fairness=fairness)
        runs[f"isometry x {factor:g}, fairness {fairness:.0e}"] = solver(options=options)
    return compare(
        "Isometry alone, 8 surfaces of seed 2002",
        runs,
        [s.sample(64) for s in bezier.generate(8, seed=2002)],
        lambda points, result: quality(points, result.grid),
        [*_QUALITY, ("worst loss_gc", "loss_gc", np.max)],
        head="weights",
    )


def interactive() -> dict[str, Any]:
    """Measure frames per second while handles are dragged, and the lag of the surface."""
    rows = {}
    for name, drag in _drags().items():
        for steps in (1, 2):
            rows[name, str(steps)] = _dragged(*drag, steps)
    return tabulate(
        "Dragging (aim: 10 frames / s). Lag: largest distance from the settled surface, percent "
        "of its diagonal, and relative to what the handle moves in a frame",
        ["task", "iterations"],
        rows,
    )


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
        # Rows or columns of the grid in a corner.
        ends = (slice(0, 3), slice(-3, None))
        corners = [grid[a, b].ravel() for a in ends for b in ends]
        ids = np.concatenate(corners)
        held = [gso.Handle(ids, p[ids], weight=weight)]
        session = gso.tno.Session(mesh, task=task, formulation=formulation, constraints=held)
        along, normal = p[grid[0, 0]] - p[grid[-1, -1]], metrics.face_normals(mesh).mean(axis=0)
        way = reach * (along + np.linalg.norm(along) * normal / np.linalg.norm(normal))
        way = np.isin(ids, corners[3])[:, None] * way
        name = f"{task}, {formulation}, {size} x {size}, a corner"
        found[name] = session, ids, lambda share, start=p[ids], way=way: start + share * way
    return found


def _dragged(session: gso.tno.Session, ids: Any, place: Any, steps: int) -> dict[str, Any]:
    """Settle a session at the start, drag its handles to the end, and measure."""
    session.move(ids, place(0.0))
    session.settle()
    ways = progress(range(1, FRAMES + 1), "drag")
    speed, vertices = frames(session, ids, (place(k / FRAMES) for k in ways), steps)
    moved = np.linalg.norm(place(1.0) - place(1.0 - 1.0 / FRAMES), axis=1).max()
    result = session.settle()
    lag = np.linalg.norm(result.mesh.vertices - vertices, axis=1).max()
    lags = {"lag %": 100.0 * lag / result.design.diagonal, "lag / frame": lag / moved}
    return speed | lags | {"backend": result.backend, "analyses": float(session.analyses)}


def bend() -> dict[str, Any]:
    """Roll up sheets by their ends: length errors, and the distance from the cylinder."""

    keys = {"edges": "edge_length_error", "strain max": "strain_max", "loss_gc": "loss_gc"}

    def rated(given: tuple[np.ndarray, ...], result: gso.Result) -> dict[str, float]:
        far = np.linalg.norm(result.mesh.vertices - given[2], axis=1).max() / 2.0
        found = {name: result.metrics[key] for name, key in keys.items()}
        return found | {"from cylinder": far, "iterations": float(result.iterations)}

    def rolled_up(given: tuple[np.ndarray, ...], preset: str) -> gso.Result:
        points, ids, wanted = given
        handles = [gso.Handle(ids, wanted[ids])]
        return gso.tno.optimize(points, task="bend", options=preset, constraints=handles)

    found = {}
    for size, turn in product((32, 64), (0.5, 1.0, 1.6)):
        points = sheet(size)
        ids = np.r_[: 2 * size, size * (size - 2) : size * size]
        case = (points, ids, rolled(points.reshape(-1, 3), turn * np.pi))
        name = f"{size} x {size}, {turn * 180:.0f} degrees"
        title = f"A sheet rolled up, {name}; the handles are on a smooth cylinder, whose chords "
        runs = {f"{name}, {preset}": partial(rolled_up, preset=preset) for preset in PRESETS}
        columns = [*keys, "from cylinder", "iterations"]
        found |= compare(title + "are shorter", runs, [case], rated, columns)
    return found


def conformal() -> dict[str, Any]:
    """Compare angle distortion on the 24 surfaces with libigl's least-squares conformal map."""
    runs: dict[str, Callable[[Mesh], Any]] = {
        preset: lambda m, o=preset: gso.tno.optimize(m, task="conformal", options=o).flat
        for preset in PRESETS
    }
    return compare(
        "Conformal maps of the 24 surfaces: s1/s2 - 1 of the cells, lengths flat / surface",
        runs | {"libigl LSCM": lscm},
        [Mesh.from_grid(s) for s in reference()[0]],
        _distorted,
        ["mean", "p99", "max", "scale min", "scale max", ("flipped", np.sum)],
        head="map",
    )


def _distorted(mesh: Mesh, flat: np.ndarray) -> dict[str, float]:
    distortion = metrics.quasi_conformal(mesh, flat) - 1.0
    scale = np.sqrt(np.prod(metrics.stretches(mesh, flat), axis=0))
    scale /= np.sqrt((scale**2).mean())
    return {
        "mean": distortion.mean(),
        "p99": np.percentile(distortion, 99),
        "max": distortion.max(),
        "scale min": scale.min(),
        "scale max": scale.max(),
        "flipped": metrics.flips(mesh, flat),
    }


SECTIONS = (developable, tradeoff, bend, conformal, interactive)
