"""Terms of the user's own in the objectives of tasks."""

from __future__ import annotations

import numpy as np
import pytest

import gso
from gso import OptionError
from gso.energy import Term, Weighted, mean_weights
from tests.conftest import cylinder, saddle


def height(points, constants):
    """How far a vertex is from the plane z = 0."""
    ((_, _, z),) = points
    return (z,)


def shear(points, constants):
    """The product of a vertex's coordinates, zero on the axes."""
    ((x, y),) = points
    return (x * y,)


class Own:
    """Builds a term with one element for each vertex; remembers the meshes."""

    def __init__(self, residual=height, block="surface", weight=1.0, name="own"):
        self.residual, self.block, self.weight, self.name = residual, block, weight, name
        self.meshes = []

    def __call__(self, mesh):
        self.meshes.append(mesh)
        ids = np.arange(len(mesh.vertices))[:, None]
        term = Term(self.name, self.residual, ((self.block, ids),), mean_weights(len(ids)))
        return [Weighted(term, self.weight)]


def by_height(mesh):
    return Own()(mesh)


def triangles(points):
    return gso.Mesh(points.reshape(-1, 3), gso.Mesh.from_grid(points).triangles)


@pytest.mark.parametrize("make", [gso.Mesh.from_grid, triangles])
def test_a_term_joins_the_objective(make):
    design = make(saddle(33))
    # Without a verdict there is no second solve nearer to the design.
    plain, result = (
        gso.tno.optimize(design, formulation="curvature", terms=terms, verdict=False)
        for terms in ((), [Own()])
    )
    assert "own" not in plain.energy and result.energy["own"] > 0
    assert set(result.energy) == {*plain.energy, "own"}
    flatter = [np.ptp(r.mesh.vertices[:, 2]) for r in (plain, result)]
    assert flatter[1] < 0.5 * flatter[0]
    assert result.metrics.keys() == plain.metrics.keys()


def test_a_term_is_built_for_every_level():
    own = Own(weight=1e-3)
    result = gso.tno.optimize(saddle(65), terms=[own])
    assert "strain_max" in result.metrics
    sides = {mesh.grid_shape[0] for mesh in own.meshes}
    assert len(sides) > 1 and max(sides) == 65
    for mesh in own.meshes:
        assert np.linalg.norm(mesh.vertices, axis=1).max() == pytest.approx(1.0, abs=0.05)
    # The energy is that of the term at the result, in the unit ball.
    frame = result.design.frame
    z = frame.to_unit(result.mesh.vertices)[:, 2]
    assert result.energy["own"] == pytest.approx(1e-3 * 0.5 * np.mean(z**2), rel=1e-6)


def test_a_term_without_weight_changes_nothing():
    plain, result = (
        gso.tno.optimize(saddle(33), formulation="curvature", terms=terms)
        for terms in ((), [Own(weight=0.0)])
    )
    np.testing.assert_array_equal(result.mesh.vertices, plain.mesh.vertices)


@pytest.mark.parametrize("formulation", ["strain", "lengths", "isometry", "minimax"])
def test_a_term_of_a_flat_image(formulation):
    design = saddle(33)
    plain = gso.tno.optimize(design, task="flatten", formulation=formulation)
    own = Own(shear, "flat", 10.0)
    result = gso.tno.optimize(design, task="flatten", formulation=formulation, terms=[own])
    assert result.energy["own"] > 0
    products = [
        np.mean(np.prod(r.flat - r.flat.mean(axis=0), axis=1) ** 2) for r in (plain, result)
    ]
    assert products[1] < products[0]


def test_limits_components_and_warm_starts():
    far = saddle(17) + np.array([5.0, 0.0, 0.0])
    two = gso.Mesh(
        np.concatenate([saddle(17).reshape(-1, 3), far.reshape(-1, 3)]),
        np.concatenate([(faces := gso.Mesh.from_grid(far).faces), faces + 17 * 17]),
    )
    for keywords in ({"max_deviation": "2%"}, {"x0": saddle(17)}):
        assert gso.tno.optimize(saddle(17), terms=[Own()], **keywords).energy["own"] >= 0
    own = Own()
    assert gso.tno.optimize(two, terms=[own]).energy["own"] > 0
    assert {len(mesh.vertices) for mesh in own.meshes} == {17 * 17}


def test_hybrid_solves_take_terms():
    own = Own()
    result = gso.hybrid.solve(saddle(33), terms=[own])
    assert result.energy["own"] > 0 and own.meshes
    with pytest.raises(OptionError, match="list of callables"):
        gso.hybrid.solve(saddle(9), terms=[3])


class TestSessions:
    def session(self, constraints, **keywords):
        given = {"task": "developable", "terms": [Own()]} | keywords
        return gso.tno.Session(saddle(25), constraints=constraints, **given)

    def test_the_first_solve_has_the_terms(self):
        fixed = [gso.Fixed([0, 24])]
        result, plain = (self.session(fixed, terms=terms).result() for terms in ([Own()], ()))
        assert set(result.energy) == {*plain.energy, "own"}
        z = result.design.frame.to_unit(result.mesh.vertices)[:, 2]
        assert result.energy["own"] == pytest.approx(0.5 * np.mean(z**2), rel=1e-6)
        assert np.ptp(result.mesh.vertices[:, 2]) < 0.9 * np.ptp(plain.mesh.vertices[:, 2])

    def test_frames_and_new_constraints_keep_them(self):
        session = self.session([gso.Fixed([0, 24]), gso.Handle([600], [[0.6, 0.5, 0.6]])])
        plain = self.session([gso.Fixed([0, 24]), gso.Handle([600], [[0.6, 0.5, 0.6]])], terms=())
        for each in (session, plain):
            each.move([600], [[0.6, 0.5, 0.7]])
            each.step(3)
        heights = [np.abs(each.vertices[:, 2]).mean() for each in (session, plain)]
        assert heights[0] < 0.9 * heights[1]
        session.constrain([gso.Fixed([0, 24, 600])])
        session.step()
        assert session.result().energy["own"] > 0
        # The solve from the design has them, too.
        assert session.settle().energy["own"] > 0

    def test_a_task_without_terms_says_so(self):
        with pytest.raises(
            OptionError, match="task 'bend' takes no terms; these do: 'developable'"
        ):
            self.session([gso.Fixed([0])], task="bend")


def test_many_in_processes():
    grids = [saddle(17), 2.0 * saddle(17)]
    for many in (gso.tno.optimize_many, gso.hybrid.solve_many):
        items = list(many(grids, workers=1, terms=[by_height], verdict=False))
        assert [item.error for item in items] == [None, None]
        # The term refers to the unit ball, so that the size of a design does not matter.
        one, other = (item.result.energy["own"] for item in items)
        assert one > 0 and one == pytest.approx(other, rel=1e-3)


@pytest.mark.parametrize("many", [gso.tno.optimize_many, gso.hybrid.solve_many])
def test_what_cannot_be_sent_is_refused_before_any_work(many):
    def designs():
        raise AssertionError("a design was read")
        yield

    with pytest.raises(OptionError, match=r"terms: .*lambda.* top level of a module, or .*=0"):
        next(many(designs(), workers=1, terms=[lambda mesh: []]))
    with pytest.raises(OptionError, match="list of callables"):
        next(many(designs(), workers=0, terms=[3]))


class TestBatches:
    grids = np.stack([saddle(17), 0.7 * saddle(17) + [0.0, 0.0, 0.1], 3.0 * saddle(17)])

    @pytest.fixture(autouse=True)
    def torch(self):
        pytest.importorskip("torch")

    @pytest.mark.parametrize(
        ("task", "own"), [("developable", by_height), ("flatten", Own(shear, "flat", 10.0))]
    )
    def test_results_are_those_of_single_solves(self, task, own, monkeypatch):
        monkeypatch.setattr("gso.tno.batched.batches.optimize", None)  # no surface is solved alone
        batch = gso.tno.optimize_batch(self.grids, task=task, terms=[own], workers=0)
        plain = gso.tno.optimize_batch(self.grids, task=task, workers=0)
        monkeypatch.undo()
        for grid, result, without in zip(self.grids, batch, plain, strict=True):
            single = gso.tno.optimize(grid, task=task, terms=[own], verdict=False)
            assert result.energy == pytest.approx(single.energy, rel=1e-3, abs=1e-9)
            assert result.energy["own"] > 0 and "own" not in without.energy

    def test_functions_of_one_name_are_not_mistaken_for_each_other(self):
        def build(mesh):
            size = np.ptp(mesh.vertices[:, 2])

            def residual(points, constants):
                return (points[0][2] * size,)

            return Own(residual)(mesh)

        found = gso.tno.optimize_batch(self.grids, terms=[build], workers=0)
        for grid, result in zip(self.grids, found, strict=True):
            single = gso.tno.optimize(grid, terms=[build], verdict=False)
            assert result.energy == pytest.approx(single.energy, rel=1e-9)

    def test_refusals(self):
        with pytest.raises(OptionError, match=r"formulation 'isometry' .* takes no terms"):
            gso.tno.optimize_batch(self.grids, formulation="isometry", terms=[Own()])
        with pytest.raises(OptionError, match=r"terms: .* or take workers=0"):
            gso.tno.optimize_batch(self.grids, terms=[lambda mesh: []], workers=1)


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"task": "denoise"}, "takes no terms; these do: 'developable' by 'curvature'"),
        ({"formulation": "isometry"}, "formulation 'isometry' of task 'developable' takes no"),
        ({"formulation": "ruled"}, "'ruled'"),
        ({"task": "bend"}, "task 'bend' takes no terms"),
        ({"terms": Own()}, "list of callables"),
        ({"terms": [lambda mesh: [1.0]]}, "1.0 is no gso.energy.Weighted"),
        ({"terms": [lambda mesh: None]}, "returns None"),
        ({"terms": [Own(name="curvature")]}, "'curvature' is that of a term"),
    ],
)
def test_refusals(keywords, words):
    with pytest.raises(OptionError, match=words):
        gso.tno.optimize(cylinder(9) + saddle(9), **{"terms": [Own()], **keywords})


def test_a_cut_design_takes_none():
    design = gso.Mesh.from_grid(saddle(9))
    pieces = gso.cut(design, gso.seams.Path([4, 76]))
    with pytest.raises(OptionError, match="cut into pieces takes no terms"):
        gso.tno.optimize(pieces, terms=[Own()])


def rise(points, constants):
    return (points[0][2] - constants[0],)


FITTING = {
    "stencil": (("surface", np.arange(4)[:, None]),),
    "weights": np.full(4, 0.25),
    "constants": np.zeros((1, 4)),
}


@pytest.mark.parametrize(
    ("wrong", "weight", "words"),
    [
        ({}, -1.0, "has the weight -1.0"),
        ({}, np.nan, "has the weight nan"),
        ({}, "1", "has the weight '1'"),
        ({"weights": np.full(3, 0.25)}, 1.0, r"constants have the shape \(1, 4\).*\(c, 3\)"),
        ({"weights": -np.ones(4)}, 1.0, "weights must be finite numbers of 0 or more"),
        ({"constants": np.zeros(4)}, 1.0, r"constants have the shape \(4,\).*\(c, 4\)"),
        ({"constants": np.zeros((4, 1))}, 1.0, r"constants have the shape \(4, 1\)"),
        ({"constants": np.full((1, 4), np.nan)}, 1.0, "constants must be finite"),
        ({"stencil": (("surface", np.arange(4)),)}, 1.0, r"the shape \(4,\)"),
        ({"stencil": (("surface", np.full((4, 1), 81)),)}, 1.0, "row 81 of 'surface'.* 81 rows"),
        ({"stencil": (("surface", np.zeros((4, 1))),)}, 1.0, "whole numbers"),
        ({"stencil": (("flat", np.zeros((4, 1), int)),)}, 1.0, "no block 'flat'.* 'surface'"),
        ({"residual": lambda points, _: points[0][2]}, 1.0, "residual .*lambda.* of a term fails"),
        ({"residual": lambda p, _: (max(p[0][2], 0.0),)}, 1.0, "without conditions"),
        ({"residual": lambda p, c: (c[1],)}, 1.0, "residual .*lambda.* of a term fails"),
    ],
)
def test_terms_that_do_not_fit_are_named(wrong, weight, words):
    def build(mesh):
        term = Term("height", **{"residual": rise, **FITTING, **wrong})
        return [Weighted(term, weight)]

    with pytest.raises(OptionError, match=words):
        gso.tno.optimize(cylinder(9) + saddle(9), terms=[build])


def test_what_is_no_term_is_named_in_one_line():
    words = r"an object of Term is no gso\.energy\.Weighted"
    with pytest.raises(OptionError, match=words) as error:
        gso.tno.optimize(saddle(9), terms=[lambda mesh: [Term("height", rise, **FITTING)]])
    assert len(str(error.value)) < 200
