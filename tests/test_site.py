"""The pages of docs as a site: no warnings, no broken links between pages, every name described."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import gso

pytest.importorskip("sphinx")
pytest.importorskip("furo")

ROOT = Path(__file__).resolve().parents[1]
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the site, built from a copy of the pages."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
    done = subprocess.run(
        [*command, "-d", folder / "trees", ROOT / "docs", folder / "html"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return folder / "html"


def test_every_public_name_is_described(site):
    pages = "".join(page.read_text() for page in (site / "generated").glob("*.html"))
    anchors = set(re.findall(r'id="(gso\.[\w.]+)"', pages))
    packages = {"constraints", "dataset", "exact", "executors", "hybrid", "io", "metrics", "net"}
    packages |= {"plot", "recognition", "rulings", "seams", "tno", "topology", "verdict"}
    names = set(gso.__all__) - packages - {"__version__"}
    left = {n for n in names if not {f"gso.{n}", f"gso.constraints.{n}"} & anchors}
    assert not left


def test_links_between_pages_lead_somewhere(site):
    for page in site.rglob("*.html"):
        text = page.read_text()
        for target in re.findall(r'href="([^"#:?]+\.html)(?:#[^"]*)?"', text):
            assert (page.parent / target).exists(), (page.name, target)
        if "_modules" in page.parts:  # of source code: Sphinx links names where they are defined
            continue
        for target, anchor in re.findall(r'href="([^"#:?]*\.html|)#([^"]+)"', text):
            other = (page.parent / target if target else page).read_text()
            assert f'id="{anchor}"' in other, (page.name, target, anchor)
        for target in re.findall(r'<img[^>]* src="([^":]+)"', text):
            assert (page.parent / target).exists(), (page.name, target)
