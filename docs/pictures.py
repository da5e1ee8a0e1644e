"""Draw the pictures of the documentation: ``python docs/pictures.py`` from the repository's root.

They are those of ``gso optimize --plot`` and ``gso plot --rulings``, reduced to a palette of 256
colours, a third of the size; and a part, a sheet and the page of ``gso fabricate``. The last one is
drawn where Chromium is installed.
"""

from __future__ import annotations

import io
import shutil
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

import gso
from gso.mesh import Mesh
from gso.plot import Panel, View, plot_pieces, plot_result, plot_rulings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images"


def main() -> None:
    """Draw every picture."""
    panel = gso.load(ROOT / "examples" / "panel.obj")
    developable = gso.tno.optimize(panel)
    draw("developable", plot_result(developable))
    draw("flatten", plot_result(gso.tno.optimize(developable.mesh, task="flatten")))
    together = gso.tno.optimize(panel, formulation="isometry")
    draw("isometry", plot_result(together))
    draw("rulings", plot_rulings(together.mesh, before=panel))
    for name, options in (
        ("strip", gso.RuledOptions(flats=True)),
        ("strips", gso.RuledOptions(strips=4)),
    ):
        draw(name, plot_result(gso.tno.optimize(panel, options=options)))
    sys.path.insert(0, str(ROOT / "examples"))
    import whole

    draw(
        "pieces", plot_pieces(gso.pieces(Mesh(*whole.sphere()), max_strain=1e-3, max_deviation=30))
    )
    noise = np.random.default_rng(0).standard_normal(panel.vertices.shape)
    noisy = panel.replaced(panel.vertices + 0.005 * panel.frame.scale * noise)
    draw("denoise", plot_result(gso.tno.optimize(noisy, task="denoise")))
    examples()
    workshop()


def examples() -> None:
    """Draw the fox and the scan of the tutorials."""
    import fox
    import scan

    mesh = Mesh(*fox.fox())
    net = gso.unfold(mesh)
    view, flat = View.of(mesh), net.pattern.flat
    points = (flat - flat.mean(axis=0)) / mesh.frame.scale
    panels = [
        Panel(view.project(mesh.vertices), mesh.faces, "design"),
        Panel(np.pad(points, ((0, 0), (0, 1))), net.pattern.faces, "parts", shaded=False),
    ]
    draw("fox", gso.plot.draw(panels))
    found = gso.pieces(Mesh(*scan.scan()), max_deviation="2%", denoise="auto", effort="draft")
    draw("scan", plot_pieces(found))


def workshop() -> None:
    """Draw what ``gso fabricate`` makes of the panel."""
    with tempfile.TemporaryDirectory() as folder:
        job = gso.fabricate(
            ROOT / "examples" / "panel.obj",
            folder,
            unit="m",
            max_deviation=0.01,
            sheet=(3500.0, 1500.0),
            formats=("svg",),
        )
        name = max(job.parts, key=lambda part: len(part.bends)).name
        shutil.copy(Path(folder) / "parts" / f"{name}.svg", IMAGES / "part.svg")
        shutil.copy(Path(folder) / "sheets" / "sheet-1.svg", IMAGES / "sheet.svg")
        sys.path.insert(0, str(ROOT))
        from tests.browser import PROGRAM, Browser

        if PROGRAM is not None:
            with Browser(1200, 980) as browser:
                browser.open(Path(folder) / "index.html")
                browser.run(
                    "(() => { const one = gsoPage.viewer.form.elements.explode; one.value = 0.25;"
                    "one.dispatchEvent(new Event('input')); })()"
                )
                browser.run("gsoPage.choosePart(1)")
                browser.wait("gsoPage.viewer.stage.isSharp && !gsoPage.viewer.stage.asked")
                # The names are written once nothing moves.
                browser.run("new Promise((done) => setTimeout(done, 1000))")
                page = io.BytesIO(browser.picture())
            reduce("page", Image.open(page).convert("RGB"))


def draw(name: str, figure: Figure) -> None:
    """Write a picture."""
    figure.set_dpi(100)
    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())[..., :3]  # type: ignore[attr-defined]
    reduce(name, Image.fromarray(np.ascontiguousarray(pixels)))


def reduce(name: str, image: Image.Image) -> None:
    """Write an image with a palette whose first colour is white."""
    palette = image.quantize(256, kmeans=3)
    IMAGES.mkdir(exist_ok=True)
    reduced = image.quantize(256, palette=palette)
    white = reduced.getpixel((0, 0))
    colours = reduced.getpalette()
    colours[3 * white : 3 * white + 3] = [255, 255, 255]
    reduced.putpalette(colours)
    reduced.save(IMAGES / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main()
