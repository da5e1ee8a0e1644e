"""From designs to the cutter: time, parts, distances, mismatch of seams, density of nesting.

Distances are per cent of each design's diagonal, the largest of all; mismatch is in millimetres.
The designs are the teapot's 32 patches, a hemisphere of 12 gores, the terrain, 200 facade panels.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from harness import example, progress, quietly, tabulate, timed

import gso
from gso.mesh import Mesh

#: Unit of each set, sheet, and the allowed distance in per cent.
_SETS = {
    "teapot": ("dm", (2000.0, 1000.0), 1.0),
    "hemisphere": ("mm", (2000.0, 1000.0), 1.0),
    "terrain": ("m", None, 0.5),
    "facade": ("mm", (3000.0, 1500.0), 1.0),
}


def fabricate(names: str = ",".join(_SETS), seconds: str = "30") -> dict[str, Any]:
    """Make sets of designs, with two processes."""
    rows = {}
    for name in progress(names.split(","), "fabricate"):
        unit, sheet, share = _SETS[name]
        asked = {"unit": unit, "sheet": sheet, "max_deviation": f"{share}%", "workers": 2}
        asked |= {"keep_groups": name == "hemisphere", "seconds": float(seconds)}
        with tempfile.TemporaryDirectory() as folder:
            designs = _designs(name, Path(folder))
            job, took = timed(quietly, gso.fabricate, designs, folder, **asked)
        own = job.certificate["designs"]
        made = [one for one in own if "parts" in one]
        rows[name] = {
            "designs": sum(len(one["copies"]) for one in own),
            "distinct": len(own),
            "parts": job.certificate["parts"],
            "mean %": 100.0 * max(d["deviation_mean"] / d["diagonal"] for d in made),
            "max %": 100.0 * max(d["deviation_max"] / d["diagonal"] for d in made),
            "strain (99 %)": max(d["strain_p99"] for d in made),
            "mismatch mm": max(d["seam_mismatch_max"] for d in made),
            "density": job.certificate.get("nesting", {}).get("density", np.nan),
            "refused": sum(bool(d["reasons"]) for d in own),
            "s": took,
        }
    return tabulate("fabricate", ["set"], rows)


def _designs(name: str, folder: Path) -> list[Mesh | Path]:
    if name == "hemisphere":
        example("gores").write(folder / "gores.obj")
        return [folder / "gores.obj"]
    module = example(name)
    if name == "teapot":
        return [gso.as_mesh(module.patch(k, 17)) for k in range(module.PATCH_COUNT)]
    grids = module.panels() if name == "facade" else [module.terrain()]
    return [gso.as_mesh(grid) for grid in grids]


SECTIONS = (fabricate,)
