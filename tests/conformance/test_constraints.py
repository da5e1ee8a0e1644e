"""Every registered constraint: it holds after invariances, is determinate, and names bad input."""

from __future__ import annotations

import json
import warnings
from dataclasses import fields
from functools import cache

import numpy as np
import pytest

import gso
from gso.constraints import kinds, read_constraints
from tests.conftest import rotation


def mirrored() -> np.ndarray:
    """A surface that is its own image under x -> -x, (9, 9, 3)."""
    u, v = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9), indexing="ij")
    return np.stack([u, v, 0.4 * u * u * v + 0.2 * u * u], axis=-1)


DESIGN = gso.Mesh.from_grid(mirrored())
ENDS = np.array([0, 8, 72, 80])


def examples(mesh: gso.Mesh, turn: np.ndarray, shift: np.ndarray) -> dict[str, gso.Constraint]:
    """Return a constraint of every kind on a design that was turned and then shifted."""
    rim = mesh.boundary_loops[0]
    size, up = mesh.frame.scale, turn @ np.array([0.0, 0.0, 1.0])
    return {
        "Fixed": gso.Fixed(ENDS),
        "FixedBoundary": gso.FixedBoundary(),
        "FixedLengths": gso.FixedLengths(mesh.edges[::7]),
        "Glue": gso.Glue([rim[[0, 3]]]),
        "Handle": gso.Handle(ENDS[:1], mesh.vertices[ENDS[:1]] + 0.1 * size * up),
        "OnCurve": gso.OnCurve(rim, mesh.vertices[rim] + 0.05 * size * up, closed=True),
        "PlanarFaces": gso.PlanarFaces(np.arange(0, len(mesh.faces), 5)),
        "Ruling": gso.Ruling(np.arange(36, 45)),
        "SmoothCurves": gso.SmoothCurves([np.arange(36, 45)]),
        "SlidingBoundary": gso.SlidingBoundary(),
        "SymmetryPlane": gso.SymmetryPlane(shift, turn @ np.array([1.0, 0.0, 0.0])),
    }


NAMES = list(examples(DESIGN, np.eye(3), np.zeros(3)))


def solve(mesh, constraint, **more):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gso.ConvergenceWarning)
        return gso.tno.optimize(mesh, task="bend", constraints=[constraint], **more)


@cache
def solved(name: str) -> gso.Result:
    """The design with a constraint, solved once; no test may change the result."""
    return solve(DESIGN, examples(DESIGN, np.eye(3), np.zeros(3))[name])


def test_every_registered_kind_has_an_example():
    assert set(NAMES) == set(kinds())


@pytest.mark.parametrize("name", NAMES)
def test_unit_position_and_rotation_do_not_matter(name):
    turn, shift = rotation(5), np.array([30.0, -20.0, 10.0])
    here = solved(name)
    moved = DESIGN.replaced(1000.0 * (DESIGN.vertices @ turn.T + shift))
    there = solve(moved, examples(moved, turn, 1000.0 * shift)[name])
    back = (there.mesh.vertices / 1000.0 - shift) @ turn
    np.testing.assert_allclose(back, here.mesh.vertices, atol=1e-5 * DESIGN.diagonal)
    assert there.usable is here.usable


@pytest.mark.parametrize("name", NAMES)
def test_two_solves_are_equal_to_the_last_bit(name):
    again = solve(DESIGN, examples(DESIGN, np.eye(3), np.zeros(3))[name])
    np.testing.assert_array_equal(again.mesh.vertices, solved(name).mesh.vertices)


@pytest.mark.parametrize("name", NAMES)
def test_the_violation_is_reported_and_small(name):
    result = solved(name)
    found = result.details["constraints"]
    assert list(found) == [f"constraint 0 ({name})"]
    assert all(v <= 1e-6 * DESIGN.diagonal for v in found.values())


@pytest.mark.parametrize("name", NAMES)
def test_cancelled_solves_are_not_usable(name):
    constraint = examples(DESIGN, np.eye(3), np.zeros(3))[name]
    result = solve(DESIGN, constraint, callback=lambda progress: False)
    assert result.status is gso.Status.CANCELLED
    assert not result.usable
    assert np.isfinite(result.mesh.vertices).all()


@pytest.mark.parametrize("name", NAMES)
def test_files_give_the_same_constraint(name, tmp_path):
    constraint = examples(DESIGN, np.eye(3), np.zeros(3))[name]
    entry = {"type": name}
    for f in fields(constraint):
        value = getattr(constraint, f.name)
        entry[f.name] = value.tolist() if isinstance(value, np.ndarray) else value
    entry = json.loads(json.dumps(entry, default=lambda x: np.asarray(x).tolist()))
    (tmp_path / "constraints.json").write_text(json.dumps([entry]))
    (again,) = read_constraints(tmp_path / "constraints.json")
    assert type(again) is type(constraint)
    np.testing.assert_array_equal(solve(DESIGN, again).mesh.vertices, solved(name).mesh.vertices)


@pytest.mark.parametrize("name", NAMES)
def test_bad_input_is_named(name):
    constraint = examples(DESIGN, np.eye(3), np.zeros(3))[name]
    arrays = [f.name for f in fields(constraint) if np.ndim(getattr(constraint, f.name)) >= 1]
    for field in arrays:
        value = np.asarray(getattr(constraint, field))
        wrong = np.full(value.shape, 10_000) if value.dtype.kind == "i" else value * np.nan
        bad = type(constraint)(
            **{f.name: getattr(constraint, f.name) for f in fields(constraint)} | {field: wrong}
        )
        with pytest.raises(gso.OptionError, match=rf"{name}.*(10000|finite|number)"):
            solve(DESIGN, bad)
    with pytest.raises(gso.OptionError, match="wieght"):
        type(constraint)(wieght=1.0)
