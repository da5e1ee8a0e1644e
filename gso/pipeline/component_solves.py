"""Solves of a mesh of several components, one by one, merged into one result."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from gso.components import Component, labels, split
from gso.constraints import Compiled
from gso.errors import GSOError
from gso.executors import open_executor
from gso.executors.base import useful_workers
from gso.mesh import Mesh
from gso.pipeline.component_results import renumbered, together
from gso.pipeline.job import Job
from gso.pipeline.normalise import given_points
from gso.result import Result
from gso.solver import Callback
from gso.status import Progress

#: Number of vertices outside the largest component from which worker processes save time.
_WORTH = 20_000
#: Largest coordinate difference, in the unit ball, of components that count as copies.
_ALIKE = 1e-12

#: Solves one job; a partial of a function that is importable by name.
Solve = Callable[[Job, Callback | None], Result]


def parts(design: Mesh, constraints: Compiled) -> list[Component]:
    """Return the parts that can be solved separately; none if that is only the whole mesh."""
    if design.grid_index is not None:
        return []
    label = labels(design, constraints.links)
    return split(design, label) if label.max() > 0 else []


def solve(
    one: Solve,
    whole: Job,
    pieces: Sequence[Component],
    callback: Callback | None = None,
    workers: int | None = None,
) -> Result:
    """Solve the components of a mesh, each in its own frame, and merge the results.

    Translated copies of a component are solved once, unless they have constraints or a start.
    Worker processes are used where they save time.

    Parameters
    ----------
    one : callable
        Solves a job.
    whole : Job
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
    jobs = _jobs(whole, pieces)
    origin = _origins(jobs)
    chosen = sorted(set(origin))
    watch = None if callback is None else _Watch(callback, len(chosen))
    if workers is None:
        workers = _paying([len(jobs[k].design.vertices) for k in chosen])
    solved = _spread(one, jobs, chosen, watch, workers) if workers > 0 else {}
    for place, k in enumerate(chosen):
        if k not in solved:
            if watch is not None:
                watch.place = place
            solved[k] = _named(one, k, len(jobs), jobs[k], watch)
    results = [
        solved[k] if k == number else _moved(solved[k], jobs[k].design, jobs[number].design)
        for number, k in enumerate(origin)
    ]
    return together(whole, pieces, jobs, results, chosen)


def _jobs(whole: Job, pieces: Sequence[Component]) -> list[Job]:
    count, flat = len(whole.design.vertices), whole.constraints.flat
    points = whole.start.points
    if points is not None:
        points, _ = given_points(points, count, None, flat=flat)
    return [
        Job(
            piece.mesh,
            whole.constraints.within(piece.vertices, count),
            whole.start if points is None else replace(whole.start, points=points[piece.vertices]),
            piece.vertices,
        )
        for piece in pieces
    ]


def _origins(jobs: Sequence[Job]) -> list[int]:
    """Return for each job the index of the job that it copies, or its own if there is none."""
    first: dict[bytes, list[int]] = {}
    out = []
    for k, job in enumerate(jobs):
        out.append(k)
        if job.start.points is not None or not job.constraints.empty:
            continue
        same = first.setdefault(job.design.faces.tobytes(), [])
        like = next((j for j in same if _alike(jobs[j].design, job.design)), None)
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


def _moved(result: Result, here: Mesh, there: Mesh) -> Result:
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
    """Callback that passes on the progress of one component after the other."""

    def __init__(self, callback: Callback, count: int):
        self.callback, self.count = callback, count
        self.place, self.stopped = 0, False

    def __call__(self, progress: Progress) -> bool:
        if not self.stopped:
            self.stopped = self.callback(renumbered(progress, self.place, self.count)) is False
        return not self.stopped


def _named(one: Solve, k: int, count: int, job: Job, callback: Callback | None) -> Result:
    """Solve one component, and name it in error messages."""
    try:
        return one(job, callback)
    except GSOError as error:
        names = job.design.vertices if job.names is None else job.names
        raise type(error)(
            f"component {k} of {count} ({len(names)} vertices, the first is vertex {names[0]}): "
            f"{error}"
        ) from None


def _paying(sizes: Sequence[int]) -> int:
    """Return the number of worker processes that saves time for components of these sizes."""
    return 0 if sum(sizes) - max(sizes) < _WORTH else useful_workers(len(sizes))


def _piece(one: Solve, count: int, numbered: tuple[int, Job]) -> Result | GSOError:
    """Solve one component in a worker process; return errors, so that they keep their type."""
    try:
        return _named(one, numbered[0], count, numbered[1], None)
    except GSOError as error:
        return error


def _spread(
    one: Solve, jobs: Sequence[Job], chosen: Sequence[int], watch: _Watch | None, workers: int
) -> dict[int, Result]:
    """Solve in worker processes; omit components whose worker died or that were not reached."""
    # The largest first, so that no large one runs alone at the end.
    order = sorted(chosen, key=lambda k: -len(jobs[k].design.vertices))
    work, items = partial(_piece, one, len(jobs)), ((k, jobs[k]) for k in order)
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
