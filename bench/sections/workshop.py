"""From designs to the cutter: time, parts, distances, mismatch of seams, density of nesting.

Distances are per cent of each design's diagonal, the largest of all; mismatch is in millimetres.
The designs are the teapot's 32 patches, a hemisphere, the terrain, and 200 facade panels.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from harness import ROOT, progress, table

import gso
from gso.mesh import Mesh

#: Sheet for each set, its unit, and the allowed distance in per cent.
_SETS = {
    "teapot": ("dm", (2000.0, 1000.0), 1.0),
    "hemisphere": ("mm", (2000.0, 1000.0), 1.0),
    "terrain": ("m", None, 0.5),
    "facade": ("mm", (3000.0, 1500.0), 1.0),
}


def fabricate(names: str = ",".join(_SETS), seconds: str = "30") -> dict[str, Any]:
    """Make sets of designs, with two processes."""
    rows, out = [], {}
    for name in progress(names.split(","), "fabricate"):
        unit, sheet, share = _SETS[name]
        designs = _designs(name)
        folder = Path(tempfile.mkdtemp())
        clock = time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            job = gso.fabricate(
                designs,
                folder,
                unit=unit,
                max_deviation=f"{share}%",
                sheet=sheet,
                seconds=float(seconds),
                workers=2,
            )
        took = time.perf_counter() - clock
        shutil.rmtree(folder)
        own = job.certificate["designs"]
        made = [one for one in own if "parts" in one]
        out[name] = {
            "designs": sum(len(one["copies"]) for one in own),
            "distinct": len(own),
            "parts": job.certificate["parts"],
            "mean": 100.0 * max(d["deviation_mean"] / d["diagonal"] for d in made),
            "max": 100.0 * max(d["deviation_max"] / d["diagonal"] for d in made),
            "p99": max(d["strain_p99"] for d in made),
            "mismatch": max(d["seam_mismatch_max"] for d in made),
            "density": job.certificate.get("nesting", {}).get("density", np.nan),
            "refused": sum(bool(d["reasons"]) for d in own),
            "seconds": took,
        }
        rows.append([name, *out[name].values()])
    columns = ["set", "designs", "distinct", "parts", "mean %", "max %", "strain (99 %)"]
    table("fabricate", [*columns, "mismatch mm", "density", "refused", "s"], rows)
    return out


def _designs(name: str) -> list[Mesh]:
    sys.path.insert(0, str(ROOT / "examples"))
    if name == "teapot":
        import teapot

        return [gso.as_mesh(teapot.patch(k, 17)) for k in range(teapot.PATCH_COUNT)]
    if name == "facade":
        import facade

        return [gso.as_mesh(grid) for grid in facade.panels()]
    if name == "terrain":
        import terrain

        return [gso.as_mesh(terrain.terrain())]
    return [hemisphere()]


def hemisphere(radius: float = 500.0, around: int = 48, rows: int = 16) -> Mesh:
    """Make a hemisphere of triangles, without a pole where edges have no length."""
    a = 2.0 * np.pi * np.arange(around) / around
    b = np.linspace(0.0, 0.5 * np.pi, rows + 1)[1:]
    a, b = np.meshgrid(a, b, indexing="ij")
    ring = np.stack([np.sin(b) * np.cos(a), np.sin(b) * np.sin(a), np.cos(b)], axis=-1)
    i = np.arange(around * rows).reshape(around, rows)
    j = np.roll(i, -1, axis=0)
    top = around * rows
    faces = [
        np.stack([i[:, :-1], i[:, 1:], j[:, 1:]], axis=-1).reshape(-1, 3),
        np.stack([i[:, :-1], j[:, 1:], j[:, :-1]], axis=-1).reshape(-1, 3),
        np.stack([np.full(around, top), i[:, 0], j[:, 0]], axis=-1),
    ]
    points = np.concatenate([ring.reshape(-1, 3), [[0.0, 0.0, 1.0]]])
    return Mesh(radius * points, np.concatenate(faces))


SECTIONS = (fabricate,)
