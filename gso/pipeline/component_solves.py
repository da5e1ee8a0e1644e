"""Solves of a mesh of several components, one by one, merged into one result."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from gso import tasks
from gso.components import Component, labels, several, split
from gso.constraints import Compiled, Constraint, compile_constraints
from gso.errors import GSOError
from gso.executors import open_executor
from gso.executors.base import useful_workers
from gso.mesh import Mesh
from gso.pipeline.case import Case
from gso.pipeline.component_results import merge, renumber
from gso.pipeline.lay_flat import lay_out
from gso.pipeline.normalise import given_points
from gso.pipeline.run import Run
from gso.pipeline.second_solve import solve_and_judge
from gso.result import Result
from gso.solver import Callback
from gso.status import Progress
from gso.tasks.base import Options
from gso.tasks.request import Request

#: Number of vertices outside the largest component from which worker processes save time.
_WORTH = 20_000
#: Largest coordinate difference, in the unit ball, of components that count as copies.
_ALIKE = 1e-12

#: Solves one case; it must be importable by name where worker processes are used.
Solve = Callable[[Case, Callback | None], Result]


def solve_mesh(
    request: Request[Options],
    design: Mesh,
    constraints: Iterable[Constraint] = (),
    callback: Callback | None = None,
) -> Result:
    """Solve a mesh: each of its components that no constraint joins to others on its own."""
    flat = tasks.get(request.task).flat
    whole = Case(request, design, compile_constraints(constraints, design, flat=flat))
    pieces = parts(design, whole.constraints)
    if pieces:
        return solve_components(solve_case, whole, pieces, callback)
    return solve_case(whole, callback)


def solve_case(case: Case, callback: Callback | None = None) -> Result:
    """Solve a single component, or several that constraints join."""
    result = solve_and_judge(Run(case, callback, lay_out=lay_out))
    if several(case.design):
        result.notes += ("its components are joined by constraints and solved together",)
    return result


def parts(design: Mesh, constraints: Compiled) -> list[Component]:
    """Return the parts that can be solved separately; none if that is only the whole mesh."""
    if design.grid_index is not None:
        return []
    label = labels(design, constraints.links)
    return split(design, label) if label.max() > 0 else []


def solve_components(
    solve: Solve,
    whole: Case,
    pieces: Sequence[Component],
    callback: Callback | None = None,
    workers: int | None = None,
) -> Result:
    """Solve the components of a mesh, each in its own frame, and merge the results.

    Translated copies of a component are solved once, unless they have constraints or a start.
    Worker processes are used where they save time.

    Parameters
    ----------
    solve : callable
        Solves a case.
    whole : Case
        The user's mesh, with its constraints and its start.
    pieces : sequence of Component
        Its :func:`parts`.
    callback : callable, optional
        Called after every iteration, or, with worker processes, with the last iteration of
        each component. Once it returns False, the remaining components are not iterated.
    workers : int, optional
        Number of worker processes; as many as save time when not given, 0 for none.

    Raises
    ------
    GSOError
        A component cannot be solved; the message says which.
    """
    cases = _cases(whole, pieces)
    origin = _origins(cases)
    chosen = sorted(set(origin))
    watch = None if callback is None else _Watch(callback, len(chosen))
    if workers is None and whole.request.terms:
        # The user's functions may not be sent to other processes.
        workers = 0
    if workers is None:
        workers = _useful_workers([len(cases[k].design.vertices) for k in chosen])
    solved = _solve_in_workers(solve, cases, chosen, watch, workers) if workers > 0 else {}
    for place, k in enumerate(chosen):
        if k not in solved:
            if watch is not None:
                watch.place = place
            solved[k] = _solve_named(solve, k, len(cases), cases[k], watch)
    results = [
        solved[k] if k == number else _translate(solved[k], cases[k].design, cases[number].design)
        for number, k in enumerate(origin)
    ]
    return merge(whole, pieces, cases, results, chosen)


def _cases(whole: Case, pieces: Sequence[Component]) -> list[Case]:
    """Return the case of each component."""
    count, start = len(whole.design.vertices), whole.request.start
    points = None
    if start.points is not None:
        points, _ = given_points(start.points, count, None, flat=whole.constraints.flat)
    out = []
    for piece in pieces:
        own = start if points is None else replace(start, points=points[piece.vertices])
        constraints = whole.constraints.within(piece.vertices, count)
        request = replace(whole.request, start=own)
        out.append(Case(request, piece.mesh, constraints, piece.vertices))
    return out


def _origins(cases: Sequence[Case]) -> list[int]:
    """Return for each case the index of the case that it copies, or its own if there is none."""
    first: dict[bytes, list[int]] = {}
    out = []
    for k, case in enumerate(cases):
        out.append(k)
        if case.request.start.points is not None or not case.constraints.empty:
            continue
        same = first.setdefault(case.design.faces.tobytes(), [])
        like = next((j for j in same if _alike(cases[j].design, case.design)), None)
        if like is None:
            same.append(k)
        else:
            out[-1] = like
    return out


def _alike(a: Mesh, b: Mesh) -> bool:
    """Return whether two meshes of the same faces differ by a translation only."""
    if a.vertices.shape != b.vertices.shape or a.faces.shape != b.faces.shape:
        return False
    here, there = (m.frame.to_unit(m.vertices) for m in (a, b))
    same_size = abs(a.frame.scale - b.frame.scale) <= _ALIKE * a.frame.scale
    return same_size and bool(np.abs(here - there).max() <= _ALIKE)


def _translate(result: Result, here: Mesh, there: Mesh) -> Result:
    """Transfer the result of a mesh to a translated copy of it."""
    if np.array_equal(here.vertices, there.vertices):
        mesh = result.mesh
    elif result.mesh is result.design:
        mesh = there
    elif result.pattern is not None and np.array_equal(
        result.mesh.vertices[:, :2], result.pattern.flat
    ):
        mesh = result.mesh
    else:
        unit = here.frame.to_unit(result.mesh.vertices)
        mesh = there.replaced(there.frame.to_user(unit))
    return replace(result, design=there, mesh=mesh)


class _Watch:
    """Callback that passes on the progress of one component after the other.

    The stages of a component's other solves, which count from zero again, are given the number of
    the last stage reached.
    """

    def __init__(self, callback: Callback, count: int):
        self.callback, self.count = callback, count
        self.place, self.stopped, self.reached = 0, False, (0, 1)

    def __call__(self, progress: Progress) -> bool:
        if not self.stopped:
            progress = renumber(progress, self.place, self.count)
            if progress.stage / progress.stages < self.reached[0] / self.reached[1]:
                stage, stages = self.reached
                progress = replace(progress, stage=stage, stages=stages)
            self.reached = (progress.stage, progress.stages)
            self.stopped = self.callback(progress) is False
        return not self.stopped


def _solve_named(solve: Solve, k: int, count: int, case: Case, callback: Callback | None) -> Result:
    """Solve one component, and name it in error messages."""
    try:
        return solve(case, callback)
    except GSOError as error:
        names = case.design.vertices if case.names is None else case.names
        raise type(error)(
            f"component {k} of {count} ({len(names)} vertices, the first is vertex {names[0]}): "
            f"{error}"
        ) from None


def _useful_workers(sizes: Sequence[int]) -> int:
    """Return the number of worker processes that saves time for components of these sizes."""
    return 0 if sum(sizes) - max(sizes) < _WORTH else useful_workers(len(sizes))


def _solve_or_error(solve: Solve, count: int, numbered: tuple[int, Case]) -> Result | GSOError:
    """Solve one component in a worker process; return errors, so that they keep their type."""
    try:
        return _solve_named(solve, numbered[0], count, numbered[1], None)
    except GSOError as error:
        return error


def _solve_in_workers(
    solve: Solve, cases: Sequence[Case], chosen: Sequence[int], watch: _Watch | None, workers: int
) -> dict[int, Result]:
    """Solve in worker processes; omit components whose worker died or that were not reached."""
    # The largest first, so that no large one runs alone at the end.
    order = sorted(chosen, key=lambda k: -len(cases[k].design.vertices))
    work, items = partial(_solve_or_error, solve, len(cases)), ((k, cases[k]) for k in order)
    found: dict[int, Result] = {}
    failed: dict[int, GSOError] = {}
    with open_executor(workers) as executor:
        for place, done in enumerate(executor.as_completed(work, items)):
            k = order[done.index]
            if isinstance(done.result, GSOError):
                failed[k] = done.result
            elif done.result is not None:
                found[k] = done.result
                if watch is not None and done.result.history:
                    watch.place = place
                    if not watch(done.result.history[-1]):
                        break
    if failed:
        raise failed[min(failed)]
    return found
