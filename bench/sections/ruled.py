"""Exactly ruled surfaces: one strip and several, on the reference surfaces and the panel.

Distances are the larger of both directions, all over both surfaces, percent of the diagonal; the
largest one includes those between the outlines, which show slits. The solver minimises distances
of about a thousand points. Folds are the largest angles between two
faces, in degrees: neither distance nor strain sees a surface that is crumpled.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from designs import analytic
from designs.base import shuffled
from harness import ROOT, compare, example, progress, quietly, reference, tabulate, timed

import gso
from gso import metrics
from gso.dataset import bezier

#: Options by the name of the row.
STRIPS = {"1": {"strips": 1}, "tree": {"flats": True}}
STRIPS |= {str(k): {"strips": k} for k in (2, 4, 8, 16, 32)}
#: Curvature up to which surfaces of another seed are used.
_MOST = 0.9
_quantile = partial(np.quantile, q=0.9)


def strips(seed: str = "", start: str = "design", count: int = 24) -> dict[str, Any]:
    """Measure numbers of strips; with a seed on other surfaces of the same recipe."""
    surfaces = _surfaces(seed, count)
    columns = [("mean %", np.median), ("max %", np.median), ("max 90 %", "max %", _quantile)]
    columns += [("worst", "max %", np.max), ("crossed", np.count_nonzero), ("fold", np.median)]
    columns += [("fold 90 %", "fold", _quantile), ("usable", sum), ("s", np.median)]
    runs = {number: _solver(start, **settings) for number, settings in STRIPS.items()}
    title = f"{len(surfaces)} surfaces, starts {start}"
    return compare(title, runs, surfaces, _rated, columns, head="strips")


def cad(seed: str = "", count: int = 24) -> dict[str, Any]:
    """Measure smooth strips: how torsal they are, and their distance from the planar faces."""
    surfaces = _surfaces(seed, count)

    def rated(_: Any, result: gso.Result) -> dict[str, float]:
        found, seconds = timed(gso.smooth_strips, result.ruled, result.design)
        mean, largest = (100.0 / result.design.diagonal * x for x in found.distances)
        flat = {"turn deg": found.turning, "no break": found.kink <= 0.1, "torsal": found.is_torsal}
        faces = sum(len(p.faces) for p in found.patches)
        return flat | {"mean %": mean, "max %": largest, "faces": faces, "s": seconds}

    columns = [("turn deg", np.median), ("worst", "turn deg", np.max), ("no break", sum)]
    columns += [("torsal", sum), *((k, np.median) for k in ("mean %", "max %", "faces", "s"))]
    runs = {
        number: _solver("design", lines=False, **STRIPS[number]) for number in ("1", "tree", "4")
    }
    title = f"Smooth strips of {len(surfaces)} surfaces"
    return compare(title, runs, surfaces, rated, columns, head="strips")


def _surfaces(seed: str = "", count: int = 24) -> list[Any]:
    """Return the references and the panel, or surfaces of another seed."""
    if not seed:
        return [*reference()[0], gso.load(ROOT / "examples" / "panel.obj")]
    every = (shape.sample() for shape in bezier.generate(4 * count, seed=int(seed)))
    return [points for points in every if metrics.loss_gc(points) <= _MOST][:count]


def _solver(start: str, **settings: Any) -> Any:
    options = gso.RuledOptions(starts=tuple(start.split("+")), **settings)
    return partial(quietly, gso.tno.optimize, options=options)


def _rated(_: Any, result: gso.Result) -> dict[str, float]:
    found = result.metrics
    return {
        "mean %": found["distance_mean"],
        "max %": found["distance_max"],
        "crossed": found["rulings_crossed"],
        "fold": found["fold_max"],
        "usable": int(result.usable),
        "s": result.seconds["strips"],
    }


def convergence() -> dict[str, Any]:
    """Compare the rulings of known surfaces, sampled four times as finely as they are many."""
    rows: dict[Any, dict[str, Any]] = {}
    for name, make in analytic.SURFACES.items():
        for count in (17, 33, 65):
            known = make(4 * count)
            options = gso.RuledOptions(rulings=count, starts=("design",))
            result = gso.tno.optimize(known.points, options=options)
            percent = 100.0 / result.design.diagonal
            a, b = result.mesh.vertices[result.rulings.edges].transpose(1, 0, 2)
            length = np.linalg.norm(b - a, axis=1)
            true = known.ruling(0.5 * (a + b))
            sine = np.linalg.norm(np.cross(b - a, true), axis=1) / length
            angle = np.degrees(np.arcsin(np.clip(sine, 0.0, 1.0)))
            long = angle[length > 0.5 * length.max()]
            back = metrics.point_to_surface(result.design.vertices, result.mesh)
            rows[name, str(count)] = {
                "off %": percent * known.distance(result.ruled.samples()[0]).max(),
                "back %": percent * back.max(),
                "median deg": np.median(long),
                "long deg": long.max(),
                "all deg": angle.max(),
                "usable": str(result.usable),
            }
    return tabulate("Known surfaces", ["surface", "rulings"], rows)


def bounds(seed: str = "", start: str = "design", count: int = 24) -> dict[str, Any]:
    """Measure the numbers of strips that hold bounds on the deviation."""
    surfaces, rows = _surfaces(seed, count), {}
    for percent in (2.0, 1.0, 0.5):
        numbers, refused, seconds = [], [], []
        for surface in progress(surfaces, f"{percent} %"):
            mesh = gso.as_mesh(surface)
            most = 0.01 * percent * mesh.diagonal
            result = _solver(start, strips="auto")(mesh, max_deviation=most)
            seconds.append(result.seconds["strips"])
            if result.usable:
                numbers.append(result.ruled.strips)
            else:
                refused.append(result.metrics["distance_max"])
        rows[f"{percent} %"] = {
            "refused": len(refused),
            "their best %": " ".join(f"{far:.2f}" for far in sorted(refused)),
            "numbers of strips": " ".join(map(str, sorted(numbers))),
            "median s": np.median(seconds),
            "max s": max(seconds),
        }
    return tabulate(f"{len(surfaces)} surfaces, starts {start}", ["bound"], rows)


def general(start: str = "design") -> dict[str, Any]:
    """Measure meshes from practice: teapot patches, irregular quads, triangles, a hole."""
    irregular, teapot = example("irregular"), example("teapot")
    panel = gso.load(ROOT / "examples" / "panel.obj")
    triangles = shuffled(panel.vertices, panel.triangles, np.random.default_rng(5))
    middle = panel.vertices[panel.faces].mean(axis=1)
    away = np.linalg.norm(middle - middle.mean(axis=0), axis=1)
    u, v = np.meshgrid(*[np.linspace(-0.5, 0.5, 33)] * 2, indexing="ij")
    cases = {
        "panel": panel,
        "panel, triangles": gso.Mesh(*triangles),
        "panel with a hole": gso.Mesh(panel.vertices, panel.faces[away > 0.2 * away.max()]),
        "irregular quads": gso.Mesh(*irregular.disk()),
        "irregular, hole": gso.Mesh(*irregular.disk_with_hole()),
        "strip of triangles": gso.Mesh(*irregular.with_hole()),
        "sphere cap": np.dstack([np.sin(u) * np.cos(v), np.sin(v), np.cos(u) * np.cos(v)]),
        **{f"teapot {k}": teapot.patch(k, 33) for k in range(len(teapot.patches(2)))},
    }
    rows: dict[Any, dict[str, Any]] = {}
    for name, case in progress(cases.items(), "meshes"):
        for number in (1, 4):
            try:
                row = _rated(case, _solver(start, strips=number)(case))
            except gso.GSOError as error:
                row = {"mean %": "refused", "max %": str(error)[:60], "crossed": ""}
                row |= {"usable": "", "s": ""}
            row.pop("fold", None)
            rows[name, str(number)] = row
    return tabulate("Meshes from practice", ["mesh", "strips"], rows)


def peers() -> dict[str, Any]:
    """Compare ruled surfaces with other results, flattened with strain.

    No other installable package makes strips of planar faces near a surface; those that there are
    flatten, or need rulings that are given.
    """
    methods = {"curvature": {}, "isometry": {"formulation": "isometry"}}
    methods |= {f"ruled, {k}": {"options": gso.RuledOptions(**o)} for k, o in STRIPS.items()}
    runs = {name: partial(quietly, gso.tno.optimize, **given) for name, given in methods.items()}

    def rated(_: Any, result: gso.Result) -> dict[str, Any]:
        wobble = 0.0
        if result.ruled is None:
            wobble = gso.rulings.trace(result.mesh).straightness.mean()
        mean, far = (result.metrics[k] for k in ("distance_mean", "distance_max"))
        found = {"mean %": mean, "max %": far, "off straight %": 100 * wobble}
        strain = 100 * result.metrics.get("strain_max", np.nan)
        return found | {"strain %": strain, "usable": int(result.usable)}

    columns = [("mean %", np.median), ("max %", np.median), ("90 %", "max %", _quantile)]
    columns += [("strain %", np.nanmedian), ("off straight %", np.median)]
    columns += [("usable", sum), ("s", np.median)]
    title = "Largest strain of the pattern, and how far rulings are off straight"
    return compare(title, runs, _surfaces(), rated, columns)


SECTIONS = (strips, convergence, bounds, general, peers, cad)
