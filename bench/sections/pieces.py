"""Whole designs in pieces: seams, strain, distance, and times.

Strain is that of the patterns, the 99th percentile of the worst piece; seams are relative to the
root of the area; distances are those between the surfaces, both ways, per cent of the diagonal;
necks are relative to the root of the piece's area. Without ``shapes=FILE.npz`` (arrays
NAME_vertices, NAME_faces) the designs of ``examples/whole.py`` are cut.
"""

from __future__ import annotations

import sys
import time
import warnings
from typing import Any

import numpy as np
from harness import ROOT, progress, reference, table

import gso
from gso import metrics
from gso.components import split
from gso.mesh import Mesh

#: Allowed strain and distance (per cent of the diagonal) of designs that may change.
_JOINT = 2e-4
_AWAY = (3.0, 2.0)
#: Strain up to which pieces are cut before they become ruled.
_WHOLE = 1e-3


def as_is(shapes: str = "", strain: str = "0.01") -> dict[str, Any]:
    """Cut designs whose shape does not change, with darts and without."""
    rows, out = [], {}
    for name, mesh in progress(list(_shapes(shapes).items()), "as is"):
        for darts in (True, False):
            found = _timed(mesh, max_strain=float(strain), darts=darts)
            rows.append(_row(name, "darts" if darts else "no darts", mesh, found))
            out[f"{name}, {'darts' if darts else 'no darts'}"] = found.metrics
    table(f"as they are, strain {strain}", _COLUMNS, rows)
    return out


def joint(shapes: str = "") -> dict[str, Any]:
    """Cut designs whose shape may change, and solve all pieces together."""
    rows, out = [], {}
    for name, mesh in progress(list(_shapes(shapes).items()), "joint"):
        for share in _AWAY:
            far = 0.01 * share * mesh.diagonal
            found = _timed(mesh, max_strain=_JOINT, max_deviation=far)
            rows.append(_row(name, f"{share:g} %", mesh, found))
            out[f"{name}, {share:g} %"] = found.metrics
    table(f"shape may change, strain {_JOINT}", _COLUMNS, rows)
    return out


def ruled(shapes: str = "") -> dict[str, Any]:
    """Cut designs without darts, and make every piece of exactly ruled strips."""
    rows, out = [], {}
    for name, mesh in progress(list(_shapes(shapes).items()), "ruled"):
        allowed = 0.01 * _AWAY[0] * mesh.diagonal
        found = _timed(mesh, max_strain=_WHOLE, max_deviation=allowed, darts=False)
        clock = time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            # The seams on the design itself, from which distances count.
            own = gso.cut(mesh, found.edges)
            result = gso.tno.optimize(own, formulation="ruled", max_deviation=allowed)
        seconds = time.perf_counter() - clock
        percent = 100.0 / mesh.diagonal
        away = result.ruled.deviation
        out[name] = {
            "pieces": len(found),
            "strips": result.ruled.strips,
            "mean": percent * away.there_mean,
            "max": percent * max(away.there_max, away.back_max),
            "gap": percent * result.details["seam_gap"],
            "strain": result.metrics["strain_max"],
            "usable": result.usable,
            "seconds": seconds,
        }
        rows.append([name, *out[name].values()])
    columns = ["design", "pieces", "strips", "mean %", "max %", "gap at seams %", "strain"]
    table(f"exactly ruled, within {_AWAY[0]:g} %", [*columns, "usable", "s"], rows)
    return out


def uncut(shapes: str = "") -> dict[str, Any]:
    """Compare pieces with the same design made developable without cuts, and with xatlas."""
    rows, out = [], {}
    for name, mesh in progress(list(_shapes(shapes).items()), "uncut"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = gso.tno.optimize(mesh)
        away = metrics.surface_distance(mesh, result.mesh)
        percent = 100.0 / mesh.diagonal
        strain = result.metrics.get("strain_p99", np.nan)
        rows.append(
            [name, "uncut", 1, 0.0, strain, percent * away.there_mean, percent * away.there_max]
        )
        out[name] = {"strain_p99": strain, "mean": percent * away.there_mean}
        found = _timed(mesh, max_strain=0.01, darts=False)
        rows.append(
            [name, "as is", len(found), found.seam_length, found.metrics["strain_p99"], 0, 0]
        )
        charts = _xatlas(mesh)
        if charts is not None:
            rows.append([name, "xatlas", *charts, 0, 0])
    columns = ["design", "", "pieces", "seam", "p99", "mean %", "max %"]
    table("against no cuts, and against xatlas", columns, rows)
    return out


def minimax() -> dict[str, Any]:
    """Compare the flatten formulations "strain" and "minimax" on the reference surfaces."""
    ratios = []
    for surface in progress(reference()[0], "minimax"):
        found = []
        for formulation in ("strain", "minimax"):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                result = gso.tno.optimize(
                    surface,
                    task="flatten",
                    formulation=formulation,
                    verdict=False,
                )
            found.append([result.metrics[k] for k in ("strain_p99", "strain_max", "strain_mean")])
        ratios.append(np.array(found[1]) / np.array(found[0]))
    middle = np.median(ratios, axis=0)
    table("minimax over strain, medians", ["p99", "max", "mean"], [middle.tolist()])
    return {"ratios": np.array(ratios).tolist()}


def times() -> dict[str, Any]:
    """Time the search on spheres of growing size."""
    rows, out = [], {}
    for count in (2_500, 10_000, 50_000):
        mesh = _ball(count // 2)
        row: list[Any] = [len(mesh.faces)]
        for given in ({}, {"darts": False}, {"max_deviation": 0.06}):
            found = _timed(mesh, max_strain=0.01, **given)
            row += [found.seconds, len(found)]
        clock = time.perf_counter()
        pieces = gso.cut(mesh, found.edges) if len(found.edges) else gso.cut(mesh, [])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            gso.tno.optimize(pieces, verdict=False)
        row.append(time.perf_counter() - clock)
        rows.append(row)
        out[str(len(mesh.faces))] = row
    columns = [
        "triangles",
        "darts s",
        "n",
        "no darts s",
        "n",
        "changed s",
        "n",
        "one joint solve s",
    ]
    table("times", columns, rows)
    return out


_COLUMNS = [
    "design",
    "",
    "pieces",
    "seam",
    "p99",
    "neck",
    "mean %",
    "max %",
    "fold ratio",
    "largest",
    "planarity",
    "overlaps",
    "usable",
    "s",
]


def _timed(mesh: Mesh, **given: Any) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return gso.pieces(mesh, **given)


def _row(name: str, how: str, mesh: Mesh, found: Any) -> list[Any]:
    from gso import faults

    known = found.metrics
    percent = 100.0 / mesh.diagonal
    overlaps = sum(int(faults.overlaps(s.mesh, s.flat).size) for s in found.sheets if s is not None)
    before = known.get("dihedral_mean_before", np.nan)
    return [
        name,
        how,
        len(found),
        found.seam_length,
        known["strain_p99"],
        known["neck_share"],
        percent * known.get("deviation_mean", 0.0),
        percent * known.get("deviation_max", 0.0),
        known.get("dihedral_mean", np.nan) / before,
        known.get("dihedral_max", np.nan),
        known.get("nonplanarity_max", np.nan),
        overlaps,
        "yes" if found.usable else "no",
        found.seconds,
    ]


def _shapes(path: str) -> dict[str, Mesh]:
    """Read the designs of a file, or make those of the examples."""
    if path:
        with np.load(path) as data:
            names = [k.removesuffix("_vertices") for k in data.files if k.endswith("_vertices")]
            return {n: Mesh(data[f"{n}_vertices"], data[f"{n}_faces"]) for n in names}
    sys.path.insert(0, str(ROOT / "examples"))
    import whole

    return {name: Mesh(*make()) for name, make in whole.DESIGNS.items()}


def _ball(count: int) -> Mesh:
    """Make a sphere of radius one with about twice as many triangles as vertices."""
    from scipy.spatial import ConvexHull

    k = np.arange(count) + 0.5
    z, turn = 1.0 - 2.0 * k / count, np.pi * (1.0 + 5.0**0.5) * k
    ring = np.sqrt(1.0 - z * z)
    points = np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
    return Mesh(points, ConvexHull(points).simplices)


def _xatlas(mesh: Mesh) -> tuple[int, float, float] | None:
    """Return charts, seam and strain of xatlas at its lowest distortion; None without it."""
    try:
        import xatlas
    except ImportError:
        return None
    atlas = xatlas.Atlas()
    atlas.add_mesh(mesh.vertices.astype(np.float32), mesh.triangles.astype(np.uint32))
    options = xatlas.ChartOptions()
    options.max_cost = 0.5
    atlas.generate(options)
    vertex, faces, flat = atlas[0]
    opened = Mesh(mesh.vertices[vertex], faces.astype(np.int64))
    flat = flat.astype(float) * [atlas.width, atlas.height]
    strain = 0.0
    for part in split(opened):
        # Each chart at its own best scale, and not mirrored.
        own = flat[part.vertices]
        if len(metrics.flipped_faces(part.mesh, own)) > 0.5 * len(part.faces):
            own = own * [-1.0, 1.0]
        image = metrics.area(part.mesh, own)
        own = own * np.sqrt(part.area / image)
        strain = max(strain, metrics.strains(part.mesh, own)["strain_p99"])
    loops = opened.boundary_loops
    length = sum(
        float(np.linalg.norm(np.diff(opened.vertices[np.r_[x, x[:1]]], axis=0), axis=1).sum())
        for x in loops
    )
    rim = sum(
        float(np.linalg.norm(np.diff(mesh.vertices[np.r_[x, x[:1]]], axis=0), axis=1).sum())
        for x in mesh.boundary_loops
    )
    seam = 0.5 * (length - rim) / np.sqrt(metrics.area(mesh))
    return int(atlas.chart_count), seam, strain


SECTIONS = (as_is, joint, ruled, uncut, minimax, times)
