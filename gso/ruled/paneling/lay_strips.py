"""Strips of a design: what is asked for, read and checked."""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from dataclasses import replace

from numpy.typing import ArrayLike

from gso.constraints import Constraint
from gso.cut_pieces import Pieces
from gso.errors import ConvergenceWarning, OptionError
from gso.mesh import Mesh
from gso.pipeline.judgement import warning
from gso.quantities import Length, Strain, as_length, as_sheet, as_strain
from gso.result import Result
from gso.ruled.paneling.along import Along
from gso.ruled.paneling.given_design import design_of
from gso.ruled.paneling.options import MOST, Options
from gso.ruled.paneling.strip_ways import StripsTask
from gso.ruled.paneling.strips_request import StripsRequest, own_names
from gso.seams.edge_prices import Avoid, Follow, edges_to_follow, faces_to_avoid
from gso.seams.seam_request import SeamRequest
from gso.solver import Callback
from gso.tasks import Limits
from gso.tasks.start import Start
from gso.typing import Ints, Keywords, MeshLike


def strips(
    mesh: MeshLike | Pieces,
    *,
    strips: int | str | None = None,
    max_deviation: Length | None = None,
    max_strain: Strain | None = None,
    max_strips: int = MOST,
    max_crease: float | None = None,
    min_radius: Length | None = None,
    flats: bool | None = None,
    rulings: int | None = None,
    options: str | Options = "balanced",
    constraints: Sequence[Constraint] = (),
    sheet: tuple[Length, Length] | None = None,
    along: str | ArrayLike | None = None,
    max_pieces: int | None = None,
    min_neck: Length | None = None,
    min_size: Length | None = None,
    symmetric: bool = False,
    seams_along: Follow | None = None,
    avoid: Avoid | None = None,
    effort: str = "standard",
    unit: str = "mm",
    x0: MeshLike | Start | None = None,
    workers: int | None = 0,
    callback: Callback | None = None,
    verdict: bool = True,
) -> Result:
    """Make strips of planar faces near a design: exactly developable, with straight bend lines.

    A design that is flat or developable as it is, within `max_strain`, is kept: its own rulings and
    folds are the lines to bend along, and its parts are the strips. Constraints, `x0`, `max_crease`
    and a number of strips rule that out. Without `max_deviation` it takes folds, and a design that
    does not close around.

    Otherwise the design is tried as one surface, with as few strips side by side as hold
    `max_deviation`. Strips along lines are tried, too, which may close around: the lines of a quad
    mesh, or of a grid laid over a disk or a tube. Windows and other holes are cut out of strips of
    the design without them, and of a dome out of rings. Where neither holds it, the design is cut
    into pieces without darts, which become developable together, and are divided by rulings
    between shared points of their seams. Where that does not hold the limits, each piece becomes
    strips that follow it. With a sheet, strips that are too long are divided across, but for those
    whose rulings branch. The result that holds the limits is returned, or else the closest.

    Parameters
    ----------
    mesh : Mesh, array (H, W, 3), (vertices, faces), trimesh.Trimesh, path, or Pieces
        The design, one surface, in any unit of length. Pieces that :func:`gso.cut` made stay: each
        of them becomes strips. Those that :func:`gso.pieces` found are used where the whole
        surface does not hold the limits; their darts are not.
    strips : int, "auto" or None
        Number of strips side by side, which share creases and are separate parts of the pattern:
        of the whole surface, or of each piece that was given. "auto": as few as hold
        `max_deviation` and `max_crease`. None: "auto" where there is such a limit, else 1.
    max_deviation : float or str, optional
        The largest distance between result and design, both ways: a number in the mesh's unit, or
        a text such as "5mm" or "0.5%" (of the diagonal of the bounding box). Without it the design
        is not cut.
    max_strain : float or str, optional
        Largest strain of pieces that no strips follow closely, such as 0.01 or "1%": they keep a
        pattern without bend lines. 0.1 % by default.
    max_strips : int
        Largest number of strips that "auto" tries.
    max_crease : float, optional
        Largest angle at a crease between strips, in degrees.
    min_radius : float or str, optional
        Smallest radius of the bends, as for `max_deviation`.
    flats : bool, optional
        Whether a single strip may branch at flat triangles.
    rulings : int, optional
        Number of rulings of a strip, 33 by default.
    options : str or RuledOptions
        "fast", "balanced", "accurate", or all settings in one record, which the keywords replace.
    constraints : sequence of Constraint
        `Fixed`, `FixedBoundary`, `Handle`, `Ruling` and one `SymmetryPlane`; with them a mesh is
        not cut. Those of a design in pieces are met by the solve that the strips follow.
    sheet : (float, float), optional
        Length and width of a sheet that every part must fit on, in millimetres, or texts such
        as "3m".
    along : {"x", "y", "z"}, array_like (3,) or (n, 3), optional
        What strips run along: a direction, or the points of a line, in the mesh's unit, that those
        nearby follow. Of the design's own lines, and those of a grid laid over it in this
        direction, the nearest are taken. The design is not cut. It takes a number of strips above
        one, or `max_deviation`.
    unit : {"mm", "um", "cm", "dm", "m", "in", "ft", "yd"}
        Unit of the coordinates.
    x0 : Mesh, array or Start, optional
        A surface near the design whose normals give first rulings too.
    workers : int, optional
        Number of processes for the strips of many pieces; one for each processor when None.
    callback : callable, optional
        Called with a :class:`gso.Progress` after each iteration; returning False stops the
        solve, and the strips so far are returned.
    verdict : bool
        Judge the result (:mod:`gso.verdict`).

    Returns
    -------
    Result
        `ruled` has the strips, `pattern` their exact unrolling, `rulings` the lines to bend along,
        ``details["strips"]`` their number, or that of each piece, and `pieces` the pieces if the
        design is in pieces. Where the callback ended the solve before there were strips, `ruled`
        is None.

    Raises
    ------
    MeshError
        The design cannot be used: it has several components, or it is closed, or has a handle,
        and may not be cut.
    OptionError
        An option or constraint is wrong, or does not go with `along`; or seams of pieces are asked
        for, and the design is not cut into pieces that are to be found.

    Examples
    --------
    >>> import numpy as np, gso
    >>> t = np.linspace(0, np.pi / 2, 17)
    >>> arch = np.stack(np.broadcast_arrays(np.cos(t), np.sin(t), 2 * t[:, None]), axis=-1)
    >>> result = gso.strips(arch, max_deviation=0.02)
    >>> result.usable, result.ruled.strips, round(result.metrics["strain_max"], 9)
    (True, 1, 0.0)
    """
    design = design_of(mesh)
    diagonal = design.diagonal

    def length(value: Length | None, name: str) -> float | None:
        return None if value is None else as_length(value, name, diagonal=diagonal, unit=unit)

    named: Keywords = {
        "strips": strips,
        "max_strips": None if max_strips == MOST else max_strips,
        "max_crease": max_crease,
        "min_radius": length(min_radius, "min_radius"),
        "flats": flats,
        "rulings": rulings,
    }
    given = {name: value for name, value in named.items() if value is not None}
    request = StripsRequest(
        replace(Options.coerce(options), **given),
        Limits(
            length(max_deviation, "max_deviation"),
            None if max_strain is None else as_strain(max_strain, "max_strain"),
        ),
        as_sheet(sheet, unit),
        constraints=constraints,
        along=Along.of(along),
        seams=SeamRequest(
            max_pieces,
            length(min_neck, "min_neck"),
            length(min_size, "min_size"),
            symmetric,
            effort,
            _named_along(design, seams_along),
            faces_to_avoid(design, avoid),
        ),
        start=x0 if isinstance(x0, Start) else Start(x0),
        verdict=verdict,
        workers=workers,
        callback=callback,
    )
    if request.along is not None:
        alone = request.options.number == 1 or (
            request.options.number is None and request.max_deviation is None
        )
        barred = request.constraints or not request.options.lines or isinstance(mesh, Pieces)
        if alone or barred:
            raise OptionError(
                "along takes strips=2 or more, or max_deviation, a design that is not in pieces, "
                "no constraints, and not lines=False"
            )
    wanted = request.seams.preferences
    if wanted and (isinstance(mesh, Pieces) or not request.may_be_cut):
        raise OptionError(
            f"{own_names(wanted)[0]} is about seams that are searched for: it "
            "takes a design that is not in pieces, and max_deviation, but no number of strips, "
            "no flats, no constraints, and no direction (along)"
        )
    result = lay_strips(mesh, request)
    if said := warning(result):
        warnings.warn(said, ConvergenceWarning, stacklevel=2)
    return result


def _named_along(design: Mesh, given: Follow | None) -> Ints:
    """Return the edges that seams should follow; errors name the option of strips."""
    try:
        return edges_to_follow(design, given)
    except OptionError as error:
        raise OptionError(f"seams_{error}") from None


def lay_strips(given: MeshLike | Pieces, request: StripsRequest) -> Result:
    """Make strips near a design, or near pieces of it; see :func:`strips`."""
    clock = time.perf_counter()
    task = StripsTask.of(given, request)
    result = task.solved()
    result.seconds["total"] = time.perf_counter() - clock
    return result
