"""From designs to the cutter: time, parts, distances, mismatch of seams, density of nesting, pages.

Distances are per cent of each design's diagonal, the largest of all; mismatch is in millimetres.
The designs are the teapot's 32 patches, a hemisphere of 12 gores, the terrain, 200 facade panels.
"""

from __future__ import annotations

import re
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from harness import ROOT, example, progress, quietly, tabulate, timed

import gso
from gso.mesh import Mesh

#: Unit of each set, sheet, and the allowed distance in per cent.
_SETS = {
    "teapot": ("dm", (2000.0, 1000.0), 1.0),
    "hemisphere": ("mm", (2000.0, 1000.0), 1.0),
    "terrain": ("m", None, 0.5),
    "facade": ("mm", (3000.0, 1500.0), 1.0),
}
#: What a page does in each frame, and a script that counts frames in a second.
_MOVES = {"turn": "stage.turn(0.02, 0)", "fold": "stage.move(0.5 + 0.5 * Math.cos(0.1 * k), 0)"}
_FRAMES = """(async () => {
  const { stage } = gsoPage.viewer;
  const frame = () => new Promise(requestAnimationFrame);
  await frame();
  const start = performance.now();
  let k = 0;
  while (performance.now() - start < 4000) { %s; k += 1; await frame(); }
  return (1000 * k) / (performance.now() - start);
})()"""


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


def page(rows: str = "15", columns: str = "20", fine: str = "8") -> dict[str, Any]:
    """Measure the page of a vault of many parts: its size in kB, and frames per second.

    The frames are those of Chromium while the parts turn and while they fold, where it is
    installed and ``GSO_BROWSER=1`` asks for it. Code and geometry are compressed.
    """
    sys.path.insert(0, str(ROOT))
    from tests.browser import PROGRAM, Browser
    from tests.page_designs import html_of, vault

    html, took = timed(html_of, *vault(int(rows), int(columns), int(fine)))
    packed = dict(re.findall(r'id="page-(\w+)">([^<]*)</script>', html))
    style = sum(map(len, re.findall("<style>.*?</style>", html)))
    code, shapes = len(packed["script"]) + style, len(packed["arrays"])
    row = {
        "parts": int(rows) * int(columns),
        "kB": len(html) / 1000,
        "code": code / 1000,
        "geometry": shapes / 1000,
        "rest": (len(html) - code - shapes) / 1000,
        "s": took,
    }
    if PROGRAM is not None:
        with tempfile.TemporaryDirectory() as folder, Browser() as browser:
            place = Path(folder, "page.html")
            place.write_text(html, encoding="utf-8")
            browser.open(place)
            row |= {f"{name} 1/s": browser.run(_FRAMES % step) for name, step in _MOVES.items()}
    return tabulate("page", ["design"], {"vault": row})


SECTIONS = (fabricate, page)
