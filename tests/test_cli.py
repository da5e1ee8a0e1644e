"""The command line: what it writes, what it says, how it ends."""

from __future__ import annotations

import importlib
import json
import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from click.shell_completion import get_completion_class
from click.testing import CliRunner

import gso
from gso.cli import TABLE, main

PANEL = Path(__file__).resolve().parents[1] / "examples" / "panel.obj"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run a command in an empty folder; whatever goes wrong must be said in one line."""
    monkeypatch.chdir(tmp_path)

    def invoke(*arguments):
        done = CliRunner().invoke(main, [str(a) for a in arguments], prog_name="gso")
        assert done.exception is None or isinstance(done.exception, SystemExit), done.exc_info
        return done

    return invoke


def refused(done, *words):
    """Assert an error of one line with these words, and nothing else."""
    assert done.exit_code == 1
    lines = done.stderr.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("gso: error: ")
    for word in words:
        assert word in lines[0]
    return True


def bump(size=9, height=0.1):
    y, x = np.mgrid[:size, :size] / (size - 1)
    return np.stack([x, y, height * np.sin(np.pi * x) * np.sin(np.pi * y)], axis=-1)


@pytest.fixture
def small(tmp_path):
    """A small surface in a file."""
    path = tmp_path / "small.obj"
    gso.save(bump(), path)
    return path


@pytest.fixture
def never(monkeypatch):
    """Fail when a solve begins."""

    def begin(*args, **keywords):
        raise AssertionError("the solve began")

    monkeypatch.setattr("gso.hybrid.solve", begin)
    monkeypatch.setattr("gso.hybrid.solve_many", begin)


def test_optimises_one_file(run):
    done = run("optimize", PANEL, "-o", "out.obj", "--metrics", "out.json")
    assert done.exit_code == 0
    result, design = gso.load("out.obj"), gso.load(PANEL)
    assert np.array_equal(result.faces, design.faces)
    record = json.loads(Path("out.json").read_text())
    assert record["usable"] is True
    assert record["metrics"]["loss_gc"] < 0.2 * record["metrics"]["loss_gc_before"]
    size = gso.metrics.unit(design)
    assert np.isclose(gso.metrics.loss_gc(result, scale=size), record["metrics"]["loss_gc"])
    for name in record["metrics"]:
        assert name in done.stdout
    assert record["message"] in done.stdout
    assert "1/size^2" in done.stdout
    assert done.stderr == ""


def test_quiet_says_nothing(run, small):
    done = run("optimize", small, "-o", "out.obj", "-q")
    assert (done.exit_code, done.stdout, done.stderr) == (0, "", "")
    done = run("optimize", small, "-o", "out.obj", "-q", "--max-deviation", 1e-9)
    assert (done.exit_code, done.stdout) == (1, "")
    assert done.stderr.startswith("not usable: ")


def test_notes_are_printed(run):
    grid = bump()
    grid[0] = grid[0, 0]
    np.save("pole.npy", grid)
    done = run("optimize", "pole.npy", "-o", "out.obj")
    assert "note: the first row of the grid is one point" in done.stdout


def test_full_result_is_read_back(run, small):
    assert run("optimize", small, "-o", "out.npz").exit_code == 0
    result = gso.Result.load("out.npz")
    assert result.task == "developable"
    assert result.metrics["loss_gc"] < result.metrics["loss_gc_before"]
    assert np.allclose(result.design.vertices, gso.load(small).vertices)


def test_options_reach_the_solver(run, small, monkeypatch):
    seen = {}

    def solve(mesh, **keywords):
        seen.update(keywords)
        raise gso.GSOError("enough")

    monkeypatch.setattr("gso.hybrid.solve", solve)
    done = run(
        *("optimize", small, "-o", "out.obj", "--options", "accurate", "--backend", "superlu"),
        *("--max-deviation", 0.1, "--fix-boundary"),
    )
    assert refused(done, "enough")
    preset = gso.DevelopableOptions.preset("accurate")
    assert seen["options"].iterations == preset.iterations
    assert seen["options"].backend == "superlu"
    assert seen["max_deviation"] == 0.1
    assert isinstance(seen["constraints"][0], gso.FixedBoundary)


def test_boundary_is_kept(run, small):
    assert run("optimize", small, "-o", "out.npz", "--fix-boundary").exit_code == 0
    before, after = gso.load(small), gso.load("out.npz")
    rim = before.half_edges.boundary_vertex
    assert np.allclose(before.vertices[rim], after.vertices[rim])
    assert not np.allclose(before.vertices[~rim], after.vertices[~rim])


def test_constraints_come_from_a_file(run, small):
    Path("c.json").write_text('[{"type": "Fixed", "ids": [0, 5]}]')
    assert run("optimize", small, "-o", "out.npz", "--constraints", "c.json").exit_code == 0
    left = gso.Result.load("out.npz").details["constraints"]
    assert left == pytest.approx({"constraint 0 (Fixed)": 0.0}, abs=1e-12)
    assert refused(run("optimize", small, "-o", "out.npz", "--constraints", "no.json"), "no.json")


def test_missed_target_is_no_success(run, small):
    done = run("optimize", small, "-o", "out.obj", "--target-curvature", 1e-12)
    assert done.exit_code == 1
    assert "not usable" in done.stdout
    assert done.stderr == ""
    assert os.path.exists("out.obj")
    done = run("optimize", small, "-o", "out/", "--target-curvature", 1e-12, "--workers", 0)
    assert done.exit_code == 1
    assert "not usable" in done.stdout
    assert done.stderr == ""


def test_flattens_to_a_drawing(run, small):
    done = run("optimize", small, "-o", "out.svg", "--task", "flatten", "--unit", "cm")
    assert done.exit_code == 0
    assert "strain_max" in done.stdout
    text = Path("out.svg").read_text()
    width = float(text.split('width="')[1].split("mm")[0])
    assert 10.0 < width < 15.0  # a bump of one unit, in centimetres


def test_turned_cells_are_no_success(run, small, monkeypatch):
    from gso.hybrid import solve

    def fold(mesh, **keywords):
        result = solve(mesh, **keywords)
        result.__dict__["metrics"] = {**result.metrics, "flipped_cells": 3}
        return result

    monkeypatch.setattr("gso.hybrid.solve", fold)
    assert run("optimize", small, "-o", "out.obj", "--task", "flatten").exit_code == 1


def test_denoises(run):
    rng = np.random.default_rng(0)
    np.save("noisy.npy", bump(17) + 0.003 * rng.standard_normal((17, 17, 3)))
    done = run("optimize", "noisy.npy", "-o", "out.npy", "--task", "denoise", "--metrics", "m.json")
    assert done.exit_code == 0
    assert json.loads(Path("m.json").read_text())["metrics"]["roughness_ratio"] < 0.5


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-o", "no/such/out.obj"], ["no/such", "create it"]),
        (["-o", "out.doc"], [".doc", ".obj"]),
        (["-o", "out.svg", "--task", "bend"], ["--task flatten"]),
        (["-o", "out.dxf", "--task", "flatten"], ["gso fabricate", ".svg"]),
        (["-o", "out.obj", "--plot", "out.jpg"], [".jpg", ".png"]),
        (["-o", "out.obj", "--metrics", "no/such/out.json"], ["no/such"]),
        (["-o", "out.obj", "--backend", "abacus"], ["abacus", "superlu"]),
        (["-o", "out.obj", "--formulation", "magic"], ["magic", "curvature"]),
        (["-o", "out.obj", "--suffix", ".ply"], ["--suffix"]),
        (["-o", "out.obj", "--task", "flatten", "--max-deviation", "1"], ["max_deviation"]),
        (["-o", "out.obj", "--task", "denoise", "--target-curvature", "1"], ["target_curvature"]),
    ],
)
def test_mistakes_are_found_before_the_solve(run, small, never, arguments, words):
    assert refused(run("optimize", small, *arguments), *words)


def test_grid_format_needs_a_grid(run, never):
    gso.save(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), "tri.obj")
    assert refused(run("optimize", "tri.obj", "-o", "out.npy"), "no grid")


def test_plot_without_matplotlib_is_found_before_the_solve(run, small, never, monkeypatch):
    monkeypatch.setattr(importlib.import_module("gso.plot.draw"), "find_spec", lambda name: None)
    done = run("optimize", small, "-o", "out.obj", "--plot", "out.png")
    assert refused(done, 'pip install ".[plot]" in the folder of gso')


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, ["in.obj", "no such file"]),
        ("", ["in.obj", "empty"]),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", ["in.obj", "vertex 9"]),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", ["interior vertex"]),
        ("v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", ["in.obj"]),
    ],
)
def test_bad_input_keeps_the_old_output(run, content, words):
    if content is not None:
        Path("in.obj").write_text(content)
    Path("out.obj").write_text("precious")
    assert refused(run("optimize", "in.obj", "-o", "out.obj"), *words)
    assert Path("out.obj").read_text() == "precious"


def test_negative_deviation_is_refused(run, small):
    done = run("optimize", small, "-o", "o.obj", "--max-deviation", -1)
    assert done.exit_code == 2 and "no positive length" in done.output


def test_usage_errors_are_clicks(run, small):
    assert run("optimize", small).exit_code == 2
    assert run("optimize", small, "-o", "o.obj", "--task", "cook").exit_code == 2


def test_interrupted_run_leaves_nothing(run, small, monkeypatch):
    def stop(*args, **keywords):
        raise KeyboardInterrupt

    monkeypatch.setattr("gso.hybrid.solve", stop)
    done = run("optimize", small, "-o", "out.obj", "--metrics", "out.json")
    assert done.exit_code == 130
    assert os.listdir() == ["small.obj"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_ctrl_c(tmp_path):
    pipe = tmp_path / "in.obj"
    os.mkfifo(pipe)
    command = [sys.executable, "-m", "gso", "optimize", pipe, "-o", tmp_path / "out.obj"]
    # A shell's background jobs ignore Ctrl-C, and so would their children.
    process = subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    with open(pipe, "w") as writer:  # opens when the other side reads
        writer.write("v 0 0 0\n")
        writer.flush()
        time.sleep(0.3)  # in the midst of reading
        process.send_signal(signal.SIGINT)
        error = process.communicate(timeout=30)[1]
    assert process.returncode == 130
    assert error == "gso: interrupted\n"
    assert os.listdir(tmp_path) == ["in.obj"]


def test_many_files(run, small):
    gso.save(bump(11), "other.ply")
    Path("broken.obj").write_text("f 1 2 3\n")
    done = run(
        *("optimize", small, "broken.obj", "other.ply", "gone.obj", "-o", "out"),
        *("--workers", 0, "--metrics", "all.json", "--plot", "pictures"),
    )
    assert done.exit_code == 1
    assert sorted(os.listdir("out")) == ["other.ply", "small.obj"]
    assert sorted(os.listdir("pictures")) == ["other.png", "small.png"]
    lines = done.stdout.splitlines()
    assert len(lines) == 3
    assert lines[-1] == "2 of 4 results usable"
    errors = done.stderr.splitlines()
    assert [line.split(":")[2].strip() for line in errors] == ["broken.obj", "gone.obj"]
    records = json.loads(Path("all.json").read_text())
    assert [r["usable"] for r in records] == [True, False, True, False]
    assert "error" in records[1]


def test_many_files_in_processes(run, small):
    gso.save(bump(11), "other.obj")
    done = run("optimize", small, "other.obj", "gone.obj", "-o", "out", "--workers", 2)
    assert sorted(os.listdir("out")) == ["other.obj", "small.obj"], done.stderr
    assert done.exit_code == 1
    assert done.stderr.splitlines() == [
        "gso: error: gone.obj: there is no such file; check the name and the folder"
    ]


def test_many_files_to_another_format(run, small):
    gso.save(bump(11), "other.ply")
    done = run(
        *("optimize", small, "other.ply", "-o", "out", "--suffix", "svg", "--task", "flatten"),
        *("--workers", 0, "-q"),
    )
    assert (done.exit_code, done.stdout) == (0, "")
    assert sorted(os.listdir("out")) == ["other.svg", "small.svg"]


@pytest.fixture
def net(tmp_path):
    """File of a net that moves nothing."""
    pytest.importorskip("torch")
    from gso.net import CoarseNet, save

    path = tmp_path / "still.safetensors"
    save(CoarseNet(widths=(8, 8, 8), depths=(1, 1, 1), passes=1), path)
    return path


def test_a_net_alone(run, small, net):
    done = run("optimize", small, "-o", "out.npz", "--method", "net", "--net", net)
    # It moves nothing, and the surface is as curved as before.
    assert done.exit_code == 1
    assert "not usable: nothing was done" in done.stdout
    result = gso.Result.load("out.npz")
    assert (result.warm_start, result.iterations) == ("net", 0)
    assert np.allclose(result.mesh.vertices, gso.load(small).vertices)
    assert f"net {net}" in done.stdout


def test_a_net_starts_many_files(run, small, net):
    gso.save(bump(12), "other.obj")
    done = run(
        "optimize", small, "other.obj", "-o", "out", "--method", "hybrid", "--net", net,
        "--workers", 0, "--suffix", ".npz",
    )  # fmt: skip
    assert done.exit_code == 0
    for name in ("small", "other"):
        assert gso.Result.load(f"out/{name}.npz").details["net"] == str(net)


def test_the_optimiser_alone(run, small, never):
    for out in ("out.obj", "out/"):
        done = run("optimize", small, "-o", out, "--method", "tno", "--workers", 0)
        assert done.exit_code == 0


def test_without_a_net_the_optimiser_says_so(run, small, monkeypatch, tmp_path):
    monkeypatch.setattr("gso.net.catalogue.FOLDER", tmp_path)
    done = run("optimize", small, "-o", "out.obj", "--method", "hybrid")
    assert done.exit_code == 0
    assert "note: solved without a net: no net" in done.stdout


def test_a_net_that_nobody_asks(run, small, never):
    refused(run("optimize", small, "-o", "out.obj", "--net", "best"), "--net", "--method")


def test_a_net_that_does_not_exist(run, small):
    done = run("optimize", small, "-o", "out.obj", "--method", "net", "--net", "best")
    refused(done, "no net 'best'")


def test_one_file_into_a_folder(run, small):
    assert run("optimize", small, "-o", "out/", "--workers", 0).exit_code == 0
    assert os.listdir("out") == ["small.obj"]


def test_outputs_that_clash_are_refused(run, small, never, tmp_path):
    (tmp_path / "copy").mkdir()
    (tmp_path / "copy" / "small.obj").write_bytes(small.read_bytes())
    done = run("optimize", "small.obj", "copy/small.obj", "-o", "out")
    assert refused(done, "small.obj and copy/small.obj")
    gso.save(bump(), "other.obj")
    done = run("optimize", "small.obj", "other.obj", "-o", ".")
    assert refused(done, "would replace an input")
    gso.save(bump(11), "small.ply")
    done = run("optimize", small, "small.ply", "-o", "out", "--plot", "pictures")
    assert refused(done, "would both be written to", "small.png")
    Path("file").write_text("")
    assert refused(run("optimize", "small.obj", "other.obj", "-o", "file"), "folder")


def test_a_result_that_cannot_be_written_is_reported(run, small, monkeypatch):
    gso.save(bump(11), "other.obj")
    save = gso.Result.save

    def fail(self, path, **keywords):
        if "small" in str(path):
            raise gso.MeshError(f"{path}: the disk is full")
        save(self, path, **keywords)

    monkeypatch.setattr(gso.Result, "save", fail)
    done = run("optimize", small, "other.obj", "-o", "out", "--workers", 0)
    assert done.exit_code == 1
    assert "the disk is full" in done.stderr
    assert os.listdir("out") == ["other.obj"]


def test_progress_is_shown_to_a_person(run, small, monkeypatch):
    monkeypatch.setattr("gso.cli.progress.watched", lambda: True)
    monkeypatch.setattr("gso.cli.progress.PATIENCE", 0.0)
    assert "stage 1/" in run("optimize", small, "-o", "out.obj").stderr
    assert "file" in run("optimize", small, "-o", "out/", "--workers", 0).stderr


def test_short_runs_show_no_progress(run, small, monkeypatch):
    monkeypatch.setattr("gso.cli.progress.watched", lambda: True)
    monkeypatch.setattr("gso.cli.progress.PATIENCE", 1e9)
    assert run("optimize", small, "-o", "out.obj").stderr == ""


def test_metrics_are_those_of_the_result(run, small):
    run("optimize", small, "-o", "out.npz", "--metrics", "out.json")
    done = run("metrics", small, "out.npz", "--json")
    values = json.loads(done.stdout)["metrics"]
    for name, value in json.loads(Path("out.json").read_text())["metrics"].items():
        assert np.isclose(values[name], value, atol=1e-12), name
    assert "theta" in values
    table = run("metrics", small, "out.npz").stdout
    assert len(table.splitlines()) == len(values)


def test_metrics_of_a_flat_pattern(run, small):
    run("optimize", small, "-o", "out.ply", "--task", "flatten", "--metrics", "out.json")
    done = run("metrics", small, "out.ply", "--json")
    record = json.loads(done.stdout)
    for name, value in json.loads(Path("out.json").read_text())["metrics"].items():
        assert np.isclose(record["metrics"][name], value, atol=1e-12), name
    assert "flat pattern" in record["notes"][0]


def test_metrics_of_another_flat_mesh(run, small):
    y, x = np.mgrid[:4.0, :4.0]
    gso.save(np.stack([x, y, 0 * x], axis=-1), "plane.obj")
    done = run("metrics", small, "plane.obj", "--json")
    record = json.loads(done.stdout)
    assert "strain_max" not in record["metrics"]
    assert "faces" in record["notes"][0]


def test_info(run, small):
    gso.save(([[0, 0, 0], [1, 0, 0], [0, 2, 0], [5, 5, 5]], [[0, 1, 2]]), "tri.obj")
    done = run("info", small, "tri.obj", "gone.obj")
    assert done.exit_code == 1
    assert "gone.obj: there is no such file" in done.stderr
    first, second = done.stdout.split("\n\n")
    facts = dict(line.strip().split("  ", 1) for line in first.splitlines()[1:] if "  " in line)
    facts = {k: v.strip() for k, v in facts.items()}
    assert facts["kind"] == "grid 9 x 9"
    assert facts["vertices"] == "81"
    assert facts["faces"] == "64"
    assert facts["boundary loops"] == "1 (32 vertices)"
    assert facts["bounding box"] == "1 x 1 x 0.1"
    assert facts["loss_gc"].startswith(f"{gso.metrics.loss_gc(bump()):.4g}")
    assert "no interior vertex" in second
    assert "bounding box          1 x 2 x 0" in second
    assert "1 vertices belong to no face" in second


def test_info_has_the_unit_that_is_given(run, small):
    text = run("info", small, "--unit", "cm").stdout
    known = dict(line.strip().split("  ", 1) for line in text.splitlines()[1:])
    for name in ("bounding box", "from, to", "diagonal", "edge length"):
        assert known[name].endswith(" cm")
    assert " cm (farthest vertex" in known["size"]
    assert known["bounding box"].strip() == "1 x 1 x 0.1 cm"
    assert " cm" not in run("info", small).stdout and " mm" not in run("info", small).stdout
    (record,) = json.loads(run("info", small, "--unit", "cm", "--json").stdout)
    assert record["unit"] == "cm" and record["bounding box"] == "1 x 1 x 0.1 cm"
    (record,) = json.loads(run("info", small, "--json").stdout)
    assert record["unit"] is None and record["bounding box"] == "1 x 1 x 0.1"
    for command in ("info", "unfold", "pieces", "strips", "optimize"):
        out = () if command == "info" else ("-o", "a.svg")
        done = run(command, "a.step", *out, "--unit", "m")
        assert refused(done, "a.step", "leave out the unit")


@pytest.mark.parametrize(
    ("mesh", "kind"),
    [
        (([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]], [[0, 1, 2, 3], [1, 4, 2, -1]]),
         "quads and triangles"),
        (([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), "triangles"),
    ],
)  # fmt: skip
def test_info_kind(run, mesh, kind):
    gso.save(mesh, "mesh.obj")
    assert kind in run("info", "mesh.obj").stdout


@pytest.mark.parametrize("colour", [None, "curvature", "distance", "none"])
def test_plot(run, small, colour):
    gso.save(bump(height=0.2), "after.obj")
    chosen = [] if colour is None else ["--color", colour]
    assert run("plot", "after.obj", "-o", "a.png", "--before", small, *chosen).exit_code == 0
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")


def test_plot_of_results(run, small):
    for task in ("developable", "flatten"):
        run("optimize", small, "-o", f"{task}.npz", "--task", task)
        assert run("plot", f"{task}.npz", "-o", f"{task}.png").exit_code == 0
        assert os.path.getsize(f"{task}.png") > 1000
    done = run("plot", "flatten.npz", "-o", "s.png", "--before", small, "--color", "strain")
    assert done.exit_code == 0
    gso.save(bump(), "mesh.npz")
    assert run("plot", "mesh.npz", "-o", "mesh.png").exit_code == 0


def test_plot_mistakes(run, small):
    assert refused(run("plot", small, "-o", "a.png", "--color", "distance"), "before")
    assert refused(run("plot", small, "-o", "a.jpg"), ".jpg")
    assert refused(run("plot", "gone.obj", "-o", "a.png"), "gone.obj")


def test_version_and_help(run, monkeypatch):
    monkeypatch.setattr("importlib.metadata.version", lambda name: "1.2.3")
    monkeypatch.delitem(gso.__dict__, "__version__", raising=False)
    assert run("--version").stdout == "gso 1.2.3\n"
    for command in ("optimize", "metrics", "info", "plot"):
        assert command in run("--help").stdout
        assert run(command, "--help").exit_code == 0


def test_without_a_command_it_says_what_to_type(run):
    done = run()
    assert done.exit_code == 0
    for words in (row[1].split() for row in TABLE):
        assert words[:2] == ["gso", words[1]] and words[1] in main.commands
        assert " ".join(words) in done.stdout


def every_command(group, name):
    for word, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from every_command(command, f"{name} {word}")
        else:
            yield f"{name} {word}", command


@pytest.mark.parametrize(("name", "command"), list(every_command(main, "gso")))
def test_help_begins_with_an_example_that_is_right(run, name, command):
    shown = run(*name.split()[1:], "--help").stdout
    assert shown.startswith(f"Example:\n  {name} ")
    lines = [command.example.splitlines()[0], *(row[1] for row in TABLE)]
    for line in (line for line in lines if line.startswith(f"{name} ")):
        words = shlex.split(line.partition(" >>")[0])[len(name.split()) :]
        command.make_context(name, words)  # all options are known, and their values good


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion(run, shell, monkeypatch):
    assert "_GSO_COMPLETE" in run("completion", shell).stdout
    kind = get_completion_class(shell)(main, {}, "gso", "_GSO_COMPLETE")
    found = [one.value for one in kind.get_completions(["optimize"], "--max-d")]
    assert found == ["--max-deviation"]


def piped(*words, given):
    """Run the command line with something on standard input."""
    done = CliRunner().invoke(main, [str(w) for w in words], input=given, prog_name="gso")
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exc_info
    return done


def test_standard_input_and_output(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    given = PANEL.read_bytes()
    done = piped("optimize", "-", "-o", "-", given=given)
    assert done.exit_code == 0 and "largest strain" in done.stderr
    Path("out.obj").write_text(done.stdout)
    plain = piped("optimize", PANEL, "-o", "plain.obj", given=b"")
    assert plain.exit_code == 0
    assert Path("out.obj").read_bytes() == Path("plain.obj").read_bytes()
    assert len(list(tmp_path.iterdir())) == 2
    off = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    assert "triangles" in piped("info", "-", given=off).stdout
    assert refused(piped("info", "-", given=b""), "standard input is empty")
    assert refused(piped("optimize", "-", "-o", "-", "--json", given=given), "--json")


def test_json_instead_of_text(run, small):
    found = json.loads(run("optimize", small, "-o", "out.obj", "--json").stdout)
    assert found["output"] == "out.obj" and found["usable"] and found["metrics"]["d_H"] > 0
    gso.save(bump(11), "other.obj")
    given = ("optimize", small, "other.obj", "-o", "many", "--workers", 0, "--json")
    many = json.loads(run(*given).stdout)
    assert [one["input"] for one in many] == [str(small), "other.obj"]
    (facts,) = json.loads(run("info", small, "--json").stdout)
    assert facts["file"] == str(small) and "grid" in facts["kind"]
    strips = json.loads(run("strips", small, "-o", "strips.npz", "--json").stdout)
    assert strips["task"] == "developable"
    pieces = json.loads(run("pieces", small, "-o", "pieces", "--max-strain", "1%", "--json").stdout)
    assert len(pieces["pieces"]) >= 1
    house = PANEL.with_name("house.obj")
    net = json.loads(run("unfold", house, "-o", "net.svg", "--json").stdout)
    assert net["cut_length"] > 0 and sum(part["folds"] for part in net["parts"]) > 0


def test_choices_are_those_of_the_library():
    def choices(command, name):
        return set(next(o for o in main.commands[command].params if o.name == name).type.choices)

    assert choices("optimize", "unit") == {"um", "mm", "cm", "dm", "m", "in", "ft", "yd"}
    assert choices("plot", "colour") == set(gso.plot.COLOURS)
    of_tasks = [gso.DevelopableOptions, gso.IsometryOptions, gso.FlattenOptions]
    of_tasks += [gso.DenoiseOptions, gso.BendOptions, gso.ConformalOptions]
    assert choices("optimize", "preset") == {name for o in of_tasks for name in o.PRESETS}


@pytest.mark.parametrize("task", ["bend", "conformal", "denoise"])
def test_a_preset_that_the_task_lacks_is_refused(run, small, never, task):
    done = run("optimize", small, "-o", "out.npz", "--task", task, "--options", "jiang2020")
    assert refused(done, "jiang2020", "balanced")


def test_numbers_in_json(run, small, monkeypatch):
    values = {"a": np.float64("nan"), "b": np.int64(3), "c": np.float64(0.5), "d": -np.inf}
    monkeypatch.setattr(gso.Result, "metrics", values)
    run("optimize", small, "-o", "out.obj", "--metrics", "out.json")
    found = json.loads(Path("out.json").read_text())["metrics"]
    assert found == {"a": None, "b": 3, "c": 0.5, "d": None}
    assert isinstance(found["b"], int)


def with_modules(cache):
    """An environment in which compiled modules are kept in the folder `cache`."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPYCACHEPREFIX": str(cache)}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    return environment


def processor_time(command, cache):
    """Seconds that a command takes of the processor, with its compiled modules in `cache`."""
    resource = pytest.importorskip("resource")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, env=with_modules(cache))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


@pytest.fixture(scope="module")
def first_start(tmp_path_factory):
    """The folder of modules that the first command compiles, and the packages that it imports."""
    folder = tmp_path_factory.mktemp("first")
    code = (
        "import sys; from gso.cli import main\n"
        f"main(['optimize', {str(PANEL)!r}, '-o', {str(folder / 'o.obj')!r}, '-q'],"
        " standalone_mode=False)\n"
        "print(sorted({'matplotlib', 'trimesh', 'torch', 'tqdm'} & set(sys.modules)))"
    )
    command, cache = [sys.executable, "-c", code], folder / "modules"
    done = subprocess.run(
        command, capture_output=True, text=True, check=True, env=with_modules(cache)
    )
    return cache, done.stdout.strip()


def test_cold_start_is_quick(tmp_path, first_start):
    """Two seconds, or on a slow or busy machine four times what importing the libraries takes.

    An earlier run has compiled the modules, as after an installation. A neighbour on the machine
    only ever makes a run slower, so that the best of a few counts.
    """
    modules, _ = first_start
    start = [sys.executable, "-m", "gso", "optimize", PANEL, "-o", tmp_path / "out.obj", "-q"]
    libraries = [sys.executable, "-c", "import numpy, scipy.sparse.linalg, casadi"]
    for _ in range(5):
        spent = processor_time(start, modules)
        if spent < 2.0 or spent < 4.0 * processor_time(libraries, modules):
            return
    pytest.fail(f"the command took {spent:.2f} s of the processor")


def test_help_imports_next_to_nothing():
    code = (
        "import sys; from gso.cli import main\n"
        "heavy = {'numpy', 'scipy', 'casadi', 'igl', 'matplotlib', 'trimesh', 'torch', 'tqdm'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_optimising_imports_what_it_needs(first_start):
    _, imported = first_start
    assert imported == "[]"


@pytest.fixture
def heap(tmp_path):
    """A small surface whose faces share no vertices, in a file."""
    mesh = gso.as_mesh(bump(5))
    path = tmp_path / "heap.obj"
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)
    gso.save((corners, np.arange(len(corners)).reshape(-1, 4)), path)
    return path


def test_faces_that_share_no_vertices_are_welded(run, heap, small):
    done = run("optimize", heap, "-o", "out.obj", "--method", "tno")
    assert refused(done, "16 separate pieces", "--weld")
    done = run("optimize", heap, "-o", "out.obj", "--weld", "1e-6")
    assert done.exit_code == 0
    assert "note: weld=1e-06 merged 39 of 64 vertices with others" in done.stdout
    assert gso.load("out.obj").grid_shape == (5, 5)
    done = run("optimize", heap, small, "-o", "out", "--weld", 0, "--workers", 0)
    assert done.exit_code == 0
    assert "note 48 edges lie on others" in " ".join(run("info", heap).stdout.split())
    assert "grid 5 x 5" in run("info", heap, "--weld", 0).stdout
    assert run("metrics", heap, heap, "--weld", 0).exit_code == 0
    for bad in (-1, "nan"):
        assert refused(run("info", heap, "--weld", bad), "weld")


def test_heaps_among_many_are_reported(run, heap, small):
    done = run("optimize", heap, small, "-o", "out", "--workers", 0)
    assert done.exit_code == 1
    assert "--weld" in done.stderr
    assert os.listdir("out") == ["small.obj"]


def test_an_input_is_replaced_only_by_force(run, small):
    before = small.read_bytes()
    os.symlink(small, "soft.obj")
    os.link(small, "hard.obj")
    Path("c.json").write_text("[]")
    for arguments in (
        ("optimize", small, "-o", "small.obj"),
        ("optimize", small, "-o", "./../" + os.path.basename(os.getcwd()) + "/small.obj"),
        ("optimize", small, "-o", "soft.obj"),
        ("optimize", small, "-o", "hard.obj"),
        ("optimize", "soft.obj", "-o", "hard.obj"),
        ("optimize", small, "-o", "out.obj", "--metrics", "small.obj"),
        ("optimize", small, "-o", "out.obj", "--constraints", "c.json", "--metrics", "c.json"),
        ("optimize", small, "-o", "."),
    ):
        assert refused(run(*arguments), "would replace an input", "--force")
    assert small.read_bytes() == before
    assert run("optimize", small, "-o", "small.obj", "--force").exit_code == 0
    assert small.read_bytes() != before
    assert run("optimize", "soft.obj", "-o", ".", "--force", "--workers", 0).exit_code == 0


def test_pictures_do_not_replace_inputs(run, small):
    pytest.importorskip("matplotlib")
    os.symlink(small, "link.png")
    assert refused(run("plot", small, "-o", "link.png"), "would replace an input")
    assert refused(run("plot", PANEL, "-o", "link.png", "--before", small), "would replace")
    assert refused(
        run("optimize", small, "-o", "out.obj", "--plot", "link.png"), "would replace an input"
    )


def test_what_a_format_drops_is_a_note(run):
    Path("a.obj").write_text("".join(["g one\n", *_lines(bump(5))]))
    done = run("optimize", "a.obj", "-o", "out.ply", "--metrics", "m.json")
    assert "note: a .ply file holds no 1 groups (g): left out" in done.stdout
    assert any("groups" in note for note in json.loads(Path("m.json").read_text())["notes"])
    done = run("optimize", "a.obj", "-o", "out.obj")
    assert "left out" not in done.stdout
    assert "g one\n" in Path("out.obj").read_text()
    assert "1 groups (g)" in run("info", "out.obj").stdout


def _lines(grid):
    mesh = gso.as_mesh(grid)
    yield from ("v {} {} {}\n".format(*p) for p in mesh.vertices)
    yield from ("f {} {} {} {}\n".format(*f) for f in mesh.faces + 1)
