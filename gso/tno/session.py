"""Interactive editing: handles of a surface move, at one or two solver iterations a frame."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from gso import linalg
from gso.constraints import Constraint, Handle, compile_constraints, listed
from gso.deformation import ThinPlateField
from gso.errors import ConvergenceWarning, OptionError
from gso.linalg.base import Solver
from gso.pipeline.case import Case
from gso.pipeline.handles import move_handles, pins_of
from gso.pipeline.judgement import conclude, difference, is_better, warning
from gso.pipeline.run import Run, objective, solution_at
from gso.result import Result
from gso.solver import METHODS, Minimum, minimise
from gso.solver.augmented_lagrangian import tighten
from gso.solver.problem import Problem
from gso.status import Status
from gso.tasks.base import Options, Plan, Stage
from gso.tasks.request import OwnTerms, check
from gso.tasks.start import Start
from gso.typing import Array, Ints, MeshLike
from gso.unknowns import control_points

#: Iteration limit of the solve in :meth:`Session.settle`.
_SETTLED = 100


class Session:
    """A task that is solved repeatedly, from warm starts, while its handles move.

    The first solve is that of :func:`gso.tno.optimize`, but nothing is solved again: a result that
    strains too much, is too far away or folds is refused. After it only the last stage of the
    task is iterated, from the current surface. The session keeps the sparsity pattern of its
    equations and their symbolic factorisation, so a frame costs one or two iterations. Hard
    handles are at their positions after every :meth:`move`, up to rounding; the iterations
    then adapt the rest of the surface. By "curvature", on meshes of more than 2,000 vertices, the
    first iteration after a move changes offsets along the normals only, for a faster answer; all
    others move the vertices freely. Take two iterations a frame, or iterate while the handles rest,
    for a lower energy; so that hard lengths and planes hold, all iterations are free there. The
    components of a mesh are solved together, each with weights by its own size.

    Parameters
    ----------
    mesh : Mesh, array (H, W, 3), (vertices, faces), trimesh.Trimesh, or path
        The design, in any unit of length.
    task, formulation, options, x0, terms
        As for :func:`gso.tno.optimize`; a task whose result is a surface. The terms are built
        again for each :meth:`constrain` and :meth:`settle`. "bend", the default, takes none.
    constraints : sequence of Constraint
        Constraints on the surface, among them the handles that can be moved.

    Attributes
    ----------
    analyses : int
        Number of symbolic factorisations so far: one, and one more for each
        :meth:`constrain` that changes the sparsity pattern, such as by fixing other vertices.
        There is another one where the first iteration after a move has other unknowns.

    Raises
    ------
    MeshError, OptionError, BackendError
        As for :func:`gso.tno.optimize`.

    Examples
    --------
    >>> import numpy as np, gso
    >>> sheet = np.dstack([*np.mgrid[:9.0, :9.0], np.zeros((9, 9))])
    >>> fixed, hand = gso.Fixed(np.arange(18)), gso.Handle([76], [[8.0, 4.0, 0.0]])
    >>> session = gso.tno.Session(sheet, constraints=[fixed, hand])
    >>> for height in (0.5, 1.0, 1.5, 2.0):
    ...     session.move([76], [[8.0 - height**2 / 8, 4.0, height]])
    ...     vertices = session.step()
    >>> vertices[76]
    array([7.5, 4. , 2. ])
    >>> session.settle().metrics["edge_length_error"] < 1e-3
    True
    """

    def __init__(
        self,
        mesh: MeshLike,
        *,
        task: str = "bend",
        formulation: str | None = None,
        options: str | Options | None = None,
        constraints: Sequence[Constraint] = (),
        x0: MeshLike | Start | None = None,
        terms: Sequence[OwnTerms] = (),
    ):
        from gso.io import as_mesh

        design = as_mesh(mesh)
        design.check_joined()
        self._case = Case(check(task, formulation, options, x0=x0, terms=terms), design)
        if self._case.task.flat:
            raise OptionError(f"task {task!r} makes no surface that handles could move")
        self._options = self._case.solver_request.options
        self.analyses = 0
        self._constraints: list[Constraint] = []
        self._spread: ThinPlateField | None = None
        #: Problem and solver of the stage's unknowns, and of those while handles move.
        self._kept: dict[bool, tuple[Problem, Solver]] = {}
        #: Whether the current unknowns are those for the first iteration after a move.
        self._moving = False
        #: Whether a handle has moved since the last iteration.
        self._moved = False
        self._direction = METHODS[self._options.method]()
        self._x0 = self._case.solver_request.x0
        self._run = Run(self._case)
        self._stage: Stage | None = None
        self._plan = self._prepare(constraints, self._x0)
        self._status = self._plan.status or Status.CONVERGED
        self._coordinates = self._solve_stages(self._plan)
        self._pose()

    @property
    def vertices(self) -> Array:
        """Current vertices (n, 3), in the user's frame and numbering."""
        frame = self._case.frame
        return frame.frame.to_user(frame.back("surface", self._surface))

    def move(self, ids: ArrayLike, positions: ArrayLike) -> None:
        """Move vertices that have a :class:`gso.Handle`.

        Their displacement is spread smoothly over the surface, before any iteration.

        Parameters
        ----------
        ids : array_like of int, (k,)
            Vertex indices.
        positions : array_like, (k, 3)
            Their new positions, in the unit of the mesh.

        Raises
        ------
        OptionError
            A vertex has no handle, or the positions are not k finite points.
        """
        design = self._case.design
        pins = pins_of(Handle(ids, positions), design, "move()")
        constraints = move_handles(self._constraints, design, pins)
        case = self._case.constrained(compile_constraints(constraints, design))
        before = self._case.analysis.constraints.pinned_positions[1]
        held, after = case.analysis.constraints.pinned_positions
        self._constraints, self._case, self._run.case = constraints, case, case
        stage = self._stage
        if stage is not None and stage.imposed is not None:
            imposed = stage.imposed.with_handles(case.analysis.constraints)
            self._stage = replace(stage, imposed=imposed)
        self._follow(held, after - before)
        self._pose(moving=True)
        self._moved = True
        self._left_to_do()

    def constrain(self, constraints: Sequence[Constraint]) -> None:
        """Replace the constraints, including the handles.

        The session goes on from the current surface. Vertices with a hard position move
        there, and their displacement is spread over the surface, as by :meth:`move`.

        Raises
        ------
        OptionError
            Constraints contradict each other, or one is invalid.
        """
        self._plan = self._prepare(constraints, self._surface)
        c = self._case.analysis.constraints
        self._follow(c.hard_ids, c.hard_positions - self._surface[c.hard_ids])
        self._pose()
        self._moved = False
        self._left_to_do()

    def step(self, iterations: int = 1) -> Array:
        """Iterate from the current surface.

        Parameters
        ----------
        iterations : int
            Largest number of iterations, 1 or more; fewer once the energy no longer falls.

        Returns
        -------
        ndarray, (n, 3)
            :attr:`vertices`.

        Raises
        ------
        OptionError
            `iterations` is not a whole number of 1 or more.
        """
        if not isinstance(iterations, int | np.integer) or iterations < 1:
            raise OptionError(f"iterations is {iterations!r}; it must be 1 or more")
        if self._stage is not None:
            left = int(iterations)
            if self._moved and self._moving:
                self._iterate(self._stage, 1, 0.0)
                self._left_to_do()
                left -= 1
            self._moved = False
            if not left:
                return self.vertices
            self._at_rest()
            self._iterate(self._stage, left, 0.0)
            blocks = self._stage.layout.split(self._coordinates)
            for item in self._stage.items:
                if item.term.multipliers is not None:
                    item.term.multipliers.update(blocks)
        return self.vertices

    def settle(self) -> Result:
        """Iterate until the task's tolerance is met and all constraints hold.

        The energy has many local minima, and dragging may have led into a bad one. The task is
        therefore also solved anew from the design (or `x0`), as by :func:`gso.tno.optimize`.
        That result replaces the dragged surface if only it is usable, or if both or neither
        are usable and its energy is lower.

        Returns
        -------
        Result
            The :meth:`result`, with a `ConvergenceWarning` if it has not converged. If the solve
            from the design was taken, a note says how far it is from the dragged surface.
        """
        result = self._settle()
        if self._stage is not None:
            dragged, kept = result, (self._plan, self._stage, self._coordinates, self._status)
            self._plan = self._prepare(self._constraints, self._x0)
            self._coordinates = self._solve_stages(self._plan)
            self._pose()
            result = self.result()
            if is_better(result, dragged):
                result.notes += (difference(dragged, result),)
            else:
                result = dragged
                self._plan, self._stage, self._coordinates, self._status = kept
                self._pose()
        if not result.converged:
            warnings.warn(warning(result) or str(result.status), ConvergenceWarning, stacklevel=2)
        return result

    def _settle(self) -> Result:
        """Iterate from the current surface until the stage converges."""
        stage = self._stage
        if stage is not None:
            self._at_rest()
            minimum = self._iterate(stage, _SETTLED, stage.tolerance)
            before = self._coordinates
            solve = partial(self._run.minimise, self._options, stage)
            self._coordinates, _ = tighten(
                stage.items, stage.layout, before, minimum, lambda items, at: solve(at, items=items)
            )
            if self._coordinates is not before:
                self._pose()
        return self.result()

    def result(self) -> Result:
        """Return the current surface as a result, like that of :func:`gso.tno.optimize`."""
        plan, stage, at = self._plan, self._stage, self._coordinates
        energy = None if stage is None else objective(stage, at)[0]
        solution = solution_at(plan, at, self._status, energy, stage)
        if stage is not None:
            solution.backend = self._kept[False][1].name
        if plan.spline is not None:
            solution.spline = control_points(plan.layout, plan.spline, self._x)
        result = conclude(self._run, solution)
        result.warm_start = "session"
        return result

    @property
    def _surface(self) -> Array:
        """Current vertices (n, 3), in the solver's frame and numbering."""
        return self._plan.layout.split(self._coordinates)["surface"]

    def _solve_stages(self, plan: Plan) -> Array:
        """Solve all stages of a plan, and return the final coordinates."""
        if not plan.stages:
            return plan.start
        state = self._run.solve_stages(plan, self._options)
        self._status = plan.status or state.minimum.status
        return state.coordinates

    def _left_to_do(self) -> None:
        """Mark the surface as not converged, because its constraints have changed."""
        if self._stage is not None:
            self._status = Status.MAX_ITERATIONS

    def _prepare(self, constraints: Sequence[Constraint], start: Array | None) -> Plan:
        """Check constraints, and return the task's plan with them."""
        given = listed(constraints)
        case = self._case.constrained(compile_constraints(given, self._case.design))
        run = Run(case)
        plan = run.plan(replace(case.solver_request, x0=start))
        if not plan.stages and plan.status is not Status.ALREADY_GOOD:
            raise OptionError(f"task {case.request.task!r} has no iterations to go on with")
        run.continue_from(self._run)
        self._case, self._run, self._constraints, self._spread = case, run, given, None
        self._stage = plan.edited or (plan.stages[-1] if plan.stages else None)
        return plan

    def _follow(self, ids: Ints, displacement: Array) -> None:
        """Displace vertices (k,) by (k, 3), and spread the displacement over the surface."""
        if self._stage is None or not len(ids):
            return
        if self._spread is None or not np.array_equal(self._spread.ids, ids):
            self._spread = ThinPlateField(self._case.frame.mesh, ids)
        start, count, dim = self._stage.layout.where("surface")
        self._coordinates = self._coordinates.copy()
        surface = self._coordinates[start : start + count * dim].reshape(count, dim)
        surface += self._spread(displacement)

    def _at_rest(self) -> None:
        """Return to the stage's own unknowns."""
        if self._moving:
            self._pose()

    def _pose(self, *, moving: bool = False) -> None:
        """Rebuild the problem for the current constraints and coordinates.

        `moving` is whether to take the unknowns for the first iteration after a move.
        """
        stage = self._stage
        self._moving = moving and stage is not None and stage.moving is not None
        if stage is None:
            return
        variables = stage.unknowns(self._coordinates, moving=self._moving)
        kept = self._kept.get(self._moving)
        problem = Problem(stage.items, variables, stage.limits, like=kept and kept[0])
        if kept is not None and problem.pattern is kept[0].pattern:
            solver = kept[1]
        else:
            solver = linalg.choose(problem.pattern, self._options.backend)
            self.analyses += 1
        self._kept[self._moving] = problem, solver
        self._x = variables.project(self._coordinates)
        self._coordinates = variables.points(self._x)
        self._bounds = None if stage.bounds is None else stage.bounds(self._coordinates)

    def _iterate(self, stage: Stage, iterations: int, tolerance: float) -> Minimum:
        """Iterate a stage from the current unknowns; the current problem must be its own."""
        problem, solver = self._kept[self._moving]
        minimum = minimise(
            problem,
            self._x,
            iterations=iterations,
            tolerance=tolerance,
            continuation=stage.continuation[-1:],
            continued=stage.continued,
            bounds=self._bounds,
            solver=solver,
            direction=self._direction,
            threads=self._options.threads,
            name=stage.name,
            timings=self._run.timings,
        )
        self._x, self._status = minimum.x, minimum.status
        self._coordinates = problem.variables.points(minimum.x)
        self._run.iterations += minimum.iterations
        self._run.history += minimum.history
        return minimum
