"""One design, all ways to strips: the same parts, and one verdict.

``gso.strips``; ``gso.tno.optimize`` with ``formulation="ruled"``; ``gso.pieces`` and then
``gso.strips`` of what it found; ``gso.fabricate``. Distances are percent of the diagonal.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from typing import Any

import numpy as np
from designs import analytic
from harness import ROOT, progress, reference, table, timed

import gso
from gso.components import split

#: Allowed distance, as a share of the diagonal.
_AWAY = 0.02


def ways(only: str = "") -> dict[str, Any]:
    """Make strips of ten designs in all ways, and compare them."""
    out, rows = {}, []
    for name, design in progress(list(_designs().items()), "ways"):
        if only and name not in only.split("+"):
            continue
        found = {way: timed(make, design) for way, make in WAYS.items()}
        parts = [one for one, _ in found.values()]
        same = all(_same(parts[0], other) for other in parts[1:])
        for way, (one, seconds) in found.items():
            far = 100.0 * one["far"]
            rows.append([name, way, one["parts"], one["bare"], far, str(one["usable"]), seconds])
        rows[-1].append("same" if same else "different")
        out[name] = {way: one | {"seconds": seconds} for way, (one, seconds) in found.items()}
    columns = ["design", "way", "parts", "without bends", "max %", "usable", "s", "all ways"]
    table(
        f"Strips within {100 * _AWAY:g} %", columns, [row + [""] * (8 - len(row)) for row in rows]
    )
    return out


def _designs() -> dict[str, gso.Mesh]:
    """Return five surfaces of formulas, two of the references, and three whole designs."""
    sys.path.insert(0, str(ROOT / "examples"))
    import whole

    u, v = np.meshgrid(*[np.linspace(-1.0, 1.0, 21)] * 2, indexing="ij")
    made = {
        "dome": np.stack([u, v, 0.5 - 0.25 * (u * u + v * v)], axis=-1),
        "cap": np.stack([u, v, np.sqrt(4.0 - u * u - v * v)], axis=-1),
        "saddle": np.stack([u, v, 0.3 * u * v], axis=-1),
        "bowl": np.stack([u, v, 0.3 * u * u + 0.1 * v * v], axis=-1),
        "cone": analytic.cone(33).points,
        **{f"reference {k}": reference()[0][k] for k in (0, 12)},
    }
    designs = {name: gso.as_mesh(points) for name, points in made.items()}
    whole_designs = {name: gso.as_mesh(whole.DESIGNS[name]()) for name in ("hull", "canopy")}
    return designs | {"panel": gso.load(ROOT / "examples" / "panel.obj")} | whole_designs


def _of_result(result: gso.Result) -> dict[str, Any]:
    """Return what is compared of strips."""
    surface = result.ruled
    own = split(surface.pattern.mesh)
    bends = surface.folded.edges[:, 0]
    bare = sum(not np.isin(part.vertices, bends).any() for part in own)
    areas = sorted(part.area for part in own)
    return {
        "parts": len(own),
        "bare": bare,
        "areas": areas,
        "far": surface.farthest / result.design.diagonal,
        "usable": result.usable,
    }


def _strips(design: gso.Mesh) -> dict[str, Any]:
    return _of_result(gso.strips(design, max_deviation=_AWAY * design.diagonal))


def _optimised(design: gso.Mesh) -> dict[str, Any]:
    allowed = _AWAY * design.diagonal
    return _of_result(gso.tno.optimize(design, formulation="ruled", max_deviation=allowed))


def _from_pieces(design: gso.Mesh) -> dict[str, Any]:
    allowed = _AWAY * design.diagonal
    found = gso.pieces(design, max_strain=1e-3, max_deviation=allowed)
    return _of_result(gso.strips(found, max_deviation=allowed))


def _fabricated(design: gso.Mesh) -> dict[str, Any]:
    allowed = f"{100 * _AWAY}%"
    with tempfile.TemporaryDirectory() as folder:
        job = gso.fabricate(design, folder, max_deviation=allowed, formats=("svg",), workers=0)
    (record,) = job.certificate["designs"]
    return {
        "parts": job.certificate["parts"],
        "bare": sum(not part["bends"] for part in record["parts"]),
        "areas": sorted(part.area for part in job.parts for _ in range(part.count)),
        "far": record["deviation_max"] / record["diagonal"],
        "usable": job.usable,
    }


def _same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Whether two ways made the same parts, with one verdict."""
    alike = all(one[name] == other[name] for name in ("parts", "bare", "usable"))
    return alike and bool(
        np.allclose(one["areas"], other["areas"], rtol=1e-6)
        and np.isclose(one["far"], other["far"], rtol=1e-6)
    )


#: The ways to strips.
WAYS: dict[str, Callable[[gso.Mesh], dict[str, Any]]] = {
    "strips": _strips,
    "optimize": _optimised,
    "pieces": _from_pieces,
    "fabricate": _fabricated,
}
SECTIONS = (ways,)
