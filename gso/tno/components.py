"""A mesh of several components: each is solved by itself, and put into one result."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import parent_process
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gso.components import Component, labels, mean, split
from gso.constraints import Compiled
from gso.flat_start import beside
from gso.mesh import Mesh
from gso.result import Result
from gso.status import GSOError, Progress, Status
from gso.tno.canonical import given_points
from gso.tno.pool import processors, spread
from gso.tno.solver import Callback
from gso.tno.start import Start

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Vertices beside those of the largest component from which on processes save time.
_WORTH = 20_000
#: Difference of two components in their unit balls up to which they are copies.
_ALIKE = 1e-12
#: Gap beside what is held in place, as a share of its width.
_GAP = 0.05

#: What a result of several components is called, the worst of theirs; others are worse still.
_WORST_LAST = (
    Status.ALREADY_GOOD,
    Status.TARGET_REACHED,
    Status.CONVERGED,
    Status.MAX_ITERATIONS,
    Status.STALLED,
    Status.TARGET_MISSED,
    Status.CONSTRAINTS_MISSED,
)


@dataclass(frozen=True)
class Job:
    """What is solved for by itself: a mesh or the part of one that nothing ties to the rest.

    Attributes
    ----------
    design : Mesh
        The input.
    constraints : Compiled
        What its vertices must keep, in the user's frame.
    start : Start
        Where to start.
    names : ndarray of int, (n,), optional
        What messages call its vertices, where it is a part.
    """

    design: Mesh
    constraints: Compiled
    start: Start
    names: Ints | None = None


#: Solves one job; a partial of a function that is importable by name.
Solve = Callable[[Job, Callback | None], Result]


def parts(design: Mesh, constraints: Compiled) -> list[Component]:
    """What can be solved by itself; nothing where that is the whole mesh."""
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
    """Solve the components of a mesh, each in its own frame, and put the results together.

    Components that are copies of each other, at whatever places, are solved once, unless
    constraints or a start tell them apart. Processes are used where they save time.

    Parameters
    ----------
    one : callable
        Solves a job.
    whole : Job
        The user's mesh, what it keeps, and where it starts.
    pieces : sequence of Component
        Its :func:`parts`.
    callback : callable, optional
        Is told of all iterations in turn, or, of processes, of each component's last one.
        Where it returns False, the components that are left come back as they start.
    workers : int, optional
        Processes: as many as pay when not given, 0 for none.

    Raises
    ------
    GSOError
        Of the first component that cannot be solved; the message says which.
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
    return _together(whole, pieces, jobs, results, chosen)


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
    """For each job the first one with the same shape and wishes, itself where there is none."""
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
    """Whether two meshes of the same faces have the same shape and size."""
    if a.vertices.shape != b.vertices.shape or a.faces.shape != b.faces.shape:
        return False
    here, there = (m.frame.to_unit(m.vertices) for m in (a, b))
    same_size = abs(a.frame.scale - b.frame.scale) <= _ALIKE * a.frame.scale
    return same_size and bool(np.abs(here - there).max() <= _ALIKE)


def _moved(result: Result, here: Mesh, there: Mesh) -> Result:
    """The result of a mesh as that of a copy of it at another place."""
    if np.array_equal(here.vertices, there.vertices):
        mesh = result.mesh
    elif result.mesh is result.design:
        mesh = there
    elif result.flat is not None and np.array_equal(result.mesh.vertices[:, :2], result.flat):
        mesh = result.mesh
    else:
        unit = here.frame.to_unit(result.mesh.vertices)
        mesh = there.replaced(there.frame.to_user(unit))
    return replace(result, design=there, mesh=mesh)


class _Watch:
    """Tells a callback of the progress of one component after the other."""

    def __init__(self, callback: Callback, count: int):
        self.callback, self.count = callback, count
        self.place, self.stopped = 0, False

    def __call__(self, progress: Progress) -> bool:
        if not self.stopped:
            self.stopped = self.callback(_renumbered(progress, self.place, self.count)) is False
        return not self.stopped


def _renumbered(progress: Progress, place: int, count: int) -> Progress:
    """Progress of one component of several, each of which has so many stages."""
    return replace(
        progress,
        stage=place * progress.stages + progress.stage,
        stages=count * progress.stages,
        name=f"component {place}, {progress.name}",
    )


def _named(one: Solve, k: int, count: int, job: Job, callback: Callback | None) -> Result:
    """Solve one component; errors say which it is."""
    try:
        return one(job, callback)
    except GSOError as error:
        names = job.design.vertices if job.names is None else job.names
        raise type(error)(
            f"component {k} of {count} ({len(names)} vertices, the first is vertex {names[0]}): "
            f"{error}"
        ) from None


def _paying(sizes: Sequence[int]) -> int:
    """Processes that save time for components of so many vertices; none in a worker."""
    if parent_process() is not None or sum(sizes) - max(sizes) < _WORTH:
        return 0
    workers = min(processors(), len(sizes))
    return workers if workers > 1 else 0


def _piece(one: Solve, count: int, numbered: tuple[int, Job]) -> Result | GSOError:
    """Solve one component in a worker; errors travel as what they are."""
    try:
        return _named(one, numbered[0], count, numbered[1], None)
    except GSOError as error:
        return error


def _spread(
    one: Solve, jobs: Sequence[Job], chosen: Sequence[int], watch: _Watch | None, workers: int
) -> dict[int, Result]:
    """Solve in processes; what a worker dies of, or a callback stops, is left out."""
    # The largest first, so that none is alone at the end.
    order = sorted(chosen, key=lambda k: -len(jobs[k].design.vertices))
    work = spread(
        partial(_piece, one, len(jobs)),
        ((k, jobs[k]) for k in order),
        workers=workers,
        caller=False,
    )
    found: dict[int, Result] = {}
    failed: dict[int, GSOError] = {}
    with closing(work) as results:
        for place, done in enumerate(results):
            k = order[done.index]
            if isinstance(done.value, GSOError):
                failed[k] = done.value
            elif done.value is not None:
                found[k] = done.value
                if watch is not None and done.value.history:
                    watch.place = place
                    if not watch(done.value.history[-1]):
                        break
    if failed:
        raise failed[min(failed)]
    return found


def _together(
    whole: Job,
    pieces: Sequence[Component],
    jobs: Sequence[Job],
    results: Sequence[Result],
    chosen: Sequence[int],
) -> Result:
    """One result in the numbering of the whole mesh."""
    design = whole.design
    for piece, result in zip(pieces, results, strict=True):
        result.names = piece.vertices
    areas = [piece.area for piece in pieces]
    flat = _laid_out(len(design.vertices), pieces, jobs, results)
    if whole.constraints.flat and flat is not None:
        mesh = design.replaced(np.c_[flat, np.zeros(len(flat))])
    elif all(r.mesh is r.design for r in results):
        mesh = design
    else:
        vertices = design.vertices.copy()
        for piece, result in zip(pieces, results, strict=True):
            vertices[piece.vertices] = result.mesh.vertices
        mesh = design.replaced(vertices)
    ran = [results[k] for k in chosen]
    starts = [r.warm_start for r in results]
    return Result(
        task=results[0].task,
        formulation=results[0].formulation,
        design=design,
        mesh=mesh,
        flat=flat,
        cell_scale=_gathered(len(design.faces), pieces, [r.cell_scale for r in results]),
        status=worst(r.status for r in results),
        iterations=sum(r.iterations for r in ran),
        energy=_energy(results, areas),
        history=[
            _renumbered(progress, place, len(ran))
            for place, result in enumerate(ran)
            for progress in result.history
        ],
        seconds={name: sum(r.seconds.get(name, 0.0) for r in ran) for name in _names(ran)},
        backend=", ".join(dict.fromkeys(r.backend for r in results if r.backend)),
        warm_start=next((s for s in starts if s != "cold"), "cold"),
        notes=design.notes + _notes(design, pieces, jobs, results),
        details=_details(results, areas),
        components=list(results),
    )


def worst(several: Any) -> Status:
    """The status of a whole: the worst of those of its parts, a cancelled one above all.

    >>> worst([Status.CONVERGED, Status.STALLED, Status.ALREADY_GOOD]).name
    'STALLED'
    """
    order = {status: k for k, status in enumerate(_WORST_LAST)}

    def rank(status: Status) -> tuple[bool, int]:
        return status is Status.CANCELLED, order.get(status, len(order))

    return max(several, key=rank)


def _laid_out(
    count: int, pieces: Sequence[Component], jobs: Sequence[Job], results: Sequence[Result]
) -> Array | None:
    """Flat images side by side; those that are held in a place stay there."""
    if any(r.flat is None for r in results):
        return None
    out = np.zeros((count, 2))
    loose: list[tuple[Ints, Array]] = []
    held: list[tuple[Ints, Array]] = []
    for piece, job, result in zip(pieces, jobs, results, strict=True):
        begun = job.start.points is not None and result.warm_start != "cold"
        stays = job.constraints.flat and (begun or bool(job.constraints.anchored))
        (held if stays else loose).append((piece.vertices, np.asarray(result.flat)))
    for ids, image in held:
        out[ids] = image
    corner = np.zeros(2)
    if held:
        there = np.concatenate([image for _, image in held])
        gap = _GAP * float(np.ptp(there[:, 0]))
        corner = np.array([there[:, 0].max() + gap, there[:, 1].min()])
    for (ids, _), image in zip(loose, beside([image for _, image in loose]), strict=True):
        out[ids] = image + corner
    return out


def _gathered(
    count: int, pieces: Sequence[Component], values: Sequence[Array | None]
) -> Array | None:
    """Values of the faces of all components, in the order of the whole mesh's faces."""
    out = np.zeros(count)
    for piece, own in zip(pieces, values, strict=True):
        if own is None:
            return None
        out[piece.faces] = own
    return out


def _names(results: Sequence[Result]) -> dict[str, None]:
    return dict.fromkeys(name for result in results for name in result.seconds)


def _energy(results: Sequence[Result], areas: Sequence[float]) -> dict[str, float]:
    """Mean of the components' energies, weighted by area, by term."""
    names = dict.fromkeys(name for result in results for name in result.energy)
    terms = [name for name in names if name != "objective"] or list(names)
    share = np.array(areas) / sum(areas)
    return {
        name: float(share @ [result.energy.get(name, 0.0) for result in results]) for name in terms
    }


def _notes(
    design: Mesh, pieces: Sequence[Component], jobs: Sequence[Job], results: Sequence[Result]
) -> tuple[str, ...]:
    """What the components' results say: once where all say the same."""
    out = []
    if len(np.unique(design.components[design.used])) > len(pieces):
        for k, piece in enumerate(pieces):
            joined = np.unique(piece.mesh.components).size
            if joined > 1:
                out.append(f"component {k} is {joined} that constraints join: solved together")
    if results[0].flat is not None:
        out.append(f"the {len(pieces)} components are laid out side by side")
        if not design.used.all():
            out.append("vertices that belong to no face are at the pattern's origin")
    said: dict[str, list[int]] = {}
    for k, result in enumerate(results):
        for note in dict.fromkeys(result.notes):
            said.setdefault(note, []).append(k)
    for note, who in said.items():
        if len(who) == len(results):
            out.append(note)
        else:
            numbers = ", ".join(map(str, who[:8])) + (" ..." if len(who) > 8 else "")
            out.append(f"component{'s' if len(who) > 1 else ''} {numbers}: {note}")
    states = {r.status for r in results}
    if len(states) > 1:
        bad = worst(states)
        which = [str(k) for k, r in enumerate(results) if r.status is bad]
        numbers = ", ".join(which[:8]) + (" ..." if len(which) > 8 else "")
        out.append(
            f"component{'s' if len(which) > 1 else ''} {numbers} ended so; see result.components "
            "for the others"
        )
    if any(r.spline is not None for r in results):
        out.append("every component has a spline of its own: result.components[k].spline")
    return tuple(out)


def _details(results: Sequence[Result], areas: Sequence[float]) -> dict[str, Any]:
    """Numbers that all share, means of those that differ, the largest miss of a constraint."""
    out: dict[str, Any] = {}
    for name in dict.fromkeys(name for result in results for name in result.details):
        have = [k for k, result in enumerate(results) if name in result.details]
        values = [results[k].details[name] for k in have]
        if name == "constraints":
            every = dict.fromkeys(key for value in values for key in value)
            out[name] = {key: max(value.get(key, 0.0) for value in values) for key in every}
        elif all(isinstance(value, float | np.floating) for value in values):
            out[name] = mean(np.array(values), np.array([areas[k] for k in have]))
        elif all(isinstance(value, str | int) for value in values) and len(set(values)) == 1:
            out[name] = values[0]
    return out
