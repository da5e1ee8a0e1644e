"""The ways to make strips of a design, and which of the results is best."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import islice

import numpy as np

from gso.cut_pieces import Pieces
from gso.errors import GSOError, MeshError
from gso.exact import keeps_rows
from gso.mesh import Mesh
from gso.pipeline.judgement import add_reasons, violation_of
from gso.recognition import fold_triangles
from gso.result import Result, StripsResult
from gso.ruled.lines import LineStrips
from gso.ruled.paneling.exact_strips import exact_strips
from gso.ruled.paneling.filled_strips import filled_strips
from gso.ruled.paneling.given_design import design_of, without_darts
from gso.ruled.paneling.light_design import LightDesign
from gso.ruled.paneling.options import Options
from gso.ruled.paneling.piece_strips import found_pieces, of_found, of_pieces
from gso.ruled.paneling.ring_strips import ring_strips
from gso.ruled.paneling.sheet_strips import (
    against_parts,
    against_sheet,
    divided,
    longest_ruling,
    on_sheets,
)
from gso.ruled.paneling.shop_notes import shop_notes
from gso.ruled.paneling.strips_request import StripsRequest, own_names
from gso.ruled.paneling.surface_strips import (
    along_lines,
    case_of,
    check_connected,
    check_whole,
    is_whole,
    lines_of,
    of_surface,
    unaligned,
    unsolved,
)
from gso.ruled.paneling.tried_strips import FOLDED, Tried
from gso.seams import Edges, Segmentation, cut
from gso.seams.crease_lines import faces_between
from gso.seams.seam_request import without_seams
from gso.typing import Ints, MeshLike
from gso.verdict import Reason, crosses_itself, judge, ordered

#: Share of the predicted distance that strips along lines may have.
_FAR = 0.6
#: Number of strips from which those along lines are nearer than others.
_MANY = 8
#: Number of strips, and distance over the predicted one, from which lines do not suit a design:
#: rulings across them twist, and pieces may be fewer.
_SEVERAL, _TWISTED = 6, 5.0
#: Largest number of features between creases that are tried as pieces.
_FEATURES = 23


@dataclass(frozen=True)
class StripsTask:
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
    def of(cls, given: MeshLike | Pieces, request: StripsRequest) -> StripsTask:
        """Read a design, or pieces of one."""
        design, fixed = design_of(given), True
        if not isinstance(given, Pieces):
            design.check_joined()
            return cls(design, request, None, not len(request.kept), request.kept)
        kept = None
        if isinstance(given, Segmentation):
            kept = given.kept
            # Its pieces were found, and the whole is better if it holds the limit.
            named = request.options.number is not None or len(given.kept) > 0
            fixed = named or request.max_deviation is None
            given = without_darts(given)
        if len(given) == 1 and is_whole(design):
            return cls(design, request, None, True, kept)
        return cls(design, request, given, not fixed, kept)

    @property
    def divisible(self) -> bool:
        """Whether pieces are tried where the whole does not hold the limits."""
        return self.division is not None or self.request.may_be_cut

    def solved(self) -> Result:
        """Return the whole or the pieces: what holds the limits, or else the closest."""
        asked = self.request
        if self.whole and not self.divisible:
            check_connected(self.design)
        tried = self._developable()
        if tried and (tried[0].holds or crosses_itself(tried[0].reasons)):
            return self._answer(tried)
        light = LightDesign.of(self.design, asked.max_deviation, named=asked.names_vertices)
        if self.whole:
            tried += self._ways_tried(light, tried)
            if tried and tried[-1].ended:
                return self._answer(tried)
            lines = self._lines
            if not tried and lines is not None and lines.stopped:
                return unsolved(self.design, self.request)
            if not tried and self.request.along is not None:
                raise MeshError(unaligned(lines, self.request.options.number))
            if not (tried or self.divisible):
                least, number = self._least, asked.options.number
                if number is not None and 1 < number < least:
                    raise MeshError(
                        f"{number} strips are too few: along the lines of this mesh there are "
                        f"{least} or more; ask for as many, or give max_deviation"
                    )
                check_whole(light.mesh)
            held = any(one.holds for one in tried)
            if not self.divisible or (held and not self._twisted(tried)):
                return self._answer(tried)
        if self.division is None:
            # Seams of a design that is not symmetric are not symmetric: nothing else will do.
            asked.seams.check_symmetric(light.mesh, light.allowed)
        failed: GSOError | None = None
        try:
            divisions = self._divisions(light, tried)
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

    def _ways_tried(self, light: LightDesign, before: Sequence[Tried] = ()) -> list[Tried]:
        """Try the ways to make strips of the whole design, one after the other."""
        found: list[Tried] = []
        for way in self._ways():
            found += way(light, [*before, *found])
            if found and found[-1].ended:
                break
        return found

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
        first = self._as_it_is, self._kept_smooth, self._in_rings, self._between_creases
        return *first, self._without_its_holes, *others

    @property
    def _many(self) -> bool:
        """Whether many strips are asked for by their number."""
        number = self.request.options.number
        return number is not None and number >= _MANY

    def _is_enough(self, one: Tried) -> bool:
        """Whether strips need not be compared with those of the design as a whole.

        Many along lines are far nearer, unless they are fewer than asked for: more were no nearer.
        """
        number = self.request.options.number or 0
        return one.is_close or (self._many and one.holds and one.strips >= number)

    @property
    def _counted(self) -> bool:
        """Whether as few strips are looked for as hold a distance."""
        asked = self.request
        return asked.options.number is None and asked.max_deviation is not None

    def _divisions(
        self, light: LightDesign, tried: Sequence[Tried]
    ) -> list[Callable[[Sequence[Tried]], Tried]]:
        """Return the ways to make strips of the pieces that are given, or that are found."""
        asked, given = self.request, self.division
        if given is not None:
            own = LightDesign(self.design, self.design, asked.max_deviation)
            return [lambda tried: self._judged_pieces(*of_pieces(own, asked, given))]
        # Pieces are one strip each at least.
        held = [one.strips for one in tried if one.holds]
        found = found_pieces(light, asked, min(held, default=None))
        if held and not found.usable:
            return []

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
        if not any(one.ended for one in tried):
            best = self._or_rows(best)
        if self.request.verdict:
            add_reasons(best.result, best.reasons)
        best.result.notes += shop_notes(best.result)
        if best.result.pieces is None and (wanted := self.request.seams.preferences):
            best.result.notes += (without_seams(own_names(wanted)),)
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
        if not (self.request.max_deviation or (folded and is_whole(self.design))):
            return []
        return [self._judged(result)]

    def _kept_smooth(self, light: LightDesign, tried: Sequence[Tried]) -> list[Tried]:
        """Return the design with its own rulings, if it is developable and whole.

        Its rulings are not along its lines. Where strips along lines are not wanted, neither are
        these: only strips between rulings have a smooth surface for CAD.
        """
        result = self._exact if self.request.options.lines else None
        if tried or result is None or not is_whole(self.design):
            return []
        return [self._judged(result)]

    def _between_creases(self, light: LightDesign, tried: Sequence[Tried]) -> list[Tried]:
        """Return one strip for each face of the design, if creases divide it into a few disks.

        Strips that run across creases are folded there. They are better only if they are far fewer.
        """
        asked = self.request
        if tried or not asked.may_be_cut or asked.seams.preferences:
            return []
        if self._lines is None and not is_whole(light.mesh):
            return []
        mesh, triangles = light.mesh, fold_triangles(light.mesh)
        if not np.array_equal(triangles, mesh.triangles):
            # Its sharp edges are diagonals of quads.
            mesh = Mesh(mesh.vertices, triangles)
        faces, bound = faces_between(mesh, most=_FEATURES), asked.max_deviation or 0.0
        if faces is None:
            return []
        if self._lines is not None:
            few = len(faces) // FOLDED
            if self._lines.cautious(few) * self.design.diagonal <= bound:
                return []
        asked.say("between its sharp edges")
        try:
            found = of_pieces(light, asked, faces, single=True)
        except GSOError:
            return []
        return [replace(self._judged_pieces(*found), creased=True)]

    def _in_rings(self, light: LightDesign, tried: Sequence[Tried]) -> list[Tried]:
        """Return a body of revolution in rings, if it is one whose number of strips is free."""
        asked, allowed = self.request, light.allowed
        if tried or not (self.divisible and asked.is_counted) or allowed is None:
            return []
        if asked.seams.preferences or asked.start.points is not None:
            return []
        if asked.options.flats or not asked.options.lines:
            return []
        made = ring_strips(light.mesh, allowed, asked)
        if made is None:
            return []
        undivided = light.whole(made, asked)
        result = on_sheets(undivided, asked, [])
        return [Tried(result, self._reasons(result, judge(result, asked.limits)), undivided)]

    def _without_its_holes(self, light: LightDesign, tried: Sequence[Tried]) -> list[Tried]:
        """Return strips of the design without its holes, from which these are cut."""
        asked = self.request
        free = self._counted and asked.options.lines and not asked.options.flats
        if any(one.holds for one in tried) or not free or asked.names_vertices:
            return []

        def ways(mesh: Mesh, request: StripsRequest, domed: bool) -> list[Tried]:
            own = StripsTask(mesh, request, None, True, self.kept)
            whole = LightDesign(mesh, mesh, request.max_deviation)
            return own._in_rings(whole, ()) if domed else own._ways_tried(whole)

        found = map(self._judged, filled_strips(light, asked, ways))
        return list(islice((one for one in found if one.holds or one.ended), 1))

    @cached_property
    def _exact(self) -> StripsResult | None:
        """The design as it is, if it is developable and may be kept."""
        return self._kept_as_it_is()

    def _kept_as_it_is(self, *, rows: bool = False) -> StripsResult | None:
        if self.kept is None or not self.request.may_keep_design:
            return None
        return exact_strips(self.design, self.request, self.kept, rows=rows)

    def _or_rows(self, best: Tried) -> Tried:
        """Return the best strips, or the design, if its rows of facets are cones and few."""
        if self._exact is not None or not self._counted:
            return best
        result = self._kept_as_it_is(rows=True)
        if result is None:
            return best
        own = self._judged(result)
        if own.holds and best.holds:
            return own if keeps_rows(own.strips, best.count) else best
        return min(best, own, key=lambda one: one.order(few=True))

    def _judged(self, result: StripsResult) -> Tried:
        return Tried(result, self._reasons(result, judge(result, self.request.limits)))

    def _reasons(self, result: Result, known: Sequence[Reason]) -> tuple[Reason, ...]:
        """Return all reasons against a result, of which those of its verdict are known."""
        # Where it may be divided, other strips within the distance may be parts that can be made.
        found = against_parts(result, self.request, slivers=self.divisible)
        return ordered([*known, *found])

    def _as_a_whole(self, light: LightDesign, tried: Sequence[Tried]) -> list[Tried]:
        asked = self.request
        if any(self._is_enough(one) for one in tried) or not is_whole(light.mesh):
            return []
        held = [one.fewer for one in tried if self._counted and one.holds]
        most = min([asked.options.max_strips, *held])
        if most < 1:
            return []
        asked = replace(asked, options=replace(asked.options, max_strips=most))
        asked.say("as a whole")

        def made(options: Options) -> Result:
            own = replace(asked, options=options)
            return light.whole(of_surface(light.mesh, own, light.allowed), own)

        result = made(asked.options)
        count, longest = result.details.get("strips", 0), longest_ruling(result)

        def narrow(widest: float, most: int | None) -> Result | None:
            more = max(int(np.ceil(count * longest / widest)), count + 1)
            # Strips with flat regions between them may be one part.
            limited = most is not None and not asked.options.flats and more > most
            if limited or more > asked.options.max_strips:
                return None
            return made(replace(asked.options, strips=more))

        undivided, result = result, on_sheets(result, asked, [narrow])
        clock = time.perf_counter()
        reasons: tuple[Reason, ...] = ()
        if asked.verdict or self.divisible:
            violation = violation_of(case_of(self.design, asked)) if asked.constraints else 0.0
            own = judge(result, asked.limits, violation)
            reasons = self._reasons(result, own)
        result.seconds["verdict"] = time.perf_counter() - clock
        return [Tried(result, reasons, undivided)]

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

    def _twisted(self, tried: Sequence[Tried]) -> bool:
        """Return whether strips are many, as the rulings across the lines of the design twist."""
        if self._lines is None or not self._counted:
            return False
        first = min(tried, key=lambda one: one.order(few=True))
        best = first.wide.ruled
        if first.creased or best is None or best.strips < _SEVERAL:
            return False
        return best.farthest > _TWISTED * self._lines.predicted(best.strips) * self.design.diagonal

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
                most = min(one.fewer, lines.most)
                if most < 1:
                    return []
                if _FAR * lines.predicted(most) > bound / self.design.diagonal:
                    return []
            elif one.is_near if self.divisible else one.is_close:
                return []
        asked.say("along its lines")
        return self._of_lines(lines, most)

    def _of_lines(self, lines: LineStrips, most: int | None) -> list[Tried]:
        asked = self.request

        def narrow(family: int, widest: float, most: int | None) -> Result | None:
            return along_lines(self.design, asked, lines, most=most, narrow=(family, widest))

        result = along_lines(self.design, asked, lines, most=most)
        if result is None:
            return []
        if asked.sheet is not None and against_sheet(result, asked):
            # Grids are mostly finer than the design: strips can be nearly as wide as sheets.
            lines.add_copies()
        families = range(len(lines.choices))
        undivided = result
        result = on_sheets(result, asked, [partial(narrow, k) for k in families])
        own = judge(result, asked.limits) if asked.verdict or self.divisible else ()
        return [Tried(result, self._reasons(result, own), undivided)]

    def _judged_pieces(self, result: Result, reasons: tuple[Reason, ...]) -> Tried:
        """Divide strips of pieces for the sheet, and judge them."""
        result = divided(result, self.request)
        return Tried(result, self._reasons(result, reasons))
