"""Lay a surface out in the plane with as little stretch as possible.

``strain`` minimises the membrane strain of all corner triangles: a sheet to cut.
``lengths`` minimises the published isometry defect of the cells, which is blind to some
shear: a figure to compare. Both start from an image without flips, and no step turns a
triangle over. Grids are solved coarse to fine.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gso import flat_start, limits
from gso import metrics as measure
from gso.mesh import Mesh
from gso.resample import coarser, resample
from gso.status import OptionError
from gso.tasks.base import Plan, Request, Stage, same
from gso.tasks.options import Options as BaseOptions
from gso.terms import Weighted, collapse, fairness, isometry, stretch
from gso.terms.losses import Absolute, Loss, Squared
from gso.topology import corner_triangles
from gso.variables import Layout, Variables, free

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

FORMULATIONS = ("strain", "lengths")

#: Strain below which a surface counts as developable: nothing is gained by telling
#: smaller strains apart.
_SMALLEST_LEVEL = 1e-7
_W = 3e-3
#: Relative fall of the energy at which a stage that only prepares another one stops.
_NEARLY = 1e-2
#: Root-mean-square strain above which the user is told to cut the surface.
_FAR_FROM_FLAT = 0.15


@dataclass(frozen=True)
class Options(BaseOptions):
    """Settings of the flatten task.

    Attributes
    ----------
    norm : {"mixed", "l2", "l1"}
        What strain costs. "l2": its square. "l1": its absolute value, for the smallest
        mean, at the price of a few large strains. "mixed": a power between them, and a
        steeper one for large strains, which lowers mean and peaks at once. For
        ``lengths``, "mixed" is the same as "l1".
    w_fairness : float or None
        Weight of the mean squared second derivative of the flat image, in units of the
        surface's unit ball; None takes 0 for ``strain`` and 1e-6 for ``lengths``, which
        needs some against drift between neighbouring vertices.
    eps : float
        Smoothing of the absolute value: relative to the typical strain of the surface for
        ``strain``, to the mean diagonal of the cells for ``lengths``.
    coarse_size : int
        Largest side of the coarsest grid.
    relax_iterations : int
        Local and global steps before the first stage.
    """

    PRESETS: ClassVar[dict[str, dict[str, Any]]] = {
        "fast": {"iterations": 1, "tolerance": 1e-3},
        "balanced": {},
        "accurate": {"iterations": 60, "tolerance": 1e-8},
    }

    iterations: int = 40
    tolerance: float = 5e-3
    norm: str = "mixed"
    w_fairness: float | None = None
    eps: float = 3e-4
    coarse_size: int = 40
    relax_iterations: int = 100

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.norm not in ("mixed", "l2", "l1"):
            raise OptionError(f"norm is {self.norm!r}; take 'mixed', 'l2' or 'l1'")
        if not self.eps > 0:
            raise OptionError(f"eps is {self.eps}; it must be positive")
        if self.coarse_size < 4:
            raise OptionError(f"coarse_size is {self.coarse_size}; it must be 4 or more")


def plan(request: Request) -> Plan:
    """Stages of the solve, from an image without flips to the one wanted."""
    mesh = request.mesh
    if not request.constraints.empty:
        raise OptionError("flatten keeps lengths, not positions: it takes no constraints")
    parts = _parts(mesh)
    notes = _remarks(mesh, parts)
    levels = [*_coarser(mesh, request.options), mesh]
    start = _start(levels[0], _parts(levels[0]), request.options)
    given = _given(request, notes)
    if start.level > _FAR_FROM_FLAT:
        notes.append(
            f"the surface is far from any plane (root-mean-square strain about {start.level:.0%}): "
            "cut it open, or cut it into pieces, for less"
        )
    if given is not None:
        levels = [mesh]
    stages = _stages(request, levels, max(start.level, _SMALLEST_LEVEL), warm=given is not None)
    return Plan(
        "flat",
        (start.flat if given is None else given).ravel(),
        stages,
        notes=notes,
        details={"strain_level": start.level},
        finish=partial(_place, mesh, parts, given),
    )


def _layout(mesh: Mesh) -> Layout:
    return Layout((("flat", len(mesh.vertices), 2),))


def _upward(mesh: Mesh) -> Ints:
    """Triangles that must not turn over: all corners of grid cells, else what carries strain."""
    if mesh.grid_index is not None:
        return corner_triangles(mesh.faces)
    return np.concatenate([corner_triangles(f) for f in stretch.pieces(mesh)])


def _flips(flat: Array, triangles: Ints) -> int:
    return int((measure.corner_areas(flat.reshape(-1, 2), triangles) <= 0).sum())


def _parts(mesh: Mesh) -> list[Ints]:
    """Vertices of each component; those of no face are left out."""
    used = mesh.half_edges.face_count > 0
    labels = mesh.components
    return [np.flatnonzero(labels == k) for k in np.unique(labels[used])]


def _remarks(mesh: Mesh, parts: list[Ints]) -> list[str]:
    notes = []
    if len(parts) > 1:
        notes.append(f"the {len(parts)} components are laid out side by side")
    if sum(map(len, parts)) < len(mesh.vertices):
        notes.append("vertices that belong to no face are at the pattern's origin")
    return notes


def _coarser(mesh: Mesh, options: Options) -> list[Mesh]:
    return coarser(mesh, options.coarse_size) if mesh.grid_index is not None else []


def _start(mesh: Mesh, parts: list[Ints], options: Options) -> flat_start.Relaxed:
    """An image without flips and the strain it has, all components at once."""
    carrying = np.concatenate([corner_triangles(f) for f in stretch.pieces(mesh)])
    flat = np.zeros((len(mesh.vertices), 2))
    if mesh.grid is not None:
        flat = flat_start.rectangle(mesh.grid).reshape(-1, 2)
    else:
        for ids in parts:
            local = np.full(len(mesh.vertices), -1)
            local[ids] = np.arange(len(ids))
            faces = mesh.faces[local[mesh.faces[:, 0]] >= 0]
            flat[ids] = flat_start.embed(
                Mesh(mesh.vertices[ids], np.where(faces < 0, -1, local[faces])),
                local[carrying[local[carrying[:, 0]] >= 0]],
            )
    return flat_start.relax(
        mesh.vertices, carrying, flat, iterations=options.relax_iterations, tolerance=1e-3
    )


def _given(request: Request, notes: list[str]) -> Array | None:
    """The user's start, unless it has flips."""
    if request.start is None:
        return None
    flat = request.start[:, :2]
    flips = _flips(flat, _upward(request.mesh))
    if flips:
        notes.append(f"x0 turns {flips} corner triangles over and was not used")
        return None
    return flat


def _stages(request: Request, levels: list[Mesh], level: float, *, warm: bool) -> list[Stage]:
    """Coarse to fine; the last stage is on the mesh itself."""
    options = request.options
    strain = [_strain_stage(options, m, level, first=m is levels[0]) for m in levels]
    for below, above, stage in zip(levels, levels[1:], strain[1:], strict=False):
        stage.enter = partial(_refined, below, above)
    last = strain[-1]
    if request.formulation == "lengths":
        # The lengths need an image that is nearly right, not one that is exact.
        last.tolerance = _NEARLY
        last = _length_stage(options, levels[-1])
        strain.append(last)
    elif options.norm == "l1":
        last.tolerance = _NEARLY
        last = replace(last, items=_strain_items(options, levels[-1], level, "l1"), enter=same)
        strain.append(last)
    last.iterations, last.tolerance = options.iterations, options.tolerance
    return [last] if warm else strain


def _strain_stage(options: Options, mesh: Mesh, level: float, *, first: bool) -> Stage:
    norm = "mixed" if options.norm == "l1" else options.norm
    items = _strain_items(options, mesh, level, norm)
    return _stage("strain", mesh, items, iterations=12 if first else 6, tolerance=_NEARLY)


def _strain_items(options: Options, mesh: Mesh, level: float, norm: str) -> list[Weighted]:
    loss: Loss = Squared()
    if norm == "l1":
        loss = stretch.Spread(level, p=1.0, peak=0.0, eps=options.eps)
    elif norm == "mixed":
        loss = stretch.Spread(level)
    return [Weighted(t, 1.0, loss) for t in stretch.build(mesh)] + _smooth(
        mesh, options.w_fairness or 0.0
    )


def _length_stage(options: Options, mesh: Mesh) -> Stage:
    terms = isometry.build(mesh)
    smooth = _smooth(mesh, 1e-6 if options.w_fairness is None else options.w_fairness)
    smooth += [Weighted(t, _W) for t in collapse.build(mesh)]
    if options.norm == "l2":
        return _stage("lengths", mesh, [*(Weighted(t, 1.0) for t in terms), *smooth])
    size = isometry.typical_length(mesh)
    eps = options.eps * size
    items = [Weighted(t, size, Absolute(eps)) for t in terms]
    stage = _stage("lengths", mesh, [*items, *smooth])
    stage.eps, stage.robust = (10.0 * eps, eps), "isometry"
    return stage


def _smooth(mesh: Mesh, weight: float) -> list[Weighted]:
    return [Weighted(fairness.build(mesh, block="flat"), weight)] if weight > 0 else []


def _stage(
    name: str, mesh: Mesh, items: list[Weighted], *, iterations: int = 0, tolerance: float = 0.0
) -> Stage:
    layout = _layout(mesh)
    return Stage(
        name,
        layout,
        items,
        partial(_unknowns, layout),
        iterations=iterations,
        tolerance=tolerance,
        limits=[limits.orientation(_upward(mesh), layout)],
    )


def _unknowns(layout: Layout, coordinates: Array) -> Variables:
    return free(layout)


def _refined(coarse: Mesh, fine: Mesh, coordinates: Array) -> Array:
    """Image of a coarse grid interpolated to a finer one, or its rectangle if that flips."""
    height, width = fine.grid_shape  # type: ignore[misc]
    image = coordinates.reshape(*coarse.grid_shape, 2)  # type: ignore[misc]
    flat = resample(image, height, width)
    if _flips(flat, _upward(fine)):
        flat = flat_start.rectangle(fine.grid)
    return flat.ravel()


def _place(mesh: Mesh, parts: list[Ints], given: Array | None, coordinates: Array) -> Array:
    """The image where it is wanted.

    Close to the user's start; or, standing on the x axis from the origin on, turned like
    Flatten-init on grids and with the long axis along x otherwise, components side by side.
    """
    flat = coordinates.reshape(-1, 2)
    used = np.concatenate(parts)
    out = np.zeros_like(flat)
    if given is not None:
        out[used] = flat_start.closest_motion(flat[used], given[used])
    elif mesh.grid is not None:
        target = flat_start.rectangle(mesh.grid).reshape(-1, 2)
        out = flat_start.beside([flat_start.closest_motion(flat, target)])[0]
    else:
        placed = flat_start.beside([flat_start.upright(flat[ids]) for ids in parts])
        out[used] = np.concatenate(placed)
    return out.ravel()


def metrics(mesh: Mesh, flat: Array) -> dict[str, float]:
    """Metrics of a flat image (n, 2); meaning and unit stand in :data:`gso.metrics.INFO`."""
    strain = measure.principal_strains(mesh, flat)
    grid = mesh.grid_index
    flipped = measure.flipped_cells(flat, mesh.faces) if grid is None else None
    return {
        "loss_iso_cell": measure.loss_iso_cell(mesh, flat),
        "edge_length_error": measure.edge_length_error(mesh, flat),
        "strain_mean": strain.mean,
        "strain_p99": strain.p99,
        "strain_max": float(strain.values.max()),
        "flipped_cells": measure.flipped_cells(flat[grid]) if flipped is None else flipped,
        "area_error": measure.area_error(mesh, flat),
    }
