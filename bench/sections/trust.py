"""Whether results that are called usable are what was asked for, judged by measures of our own.

Each design is made developable by every formulation. Beside what the result says of itself stand
figures that this file computes on its own: the largest strain from edge lengths, Gaussian
curvature by the Gauss image of the faces' normals, distances of sampled points, and angles
between faces. ``folder=PATH`` takes the meshes of a folder in place of the designs of the bench.
:func:`repeat` measures by how much results vary that should not.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import designs
import igl
import numpy as np
from harness import progress, quietly, table, timed

import gso
from gso import metrics
from gso.typing import Array

#: The ways to ask.
WAYS: dict[str, dict[str, Any]] = {
    "fast": {"options": "fast"},
    "balanced": {},
    "isometry": {"formulation": "isometry"},
}
#: Meshes of a folder with more faces are left out.
_LARGE = 12_000
#: Samples along an edge of a triangle.
_SAMPLES = 6
#: Angle of a fold in degrees.
_FOLD = 120.0
#: Curvature in the unit ball below which a surface counts as developable: the option
#: ``developable_below``. What quads hide is compared with that at least.
_NONE = 1e-3
#: Noise of the copies over the size, and the least strain, curvature and distance (in %, and in the
#: unit ball) that differences are compared with.
_NOISE, _LEAST = 1e-9, (0.1, _NONE, 0.1)
#: Designs that are repeated.
_REPEATED = "wavy+4 holes+oculus+square core+L-shaped+inset+of three+free"


def trust(
    kind: str = "", folder: str = "", ways: str = "", names: str = "", seed: int = 0
) -> dict[str, Any]:
    """Compare what results say of themselves with independent measures."""
    out: dict[str, Any] = {}
    for name, mesh in progress(list(_designs(kind, folder, seed).items()), "trust"):
        if names and not any(one in name for one in names.split("+")):
            continue
        for way in ways.split("+") if ways else WAYS:
            try:
                result, spent = timed(quietly, gso.tno.optimize, mesh, **WAYS[way])
            except gso.GSOError as error:
                print(f"{name} {way}: {error}")
                continue
            out[f"{name} {way}"] = _figures(mesh, result) | {"s": spent}
    columns = list(next(iter(out.values())))
    rows = [[key, *(_shown(row[c]) for c in columns)] for key, row in out.items()]
    table("trust: distances in % of the size, strains in %", ["design", *columns], rows)
    _summary(out)
    return out


def _shown(value: Any) -> Any:
    return value if isinstance(value, (str, float)) else str(value)


def _designs(kind: str, folder: str, seed: int) -> dict[str, gso.Mesh]:
    found = {}
    for name in [kind] if kind else [] if folder else designs.KINDS:
        for design in designs.KINDS[name](seed):
            found[f"{name}: {design.name}"] = design.mesh
    for path in sorted(Path(folder).iterdir()) if folder else ():
        if path.suffix not in (".obj", ".off", ".ply"):
            continue
        mesh = gso.load(path)
        if len(mesh.faces) <= _LARGE and len(mesh.boundary_loops):
            found[path.stem] = mesh
    return found


def _figures(design: gso.Mesh, result: gso.Result) -> dict[str, Any]:
    after, unit = result.mesh, metrics.unit(design)
    worst = metrics.loss_gc_worst(after, scale=unit)
    percent = 100.0 / design.size
    far = metrics.surface_distance(design, after)
    sampled = percent * max(_farthest(after, design), _farthest(design, after))
    pattern = result.pattern
    strain = np.nan if pattern is None else 100.0 * _strain(pattern.surface(after), pattern.flat)
    said = result.details.get("verdict", {}).get("strain_max", np.nan)
    return {
        "usable": result.usable,
        "why": ", ".join(reason.code.value for reason in result.reasons),
        "strain": 100.0 * float(said),
        "own strain": strain,
        "distance": percent * far.largest,
        "sampled": sampled,
        "|K| in": metrics.loss_gc_worst(design),
        "|K|": worst,
        "image": gauss_image(after, unit) / max(worst, _NONE),
        "folds": int((metrics.dihedral_angles(after) > _FOLD).sum())
        if len(after.faces) == len(design.faces)
        else -1,
    }


def gauss_image(mesh: gso.Mesh, unit: float) -> float:
    """Return the mean |K| over inner vertices by the signed area of the normals around each.

    Normals of faces are those of their diagonals. The area of a spherical polygon is summed over
    its triangles by the formula of Van Oosterom and Strackee (1983).
    """
    points, faces = mesh.vertices / unit, mesh.faces
    a, b, c = (points[faces[:, k]] for k in range(3))
    d = points[np.where(faces[:, -1] < 0, faces[:, 0], faces[:, -1])]
    cross = np.cross(c - a, d - b) if faces.shape[1] == 4 else np.cross(b - a, c - a)
    if faces.shape[1] == 4:
        three = faces[:, -1] < 0
        cross[three] = np.cross(b - a, c - a)[three]
    normal = cross / np.maximum(np.linalg.norm(cross, axis=1), 1e-300)[:, None]
    he = mesh.half_edges
    rim = np.zeros(len(points), bool)
    rim[[v for loop in mesh.boundary_loops for v in loop]] = True
    middle = np.zeros_like(points)
    np.add.at(middle, he.origin, normal[he.face])
    middle /= np.maximum(np.linalg.norm(middle, axis=1), 1e-300)[:, None]
    inner = (he.twin >= 0) & ~rim[he.origin]
    v = he.origin[inner]
    # Around a vertex, the face of a half-edge comes after that of its twin.
    n, m, o = normal[he.face[inner]], normal[he.face[he.twin[inner]]], middle[v]
    triple = np.einsum("kd,kd->k", o, np.cross(m, n))
    below = 1 + np.einsum("kd,kd->k", o, m) + np.einsum("kd,kd->k", m, n)
    below += np.einsum("kd,kd->k", n, o)
    solid = np.bincount(v, 2.0 * np.arctan2(triple, below), len(points))
    used = np.zeros(len(points), bool)
    used[v] = True
    # As in loss_gc: all six triangles around a vertex of a grid have three quarters of the quads.
    share = np.where(faces[:, -1] < 0, 1.0, 0.75) if faces.shape[1] == 4 else np.ones(len(faces))
    size = share * 0.5 * np.linalg.norm(cross, axis=1)
    area = np.bincount(he.origin, size[he.face], len(points))
    return float(np.abs(solid[used] / area[used]).mean())


def _strain(surface: gso.Mesh, flat: Array) -> float:
    """Return the largest |l'/l - 1| in any direction of any triangle, by Gram matrices."""
    triangles = surface.triangles
    one, two = surface.vertices[triangles], flat[triangles]
    gram = [np.einsum("tid,tjd->tij", x[:, 1:] - x[:, :1], x[:, 1:] - x[:, :1]) for x in (one, two)]
    ratio = np.sqrt(np.maximum(np.linalg.eigvals(np.linalg.solve(gram[0], gram[1])).real, 0.0))
    return float(np.abs(ratio - 1).max())


def _farthest(one: gso.Mesh, other: gso.Mesh) -> float:
    """Return the largest distance of samples of a surface from another."""
    t = np.arange(_SAMPLES + 1) / _SAMPLES
    u, v = (x[np.add.outer(t, t) <= 1 + 1e-9] for x in np.meshgrid(t, t, indexing="ij"))
    a, b, c = one.vertices[one.triangles].transpose(1, 0, 2)
    points = a[:, None] + u[:, None] * (b - a)[:, None] + v[:, None] * (c - a)[:, None]
    square, _, _ = igl.point_mesh_squared_distance(
        points.reshape(-1, 3), other.vertices, other.triangles
    )
    return float(np.sqrt(np.max(square)))


def _summary(rows: dict[str, dict[str, Any]]) -> None:
    good = [row for row in rows.values() if row["usable"]]
    print(f"\n{len(good)} of {len(rows)} usable")
    for name, bound in (("own strain", 2.0), ("own strain", 5.0), ("sampled", 5.0)):
        print(f"usable with {name} above {bound:g} %: {sum(row[name] > bound for row in good)}")
    print(f"usable with image above 1.5: {sum(row['image'] > 1.5 for row in good)}")
    print(f"folded: {sum(row['folds'] > 0 for row in rows.values())}")
    pairs = [
        (rows[key], rows[key.replace(" isometry", " balanced")])
        for key in rows
        if key.endswith(" isometry") and key.replace(" isometry", " balanced") in rows
    ]
    curved = [(a, b) for a, b in pairs if a["|K|"] > 1.5 * b["|K|"]]
    worse = sum(not a["own strain"] < 0.5 * b["own strain"] for a, b in curved)
    print(
        f"isometry with |K| above 1.5 times that of balanced: {len(curved)} of {len(pairs)}, "
        f"of these with more than half of its strain {worse}"
    )
    more = [row["sampled"] / row["distance"] - 1 for row in rows.values() if row["distance"] > 1e-9]
    print(f"sampled above the distance by at most {max(more, default=0.0):.2g}")


def repeat(
    kind: str = "", folder: str = "", ways: str = "", names: str = _REPEATED, noises: int = 3
) -> dict[str, Any]:
    """Compare results of a design, of copies with tiny noise, renumbered and mirrored.

    The spread of a figure is its largest difference over its median.
    """
    out: dict[str, Any] = {}
    for name, mesh in progress(list(_designs(kind, folder, 0).items()), "repeat"):
        if names and not any(one in name for one in names.split("+")):
            continue
        for way in ways.split("+") if ways else [*WAYS, "strips"]:
            found = np.array([_answer(copy, way) for copy in _copies(mesh, noises)])
            spread = np.ptp(found, axis=0) / np.maximum(np.median(found, axis=0), _LEAST)
            out[f"{name} {way}"] = dict(zip(("strain", "|K|", "distance"), spread, strict=True))
    columns = ["strain", "|K|", "distance"]
    rows = [[key, *(row[c] for c in columns)] for key, row in out.items()]
    table("repeat: spread over the median", ["design", *columns], rows)
    far = sum(max(row.values()) > 0.1 for row in out.values())
    print(f"\n{far} of {len(out)} with a spread above 10 %")
    return out


def _copies(mesh: gso.Mesh, noises: int) -> Iterator[gso.Mesh]:
    """Yield a design, and copies with noise, in another numbering, and mirrored."""
    points, faces = mesh.vertices, mesh.faces
    yield mesh
    for seed in range(noises):
        noise = np.random.default_rng(seed).standard_normal(points.shape)
        yield gso.Mesh(points + _NOISE * mesh.size * noise, faces)
    order, rows = (np.random.default_rng(9).permutation(len(x)) for x in (points, faces))
    yield gso.Mesh(points[order], np.where(faces < 0, -1, np.argsort(order)[faces])[rows])
    turned = np.where(faces[:, -1:] < 0, faces[:, [0, 2, 1, -1]], faces[:, ::-1])
    yield gso.Mesh(points * [-1.0, 1.0, 1.0], turned if faces.shape[1] == 4 else faces[:, ::-1])


def _answer(mesh: gso.Mesh, way: str) -> tuple[float, float, float]:
    """Return strain, curvature and distance of the result; strips have no curvature to compare."""
    if way == "strips":
        far = quietly(gso.strips, mesh, strips=4).distances
        return 0.0, 0.0, 100.0 / mesh.size * max(far.there_max, far.back_max)
    result = quietly(gso.tno.optimize, mesh, **WAYS[way])
    far = metrics.surface_distance(mesh, result.mesh)
    strain = result.details.get("verdict", {}).get("strain_max", np.inf)
    curved = metrics.loss_gc_worst(result.mesh, scale=metrics.unit(mesh))
    return 100.0 * strain, curved, 100.0 / mesh.size * max(far.there_max, far.back_max)


SECTIONS = (trust, repeat)
