"""Nesting of parts on sheets."""

from __future__ import annotations

import importlib
import os
import time

import numpy as np
import pytest
import shapely

from gso import OptionError
from gso.workshop import Part, nest

sparrow = importlib.import_module("gso.workshop.sparrow")


def gore(long=600.0, wide=120.0, n=40):
    t = np.linspace(0, 1, n)
    low = np.c_[long * t, -0.5 * wide * np.sin(np.pi * t)]
    return np.r_[low, (low * [1, -1])[::-1][1:-1]]


def triangles(count, seed=0):
    rng = np.random.default_rng(seed)
    corners = [
        [[0, 0], [rng.uniform(80, 250), 30], [60, rng.uniform(80, 250)]] for _ in range(count)
    ]
    return [Part(f"t{k}", np.array(points, float)) for k, points in enumerate(corners)]


def crescent(size=100.0, n=24):
    t = np.linspace(-1, 1, n)
    outer = np.c_[size * t, size * (1 - t * t)]
    return np.r_[outer[::-1] * [1, 0.6] + [0, 0], outer[1:-1] * [1, 0.2]][::-1]


def checked(nested, parts, sheet, spacing):
    """Check that all copies are there, inside the sheets and apart; they are not mirrored."""
    placed = [part for drawing in nested.sheets for part in drawing.parts]
    for part in parts:
        own = [p for p in placed if p.name == part.name]
        assert len(own) == part.count
        for p in own:
            assert p.area == pytest.approx(part.area)
    for drawing in nested.sheets:
        assert drawing.sheet == sheet
        shapes = [shapely.Polygon(p.outline) for p in drawing.parts]
        for p in drawing.parts:
            assert (p.low >= -1e-6).all()
            assert (p.low + p.size <= np.array(sheet) + 1e-6).all()
        for k, shape in enumerate(shapes):
            for other in shapes[k + 1 :]:
                assert shape.distance(other) >= spacing - 1e-6
                assert shape.intersection(other).area <= 1e-6


def rectangle(name, wide, high, count=1):
    return Part(name, np.array([[0.0, 0], [wide, 0], [wide, high], [0, high]]), count=count)


class TestRectangles:
    @pytest.mark.parametrize("seed", range(3))
    def test_they_do_not_overlap(self, seed):
        sizes = np.random.default_rng(seed).uniform(10, 90, (60, 2))
        parts = [rectangle(f"r{k}", *size) for k, size in enumerate(sizes)]
        nested = nest(parts, (300.0, 200.0), rotations=4, spacing=0.5, method="rectangles")
        checked(nested, parts, (300.0, 200.0), 0.5)

    def test_squares_fill_a_sheet(self):
        nested = nest([rectangle("s", 5, 5, 12)], (20.0, 15.0), spacing=0, method="rectangles")
        assert [len(sheet.parts) for sheet in nested.sheets] == [12]


class TestNest:
    @pytest.mark.parametrize("rotations", [(0, 180), 4, "any"])
    def test_parts_are_apart_and_inside(self, rotations):
        parts = [*triangles(8), Part("c", crescent(), count=3)]
        for method in ("rectangles", "spyrrow"):
            nested = nest(
                parts, (500.0, 400.0), spacing=4.0, rotations=rotations, seconds=2, method=method
            )
            checked(nested, parts, (500.0, 400.0), 4.0)

    def test_a_margin_is_kept(self):
        parts = [Part("s", np.array([[0.0, 0], [80, 0], [80, 80], [0, 80]]), count=4)]
        nested = nest(parts, (200.0, 200.0), spacing=5, margin=10, method="rectangles")
        assert len(nested.sheets) == 1
        assert min(p.low.min() for p in nested.sheets[0].parts) >= 10 - 1e-9

    def test_grain_runs_along_the_sheet(self):
        part = Part("g", gore(300, 80), grain=np.array([0.0, 1.0]), count=2)
        nested = nest([part], (400.0, 400.0), rotations="any", method="rectangles")
        for drawing in nested.sheets:
            for placed in drawing.parts:
                assert abs(placed.grain[0]) == pytest.approx(1.0)

    def test_it_is_never_below_the_best_packing_of_rectangles(self):
        parts = [Part("g", gore(), count=10)]
        both = [nest(parts, (1300.0, 600.0), seconds=2, method=m) for m in ("rectangles", None)]
        assert both[1].density >= both[0].density - 1e-9
        checked(both[1], parts, (1300.0, 600.0), 2.0)

    @pytest.mark.slow
    def test_gores_and_triangles_are_five_points_above_rectangles(self):
        for parts, rotations in (([Part("g", gore(), count=24)], (0, 180)), (triangles(30), 4)):
            low, high = (
                nest(parts, (1500.0, 1000.0), rotations=rotations, seconds=10, method=method)
                for method in ("rectangles", None)
            )
            assert high.density >= low.density + 0.05

    def test_rectangles_give_the_same_again(self):
        one, two = (
            nest(triangles(5), (400.0, 300.0), method="rectangles", seed=seed) for seed in (0, 3)
        )
        for a, b in zip(one.sheets, two.sheets, strict=True):
            for p, q in zip(a.parts, b.parts, strict=True):
                np.testing.assert_array_equal(p.outline, q.outline)


def dies(*given):
    """In place of the packing: the process ends."""
    os._exit(6)


def sleeps(*given):
    """In place of the packing: it does not end."""
    time.sleep(600)


def refuses(*given):
    """In place of the packing: it fails."""
    raise ValueError("no such shape")


class TestFallback:
    def test_without_spyrrow_rectangles_are_packed(self, monkeypatch):
        monkeypatch.setattr("gso.workshop.sparrow.find_spec", lambda name: None)
        nested = nest(triangles(4), (500.0, 400.0))
        assert nested.method == "rectangles"
        assert "pip install" in nested.notes[0]

    def test_its_death_ends_nothing(self, monkeypatch):
        monkeypatch.setattr(sparrow, "packed", dies)
        nested = nest(triangles(4), (500.0, 400.0))
        assert nested.method == "rectangles"
        assert "ended its process" in nested.notes[0]

    def test_it_is_not_waited_for_for_ever(self, monkeypatch):
        monkeypatch.setattr(sparrow, "packed", sleeps)
        monkeypatch.setattr(sparrow, "_START", -1.5)
        assert sparrow.solved([], 1.0, 1.0, 0) == (None, "spyrrow took too long")

    def test_an_error_is_no_answer(self, monkeypatch):
        monkeypatch.setattr(sparrow, "packed", refuses)
        nested = nest(triangles(4), (500.0, 400.0))
        assert nested.method == "rectangles"
        assert "no such shape" in nested.notes[0]

    def test_results_that_overlap_are_not_taken(self, monkeypatch):
        def same(items, *rest):
            every = [k for k, item in enumerate(items) for _ in range(item["count"])]
            return [{"item": k, "angle": 0.0, "x": 0.0, "y": 0.0} for k in every], ""

        monkeypatch.setattr("gso.workshop.sparrow.solved", same)
        nested = nest(triangles(4), (500.0, 400.0))
        assert nested.method == "rectangles"
        assert "distances" in nested.notes[0]


class TestErrors:
    def test_a_part_larger_than_the_sheet_is_named(self):
        with pytest.raises(OptionError, match="part g is 600 by 119"):
            nest([Part("g", gore())], (500.0, 500.0))

    @pytest.mark.parametrize(
        "bad",
        [
            {"spacing": -1.0},
            {"margin": 300.0},
            {"seconds": 0.0},
            {"method": "x"},
            {"rotations": 0},
            {"rotations": "some"},
            {"rotations": [np.nan]},
        ],
    )
    def test_wrong_options_are_named(self, bad):
        with pytest.raises(OptionError, match=next(iter(bad))):
            nest(triangles(2), (500.0, 400.0), **bad)

    def test_wrong_parts_and_sheets_are_named(self):
        with pytest.raises(OptionError, match="no parts"):
            nest([], (500.0, 400.0))
        for sheet in ((0, 5), (5,), "x", None):
            with pytest.raises(OptionError, match="sheet is"):
                nest(triangles(1), sheet)
        bow = Part("bow", np.array([[0.0, 0], [10, 10], [10, 0], [0, 10]]))
        with pytest.raises(OptionError, match="part bow"):
            nest([bow], (500.0, 400.0))


@pytest.mark.slow
def test_parts_with_other_borders_fit_on_one_sheet():
    pytest.importorskip("spyrrow")
    # Long parts are simplified more, and so have wider borders than short ones.
    rng = np.random.default_rng(0)
    parts = []
    for k in range(30):
        turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
        size = rng.uniform(5, 60, 2)
        parts.append(Part(f"p{k}", size * np.stack([np.cos(turn), np.sin(turn)], axis=1)))
    nested = nest(parts, (1000.0, 200.0), seconds=4, method="spyrrow")
    assert len(nested.sheets) == 1
    assert nested.density > 0.6
