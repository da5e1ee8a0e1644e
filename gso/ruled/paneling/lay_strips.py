"""Strips of a design: as a whole, and where that does not hold the limits, in pieces."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import ArrayLike

from gso.constraints import Constraint
from gso.cut_pieces import Pieces
from gso.errors import ConvergenceWarning, GSOError, MeshError, OptionError
from gso.io import as_mesh
from gso.mesh import Mesh
from gso.pipeline.judgement import add_reasons, violation_of, warning
from gso.quantities import Length, Strain, as_length, as_sheet, as_strain
from gso.result import Result, StripsResult
from gso.ruled.lines import LineStrips
from gso.ruled.paneling.along import Along
from gso.ruled.paneling.exact_strips import exact_strips
from gso.ruled.paneling.light_design import LightDesign
from gso.ruled.paneling.options import MOST, Options
from gso.ruled.paneling.piece_strips import found_pieces, of_found, of_pieces
from gso.ruled.paneling.sheet_strips import (
    against_parts,
    against_sheet,
    divided,
    longest_ruling,
    on_sheets,
)
from gso.ruled.paneling.shop_notes import shop_notes
from gso.ruled.paneling.strips_request import StripsRequest
from gso.ruled.paneling.surface_strips import (
    along_lines,
    case_of,
    check_whole,
    lines_of,
    of_surface,
    unsolved,
)
from gso.ruled.paneling.tried_strips import Tried
from gso.seams import Edges, Segmentation, cut
from gso.seams.edge_prices import Avoid, Follow, edges_to_follow, faces_to_avoid
from gso.seams.seam_request import SeamRequest, without_seams
from gso.solver import Callback
from gso.tasks import Limits
from gso.tasks.start import Start
from gso.typing import Ints, Keywords, MeshLike
from gso.verdict import Reason, crosses_itself, judge, ordered


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
    mesh, or of a grid laid over a disk or a tube. Where neither holds it, the design is cut into
    pieces without darts, which become developable together, and are divided by rulings between
    shared points of their seams. Where that does not hold the limits, each piece becomes strips
    that follow it. With a sheet, strips that are too long are divided across, but for those whose
    rulings branch. The result that holds the limits is returned, or else the closest.

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
    design = _read(mesh)
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
            f"{_own_names(wanted)[0]} is about seams that are searched for: it "
            "takes a design that is not in pieces, and max_deviation, but no number of strips, "
            "no flats, no constraints, and no direction (along)"
        )
    result = lay_strips(mesh, request)
    if said := warning(result):
        warnings.warn(said, ConvergenceWarning, stacklevel=2)
    return result


def _own_names(preferences: Sequence[str]) -> list[str]:
    """Return the names that preferences of the search for pieces have here."""
    return ["seams_along" if name == "along" else name for name in preferences]


def _named_along(design: Mesh, given: Follow | None) -> Ints:
    """Return the edges that seams should follow; errors name the option of strips."""
    try:
        return edges_to_follow(design, given)
    except OptionError as error:
        raise OptionError(f"seams_{error}") from None


def lay_strips(given: MeshLike | Pieces, request: StripsRequest) -> Result:
    """Make strips near a design, or near pieces of it; see :func:`strips`."""
    clock = time.perf_counter()
    task = _Task.of(given, request)
    result = task.solved()
    result.seconds["total"] = time.perf_counter() - clock
    return result


#: Share of the predicted distance that strips along lines may have.
_FAR = 0.6
#: Number of strips from which those along lines are nearer than others.
_MANY = 8


@dataclass(frozen=True)
class _Task:
    """A design, what was asked of its strips, and how it may be divided.

    Attributes
    ----------
    design : Mesh
    request : StripsRequest
    division : Pieces or None
        The pieces that it is divided into; None where they are to be found.
    whole : bool
        Whether it is tried as one surface.
    kept : ndarray of int, (k, 2), or None
        Edges that are cut in any case; None where all pieces are given.
    """

    design: Mesh
    request: StripsRequest
    division: Pieces | None
    whole: bool
    kept: Ints | None = None

    @classmethod
    def of(cls, given: MeshLike | Pieces, request: StripsRequest) -> _Task:
        """Read a design, or pieces of one."""
        design, fixed = _read(given), True
        if not isinstance(given, Pieces):
            design.check_joined()
            return cls(design, request, None, not len(request.kept), request.kept)
        kept = None
        if isinstance(given, Segmentation):
            kept = given.kept
            # Its pieces were found, and the whole is better if it holds the limit.
            named = request.options.number is not None or len(given.kept) > 0
            fixed = named or request.max_deviation is None
            given = _without_darts(given)
        if len(given) == 1 and _is_whole(design):
            return cls(design, request, None, True, kept)
        return cls(design, request, given, not fixed, kept)

    @property
    def divisible(self) -> bool:
        """Whether pieces are tried where the whole does not hold the limits."""
        return self.division is not None or self.request.may_be_cut

    def solved(self) -> Result:
        """Return the whole or the pieces: what holds the limits, or else the closest."""
        asked = self.request
        tried = self._developable()
        if tried and (tried[0].holds or crosses_itself(tried[0].reasons)):
            return self._answer(tried)
        light = LightDesign.of(self.design, asked.max_deviation, named=asked.names_vertices)
        if self.whole:
            for way in self._ways():
                tried += way(light, tried)
                if tried and tried[-1].ended:
                    return self._answer(tried)
            lines = self._lines
            if not tried and lines is not None and lines.stopped:
                return unsolved(self.design, self.request)
            if not tried and self.request.along is not None:
                raise MeshError(_unaligned(lines, self.request.options.number))
            if not (tried or self.divisible):
                least, number = self._least, asked.options.number
                if number is not None and 1 < number < least:
                    raise MeshError(
                        f"{number} strips are too few: along the lines of this mesh there are "
                        f"{least} or more; ask for as many, or give max_deviation"
                    )
                check_whole(light.mesh)
            if not self.divisible or any(one.holds for one in tried):
                return self._answer(tried)
        if self.division is None:
            # Seams of a design that is not symmetric are not symmetric: nothing else will do.
            asked.seams.check_symmetric(light.mesh, light.allowed)
        failed: GSOError | None = None
        try:
            divisions = self._divisions(light)
        except GSOError as error:
            divisions, failed = [], error
        for in_pieces in divisions:
            try:
                tried.append(in_pieces(tried))
            except GSOError as error:
                failed = error
            else:
                if tried[-1].ended:
                    break
        if failed is not None and not tried:
            raise failed
        return self._answer(tried)

    def _ways(self) -> tuple[Callable[[LightDesign, Sequence[Tried]], list[Tried]], ...]:
        """Return the ways to make strips of the whole design, in order.

        Many strips along lines are far nearer than others, which are tried only where those along
        lines fail. Where a number is looked for, others are tried if they may be fewer.
        """
        if self.request.along is not None:
            return (self._along_lines,)
        if self._many or self._counted:
            others = self._along_lines, self._as_a_whole
        else:
            others = self._as_a_whole, self._along_lines
        return self._as_it_is, self._kept_smooth, *others

    @property
    def _many(self) -> bool:
        """Whether many strips are asked for by their number."""
        number = self.request.options.number
        return number is not None and number >= _MANY

    @property
    def _counted(self) -> bool:
        """Whether as few strips are looked for as hold a distance."""
        asked = self.request
        return asked.options.number is None and asked.max_deviation is not None

    def _divisions(self, light: LightDesign) -> list[Callable[[Sequence[Tried]], Tried]]:
        """Return the ways to make strips of the pieces that are given, or that are found."""
        asked, given = self.request, self.division
        if given is not None:
            own = LightDesign(self.design, self.design, asked.max_deviation)
            return [lambda tried: self._judged_pieces(*of_pieces(own, asked, given))]
        found = found_pieces(light, asked)

        def as_found(tried: Sequence[Tried]) -> Tried:
            return self._judged_pieces(*of_found(light, asked, found))

        def nearer(tried: Sequence[Tried]) -> Tried:
            # The search may use all of its distance, and other shapes of its pieces be nearer.
            division = cut(found.unchanged, Edges(found.edges))
            single = any(one.holds for one in tried)
            return self._judged_pieces(*of_pieces(light, asked, division, single=single))

        return [nearer] if found.result is None else [as_found, nearer]

    def _answer(self, tried: Sequence[Tried]) -> Result:
        few = self.request.options.number is None
        best = min(tried, key=lambda one: one.order(few=few))
        if self.request.verdict:
            add_reasons(best.result, best.reasons)
        best.result.notes += shop_notes(best.result)
        if best.result.pieces is None and (wanted := self.request.seams.preferences):
            best.result.notes += (without_seams(_own_names(wanted)),)
        return best.result

    def _developable(self) -> list[Tried]:
        """Return the design, if it is developable and its pieces were not given.

        Without a largest distance only designs with folds are kept at once, and none is opened
        that closes around.
        """
        result = self._exact
        if result is None:
            return []
        folded = bool((result.ruled.rulings.radii == 0).any())
        if not (self.request.max_deviation or (folded and _is_whole(self.design))):
            return []
        return [self._judged(result)]

    def _kept_smooth(self, light: LightDesign, tried: Sequence[Tried]) -> list[Tried]:
        """Return the design with its own rulings, if it is developable and whole.

        Its rulings are not along its lines. Where strips along lines are not wanted, neither are
        these: only strips between rulings have a smooth surface for CAD.
        """
        result = self._exact if self.request.options.lines else None
        if tried or result is None or not _is_whole(self.design):
            return []
        return [self._judged(result)]

    @cached_property
    def _exact(self) -> StripsResult | None:
        """The design as it is, if it is developable and may be kept."""
        if self.kept is None or not self.request.may_keep_design:
            return None
        return exact_strips(self.design, self.request, self.kept)

    def _judged(self, result: StripsResult) -> Tried:
        reasons = judge(result, self.request.limits)
        return Tried(result, ordered([*reasons, *against_parts(result, self.request)]))

    def _as_a_whole(self, light: LightDesign, tried: Sequence[Tried]) -> list[Tried]:
        asked = self.request
        enough = any(one.is_close or (self._many and one.holds) for one in tried)
        if enough or not _is_whole(light.mesh):
            return []
        held = [one.strips for one in tried if self._counted and one.holds]
        most = min([asked.options.max_strips, *(count - 1 for count in held)])
        if most < 1:
            return []
        asked = replace(asked, options=replace(asked.options, max_strips=most))
        asked.say("as a whole")

        def made(options: Options) -> Result:
            own = replace(asked, options=options)
            return light.whole(of_surface(light.mesh, own, light.allowed), own)

        result = made(asked.options)
        count, longest = result.details.get("strips", 0), longest_ruling(result)

        def narrow(widest: float) -> Result | None:
            more = max(int(np.ceil(count * longest / widest)), count + 1)
            if more > asked.options.max_strips:
                return None
            return made(replace(asked.options, strips=more))

        result = on_sheets(result, asked, [narrow])
        clock = time.perf_counter()
        reasons: tuple[Reason, ...] = ()
        if asked.verdict or self.divisible:
            violation = violation_of(case_of(self.design, asked)) if asked.constraints else 0.0
            own = judge(result, asked.limits, violation)
            reasons = ordered([*own, *against_parts(result, asked)])
        result.seconds["verdict"] = time.perf_counter() - clock
        return [Tried(result, reasons)]

    @cached_property
    def _lines(self) -> LineStrips | None:
        """The strips along lines of the design or of a grid laid over it, if there are any."""
        design, asked = self.design, self.request
        allowed = asked.options.lines and not asked.constraints
        # A single strip has its rulings along lines of quads only.
        allowed = allowed and not (asked.options.number == 1 and design.has_triangles)
        if not allowed or len(np.unique(design.components[design.used])) > 1:
            return None
        return lines_of(design, asked)

    @property
    def _least(self) -> int:
        """The smallest number of strips along lines; 0 where there are none."""
        return 0 if self._lines is None else self._lines.least

    def _as_it_is(self, light: LightDesign, tried: Sequence[Tried]) -> list[Tried]:
        """Return strips that are the design itself, if there are any along its lines."""
        if self._lines is None or self.design.has_triangles:
            return []
        return self._of_lines(self._lines, 0)

    def _along_lines(self, light: LightDesign, tried: Sequence[Tried]) -> list[Tried]:
        """Return strips along lines, if they may be better than the others."""
        lines, asked, most = self._lines, self.request, None
        if lines is None:
            return []
        for one in tried:
            surface, bound = one.result.ruled, asked.max_deviation
            if one.holds and surface is not None and bound is not None and self.divisible:
                most = min(surface.strips - 1, lines.most)
                if _FAR * lines.predicted(most) > bound / self.design.diagonal:
                    return []
            elif one.is_near if self.divisible else one.is_close:
                return []
        asked.say("along its lines")
        return self._of_lines(lines, most)

    def _of_lines(self, lines: LineStrips, most: int | None) -> list[Tried]:
        asked = self.request

        def narrow(family: int, widest: float) -> Result | None:
            return along_lines(self.design, asked, lines, narrow=(family, widest))

        result = along_lines(self.design, asked, lines, most=most)
        if result is None:
            return []
        if asked.sheet is not None and against_sheet(result, asked):
            # Grids are mostly finer than the design: strips can be nearly as wide as sheets.
            lines.add_copies()
        families = range(len(lines.choices))
        result = on_sheets(result, asked, [partial(narrow, k) for k in families])
        own = judge(result, asked.limits) if asked.verdict or self.divisible else ()
        return [Tried(result, ordered([*own, *against_parts(result, asked)]))]

    def _judged_pieces(self, result: Result, reasons: tuple[Reason, ...]) -> Tried:
        """Divide strips of pieces for the sheet, and judge them."""
        result = divided(result, self.request)
        return Tried(result, ordered([*reasons, *against_parts(result, self.request)]))


def _unaligned(lines: LineStrips | None, number: int | None) -> str:
    """Return why no strips run along a direction."""
    if lines is not None and number is not None and not lines.least <= number <= lines.most:
        return (
            f"{number} strips are too {'few' if number < lines.least else 'many'} along the given "
            f"direction; ask for {lines.least} to {lines.most}"
        )
    return (
        "no strips run along the given direction: this takes one component of quads, or a disk or "
        "a tube; leave `along` out"
    )


def _read(given: MeshLike | Pieces) -> Mesh:
    """Return the design from which distances count."""
    if isinstance(given, Segmentation) and given.given is not None:
        return given.given
    return given.design if isinstance(given, Pieces) else as_mesh(given)


def _is_whole(mesh: Mesh) -> bool:
    """Tell whether a mesh is one surface that can be made of strips."""
    try:
        check_whole(mesh)
    except MeshError:
        return False
    return True


def _without_darts(found: Segmentation) -> Pieces:
    """Return pieces of the design as it was given, without darts where that leaves disks."""
    design, sides = found.unchanged, found.sides
    pieces = cut(design, Edges(found.edges[sides[:, 0] != sides[:, 1]]))
    # A seam within a piece may open a ring or a handle.
    whole = len(pieces) == 1 or all(piece.is_disk for piece in pieces)
    return pieces if whole else cut(design, Edges(found.edges))
