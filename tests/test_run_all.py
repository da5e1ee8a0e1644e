"""The report of bench/run_all.py: complete, resumable, in one file, and the same as stored."""

from __future__ import annotations

import doctest
import importlib
import json
import math
import os
import re
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

import gso

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "bench"))

pytest.importorskip("jinja2")
pytest.importorskip("matplotlib")

from report import (  # noqa: E402
    build,
    energy,
    kernels,
    measure,
    pages,
    quality,
    store,
    surfaces,
    timing,
    tuning,
    verdict,
)
from report.method import TASKS, Method, Solved, tuned  # noqa: E402
from report.methods import methods, of  # noqa: E402
from report.peers_bilateral import bilateral  # noqa: E402
from report.peers_thinning import thinned  # noqa: E402
from report.published import NETS, TABLE_1, TABLE_2, TABLE_3  # noqa: E402
from report.sections import SECTIONS, Row, Section, rows  # noqa: E402
from report.settings import Settings  # noqa: E402
from report.store import Store  # noqa: E402

STORED = ROOT / "bench" / "data" / "quick.json"
TINY = Settings(
    "tiny",
    {"fast": 2, "slow": 1, "peer": 1},
    timed=1,
    numpy={"fast": 1, "slow": 1, "peer": 1},
    sizes=(16,),
    repeats=2,
    examples=(0.3,),
    workers=0,
    apart=False,
)


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    """Folder and figures of a run on two coarse surfaces."""
    out = tmp_path_factory.mktemp("report")
    some = surfaces.reference(out / "surfaces", 2, 20)
    return out, some, build.run(TINY, some, out, "test")


# ---------------------------------------------------------------- the report


def test_every_published_row_is_there(tiny):
    sections = tiny[2]["sections"]
    published = {name: {r["name"]: r for r in s["rows"]} for name, s in sections.items()}
    found = {
        name: {r["name"]: r["figures"] for r in section["rows"] if r["source"] == "paper"}
        for name, section in sections.items()
    }
    wanted = {"developable": TABLE_1, "flatten": TABLE_2}
    wanted |= {f"denoise-{level:.3f}": {"Net": row} for level, row in TABLE_3.items()}
    for section, table in wanted.items():
        assert set(found[section]) == set(table)
        for name, figures in table.items():
            own = {k: v for k, v in figures.items() if k != "seconds"}
            assert found[section][name] == own
            # The package's row beside it.
            assert any(r["source"] == "package" for r in published[section].values())


def test_every_row_has_figures_time_and_count_or_says_why_not(tiny):
    for name, section in tiny[2]["sections"].items():
        for row in section["rows"]:
            if row["source"] == "paper" or row["absent"]:
                continue
            figures = [row["figures"][column] for column in section["columns"]]
            assert np.isfinite(figures).all(), (name, row)
            assert row["count"] > 0 and row["seconds"]["median"] > 0, (name, row)
    assert {"fairness_ratio"} <= set(tiny[2]["sections"]["developable"]["columns"])
    assert {"strain_mean", "flipped_cells"} <= set(tiny[2]["sections"]["flatten"]["columns"])


def test_only_nets_and_peers_are_absent(tiny):
    for section in SECTIONS:
        for row in rows(section, {}):
            own = next((m for m in section.methods if m.name == row.name), None)
            if row.absent:
                assert own is not None and (own.net or own.peer or own.refused)


def test_the_page_needs_nothing_else(tiny):
    out, _, result = tiny
    page = (out / "report.html").read_text()
    assert not re.search(r"(?:src|href)=[\"'](?!data:|#)", page)
    assert not re.search(r"<(?:script|link|iframe)|url\(|@import", page)
    drawn = sorted((out / "figures").glob("*.png"))
    assert page.count("data:image/png;base64,") == len(drawn) > 8
    for section in result["sections"].values():
        assert section["title"] in page
    for number in "56789":
        assert f"Figure {number}" in page


def test_markdown_has_the_same_pictures_and_tables(tiny):
    out, _, result = tiny
    text = (out / "report.md").read_text()
    for path in re.findall(r"\]\((\S+)\)", text):
        assert (out / path).exists()
    for section in result["sections"].values():
        for row in section["rows"]:
            assert f"| {row['name']} |" in text


def test_json_says_on_what_it_was_measured(tiny):
    found = json.loads((tiny[0] / "results.json").read_text())
    assert found["machine"]["processor"] and found["machine"]["packages"]["numpy"]
    assert found["surfaces"]["count"] == 2
    assert {t["task"] for t in found["timing"]} == set(TASKS)
    for t in found["timing"]:
        assert t["absent"] or (t["seconds"] and t["peak_mb"] > 0)
        if t["limit"]:
            assert t["limit"] < np.median(t["seconds"])
            assert sum(t["shares"].values()) == pytest.approx(1.0)


# ---------------------------------------------------------------- both builds of the solver


@pytest.fixture
def both(monkeypatch):
    """Two builds, whether or not Numba is installed."""
    monkeypatch.delenv(kernels.VARIABLE, raising=False)
    monkeypatch.setattr(kernels, "numba", lambda: "0.1")


def test_methods_with_kernels_have_a_time_of_either_build(tiny):
    sections = tiny[2]["sections"]
    for name, section in sections.items():
        for row in section["rows"]:
            own = methods().get((name.split("-")[0].replace("energy", "developable"), row["name"]))
            if own is None or row["source"] == "paper" or row["absent"]:
                continue
            wanted = kernels.compiled() and own.kernels
            assert bool(row["seconds_numpy"]) == wanted, (name, row["name"])
            if wanted:
                assert row["seconds_numpy"].keys() == row["seconds"].keys()
                assert row["seconds_numpy"]["median"] > 0 and row["seconds_numpy"]["count"] == 1
    text = (tiny[0] / "report.md").read_text()
    assert text.count("time, NumPy |") == (3 if kernels.compiled() else 0)
    assert "TNO, NumPy" in text and kernels.described() in text


def test_size_is_timed_with_numpy_too(tiny):
    found = {t["task"]: t for t in tiny[2]["timing"] if t["method"] == "TNO, NumPy"}
    assert set(found) == set(TASKS) and "closed form" in found["denoise"]["absent"]
    for task in ("developable", "flatten"):
        assert bool(found[task]["seconds"]) == kernels.compiled()


def test_a_surface_is_solved_with_the_kernels_of_its_block(both, monkeypatch, tmp_path):
    used = []

    def run(case):
        used.append(os.environ.get(kernels.VARIABLE, ""))
        return Solved(case.surface[..., :2])

    slow = Method("slow", "flatten", run, pace="slow", kernels=True)
    net = Method("net", "flatten", run, pace="slow")
    known = {(m.task, m.name): m for m in (slow, net)}
    monkeypatch.setattr(quality, "methods", lambda: known)
    monkeypatch.setattr(quality, "of", lambda *name: known[name])
    monkeypatch.setattr(quality, "_warm", set())
    settings = Settings("both", {"slow": 3}, timed=3, numpy={"slow": 2}, workers=0)
    some = surfaces.reference(tmp_path, 3, 12)
    given = list(quality.blocks(settings, some))
    assert [(b.name, b.stop, b.numpy) for b in given] == [
        ("slow", 3, False),
        ("slow", 2, True),
        ("net", 3, False),
    ]
    assert given[0].key != given[1].key and given[0].place != given[1].place
    records = quality.measured(settings, some, Store(tmp_path), lambda *_: None)
    # The first solves, of a small case, are not timed.
    assert used == ["", "numba", "", "", "", *["numpy"] * 3, *[""] * 4]
    slowly, others = (records["flatten", 0.0, name] for name in ("slow", "net"))
    assert ["seconds_numpy" in r for r in slowly] == [True, True, False]
    assert not any("seconds_numpy" in r for r in others)


def test_one_build_is_not_timed_twice(both, monkeypatch, tmp_path):
    some = surfaces.reference(tmp_path, 1, 12)
    assert "Numba 0.1" in kernels.described()
    assert any(b.numpy for b in quality.blocks(TINY, some))
    monkeypatch.setenv(kernels.VARIABLE, kernels.NUMPY)
    assert not kernels.compiled() and kernels.VARIABLE in kernels.described()
    assert not any(b.numpy for b in quality.blocks(TINY, some))
    monkeypatch.delenv(kernels.VARIABLE)
    monkeypatch.setattr(kernels, "numba", lambda: "")
    assert "not installed" in kernels.described() and kernels.key() == kernels.key(kernels.NUMPY)
    assert not any(b.numpy for b in quality.blocks(TINY, some))
    assert "the same as TNO" in timing._absent("TNO, NumPy", of("flatten", "TNO strain"))


def test_times_with_numpy_have_a_column_where_there_are_any():
    spent = {"median": 0.25, "p10": 0.2, "p90": 0.3, "count": 4}
    row = Row("TNO", "package", 4, seconds=spent, seconds_numpy=spent | {"median": 0.5, "count": 2})
    other = Row("Net", "package", 4, seconds=spent)
    section = {"headings": [], "columns": [], "rows": [asdict(row), asdict(other)]}
    head, _, *cells = (line.split("|") for line in pages.quality_table(section).splitlines())
    assert [r[head.index(" time, NumPy ")].strip() for r in cells] == ["500 ms of 2", ""]
    assert "time, NumPy" not in pages.quality_table(section | {"rows": [asdict(other)]})


# ---------------------------------------------------------------- resuming


def test_a_finished_run_measures_nothing_again(tiny, monkeypatch):
    out, some, before = tiny

    def never(*_: object) -> None:
        raise AssertionError("measured again")

    for module, name in ((quality, "measure"), (timing, "_measured"), (build.examples, "_points")):
        monkeypatch.setattr(module, name, never)
    again = build.run(TINY, some, out, "test")
    assert again["sections"] == before["sections"] and again["timing"] == before["timing"]


def test_a_killed_run_goes_on_where_it_was(tmp_path, monkeypatch):
    some = surfaces.reference(tmp_path, 2, 12)
    known = {k: m for k, m in methods().items() if m.name in ("Init", "TNO strain", "libigl LSCM")}
    monkeypatch.setattr(quality, "methods", lambda: known)
    settings = Settings("killed", {"fast": 2}, timed=1, workers=0)
    kept, done = Store(tmp_path), []

    def killed(name, count):
        done.append(name)
        if len(done) == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        quality.measured(settings, some, kept, killed)
    seen, measure_one = [], quality.measure
    monkeypatch.setattr(quality, "measure", lambda block: seen.append(block) or measure_one(block))
    records = quality.measured(settings, some, kept, lambda *_: None)
    assert len(seen) == 2
    assert all(len(r) == 2 and "figures" in r[1] for r in records.values()) and len(records) == 3


@pytest.mark.parametrize("known", methods().values(), ids=lambda m: f"{m.task} {m.name}")
def test_pieces_follow_the_code_of_the_method_and_of_its_measures(known, monkeypatch):
    asked, source = [], store.source

    def noted(*paths):
        asked.extend(path.name for path in paths)
        return source(*paths)

    monkeypatch.setattr(store, "source", noted)
    if known.absent():
        pytest.skip(known.absent())
    known.key(quality.levels(known.task)[0])
    assert {"quality.py", "surfaces.py"} < set(asked)
    assert {"methods.py"} <= set(asked) or any(name.startswith("peers_") for name in asked)


def test_surfaces_with_other_noise_are_others(tmp_path):
    points, noise = np.zeros((1, 4, 4, 3)), np.ones((1, 4, 4, 3))
    one, other = (surfaces.written(tmp_path, "some", points, x) for x in (noise, 2 * noise))
    assert one.key != other.key and other.case(0, 0.5).given[0, 0, 0] == 1.0


def test_a_peer_that_improves_nothing_is_left_out(monkeypatch, tmp_path):
    some = surfaces.reference(tmp_path, 1, 12)
    idle = Method("idle", "developable", lambda case, k: Solved(case.given), candidates=({"k": 1},))
    assert tuning._best(idle, some, 1, 0.0) is None
    monkeypatch.setattr("report.method.tuned", lambda: {"developable": {"idle": {"": None}}})
    assert "better than its input" in idle.absent()
    monkeypatch.setattr("report.method.tuned", dict)
    assert "--tune" in idle.absent()


def test_pieces_follow_what_they_depend_on(tmp_path):
    block = quality.Block(
        "flatten", "TNO strain", 0.0, surfaces.reference(tmp_path, 1, 12), 0, 1, True
    )
    assert block.key["measures"] != of("flatten", "libigl ARAP").key(0.0)["measures"]
    kept = Store(tmp_path)
    kept.keep("a", {"version": 1}, [1.0])
    assert kept.find("a", {"version": 1}) == [1.0] and kept.find("a", {"version": 2}) is None


def test_a_method_that_fails_does_not_stop_the_others(tmp_path):
    def broken(case):
        raise ValueError("no")

    case = surfaces.reference(tmp_path, 1, 12).case(0)
    record = quality._record(Method("broken", "flatten", broken), case)
    assert record == {"error": "ValueError: no"}
    endless = Method("endless", "flatten", lambda c: Solved(np.full((12, 12, 2), np.nan)))
    assert "not finite" in quality._record(endless, case)["error"]


def test_surfaces_of_a_set_that_is_built(tmp_path):
    from gso import dataset

    pytest.importorskip("h5py")
    recipe = dataset.Recipe(n=10, size=16, labels=("strain",), extras=False)
    split = dataset.build(tmp_path / "set", recipe, workers=0)["test"]
    some = surfaces.opened(tmp_path, tmp_path / "set")
    assert len(some) == len(split) and some.name == f"test split of seed 0, {len(split)} surfaces"
    np.testing.assert_array_equal(some[0], split["surface"][0])
    np.testing.assert_allclose(some.case(0, 0.01).given, split["noisy_0.010"][0], atol=1e-9)


@pytest.mark.parametrize("name", ["store", "method", "timing", "pages", "spread"])
def test_examples_in_the_docstrings(name):
    module = importlib.import_module(f"report.{name}")
    tried = doctest.testmod(module)
    assert tried.attempted and not tried.failed


# ---------------------------------------------------------------- figures


def compared(task, sigma, name, some):
    """Figures of the first surfaces, and the stored ones."""
    stored = json.loads(STORED.read_text())["records"][f"{task}/{sigma:g}/{name}"]
    assert stored
    for k, figures in enumerate(stored):
        found = quality._record(of(task, name), some.case(k, sigma))
        yield found["figures"], figures


#: Share by which a figure may differ where a net makes the start: processors round its single
#: precision otherwise, and |K| has many minima. Cold solves of inputs that differ by
#: as little end as far apart: ``python bench/run_all.py --only hybrid.guard``.
MINIMA = {("hybrid", "loss_gc"): 0.5}


def check_stored(paces, some, share):
    """Every figure within a share of the stored one: other machines round otherwise."""
    for (task, name), method in methods().items():
        for sigma in quality.levels(task):
            if method.pace not in paces or method.absent():
                continue
            for found, figures in compared(task, sigma, name, some):
                for metric, value in figures.items():
                    wrong = abs(found[metric] - value)
                    most = max(share, MINIMA.get((name, metric), 0.0))
                    assert wrong <= most * abs(value) + 1e-5, (task, sigma, name, metric)


def test_quality_is_as_stored(tmp_path):
    check_stored(("fast",), surfaces.reference(tmp_path), 0.03)


@pytest.mark.slow
def test_quality_of_slow_methods_is_as_stored(tmp_path):
    check_stored(("slow", "peer"), surfaces.reference(tmp_path), 0.1)


def test_published_figures_are_those_of_the_tables():
    assert TABLE_1["TNO"] == {"loss_gc": 0.0283, "K_A_r": 0.8888, "d_H": 0.823, "seconds": 38.256}
    assert TABLE_3[0.01] == {"theta_noisy": 44.64, "theta": 2.505, "rate": 94.42}
    assert NETS["flatten-w"]["loss_iso_cell"] == 2.46e-4


def test_peers_have_tuned_parameters_for_every_level():
    found = tuned()
    for method in methods().values():
        if method.candidates:
            own = found[method.task][method.name]
            assert len(own) == len(quality.levels(method.task))
            known = [None, *map(dict, method.candidates)]
            assert all(p in known for p in own.values())


# ---------------------------------------------------------------- peers


def test_bilateral_filter_of_normals_keeps_planes_and_folds(tmp_path):
    """Zheng et al. 2011: noise goes, and a fold of 90 degrees stays sharp."""
    u, v = np.mgrid[:20.0, :21.0] / 20
    roof = np.stack([u, v, np.abs(v - 0.5)], axis=-1)
    settings = {"steepness": 0.4, "passes": 10, "updates": 20}
    calm = bilateral(quality.Case(roof, roof), **settings).points
    np.testing.assert_allclose(calm, roof, atol=1e-3)
    noise = np.random.default_rng(0).normal(scale=0.002, size=roof.shape)
    case = quality.Case(roof, roof + noise, 0.002)
    found = quality.figures("denoise", case, bilateral(case, **settings).points)
    assert found["theta"] < 0.35 * found["theta_noisy"]


def test_thinning_leaves_cylinders_and_unbends_saddles():
    """Binninger et al. 2021: the Gauss image of a cylinder is a curve already."""
    u, v = np.mgrid[-0.5:0.5:24j, -0.5:0.5:24j]
    cylinder = np.stack([np.sin(u), v, np.cos(u)], axis=-1)
    saddle = np.stack([u, v, 0.5 * u * v], axis=-1)
    settings = {"rings": 2, "iterations": 30, "closeness": 1e-4}
    for points, most in ((cylinder, 0.05), (saddle, 0.6)):
        case = quality.Case(points, points)
        figures = quality.figures("developable", case, thinned(case, **settings).points)
        if points is saddle:
            assert figures["loss_gc_worst"] < most * gso.metrics.loss_gc_worst(saddle)
        else:
            assert figures["d_H"] < most


def test_other_solvers_get_the_same_objective(surfaces):
    problem, x = energy.last_problem(surfaces[0][::2, ::2], "developable", "balanced")
    x = x + 1e-3 * np.random.default_rng(0).standard_normal(len(x))
    value, slope = energy.residuals(problem, x), energy.jacobian(problem, x)
    objective, gradient, _ = problem.linearise(x)
    assert 0.5 * value @ value == pytest.approx(objective, rel=1e-12)
    np.testing.assert_allclose(slope.T @ value, gradient, atol=1e-12 * np.abs(gradient).max())
    import casadi

    unknowns, expression = energy.expressions(problem)
    at = np.asarray(casadi.Function("f", [unknowns], [expression])(x)).ravel()
    assert at @ at == pytest.approx(value @ value, rel=1e-12)


def test_parameterisations_are_those_of_the_surface(surfaces):
    from gso.mesh import Mesh

    for name in ("libigl LSCM", "libigl ARAP", "libigl SLIM"):
        points = surfaces[0]
        case = quality.Case(points, points)
        flat = of("flatten", name)(case).points
        assert flat.shape == (*points.shape[:2], 2)
        figures = quality.figures("flatten", case, flat)
        assert figures["strain_mean"] < 0.3 and figures["flipped_cells"] == 0
        assert Mesh.from_grid(points).vertices.shape[0] == flat.shape[0] * flat.shape[1]


# ---------------------------------------------------------------- losses and times


def record(seconds=1.0, **figures):
    return {"figures": figures, "seconds": seconds, "iterations": None}


def made_up(monkeypatch, default, own, peer):
    """Losses of a section with three methods."""
    known = [
        Method("default", "flatten", lambda c: None),
        Method("own", "flatten", lambda c: None),
        Method("peer", "flatten", lambda c: None, peer=True),
    ]
    paper = {"TNO": {"strain_mean": 0.5, "seconds": 0.5}}
    section = Section("one", "One", "flatten", ("strain_mean",), paper, only=("default",))
    monkeypatch.setattr(Section, "methods", property(lambda self: known))
    monkeypatch.setattr(verdict, "SECTIONS", (section,))
    given = {"default": default, "own": own, "peer": peer}
    return verdict.losses({("flatten", 0.0, k): v for k, v in given.items()})


def test_losses_are_found_on_the_same_surfaces(monkeypatch):
    default = [record(strain_mean=0.2), record(strain_mean=9.0)]
    peer = [record(0.1, strain_mean=0.1)]
    found = made_up(monkeypatch, default, [record(strain_mean=0.05)], peer)
    by = {(loss.metric, w.name): (w, w in loss.lost) for loss in found for w in loss.winners}
    strain, lost = by["strain_mean", "peer"]
    assert (strain.ours, strain.theirs, strain.count) == (0.2, 0.1, 1)
    assert not lost and strain.best_name == "own"
    assert by["seconds", "peer"][1]
    paper, lost = by["strain_mean", "the paper's TNO"]
    assert not lost and paper.ours == pytest.approx(4.6)
    assert (paper.best_name, paper.best) == ("own", 0.05)
    found = made_up(monkeypatch, default, [record(strain_mean=0.7)], peer)
    assert "better than all of the package: the paper's TNO 0.5" in str(found[0])


def test_nothing_is_lost_to_what_is_worse_or_failed(monkeypatch):
    fine = [record(0.01, strain_mean=0.1)]
    assert not made_up(monkeypatch, fine, fine, [{"error": "no"}])
    assert not made_up(monkeypatch, fine, fine, fine)


def test_means_have_intervals_and_times_have_runs(monkeypatch):
    rng = np.random.default_rng(1)
    values = rng.normal(1.0, 0.2, 400)
    default = [record(strain_mean=x) | {"again": [2.0, 3.0]} for x in values]
    # Better by a little, but on every surface: the interval of the difference is narrow.
    own = [record(strain_mean=x - 0.01) for x in values]
    peer = [record(0.1, strain_mean=x - 0.3) for x in values]
    (loss, *_) = made_up(monkeypatch, default, own, peer)
    winner = next(w for w in loss.winners if w.name == "peer")
    for mean, (low, high) in ((0.7, winner.spread), (1.0, winner.our_spread)):
        # The standard error of the mean is 0.01.
        assert low < mean < high and high - low == pytest.approx(4 * 0.01, rel=0.2)
    assert f"[{winner.spread[0]:.3g}, {winner.spread[1]:.3g}]" in str(winner)
    (section,) = verdict.SECTIONS
    given = {"default": default, "own": own, "peer": peer}
    found = {r.name: r for r in rows(section, {("flatten", 0.0, k): v for k, v in given.items()})}
    assert found["default"].spread["seconds"] == (1.0, 3.0)
    assert "seconds" not in found["own"].spread
    low, high = found["own"].from_default["strain_mean"]
    assert low == pytest.approx(-0.01) and high == pytest.approx(-0.01)
    assert not found["default"].from_default and not found["peer"].from_default


def test_published_rows_stand_beside_the_rows_of_their_names():
    def row(name, source, **more):
        found = {"loss_gc": 0.5, "d_H": 1.0}
        return asdict(Row(name, source, figures=found, seconds={"median": 1.0})) | more

    given = [
        row("TNO", "paper"),
        row("Net-S", "paper"),
        row("TNO jiang2020", "package", spread={"loss_gc": (0.3, 0.6), "d_H": (1.1, 1.2)}),
        row("TNO balanced", "package"),
        row("hybrid", "package", from_default={"loss_gc": (-0.2, -0.1)}),
    ]
    given[2]["figures"] = {"loss_gc": 0.4, "d_H": 1.15}
    given[4]["figures"] = {"loss_gc": 0.35, "d_H": 1.0001}
    found = verdict.pairs({"developable": {"columns": ["loss_gc", "d_H"], "rows": given}})
    better = {(p["own"], p["metric"]): p["better"] for p in found}
    assert better == {
        ("TNO jiang2020", "loss_gc"): "",
        ("TNO jiang2020", "d_H"): "theirs",
        ("TNO jiang2020", "seconds"): "",
        ("hybrid", "loss_gc"): "ours",
        ("hybrid", "d_H"): "",
        ("hybrid", "seconds"): "",
    }
    assert {p["other"] for p in found if p["own"] == "hybrid"} == {"TNO balanced"}


@pytest.mark.parametrize("task", TASKS)
def test_shares_and_limit_of_a_solve(task):
    found = measure.main(task, "TNO", "", 16, 2, 5.0)
    assert len(found["seconds"]) == 2 and found["peak_mb"] > 10
    assert sum(found["shares"].values()) == pytest.approx(1.0)
    assert min(found["shares"].values()) >= 0
    if task == "denoise":
        assert found["limit"] is None
    else:
        assert 0 < found["limit"] < max(found["seconds"])
        assert found["factorisations"] >= found["iterations"] > 0


def test_a_size_is_timed_in_a_process_of_its_own():
    found = timing._measured("denoise", "TNO", "", 16, 2, apart=True)
    assert len(found["seconds"]) == 2 and min(found["seconds"]) > 0 and found["peak_mb"] > 10


# ---------------------------------------------------------------- docs


def test_tables_of_docs_come_from_the_figures(tiny, monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    tables = importlib.import_module("tables")
    result = {k: v for k, v in tiny[2].items() if k != "records"}
    found = tables.measured(result)
    names = {f"measured-{n}" for n in ("machine", "developable", "energy", "flatten", "denoise")}
    names |= {f"measured-{n}" for n in ("denoise-rate", "pairs", "losses", "size")}
    assert names == set(found)
    assert found["measured-denoise"].count("with noise") == 2
    assert '"*Net-S, published*",Net-S,``K_A_r``' in found["measured-pairs"]
    balanced = next(
        r for r in result["sections"]["developable"]["rows"] if r["name"] == "TNO balanced"
    )
    assert tables.number(balanced["figures"]["loss_gc"]) in found["measured-developable"]
    assert "*Net-CF, published*" in found["measured-developable"]
    assert not math.isnan(float(tables.number(0.02)))
    columns = 'Time,"Time, NumPy",Surfaces'
    assert (columns in found["measured-developable"]) == kernels.compiled()
    assert ("TNO, NumPy" in found["measured-size"]) == kernels.compiled()
    assert "kernels" in found["measured-machine"]
    path = tmp_path / "results.json"
    path.write_text(json.dumps(result))
    monkeypatch.setattr(tables, "RESULTS", path)
    pages = {page: page.read_text() for page in tables.PAGES}
    changed = {page.name for page, text in tables.replaced(pages).items() if text != pages[page]}
    assert changed == {"benchmarks.rst"}
    page = next(page for page in pages if page.stem == "benchmarks")
    text = pages[page].replace(".. begin measured-", ".. ")
    with pytest.raises(SystemExit, match="measured-"):
        tables.replaced({**pages, page: text})


def test_tables_of_docs_come_from_older_figures_too(tiny, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    tables = importlib.import_module("tables")
    result = json.loads(json.dumps({k: v for k, v in tiny[2].items() if k != "kernels"}))
    for section in result["sections"].values():
        for row in section["rows"]:
            del row["seconds_numpy"]
    found = tables.measured(result)
    assert "Time, NumPy" not in found["measured-developable"]
    assert "kernels" not in found["measured-machine"]


def test_designs_are_cut_again_with_other_numbers():
    from sections.pieces import variants

    mesh = gso.as_mesh(([[0, 0, 0], [3, 0, 0], [3, 2, 0], [0, 1, 1]], [[0, 1, 2], [0, 2, 3]]))
    given, moved, other = variants(mesh, 3)
    assert given is mesh
    away = np.abs(moved.vertices - mesh.vertices).max()
    assert 0.0 < away <= 1e-9 * mesh.diagonal
    assert not np.array_equal(other.vertices, mesh.vertices)
    corners = [sorted(np.sort(m.vertices[m.faces].sum(axis=2)).tolist()) for m in (mesh, other)]
    np.testing.assert_allclose(*corners)


def test_sections_are_listed_and_take_settings(monkeypatch, capsys):
    with patch.dict(os.environ):
        run_all = importlib.import_module("run_all")

    def ran(*words):
        monkeypatch.setattr(sys, "argv", ["run_all.py", "--only", *words])
        run_all.main()

    ran("list")
    listed = capsys.readouterr().out
    for name in ("tno.developable", "jiang.bend", "hybrid.speed", "net.rows", "dataset.statistics"):
        assert name in listed
    for words, said in (
        (("nonsense",), "no section nonsense"),
        (("borders", "nonsense=1"), "no setting nonsense"),
        (("net.rows",), "needs data="),
    ):
        with pytest.raises(SystemExit):
            ran(*words)
        assert said in capsys.readouterr().err


def test_a_section_runs_as_a_script_and_writes_its_figures(tmp_path):
    command = [sys.executable, ROOT / "bench" / "run_all.py", "--only", "session.drags"]
    command += ["n=8", "count=1", "--json", "figures.json"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "8 x 8, medians of 1 surfaces" in done.stdout
    figures = json.loads((tmp_path / "figures.json").read_text())
    assert {"machine", "session.drags"} == set(figures)
