"""The results of a mesh's components, merged into one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from gso.components import Component, mean
from gso.mesh import Mesh
from gso.parametrization import beside
from gso.pattern import Pattern
from gso.pipeline.case import Case
from gso.pipeline.judgement import add_reasons
from gso.result import Result
from gso.status import Progress, Status
from gso.typing import Array, Ints
from gso.verdict import judge_components, ordered

#: Gap beside the flat images whose position is prescribed, as a share of their width.
_GAP = 0.05

#: Largest number of components that a note names.
_NAMED = 8

#: Statuses from the best to the worst; those not listed are worse still.
_WORST_LAST = (
    Status.ALREADY_GOOD,
    Status.TARGET_REACHED,
    Status.CONVERGED,
    Status.MAX_ITERATIONS,
    Status.STALLED,
    Status.TARGET_MISSED,
    Status.CONSTRAINTS_MISSED,
    Status.UNUSABLE,
)


def renumber(progress: Progress, place: int, count: int, what: str = "component") -> Progress:
    """Number the stages in the progress of component `place` over all `count` components.

    All components are taken to have the same number of stages.
    """
    return replace(
        progress,
        stage=place * progress.stages + progress.stage,
        stages=count * progress.stages,
        name=f"{what} {place}, {progress.name}",
    )


def merge(
    whole: Case,
    pieces: Sequence[Component],
    cases: Sequence[Case],
    results: Sequence[Result],
    chosen: Sequence[int],
) -> Result:
    """Merge the results of components into one, in the numbering of the whole mesh."""
    design = whole.design
    for piece, result in zip(pieces, results, strict=True):
        result.names = piece.vertices
    areas = [piece.area for piece in pieces]
    flat = _place_flat(len(design.vertices), pieces, cases, results)
    own = all(r.pattern is None or r.pattern.flat is r.flat for r in results)
    pattern = None if own and flat is not None else _side_by_side(design, pieces, results)
    if whole.constraints.flat and flat is not None:
        mesh = design.replaced(np.c_[flat, np.zeros(len(flat))])
    elif whole.constraints.flat and pattern is not None:
        mesh = pattern.mesh
    elif all(r.mesh is r.design for r in results):
        mesh = design
    else:
        vertices = design.vertices.copy()
        for piece, result in zip(pieces, results, strict=True):
            vertices[piece.vertices] = result.mesh.vertices
        mesh = design.replaced(vertices)
    ran = [results[k] for k in chosen]
    starts = [r.warm_start for r in results]
    joined = Result(
        task=results[0].task,
        formulation=results[0].formulation,
        design=design,
        mesh=mesh,
        flat=flat,
        cell_scale=_gather(len(design.faces), pieces, [r.cell_scale for r in results]),
        status=worst_status(r.status for r in results),
        iterations=sum(r.iterations for r in ran),
        energy=_energy(results, areas),
        history=[
            renumber(progress, place, len(ran))
            for place, result in enumerate(ran)
            for progress in result.history
        ],
        seconds={name: sum(r.seconds.get(name, 0.0) for r in ran) for name in _names(ran)},
        backend=", ".join(dict.fromkeys(r.backend for r in results if r.backend)),
        warm_start=next((s for s in starts if s != "cold"), "cold"),
        notes=design.notes + _notes(design, results),
        details=_details(results, areas),
        components=list(results),
        pattern=pattern,
        reasons=ordered(
            why.within(f"component {k}") for k, r in enumerate(results) for why in r.reasons
        ),
    )
    if whole.request.verdict:
        add_reasons(joined, ordered([*joined.reasons, *judge_components(joined)]))
    return joined


def _side_by_side(
    design: Mesh, pieces: Sequence[Component], results: Sequence[Result]
) -> Pattern | None:
    """Place the components' patterns side by side; return None if one has none."""
    patterns = [r.pattern for r in results if r.pattern is not None]
    if len(patterns) < len(results):
        return None
    faces = np.full(design.faces.shape, -1)
    first = 0
    for piece, pattern in zip(pieces, patterns, strict=True):
        own = np.where(pattern.faces < 0, -1, pattern.faces + first)
        faces[piece.faces, : own.shape[1]] = own
        first += len(pattern.flat)
    starts = np.cumsum([0, *(len(p.flat) for p in patterns)])
    seams = [p.seams + start for p, start in zip(patterns, starts, strict=False)]
    return Pattern(
        np.concatenate(beside([p.flat for p in patterns])),
        faces,
        np.concatenate([c.vertices[p.vertex] for c, p in zip(pieces, patterns, strict=True)]),
        np.concatenate(seams),
    )


def worst_status(several: Iterable[Status]) -> Status:
    """Return the worst of several statuses; `CANCELLED` is worse than all others.

    >>> worst_status([Status.CONVERGED, Status.STALLED, Status.ALREADY_GOOD]).name
    'STALLED'
    """
    order = {status: k for k, status in enumerate(_WORST_LAST)}

    def rank(status: Status) -> tuple[bool, int]:
        return status is Status.CANCELLED, order.get(status, len(order))

    return max(several, key=rank)


def _place_flat(
    count: int, pieces: Sequence[Component], cases: Sequence[Case], results: Sequence[Result]
) -> Array | None:
    """Place flat images side by side; those positioned by constraints or a start stay there."""
    if any(r.flat is None for r in results):
        return None
    out = np.zeros((count, 2))
    loose: list[tuple[Ints, Array]] = []
    held: list[tuple[Ints, Array]] = []
    for piece, case, result in zip(pieces, cases, results, strict=True):
        begun = case.request.start.points is not None and result.warm_start != "cold"
        stays = case.constraints.flat and (begun or bool(case.constraints.anchored))
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


def _gather(
    count: int, pieces: Sequence[Component], values: Sequence[Array | None]
) -> Array | None:
    """Gather face values of all components, in the order of the whole mesh's faces."""
    out = np.zeros(count)
    for piece, own in zip(pieces, values, strict=True):
        if own is None:
            return None
        out[piece.faces] = own
    return out


def _names(results: Sequence[Result]) -> dict[str, None]:
    return dict.fromkeys(name for result in results for name in result.seconds)


def _energy(results: Sequence[Result], areas: Sequence[float]) -> dict[str, float]:
    """Average the components' energies by term, weighted by area."""
    names = dict.fromkeys(name for result in results for name in result.energy)
    terms = [name for name in names if name != "objective"] or list(names)
    share = np.array(areas) / sum(areas)
    return {
        name: float(share @ [result.energy.get(name, 0.0) for result in results]) for name in terms
    }


def _notes(design: Mesh, results: Sequence[Result]) -> tuple[str, ...]:
    """Merge the components' notes; a note that all of them have appears once."""
    out = []
    if results[0].flat is not None:
        out.append(f"the {len(results)} components are laid out side by side")
        if not design.used.all():
            out.append("vertices that belong to no face are at the pattern's origin")
    said: dict[str, list[int]] = {}
    bad = worst_status(r.status for r in results)
    for k, result in enumerate(results):
        for note in dict.fromkeys(result.notes):
            said.setdefault(note, []).append(k)
        said.setdefault(f"solved by {result.formulation!r}", []).append(k)
        if result.status is bad:
            said.setdefault(str(bad), []).append(k)
    for note, who in said.items():
        if len(who) < len(results):
            numbers = ", ".join(map(str, who[:_NAMED])) + (" ..." if len(who) > _NAMED else "")
            out.append(f"component{'s' if len(who) > 1 else ''} {numbers}: {note}")
        elif note not in (str(bad), f"solved by {results[0].formulation!r}"):
            out.append(note)
    if any(r.spline is not None for r in results):
        out.append("every component has a spline of its own: result.components[k].spline")
    return tuple(out)


def _details(results: Sequence[Result], areas: Sequence[float]) -> dict[str, object]:
    """Merge details: means of floats, equal other values, each constraint's largest violation."""
    out: dict[str, object] = {}
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
