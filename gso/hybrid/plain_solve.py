"""The solves that warm starts are made and measured for."""

from __future__ import annotations

from gso.cut_pieces import Pieces
from gso.mesh import Mesh
from gso.ruled.paneling.options import RULED
from gso.tasks.developable import Options
from gso.tasks.options import Options as BaseOptions
from gso.tasks.request import Request
from gso.tno import check
from gso.typing import Keywords

#: Arguments of :func:`gso.tno.optimize` that do not depend on the mesh.
_ASKED = ("formulation", "options", "max_deviation", "max_strain", "target_curvature", "terms")
#: Vertices along the longer side of a grid from which on iterations on the finest grids take nearly
#: all of the time. Solves for offsets along normals gain nothing from nets there, and others can
#: afford to solve a coarser copy from two starts.
LARGE = 256
#: Kinds of unknowns of such solves.
_VARIABLES = ("normal", "free")


def checked_request(task: str, keywords: Keywords) -> Request[BaseOptions]:
    """Check what a solve is asked for, as far as that does not depend on the mesh.

    Raises
    ------
    OptionError, BackendError
        As :func:`gso.tno.check`.
    """
    return check(task, **{name: keywords[name] for name in _ASKED if name in keywords})


def without_gain(design: Mesh | Pieces, task: str, keywords: Keywords) -> str:
    """Say why no warm start is made for a solve, whatever the design's shape; empty if one is.

    ``python bench/run_all.py --only hybrid.elsewhere`` prints the measurements.
    """
    if isinstance(design, Pieces):
        return "for designs cut into pieces, nets were not found to help"
    request = checked_request(task, keywords)
    if request.formulation == RULED:
        return "for strips, nets were not found to help"
    if request.limits.max_deviation is not None:
        return "within max_deviation, nets were not found to help"
    return ""


def plain_options(design: Mesh, task: str, keywords: Keywords) -> Options | None:
    """Return the settings of a developable solve of a grid by curvature, without limits.

    None for other solves: by other formulations, of other meshes, under constraints, or for the
    control points of splines.
    """
    request = checked_request(task, keywords)
    options = request.options
    if not isinstance(options, Options) or options.variables not in _VARIABLES:
        return None
    if design.grid_index is None or request.limits.given or keywords.get("constraints"):
        return None
    return options


def large_grid(design: Mesh, task: str, keywords: Keywords) -> bool:
    """Return whether a solve as of :func:`plain_options` is of a grid too large to gain by nets."""
    if design.grid_shape is None or max(design.grid_shape) < LARGE:
        return False
    options = plain_options(design, task, keywords)
    return options is not None and options.variables == "normal"
