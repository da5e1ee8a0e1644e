"""From designs to the cutter: time, parts, distances, mismatch of seams, density of nesting.

Distances are per cent of each design's diagonal, the largest of all; mismatch is in millimetres.
The designs are the teapot's 32 patches, a hemisphere of 12 gores, the terrain, 200 facade panels.
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
        folder = Path(tempfile.mkdtemp())
        designs = _designs(name, folder)
        clock = time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            job = gso.fabricate(
                designs,
                folder,
                keep_groups=name == "hemisphere",
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


def _designs(name: str, folder: Path) -> list[Mesh | Path]:
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
    import gores

    gores.write(folder / "gores.obj")
    return [folder / "gores.obj"]


SECTIONS = (fabricate,)
