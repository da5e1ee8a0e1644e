"""A last stage whose unknowns are the control points of a B-spline surface."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from gso.errors import OptionError
from gso.mesh import Mesh
from gso.spline.fit import fitting_controls, grid_of
from gso.tasks.base import Analysis, Stage
from gso.tasks.developable.options import Options
from gso.tasks.request import Request
from gso.typing import Array
from gso.unknowns import Layout, Variables, spline_surface

if TYPE_CHECKING:
    from gso.tasks.developable.joint_isometry import Options as IsometryOptions


def controls(
    analysis: Analysis, request: Request[Options | IsometryOptions]
) -> tuple[int, int] | None:
    """Return the control points along both sides of the grid; None when no spline is wanted.

    Raises
    ------
    MeshError
        The mesh is not a grid.
    OptionError
        `max_deviation` or a hard constraint is set, which a spline with few control points
        cannot satisfy.
    """
    if request.options.variables != "surface":
        return None
    shape = grid_of(analysis.mesh).shape[:2]
    if request.max_displacement is not None:
        raise OptionError(
            "max_deviation cannot be kept with variables='surface'; leave it out, or solve with "
            "variables='normal' and give the result to gso.fit_spline"
        )
    compiled = analysis.constraints
    hard = [compiled.names[part.owner] for part in compiled.parts if part.hard]
    if hard:
        raise OptionError(
            f"{hard[0]} is hard, which variables='surface' cannot keep: its control points are "
            "fewer than the vertices; give a handle with a weight, or solve with other variables "
            "and give the result to gso.fit_spline"
        )
    return fitting_controls(request.options.controls, shape)


def stage(before: Stage, mesh: Mesh, wanted: tuple[int, int]) -> Stage:
    """Build the B-spline stage that follows one on the design's vertices, with its objective.

    The block "surface" becomes a B-spline surface, initially the one closest to the result of
    the stage before; other blocks stay free.
    """
    unknowns = spline_surface(before.layout, grid_of(mesh).shape[:2], wanted)
    return replace(
        before,
        name="surface",
        variables=lambda _: unknowns,
        enter=partial(_closest, unknowns),
        continuation=before.continuation[-1:],
        bounds=None,
    )


def closest(layout: Layout, mesh: Mesh, wanted: tuple[int, int], coordinates: Array) -> Array:
    """Return the coordinates of the B-spline surface closest to the given ones."""
    return _closest(spline_surface(layout, grid_of(mesh).shape[:2], wanted), coordinates)


def _closest(unknowns: Variables, coordinates: Array) -> Array:
    return unknowns.points(unknowns.project(coordinates))
