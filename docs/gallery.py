"""The gallery: a Sphinx extension that runs example jobs and shows what they write.

Each job is a title, a sentence, command lines, and the pictures that they write. The commands run
in this process, in a folder of their own with a copy of ``examples``. Pictures stay in
``docs/generated/gallery`` under a digest of the commands and of all code of the package and the
examples: a build after a change of these draws them again, any other build takes what is there.

``python docs/gallery.py`` draws the pictures without Sphinx, and prints what each job took.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import runpy
import shlex
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from click.testing import CliRunner

ROOT = Path(__file__).resolve().parents[1]
#: Where pictures and the text of the page are; Git ignores the folder.
FOLDER = ROOT / "docs" / "generated" / "gallery"
#: What ``gallery.rst`` includes; a suffix that Sphinx does not take for a page.
PAGE = FOLDER / "jobs.inc"


@dataclass(frozen=True)
class Job:
    """An example job.

    Attributes
    ----------
    name : str
        Of its pictures.
    title, text : str
        Heading, and what is to be seen.
    commands : sequence of str
        ``gso ...`` and ``python examples/...``.
    pictures : sequence of str
        Files that the commands write, .png or .svg.
    """

    name: str
    title: str
    text: str
    commands: Sequence[str]
    pictures: Sequence[str]

    def files(self, digest: str) -> list[Path]:
        """Return the places of the pictures."""
        names = (f"{self.name}-{k}-{digest}{Path(p).suffix}" for k, p in enumerate(self.pictures))
        return [FOLDER / name for name in names]


JOBS = (
    Job(
        "panel",
        "A panel that can be bent from a sheet",
        "A quarter of the teapot's upper body: curvature before and after, the distance between "
        "the two, and the strain of the flat pattern.",
        ["gso optimize examples/panel.obj -o panel.npz --plot panel.png"],
        ["panel.png"],
    ),
    Job(
        "rulings",
        "Lines to bend along",
        "The panel, solved together with its flat image: the directions of its normals before and "
        "after, an area and nearly a curve, and the straight lines of the result.",
        [
            "gso optimize examples/panel.obj -o both.obj --formulation isometry",
            "gso plot both.obj -o rulings.png --before examples/panel.obj --rulings 24",
        ],
        ["rulings.png"],
    ),
    Job(
        "strips",
        "Four strips",
        "Planar faces between straight rulings: no strain, a bend line at every ruling.",
        ["gso strips examples/panel.obj -o strips.npz --strips 4 --plot strips.png"],
        ["strips.png"],
    ),
    Job(
        "sheet",
        "Nested on a sheet",
        "The panel within 10 mm, as strips: outlines, bend lines, notches and names on a sheet of "
        "3500 mm by 1500 mm.",
        [
            "gso fabricate examples/panel.obj -o job --unit m --max-deviation 10mm "
            "--sheet 3500 1500 --seconds 2 --workers 0"
        ],
        ["job/sheets/sheet-1.svg"],
    ),
    Job(
        "gores",
        "A globe of gores",
        "A sphere of one metre within 20 mm: gores that are all alike, and unroll without strain.",
        [
            "python examples/whole.py sphere -o globe",
            "gso pieces globe/sphere.obj -o gores --max-deviation 20mm --symmetric --workers 0",
        ],
        ["gores/pieces.png", "gores/patterns.svg"],
    ),
    Job(
        "scan",
        "A scan in pieces",
        "A noisy helmet, in pieces that can be laid flat, within 2 % of its size.",
        [
            "python examples/scan.py -o scan.obj",
            "gso pieces scan.obj -o pieces --max-deviation 2% --denoise-auto --effort draft "
            "--workers 0",
        ],
        ["pieces/pieces.png"],
    ),
    Job(
        "denoise",
        "A scan without noise",
        "The same scan in grazing light, before and after; no level of noise was given.",
        [
            "python examples/scan.py -o scan.obj",
            "gso optimize scan.obj -o clean.obj --task denoise --plot denoise.png",
        ],
        ["denoise.png"],
    ),
    Job(
        "fox",
        "A fox of paper",
        "A model of 168 triangles, and its parts with folds and tabs.",
        [
            "python examples/fox.py -o fox.obj",
            "gso plot fox.obj -o fox.png --color none",
            "gso unfold fox.obj -o fox.svg --height 160mm --tabs 5",
        ],
        ["fox.png", "fox.svg"],
    ),
    Job(
        "boat",
        "A dinghy from its lines",
        "Four developable panels between keel, chine and sheer, and their patterns.",
        [
            "gso loft examples/dinghy.csv -o boat.obj --unit m",
            "gso plot boat.obj -o boat.png --color none",
            "gso loft examples/dinghy.csv -o boat.svg --unit m",
        ],
        ["boat.png", "boat.svg"],
    ),
    Job(
        "bracket",
        "A bracket",
        "A part with a rolled bend that is developable as it is, and its flat pattern.",
        [
            "gso plot examples/bracket.obj -o bracket.png --color none",
            "gso unfold examples/bracket.obj -o bracket.svg",
        ],
        ["bracket.png", "bracket.svg"],
    ),
    Job(
        "map",
        "A map that keeps angles",
        "A conformal image of the panel, coloured by the scale of its faces.",
        ["gso optimize examples/panel.obj -o map.npz --task conformal --plot map.png"],
        ["map.png"],
    ),
)


def digest() -> str:
    """Return a digest of the package, the examples and this file."""
    found = hashlib.sha256()
    files = [*(ROOT / "gso").rglob("*.py"), *(ROOT / "examples").glob("*.*"), Path(__file__)]
    for path in sorted(files):
        found.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return found.hexdigest()[:12]


def run(job: Job, places: Sequence[Path]) -> None:
    """Run a job's commands, and copy its pictures to their places.

    Raises
    ------
    RuntimeError
        A command ends with an error, or writes no picture.
    """
    with tempfile.TemporaryDirectory() as name, inside(Path(name)):
        shutil.copytree(ROOT / "examples", "examples", ignore=shutil.ignore_patterns("out", "__*"))
        for line in job.commands:
            execute(line)
        for source, target in zip(job.pictures, places, strict=True):
            if not Path(source).exists():
                raise RuntimeError(f"gallery, {job.name}: no command writes {source}")
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, target)


def execute(line: str) -> None:
    """Run a command line of ``gso`` or of an example in this process."""
    from gso.cli import main as gso_main

    program, *words = shlex.split(line)
    # Sphinx shows what others log.
    logging.getLogger("gso").setLevel(logging.WARNING)
    if program == "gso":
        done = CliRunner().invoke(gso_main, words, prog_name="gso")
        if done.exit_code:
            raise RuntimeError(f"gallery: {line}: {done.output}") from done.exception
        return
    script, *arguments = words
    argv, path = sys.argv, sys.path[:]
    sys.argv = [script, *arguments]
    sys.path.insert(0, str(Path(script).parent.resolve()))
    try:
        runpy.run_path(script, run_name="__main__")
    finally:
        sys.argv, sys.path[:] = argv, path


@contextlib.contextmanager
def inside(folder: Path) -> Iterator[None]:
    """Work in a folder."""
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def page(code: str) -> str:
    """Return the text of the page: every job with its commands and pictures."""
    parts = []
    for job in JOBS:
        lines = [job.title, "-" * len(job.title), "", job.text, ""]
        for place in job.files(code):
            lines += [f".. image:: generated/gallery/{place.name}", f"   :alt: {job.title}"]
            lines += ["   :class: drawing" if place.suffix == ".svg" else "", ""]
        lines += [".. code-block:: console", "", *(f"   $ {line}" for line in job.commands), ""]
        parts.append("\n".join(lines))
    return "\n".join(parts)


def draw(say: Callable[[str], object] | None = None) -> None:
    """Draw what has not been drawn yet, and write the text of the page.

    `say` gets a line for each job with its seconds.
    """
    code = digest()
    wanted = {place for job in JOBS for place in job.files(code)}
    for job in JOBS:
        places = job.files(code)
        if not all(place.exists() for place in places):
            start = time.process_time()
            run(job, places)
            if say is not None:
                say(f"{job.name}: {time.process_time() - start:.1f} s\n")
    for old in FOLDER.glob("*"):
        if old.suffix in (".png", ".svg") and old not in wanted:
            old.unlink()
    text = page(code)
    if not PAGE.exists() or PAGE.read_text(encoding="utf-8") != text:
        PAGE.write_text(text, encoding="utf-8")


def setup(app: Any) -> dict[str, Any]:
    """Draw the gallery before Sphinx reads the pages."""
    app.connect("builder-inited", lambda app: draw())
    return {"parallel_read_safe": True, "parallel_write_safe": True}


if __name__ == "__main__":
    draw(sys.stdout.write)
