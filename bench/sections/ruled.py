"""Exactly ruled surfaces: one strip and several, on the reference surfaces and the panel.

Distances are the larger of both directions, all over both surfaces, percent of the diagonal; the
largest one includes those between the outlines, which show slits. The solver minimises distances
of about a thousand points. Folds are the largest angles between two
faces, in degrees: neither distance nor strain sees a surface that is crumpled.
"""

from __future__ import annotations

import sys
import warnings
from typing import Any

import numpy as np
from harness import ROOT, progress, reference, table, timed

import gso
from gso import metrics
from gso.dataset import bezier
from sections import analytic

#: Options by the name of the row.
STRIPS = {
    "1": {"strips": 1},
    "tree": {"flats": True},
    **{str(k): {"strips": k} for k in (2, 4, 8)},
}
#: Curvature up to which surfaces of another seed are used.
_MOST = 0.9


def strips(seed: str = "", start: str = "design", count: int = 24) -> dict[str, Any]:
    """Measure numbers of strips; with a seed on other surfaces of the same recipe."""
    surfaces = _others(int(seed), count) if seed else _references()
    out = {}
    rows = []
    for number, settings in STRIPS.items():
        options = gso.RuledOptions(starts=tuple(start.split("+")), **settings)
        found = [_measured(s, options) for s in progress(surfaces, f"strips: {number}")]
        every = {k: np.array([f[k] for f in found]) for k in found[0]}
        out[number] = {k: v.tolist() for k, v in every.items()}
        far, fold = every["max"], every["fold"]
        rows.append(
            [
                number,
                np.median(every["mean"]),
                np.median(far),
                np.quantile(far, 0.9),
                far.max(),
                int((every["crossed"] > 0).sum()),
                np.median(fold),
                np.quantile(fold, 0.9),
                int(every["usable"].sum()),
                np.median(every["s"]),
            ]
        )
    columns = [
        "strips",
        "mean %",
        "max %",
        "90 %",
        "worst",
        "crossed",
        "fold",
        "90 %",
        "usable",
        "s",
    ]
    table(f"{len(surfaces)} surfaces, starts {start}", columns, rows)
    return out


def cad(seed: str = "", count: int = 24) -> dict[str, Any]:
    """Measure smooth strips: how torsal they are, and their distance from the planar faces."""
    surfaces = _others(int(seed), count) if seed else _references()
    out, rows = {}, []
    for number in ("1", "tree", "4"):
        found = []
        for surface in progress(surfaces, f"smooth strips: {number}"):
            options = gso.RuledOptions(starts=("design",), **STRIPS[number])
            result = _optimised(surface, options=options)
            strips, seconds = timed(gso.smooth_strips, result.ruled, result.design)
            percent = 100.0 / result.design.diagonal
            far = [percent * x for x in strips.distances]
            faces = sum(len(p.faces) for p in strips.patches)
            found.append([strips.turning, strips.kink, strips.is_torsal, *far, faces, seconds])
        every = np.array(found, float)
        out[number] = every.tolist()
        turn, lean, torsal, mean, largest, faces, seconds = every.T
        row = [np.median(turn), turn.max(), int((lean <= 0.1).sum()), int(torsal.sum())]
        rows.append([number, *row, *(np.median(x) for x in (mean, largest, faces, seconds))])
    columns = ["strips", "turn deg", "worst", "no break", "torsal", "mean %", "max %", "faces", "s"]
    table(f"Smooth strips of {len(surfaces)} surfaces", columns, rows)
    return out


def _references() -> list[Any]:
    return [*reference()[0], gso.load(ROOT / "examples" / "panel.obj")]


def _others(seed: int, count: int) -> list[Any]:
    every = (shape.sample() for shape in bezier.generate(4 * count, seed=seed))
    return [points for points in every if metrics.loss_gc(points) <= _MOST][:count]


def _optimised(surface: Any, **given: Any) -> gso.Result:
    """Optimise without warnings: results that are not usable are counted."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gso.ConvergenceWarning)
        return gso.tno.optimize(surface, **given)


def _measured(surface: Any, options: gso.RuledOptions) -> dict[str, float]:
    result = _optimised(surface, options=options)
    found = result.metrics
    return {
        "mean": found["distance_mean"],
        "max": found["distance_max"],
        "crossed": found["rulings_crossed"],
        "fold": found["fold_max"],
        "usable": float(result.usable),
        "s": result.seconds["strips"],
    }


def convergence() -> dict[str, Any]:
    """Compare the rulings of known surfaces, sampled four times as finely as they are many."""
    out, rows = {}, []
    for name, make in analytic.SURFACES.items():
        for count in (17, 33, 65):
            known = make(4 * count)
            options = gso.RuledOptions(rulings=count, starts=("design",))
            result = gso.tno.optimize(known.points, options=options)
            size = result.design.diagonal
            off = known.distance(result.ruled.samples()[0]).max() / size
            back = metrics.point_to_surface(result.design.vertices, result.mesh).max() / size
            a, b = result.mesh.vertices[result.rulings.edges].transpose(1, 0, 2)
            length = np.linalg.norm(b - a, axis=1)
            true = known.ruling(0.5 * (a + b))
            sine = np.linalg.norm(np.cross(b - a, true), axis=1) / length
            angle = np.degrees(np.arcsin(np.clip(sine, 0.0, 1.0)))
            long = angle[length > 0.5 * length.max()]
            row = [100 * off, 100 * back, np.median(long), long.max(), angle.max()]
            out[f"{name}, {count}"] = row
            rows.append([name, count, *row, str(result.usable)])
    columns = [
        "surface",
        "rulings",
        "off %",
        "back %",
        "median deg",
        "long deg",
        "all deg",
        "usable",
    ]
    table("Known surfaces", columns, rows)
    return out


def bounds(seed: str = "", start: str = "design", count: int = 24) -> dict[str, Any]:
    """Measure the numbers of strips that hold bounds on the deviation."""
    surfaces = _others(int(seed), count) if seed else _references()
    out, rows = {}, []
    options = gso.RuledOptions(strips="auto", starts=tuple(start.split("+")))
    for percent in (2.0, 1.0, 0.5):
        numbers, refused, seconds = [], [], []
        for surface in progress(surfaces, f"{percent} %"):
            mesh = surface if isinstance(surface, gso.Mesh) else gso.Mesh.from_grid(surface)
            most = 0.01 * percent * mesh.diagonal
            result = _optimised(mesh, options=options, max_deviation=most)
            seconds.append(result.seconds["strips"])
            if result.usable:
                numbers.append(result.ruled.strips)
            else:
                refused.append(result.metrics["distance_max"])
        out[str(percent)] = {"strips": numbers, "refused": refused, "s": seconds}
        found = " ".join(map(str, sorted(numbers)))
        best = " ".join(f"{far:.2f}" for far in sorted(refused))
        rows.append([f"{percent} %", len(refused), best, found, np.median(seconds), max(seconds)])
    columns = ["bound", "refused", "their best %", "numbers of strips", "median s", "max s"]
    table(f"{len(surfaces)} surfaces, starts {start}", columns, rows)
    return out


def general(start: str = "design") -> dict[str, Any]:
    """Measure meshes from practice: teapot patches, irregular quads, triangles, a hole."""
    sys.path.insert(0, str(ROOT / "examples"))
    import irregular
    import teapot

    panel = gso.load(ROOT / "examples" / "panel.obj")
    order = np.random.default_rng(5).permutation(len(panel.vertices))
    middle = panel.vertices[panel.faces].mean(axis=1)
    away = np.linalg.norm(middle - middle.mean(axis=0), axis=1)
    cases = {
        "panel": panel,
        "panel, triangles": gso.Mesh(panel.vertices[order], np.argsort(order)[panel.triangles]),
        "panel with a hole": gso.Mesh(panel.vertices, panel.faces[away > 0.2 * away.max()]),
        "irregular quads": gso.Mesh(*irregular.disk()),
        "irregular, hole": gso.Mesh(*irregular.disk_with_hole()),
        "strip of triangles": gso.Mesh(*irregular.with_hole()),
        "sphere cap": _cap(),
        **{f"teapot {k}": teapot.patch(k, 33) for k in range(len(teapot.patches(2)))},
    }
    out, rows = {}, []
    for name, case in progress(cases.items(), "meshes"):
        for number in (1, 4):
            options = gso.RuledOptions(strips=number, starts=tuple(start.split("+")))
            try:
                row = _measured(case, options)
            except gso.GSOError as error:
                rows.append([name, number, "refused", str(error)[:60], "", "", ""])
                continue
            out[f"{name}, {number}"] = row
            rows.append(
                [name, number, *(row[k] for k in ("mean", "max", "crossed", "usable", "s"))]
            )
    columns = ["mesh", "strips", "mean %", "max %", "crossed", "usable", "s"]
    table("Meshes from practice", columns, rows)
    return out


def peers() -> dict[str, Any]:
    """Compare ruled surfaces with other results, flattened with strain.

    No other installable package makes strips of planar faces near a surface; those that there are
    flatten, or need rulings that are given.
    """
    methods = {
        "curvature": {},
        "isometry": {"formulation": "isometry"},
        **{f"ruled, {name}": {"options": gso.RuledOptions(**o)} for name, o in STRIPS.items()},
    }
    out, rows = {}, []
    for name, given in methods.items():
        found = []
        for surface in progress(_references(), name):
            result, spent = timed(_optimised, surface, **given)
            m = result.metrics
            wobble = 0.0
            if result.ruled is None:
                wobble = gso.rulings.trace(result.mesh).straightness.mean()
            strain = m.get("strain_max", np.nan)
            row = (m["distance_mean"], m["distance_max"], strain, wobble, result.usable, spent)
            found.append(row)
        every = np.array(found, float)
        mean, far, strain, wobble, usable, seconds = every.T
        row = [np.median(mean), np.median(far), np.quantile(far, 0.9), 100 * np.nanmedian(strain)]
        row += [100 * np.median(wobble), int(usable.sum()), np.median(seconds)]
        out[name] = row
        rows.append([name, *row])
    columns = ["method", "mean %", "max %", "90 %", "strain %", "off straight %", "usable", "s"]
    table("Largest strain of the pattern, and how far rulings are off straight", columns, rows)
    return out


def _cap(n: int = 33, angle: float = 0.5) -> np.ndarray:
    """Return a square piece of a sphere around its pole."""
    u, v = np.meshgrid(*[np.linspace(-angle, angle, n)] * 2, indexing="ij")
    return np.stack([np.sin(u) * np.cos(v), np.sin(v), np.cos(u) * np.cos(v)], axis=-1)


SECTIONS = (strips, convergence, bounds, general, peers, cad)
