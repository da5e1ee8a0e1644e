"""The pages of six jobs in a browser: they show parts, and fold them."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import gso
from gso.cli import main
from gso.mesh import Mesh
from tests.browser import PROGRAM, Browser

ROOT = Path(__file__).resolve().parents[1]


def duct() -> Mesh:
    """A transition from a square to an octagon, open at both ends."""
    turn = np.arange(8) * np.pi / 4
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    square = circle / np.abs(circle).max(axis=1)[:, None]
    points = np.concatenate([np.c_[200 * square, 0 * turn], np.c_[150 * circle, 0 * turn + 400]])
    a = np.arange(8)
    b = (a + 1) % 8
    return Mesh(points, np.concatenate([np.c_[a, b, b + 8], np.c_[a, b + 8, a + 8]]))


def scan() -> Mesh:
    """Half of an uneven ellipsoid, as triangles."""
    x, y = np.mgrid[-1:1:13j, -1:1:13j].reshape(2, -1)
    noise = np.random.default_rng(0).normal(0.0, 0.3, x.shape)
    height = 60 * np.sqrt(np.maximum(1.2 - 0.5 * x * x - 0.5 * y * y, 0)) + noise
    grid = Mesh.from_grid(np.stack([100 * x, 80 * y, height], axis=-1).reshape(13, 13, 3))
    return Mesh(grid.vertices, grid.triangles)


def command(*words: str) -> None:
    done = CliRunner().invoke(main, [*words, "--quiet"])
    assert done.exit_code == 0, done.output


#: Jobs, and the page of each.
JOBS = {
    "panel": lambda at: (
        command("pieces", str(ROOT / "examples" / "panel.obj"), "-o", str(at), "--unit", "m"),
        at / "index.html",
    ),
    "papercraft": lambda at: (
        command(
            *("unfold", str(ROOT / "examples" / "house.obj"), "-o", str(at / "house.svg")),
            *("--tabs", "6", "--page", str(at / "page.html")),
        ),
        at / "page.html",
    ),
    "duct": lambda at: (
        gso.save(duct(), at / "duct.obj"),
        command(
            *("fabricate", str(at / "duct.obj"), "-o", str(at / "job"), "--workers", "0"),
            *("--sheet", "2000", "1000"),
        ),
        at / "job" / "index.html",
    ),
    "hull": lambda at: (
        command("loft", str(ROOT / "examples" / "dinghy.csv"), "-o", str(at / "hull.obj")),
        command("fabricate", str(at / "hull.obj"), "-o", str(at / "job"), "--workers", "0"),
        at / "job" / "index.html",
    ),
    "loft": lambda at: (
        command(
            *("loft", str(ROOT / "examples" / "dinghy.csv"), "-o", str(at / "hull.dxf")),
            *("--unit", "m", "--page", str(at / "hull.html")),
        ),
        at / "hull.html",
    ),
    "scan": lambda at: (
        gso.save(scan(), at / "scan.obj"),
        command("pieces", str(at / "scan.obj"), "-o", str(at / "cut"), "--max-strain", "4%"),
        at / "cut" / "index.html",
    ),
}


@pytest.mark.slow
@pytest.mark.skipif(PROGRAM is None, reason="no Chromium, or GSO_BROWSER is not set")
@pytest.mark.parametrize("job", JOBS)
def test_pages_of_jobs_show_parts_that_fold(job, tmp_path):
    """No error, no request; something is seen in space, and it changes as the parts fold."""
    from PIL import Image

    page = JOBS[job](tmp_path)[-1]
    with Browser() as browser:
        browser.open(page)
        left, top, wide, high = browser.run(
            "(() => { const b = gsoPage.viewer.space.getBoundingClientRect();"
            "return [b.left, b.top, b.width, b.height]; })()"
        )

        def seen(share: float) -> np.ndarray:
            browser.run(
                f"(() => {{ const one = gsoPage.viewer.form.elements.fold; one.value = {share};"
                "one.dispatchEvent(new Event('input')); gsoPage.viewer.visible.clear(); })()"
            )
            browser.wait("gsoPage.viewer.visible.size > 0")
            picture = Image.open(io.BytesIO(browser.picture())).convert("RGB")
            box = (left + 2, top + 2, left + wide - 2, top + high - 2)
            return np.asarray(picture.crop(tuple(map(round, box))), int)

        place, half, flat = (seen(share) for share in (1, 0.5, 0))
        for one in (place, half, flat):
            assert (np.abs(one - one[0, 0]).max(axis=2) > 8).mean() > 0.03
        for one, other in ((place, half), (half, flat)):
            assert (np.abs(one - other).max(axis=2) > 8).mean() > 0.005
        browser.check()
        browser.resize(400, 900)
        assert browser.run("document.documentElement.scrollWidth") <= 400
