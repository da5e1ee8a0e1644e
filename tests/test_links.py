"""Links of the pages lead somewhere, checked without a network and without Sphinx."""

from __future__ import annotations

import re
from configparser import ConfigParser
from pathlib import Path
from urllib.parse import urlsplit

import pytest

ROOT = Path(__file__).resolve().parents[1]
DOCS = {page.stem: page.read_text() for page in (ROOT / "docs").glob("*.rst")}
OTHERS = ("README.rst", "CONTRIBUTING.rst", "CHANGELOG.rst", "examples/README.rst")
PAGES = {f"docs/{name}.rst": text for name, text in DOCS.items()} | {
    name: (ROOT / name).read_text() for name in OTHERS
}


def prose(text):
    """A page without literals and code blocks."""
    text = re.sub(r"\n( *)\.\. code-block::.*\n\n(?:\1 +.*\n|\n)+", "\n", text)
    return re.sub(r"``.+?``", "", text, flags=re.S)


def anchors(text):
    """Labels and headings of a page, in lower case."""
    labels = re.findall(r"^\.\. _([^:]+):", text, re.M)
    headings = re.findall(r"^(\S.*)\n[-=~#*]{3,}$", text, re.M)
    return {" ".join(name.lower().split()) for name in (*labels, *headings)}


def target(reference):
    """What a role or a link names: the part in angle brackets, if there is one."""
    return re.sub(r"(?s).*<(.+)>", r"\1", reference)


@pytest.mark.parametrize("page", PAGES)
def test_pages_and_labels_exist(page):
    text = prose(PAGES[page])
    labels = {name for other in PAGES.values() for name in anchors(other)}
    for role, reference in re.findall(r":(doc|ref):`([^`]+)`", text):
        place = target(reference)
        assert place in DOCS if role == "doc" else place.lower() in labels, place
    assert page.startswith("docs/") or not re.search(r":(doc|ref):", text), "no page of the site"


@pytest.mark.parametrize("page", PAGES)
def test_links_are_anchors_or_addresses(page):
    text = prose(PAGES[page])
    own = anchors(PAGES[page])
    for reference in re.findall(r"(?<![:`\w])`([^`]+)`__?(?!\w)", text):
        place = " ".join(target(reference).split())
        if place.startswith("http"):
            assert urlsplit(place).netloc and " " not in place, place
        else:
            assert place.removesuffix("_").lower() in own, place


@pytest.mark.parametrize("page", PAGES)
def test_files_named_by_path_exist(page):
    for name in re.findall(r"``((?:gso|docs|bench|examples|tests|web)/[\w/.-]+)``", PAGES[page]):
        # What the examples write is not there before they run.
        assert (ROOT / name).exists() or name.startswith("examples/out"), name


def test_every_page_is_in_the_index():
    listed = set(re.findall(r"^   (\w+)$", DOCS["index"], re.M))
    assert listed == set(DOCS) - {"index"}


def test_every_extra_is_on_the_first_page():
    setup = ConfigParser()
    setup.read(ROOT / "setup.cfg")
    listed = re.findall(r"^   ``(\w+)``,", DOCS["index"], re.M)
    assert sorted(listed) == sorted(setup["options.extras_require"])


def test_version_is_the_same_everywhere():
    version = re.search(r"^version = (\S+)$", (ROOT / "setup.cfg").read_text(), re.M)[1]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()
    assert re.search(r"^(\d\S*)", PAGES["CHANGELOG.rst"], re.M)[1] == version
