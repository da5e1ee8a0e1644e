"""What a prompt shows of results and their parts."""

from __future__ import annotations

import base64
import html
import re
from dataclasses import fields, is_dataclass

import numpy as np
import pytest

import gso
from tests.conftest import saddle

#: Largest number of lines, and of characters of one.
LINES, WIDTH = 5, 100
T = np.linspace(0, 1, 40)
PANEL = gso.Mesh.from_grid(saddle(24))

MADE = {
    "mesh": lambda: PANEL,
    "developable": lambda: gso.tno.optimize(saddle(24, strength=0.2)),
    "flatten": lambda: gso.tno.optimize(PANEL, task="flatten"),
    "strips": lambda: gso.strips(PANEL, max_deviation="4%"),
    "loft": lambda: gso.loft(np.c_[T, 0 * T, np.sin(T)], np.c_[T, 1 + 0 * T, np.cos(T)]),
    "pieces": lambda: gso.pieces(PANEL, max_strain="2%"),
    "unfold": lambda: gso.unfold(gso.load("examples/house.obj")),
    "handle": lambda: gso.Handle(np.arange(500), np.zeros((500, 3))),
    "fixed": lambda: gso.Fixed(np.arange(500)),
    "spline": lambda: gso.fit_spline(PANEL, 12),
}


def parts(name, found, depth=3):
    """Objects of the package that an object has, with their names."""
    if not type(found).__module__.startswith("gso"):
        return
    yield name, found
    if depth:
        own = [f.name for f in fields(found)] if is_dataclass(found) else list(vars(found))
        for key in own:
            value = getattr(found, key, None)
            values = [value] if not isinstance(value, tuple | list) else value[:1]
            for one in values:
                yield from parts(f"{name}.{key}", one, depth - 1)


@pytest.mark.parametrize("name", MADE)
def test_representations_are_short(name):
    for where, found in parts(name, MADE[name]()):
        shown = repr(found)
        assert shown.count("\n") < LINES, where
        assert len(shown) <= LINES * (WIDTH + 1), where


@pytest.mark.parametrize("name", ["mesh", "flatten", "loft", "pieces", "unfold"])
def test_notebooks_show_a_picture(name, monkeypatch):
    pytest.importorskip("matplotlib")
    found = MADE[name]()
    shown = found._repr_html_()
    head, _, rest = shown.partition("</pre>")
    assert html.escape(repr(found)) in head
    data = base64.b64decode(re.search(r"base64,([^\"]+)", rest)[1])
    assert data.startswith(b"\x89PNG") and len(data) < 1_000_000
    monkeypatch.setattr("gso.plot.available", lambda: False)
    assert "<img" not in found._repr_html_()


def test_values_are_shown_by_their_kind():
    found = repr(gso.Pattern(np.zeros((9, 2)), np.zeros((4, 4), int), np.arange(9)))
    assert found == (
        "Pattern(flat=float64 (9, 2), faces=int64 (4, 4), vertex=int64 (9,), seams=int64 (0, 2, 2))"
    )


def test_solves_and_searches_are_logged(caplog):
    caplog.set_level("INFO", "gso")
    gso.tno.optimize(saddle(16, strength=0.1))
    assert any("developable by 'curvature': " in line for line in caplog.messages)
    caplog.clear()
    gso.pieces(PANEL, max_deviation="5%", effort="draft", workers=0)
    assert any("seams" in line for line in caplog.messages)
