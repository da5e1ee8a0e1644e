"""Whole designs in pieces: seams, strain, distance, and times.

Strain is that of the patterns, the 99th percentile of the worst piece; seams are relative to the
root of the area; distances are those between the surfaces, both ways, per cent of the diagonal;
necks are relative to the root of the piece's area. Without ``shapes=FILE.npz`` (arrays
NAME_vertices, NAME_faces) the designs of ``examples/whole.py`` are cut.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from harness import example, medians, progress, quietly, reference, tabulate, timed
from piece_peers import PUBLISHED, as_many, has_xatlas, least_strained

import gso
from gso import faults, metrics
from gso.mesh import Mesh

#: Allowed strain and distance (per cent of the diagonal) of designs that may change.
_JOINT = 2e-4
_AWAY = (3.0, 2.0)
#: Strain up to which pieces are cut before they become ruled.
_WHOLE = 1e-3
#: Columns of the comparison with peers.
_PEERS = ("pieces", "seam", "mean %", "max %", "p99", "largest", "s")
#: How far coordinates are moved, relative to the diagonal.
_MOVED = 1e-9
_Rows = dict[Any, dict[str, Any]]


def as_is(shapes: str = "", strain: str = "0.01") -> dict[str, Any]:
    """Cut designs whose shape does not change, with darts and without."""
    rows: _Rows = {}
    for name, mesh in _shapes(shapes, "as is"):
        for how, darts in (("darts", True), ("no darts", False)):
            rows[name, how] = _figures(mesh, max_strain=float(strain), darts=darts)
    return tabulate(f"as they are, strain {strain}", ["design", ""], rows)


def joint(shapes: str = "") -> dict[str, Any]:
    """Cut designs whose shape may change, and solve all pieces together."""
    rows: _Rows = {}
    for name, mesh in _shapes(shapes, "joint"):
        for share in _AWAY:
            far = 0.01 * share * mesh.diagonal
            rows[name, f"{share:g} %"] = _figures(
                mesh, max_strain=_JOINT, max_deviation=far, darts=True
            )
    return tabulate(f"shape may change, strain {_JOINT}", ["design", ""], rows)


def within(
    shapes: str = "", files: str = "", share: str = "1.75", effort: str = "standard"
) -> dict[str, Any]:
    """Cut designs without darts whose shape may change within a share (%) of the diagonal.

    ``files=A.obj,B.off`` names meshes to take instead; ``seam turn`` is in degrees per cent of the
    diagonal, ``smallest %`` the area of the smallest piece over all.
    """
    rows: _Rows = {}
    for name, mesh in _designs(files, shapes, "within"):
        found = _found(mesh, mesh.diagonal, share, effort)
        row = _of_found(found, 100.0 / mesh.diagonal)
        areas = [part.area for part in found.parts]
        rows[name] = {
            "triangles": len(mesh.triangles),
            **{key: row[key] for key in ("pieces", "seam", "mean %", "max %", "p99", "neck")},
            "smallest %": 100.0 * min(areas) / sum(areas),
            "seam turn": found.metrics["seam_turn"],
            "usable": row["usable"],
            "s": row["s"],
        }
    return tabulate(f"within {share} %, {effort}", ["design"], rows)


def perturbed(
    files: str = "",
    shapes: str = "",
    share: str = "1.75",
    effort: str = "standard",
    runs: int = 10,
) -> dict[str, Any]:
    """Cut every design several times, each time with other coordinates or numbers of vertices.

    The first run has the design as it is. Then coordinates are moved by 1e-9 of the diagonal, and
    vertices and faces renumbered, in turn. Columns are the smallest, median and largest number of
    pieces and length of seams. Options are those of ``within``.
    """
    rows: _Rows = {}
    for name, mesh in _designs(files, shapes, "perturbed"):
        found = [_found(one, mesh.diagonal, share, effort) for one in variants(mesh, runs)]
        figures = {
            "pieces": [len(one) for one in found],
            "seam": [one.seam_length for one in found],
        }
        rows[name] = {
            f"{what} {word}": float(how(values))
            for what, values in figures.items()
            for word, how in (("min", np.min), ("median", np.median), ("max", np.max))
        }
        rows[name]["usable"] = f"{sum(one.usable for one in found)}/{runs}"
        rows[name]["s"] = float(np.median([one.seconds for one in found]))
    return tabulate(f"{runs} runs within {share} %, {effort}", ["design"], rows)


def peers(
    files: str = "",
    shapes: str = "",
    share: str = "1.75",
    effort: str = "standard",
    strain: str = "0.01",
) -> dict[str, Any]:
    """Compare pieces with charts of xatlas, with pieces of the same shape, and with publications.

    ``xatlas, as many`` has about as many charts as there are pieces, and ``xatlas, least`` its
    lowest distortion. ``as is`` are pieces within a strain whose shape does not change. Published
    results are below the design of their name. Options are those of ``within``.
    """
    rows: _Rows = {}
    for name, mesh in _designs(files, shapes, "peers"):
        found = _found(mesh, mesh.diagonal, share, effort)
        kept = quietly(gso.pieces, mesh, max_strain=float(strain))
        kinds: _Rows = {}
        for kind, one in ((f"within {share} %", found), (f"as is, strain {strain}", kept)):
            kinds[kind] = _of_found(one, 100.0 / mesh.diagonal)
            kinds[kind]["largest"] = one.metrics["strain_max"]
        if has_xatlas():
            kept_shape = {"mean %": 0.0, "max %": 0.0}
            kinds["xatlas, as many"] = as_many(mesh, len(found)) | kept_shape
            kinds["xatlas, least"] = least_strained(mesh) | kept_shape
        for published in PUBLISHED:
            if published in name.lower():
                kinds["published"] = PUBLISHED[published]
        for kind, figures in kinds.items():
            rows[name, kind] = {key: figures.get(key, np.nan) for key in _PEERS}
    every = tabulate("pieces and their peers", ["design", ""], rows)
    title = "published results, of meshes that are not all here"
    return every | {"published": tabulate(title, ["design"], PUBLISHED)}


def ruled(shapes: str = "") -> dict[str, Any]:
    """Cut designs without darts, and make every piece of exactly ruled strips."""
    rows: _Rows = {}
    for name, mesh in _shapes(shapes, "ruled"):
        allowed, percent = 0.01 * _AWAY[0] * mesh.diagonal, 100.0 / mesh.diagonal
        asked = {"max_strain": _WHOLE, "max_deviation": allowed, "darts": False}
        found = quietly(gso.pieces, mesh, **asked)
        # The seams on the design itself, from which distances count.
        own, cutting = timed(gso.cut, mesh, found.edges)
        strips = {"formulation": "ruled", "max_deviation": allowed}
        result, seconds = timed(quietly, gso.tno.optimize, own, **strips)
        away = result.ruled.deviation
        rows[name] = {
            "pieces": len(found),
            "strips": result.ruled.strips,
            "mean %": percent * away.there_mean,
            "max %": percent * away.largest,
            "gap at seams %": percent * result.details["seam_gap"],
            "strain": result.metrics["strain_max"],
            "usable": result.usable,
            "s": cutting + seconds,
        }
    return tabulate(f"exactly ruled, within {_AWAY[0]:g} %", ["design"], rows)


def uncut(shapes: str = "") -> dict[str, Any]:
    """Compare pieces with the same design made developable without cuts, and with xatlas."""
    rows: _Rows = {}
    for name, mesh in _shapes(shapes, "uncut"):
        result = quietly(gso.tno.optimize, mesh)
        away, percent = metrics.surface_distance(mesh, result.mesh), 100.0 / mesh.diagonal
        found = quietly(gso.pieces, mesh, max_strain=0.01, darts=False)
        kinds = {
            "uncut": (1, 0.0, result.metrics.get("strain_p99", np.nan)),
            "as is": (len(found), found.seam_length, found.metrics["strain_p99"]),
        }
        if has_xatlas():
            charts = least_strained(mesh)
            kinds["xatlas"] = charts["pieces"], charts["seam"], charts["p99"]
        for kind, figures in kinds.items():
            row = dict(zip(("pieces", "seam", "p99"), figures, strict=True))
            rows[name, kind] = row | {"mean %": 0, "max %": 0}
        rows[name, "uncut"]["mean %"] = percent * away.there_mean
        rows[name, "uncut"]["max %"] = percent * away.there_max
    return tabulate("against no cuts, and against xatlas", ["design", ""], rows)


def minimax() -> dict[str, Any]:
    """Compare the flatten formulations "strain" and "minimax" on the reference surfaces."""
    names, ratios = {"p99": "strain_p99", "max": "strain_max", "mean": "strain_mean"}, []
    for surface in progress(reference()[0], "minimax"):
        asked = {"task": "flatten", "verdict": False}
        strain, least = (
            quietly(gso.tno.optimize, surface, formulation=f, **asked).metrics
            for f in ("strain", "minimax")
        )
        ratios.append({name: least[key] / strain[key] for name, key in names.items()})
    return tabulate(
        "minimax over strain, medians", ["surfaces"], {str(len(ratios)): medians(ratios)}
    )


def times() -> dict[str, Any]:
    """Time the search on spheres of growing size."""
    rows: _Rows = {}
    for count in (2_500, 10_000, 50_000):
        mesh = _ball(count // 2)
        asked = {
            "darts": {"darts": True},
            "no darts": {"darts": False},
            "changed": {"max_deviation": 0.06, "darts": True},
        }
        found = {k: quietly(gso.pieces, mesh, max_strain=0.01, **v) for k, v in asked.items()}
        row = {
            f"{k} {what}": x
            for k, v in found.items()
            for what, x in (("s", v.seconds), ("n", len(v)))
        }
        _, row["one joint solve s"] = timed(
            quietly, gso.tno.optimize, found["changed"], verdict=False
        )
        rows[str(len(mesh.faces))] = row
    return tabulate("times", ["triangles"], rows)


def _found(mesh: Mesh, size: float, share: str, effort: str) -> gso.seams.Segmentation:
    """Cut a design whose shape may change within a share (%) of a size."""
    far = 0.01 * float(share) * size
    return quietly(gso.pieces, mesh, max_strain=_WHOLE, max_deviation=far, effort=effort)


def _figures(mesh: Mesh, **given: Any) -> dict[str, Any]:
    return _of_found(quietly(gso.pieces, mesh, **given), 100.0 / mesh.diagonal)


def _of_found(found: gso.seams.Segmentation, percent: float) -> dict[str, Any]:
    known = found.metrics
    before = known.get("dihedral_mean_before", np.nan)
    return {
        "pieces": len(found),
        "seam": found.seam_length,
        "p99": known["strain_p99"],
        "neck": known["neck_share"],
        "mean %": percent * known.get("deviation_mean", 0.0),
        "max %": percent * known.get("deviation_max", 0.0),
        "fold ratio": known.get("dihedral_mean", np.nan) / before,
        "largest": known.get("dihedral_max", np.nan),
        "planarity": known.get("nonplanarity_max", np.nan),
        "overlaps": sum(
            int(faults.overlaps(s.mesh, s.flat).size) for s in found.sheets if s is not None
        ),
        "usable": "yes" if found.usable else "no",
        "s": found.seconds,
    }


def _designs(files: str, shapes: str, text: str) -> Any:
    """Yield the designs of mesh files, or else those of :func:`_shapes`, by name."""
    given = [Path(name) for name in files.split(",") if name]
    if not given:
        return _shapes(shapes, text)
    return progress([(path.stem, gso.as_mesh(path)) for path in given], text)


def variants(mesh: Mesh, runs: int) -> Iterator[Mesh]:
    """Yield a mesh as it is, and then with moved coordinates and with other numbers, in turn."""
    for run in range(runs):
        random = np.random.default_rng(run)
        if run == 0:
            yield mesh
        elif run % 2:
            moves = random.uniform(-1.0, 1.0, mesh.vertices.shape)
            yield mesh.replaced(mesh.vertices + _MOVED * mesh.diagonal * moves)
        else:
            order = random.permutation(len(mesh.vertices))
            faces = random.permutation(mesh.faces)
            number = np.argsort(order)
            yield Mesh(mesh.vertices[order], np.where(faces < 0, -1, number[faces]))


def _shapes(path: str, text: str) -> Any:
    """Yield the designs of a file, or those of the examples, by name."""
    if path:
        with np.load(path) as data:
            names = [k.removesuffix("_vertices") for k in data.files if k.endswith("_vertices")]
            found = {n: Mesh(data[f"{n}_vertices"], data[f"{n}_faces"]) for n in names}
    else:
        found = {name: Mesh(*make()) for name, make in example("whole").DESIGNS.items()}
    return progress(list(found.items()), text)


def _ball(count: int) -> Mesh:
    """Make a sphere of radius one with about twice as many triangles as vertices."""
    from scipy.spatial import ConvexHull

    k = np.arange(count) + 0.5
    z, turn = 1.0 - 2.0 * k / count, np.pi * (1.0 + 5.0**0.5) * k
    ring = np.sqrt(1.0 - z * z)
    points = np.stack([ring * np.cos(turn), ring * np.sin(turn), z], axis=1)
    return Mesh(points, ConvexHull(points).simplices)


SECTIONS = (as_is, joint, within, perturbed, peers, ruled, uncut, minimax, times)
