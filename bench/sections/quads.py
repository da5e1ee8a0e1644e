"""Strips of quad designs: their distance by number, beside every m-th line of the design itself.

``folder=PATH`` takes the quad meshes of a folder instead of designs by formula, ``names=a+b`` some
of them. Distances are per cent of the diagonal, angles degrees, seconds those of the processor.
The trivial method takes lines at equal numbers of rows and makes the quads between them planar.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from harness import progress, quietly, tabulate

import gso
from gso.ruled.lines import Cells, Family, families, line_surface, planarised
from gso.typing import Array, Ints

#: Meshes of a folder with more faces are left out.
_LARGE = 12_000
_SUFFIXES = (".obj", ".off", ".ply")


def formulas(count: int = 33) -> dict[str, gso.Mesh]:
    """Return smooth quad designs, none of which was tuned on."""
    u, v = np.meshgrid(np.linspace(-1, 1, count), np.linspace(-1.3, 1.3, count), indexing="ij")
    a, b = np.pi * u, np.pi * v / 1.3
    heights = {
        "pillow": 0.4 * np.cos(a / 2) * np.cos(b / 2),
        "dome": np.sqrt(4.0 - u**2 - v**2) - 1.0,
        "saddle": 0.35 * (u**2 - v**2),
        "hypar": 0.5 * u * v,
        "wave": 0.12 * np.sin(a) * np.cos(b / 2) + 0.1 * v**2,
        "bump": 0.6 * np.exp(-2.0 * (u**2 + 0.5 * v**2)),
        "monkey": 0.25 * (u**3 - 3.0 * u * v**2) / 1.5,
        "twist": 0.3 * u * np.sin(b / 2) + 0.2 * v**2,
    }
    out = {name: np.stack([u, v, z], axis=-1) for name, z in heights.items()}
    t, s = a / 2, 0.4 * b
    out["torus"] = np.stack(
        [(2 + np.cos(t)) * np.cos(s), (2 + np.cos(t)) * np.sin(s), np.sin(t)], axis=-1
    )
    out["catenoid"] = np.stack([np.cosh(v) * np.cos(t), np.cosh(v) * np.sin(t), v], axis=-1)
    return {name: gso.as_mesh(points) for name, points in out.items()}


def _designs(folder: str, names: str) -> Iterator[tuple[str, gso.Mesh]]:
    every = formulas() if not folder else {}
    for path in sorted(Path(folder).iterdir()) if folder else ():
        if path.suffix in _SUFFIXES:
            mesh = gso.load(path)
            if len(mesh.faces) <= _LARGE and not mesh.has_triangles and mesh.boundary_loops:
                every[path.stem] = mesh
    for name, mesh in every.items():
        if not names or name in names.split("+"):
            yield name, mesh


def lines(folder: str = "", names: str = "", numbers: str = "4+8+16") -> dict[str, Any]:
    """Measure strips by number, and the trivial method."""
    rows: dict[Any, dict[str, Any]] = {}
    for name, mesh in progress(list(_designs(folder, names)), "designs"):
        start = time.process_time()
        quietly(gso.tno.optimize, mesh)
        balanced = time.process_time() - start
        far = np.inf
        for number in numbers.split("+"):
            start = time.process_time()
            try:
                result = quietly(gso.strips, mesh, strips=int(number))
            except gso.MeshError as error:
                print(f"{name}, {number}: {error}")
                continue
            spent = time.process_time() - start
            found = result.metrics
            trivial = every_line(mesh, int(number))
            rows[name, number] = {
                "mean": found["distance_mean"],
                "max": found["distance_max"],
                "trivial mean": trivial[0],
                "trivial max": trivial[1],
                "crease": found["crease_angle_max"],
                "turn": found["crease_turn_max"],
                "radius": 100.0 * found["bend_radius_min"] / mesh.diagonal,
                "from": result.details["rulings_from"],
                "usable": str(result.usable),
                "why": ", ".join(reason.code.value for reason in result.reasons),
                "nearer": str(found["distance_max"] <= min(far, trivial[1])),
                "s": spent,
                "x balanced": spent / balanced,
            }
            far = found["distance_max"]
    return tabulate("Strips of quad designs", ["design", "strips"], rows)


def auto(folder: str = "", names: str = "", bounds: str = "2+1") -> dict[str, Any]:
    """Count the designs whose strips hold a bound on the deviation, as a whole or in pieces."""
    rows: dict[Any, dict[str, Any]] = {}
    for name, mesh in progress(list(_designs(folder, names)), "designs"):
        for bound in bounds.split("+"):
            start = time.process_time()
            result = quietly(gso.strips, mesh, max_deviation=f"{bound}%")
            rows[name, bound] = {
                "strips": str(result.details.get("strips")),
                "max": result.metrics["distance_max"],
                "usable": str(result.usable),
                "why": ", ".join(reason.code.value for reason in result.reasons),
                "from": str(result.details.get("rulings_from")),
                "s": time.process_time() - start,
            }
    return tabulate("As few strips as hold a bound", ["design", "bound %"], rows)


def every_line(mesh: gso.Mesh, count: int) -> tuple[float, float]:
    """Return the mean and largest distance of quads between lines at equal numbers of rows."""
    unit = mesh.replaced((mesh.vertices - mesh.vertices.mean(axis=0)) / mesh.diagonal)
    best = np.inf, np.inf
    for family in families(unit):
        kept = _even(family, count)
        if kept is None:
            continue
        try:
            polygons = Cells(family, kept).polygons
            surface = line_surface(unit, polygons, planarised(polygons, unit.vertices))
        except gso.MeshError:
            # Corners may run together.
            continue
        far = surface.distances(unit, sampled=True)
        tried = far.mean, far.largest
        best = min(best, tried, key=lambda one: one[1])
    return 100.0 * best[0], 100.0 * best[1]


def _even(family: Family, count: int) -> Ints | None:
    """Return lines at equal numbers of rows; None where there are too few for so many strips."""
    size: Array = np.array([len(band.rows) for band in family.bands])
    least = np.array([3 if band.closed else 1 for band in family.bands])
    if not least.sum() <= count <= size.sum():
        return None
    own = least.copy()
    for _ in range(count - int(least.sum())):
        own[int(np.where(own < size, size / own, -1.0).argmax())] += 1
    kept = []
    for band, number in zip(family.bands, own, strict=True):
        at = np.round(np.arange(1, number + band.closed) * len(band.rows) / number).astype(int)
        kept.append(band.lines[at - 1])
    return np.sort(np.concatenate(kept))


SECTIONS = (lines, auto)
