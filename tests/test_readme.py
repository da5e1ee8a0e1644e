"""The README and the pages of docs/: their code runs, their tables and pictures are up to date."""

from __future__ import annotations

import glob
import importlib
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
from dataclasses import fields
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner

import gso
from gso.cli import main

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.rst"
GUIDE, REFERENCE, WORKSHOP, TUTORIALS, HOWTO = (
    ROOT / "docs" / f"{name}.rst"
    for name in ("guide", "reference", "workshop", "tutorials", "howto")
)
#: Pages whose commands run.
SHOWN = (README, GUIDE, WORKSHOP)
#: Pages whose sections run one by one, commands and Python in the order in which they stand.
IN_SECTIONS = (TUTORIALS, HOWTO)
#: Sections of these that take a few seconds only; the others are slow tests.
QUICK = (
    "Stay under a strain",
    "Reckon with the sheet's thickness",
    "Repair a scan",
    "Show progress, and stop",
    "Read a result in a notebook",
    "Check a result by yourself",
)
PAGES = [README, ROOT / "CONTRIBUTING.rst", *sorted((ROOT / "docs").glob("*.rst"))]


def code_blocks(text):
    """Code blocks: the language and the text of each, in order."""
    found = re.findall(r"^( *)\.\. code-block:: (\w+)\n\n((?:\1 +.*\n|\n)+)", text, re.M)
    return [(language, textwrap.dedent(body).strip()) for _, language, body in found]


def blocks(page, language):
    """Code blocks of a language, in order."""
    return [body for name, body in code_blocks(page.read_text()) if name == language]


def sections(page):
    """Sections by title; each has code of its own."""
    parts = re.split(r"^(.+)\n-{3,}\n", page.read_text(), flags=re.M)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def command_lines(text):
    """Command lines of a block, after their dollar signs; a backslash continues a line."""
    lines = text.replace("\\\n", " ").splitlines()
    return [line.removeprefix("$ ") for line in lines if line.startswith("$ ")]


def run_line(line):
    """Run a command line, in this process where it is one of gso."""
    program, *words = shlex.split(line)
    if program == "echo":
        subprocess.run(line, shell=True, check=True)
    elif program == "python":
        subprocess.run([sys.executable, ROOT / words[0], *words[1:]], check=True)
    elif program == "gso":
        words = [path for word in words for path in (sorted(glob.glob(word)) or [word])]
        done = CliRunner().invoke(main, words, prog_name="gso")
        assert done.exit_code == 0, (line, done.output)
        if words[0] == "fabricate":
            assert (Path(words[words.index("-o") + 1]) / "index.html").exists()
        elif "-o" in words and not words[words.index("-o") + 1].endswith("/"):
            assert Path(words[words.index("-o") + 1]).stat().st_size > 0


def commands(page):
    """Command lines after a dollar sign."""
    return command_lines("\n".join(blocks(page, "console")))


@pytest.fixture
def workshop(tmp_path, monkeypatch):
    """A folder with the files that the README speaks of."""
    (tmp_path / "panels").mkdir()
    (tmp_path / "examples").mkdir()
    panel = ROOT / "examples" / "panel.obj"
    for target in ("examples/panel.obj", "panel.obj", "panels/a.obj"):
        shutil.copy(panel, tmp_path / target)
    for name in ("bracket.obj", "house.obj", "dinghy.csv"):
        shutil.copy(ROOT / "examples" / name, tmp_path / "examples")
    (tmp_path / "bench" / "data").mkdir(parents=True)
    shutil.copy(ROOT / "bench" / "data" / "bench24.npz", tmp_path / "bench" / "data")
    mesh = gso.load(panel)
    noise = np.random.default_rng(0).normal(scale=0.005, size=mesh.vertices.shape)
    gso.save(mesh.replaced(mesh.vertices + noise), tmp_path / "scan.obj")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("page", [p for p in PAGES if p not in IN_SECTIONS], ids=lambda p: p.name)
def test_python_blocks_run(page, workshop, monkeypatch):
    monkeypatch.setattr("gso.tasks._ADDED", {})
    for package in ("OCP", "rhino3dm", "ezdxf"):
        pytest.importorskip(package, exc_type=ImportError)
    scope = {}
    for number, code in enumerate(blocks(page, "python")):
        exec(compile(code, f"{page.name}, block {number}", "exec"), scope)
    if page == README:
        assert Path("panel_developable.obj").exists()
        assert Path("panel_pattern.svg").exists()
        assert scope["held"].metrics["distance_max"] <= 10.0 / scope["mesh"].diagonal * (1 + 1e-6)
        assert scope["aimed"].metrics["loss_gc_worst"] <= 0.02 * (1 + 0.05)
        assert scope["strained"].metrics["strain_max"] <= 0.002 * (1 + 1e-6)
    if page.stem == "CONTRIBUTING":
        plain, low = (scope[name].mesh.vertices[:, 2].std() for name in ("plain", "low"))
        assert low < 0.9 * plain
    if page.stem == "extending":
        before = scope["problem"].by_term(scope["noisy"].vertices.ravel())["planarity"]
        assert scope["problem"].by_term(scope["solution"].x)["planarity"] < 0.1 * before
        held, noisy = scope["held"], scope["noisy"]
        assert held.metrics["nonplanarity_max"] < gso.metrics.nonplanarity(noisy).max()
        rim = noisy.boundary_loops[0]
        np.testing.assert_allclose(held.mesh.vertices[rim], noisy.vertices[rim])


@pytest.mark.parametrize("page", SHOWN, ids=lambda p: p.stem)
def test_commands_run(page, workshop):
    words = ("gso ", "python examples/", "echo ")
    lines = [line for line in commands(page) if line.startswith(words)]
    assert len(lines) > 3
    pytest.importorskip("matplotlib")
    pytest.importorskip("OCP", exc_type=ImportError)
    for line in lines:
        run_line(line)
    assert page != GUIDE or Path("out/a.ply").exists()


@pytest.mark.parametrize(
    "page, title",
    [
        pytest.param(
            page,
            title,
            marks=() if title in QUICK else pytest.mark.slow,
            id=f"{page.stem}: {title}".encode("ascii", "ignore").decode(),
        )
        for page in IN_SECTIONS
        for title in sections(page)
    ],
)
def test_sections_run(page, title, workshop):
    pytest.importorskip("matplotlib")
    text = sections(page)[title]
    if ".step" in text:
        pytest.importorskip("OCP", exc_type=ImportError)
    if "gso train" in text:
        pytest.importorskip("torch")
    scope = {}
    for number, (language, code) in enumerate(code_blocks(text)):
        if language == "python":
            exec(compile(code, f"{page.name}, {title}, block {number}", "exec"), scope)
        for line in command_lines(code):
            if line.startswith(("gso ", "python examples/", "echo ")):
                run_line(line)


def test_every_option_of_a_command_in_the_readme_exists():
    ours = [line for page in (*SHOWN, *IN_SECTIONS) for line in commands(page)]
    ours = [line for line in ours if line.startswith("gso ")]
    named = set(re.findall(r"--[a-z][a-z-]+", "\n".join(ours)))
    groups = [getattr(c, "commands", {"": c}).values() for c in main.commands.values()]
    params = [p for commands in groups for c in commands for p in c.params]
    known = {name for p in params for name in (*p.opts, *p.secondary_opts)}
    assert named <= known


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_commands_are_understood(page):
    for line in commands(page):
        program, *words = shlex.split(line, comments=True)
        if program != "gso" or not words:
            continue
        command = main
        while words and words[0] in getattr(command, "commands", {}):
            command = command.commands[words.pop(0)]
        context = click.Context(command, info_name=command.name)
        command.make_parser(context).parse_args(words)  # raises for an option that is unknown


def test_commands_of_the_continuous_integration():
    text = README.read_text()
    for name, expected in {
        "main-job": [
            'pip install -c constraints.txt ".[plot]"',
            "gso optimize examples/panel.obj -o panel_developable.obj --plot panel_developable.png",
        ],
        "tests": ['pip install -c constraints.txt -e ".[test]"', "pytest"],
    }.items():
        body = re.search(rf"\.\. ci: {name}\n\n\.\. code-block:: console\n\n((?:   .*\n)+)", text)
        assert body is not None
        lines = [line.strip().removeprefix("$ ") for line in body[1].splitlines()]
        assert lines == expected


def test_tables_are_up_to_date(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    tables = importlib.import_module("tables")
    pages = {page: page.read_text() for page in tables.PAGES}
    assert tables.replaced(pages) == pages, "run python docs/tables.py"


def test_tables_name_every_metric_reason_and_setting():
    text = REFERENCE.read_text()
    for name in (*gso.metrics.INFO, *gso.verdict.Code.__members__):
        assert f"* - ``{name}``\n" in text
    for options in (gso.DevelopableOptions, gso.FlattenOptions, gso.DenoiseOptions):
        for name in (field.name for field in fields(options)):
            assert f"* - ``{name}``\n" in text


def test_theory_has_every_metric_with_what_it_does_not_see():
    text = (ROOT / "docs" / "theory.rst").read_text()
    left = [name for name in gso.metrics.INFO if f"``{name}``" not in text]
    assert not [name for name in left if not name.endswith("_before")]


def test_files_named_in_theory_exist():
    """A name without a folder is in that of the last name with one."""
    text = (ROOT / "docs" / "theory.rst").read_text()
    folder = None
    for name in re.findall(r"``([\w/]+(?:\.py)?)``", text):
        if name.startswith("gso/"):
            folder = ROOT / name if not name.endswith(".py") else (ROOT / name).parent
            assert (ROOT / name).exists(), name
        elif name.endswith(".py"):
            assert (folder / name).exists(), (folder, name)


def test_formulations_are_named():
    from gso import tasks

    text = REFERENCE.read_text()
    for task in tasks.names():
        names = ", ".join(f"``{name}``" for name in tasks.get(task).formulations)
        assert f"   * - ``{task}``\n     - {names}\n" in text


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_pictures_and_files_exist(page):
    text = page.read_text()
    for name in re.findall(r"^\.\. image:: (\S+)", text, re.M):
        picture = page.parent / name
        assert picture.stat().st_size < 150_000
        start = picture.read_bytes()[:200]
        assert b"<svg" in start if picture.suffix == ".svg" else start.startswith(b"\x89PNG")
    for name in re.findall(r"``((?:gso|docs|bench|examples)/[\w/.]+)``", text):
        assert (ROOT / name).exists(), name
