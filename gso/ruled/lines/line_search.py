"""Strips along lines of quad meshes, for one number of strips after the other."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from gso import faults, metrics
from gso.errors import MeshError
from gso.mesh import Mesh
from gso.ruled.lines.free_rulings import free_rulings, single
from gso.ruled.lines.line_choice import Choice
from gso.ruled.lines.line_families import families
from gso.ruled.lines.line_fit import FAIR, LineFitter
from gso.ruled.lines.line_surface import line_surface
from gso.ruled.lines.line_twist import alignment
from gso.ruled.lines.polygons import Polygons
from gso.ruled.lines.strip_cells import Cells
from gso.ruled.pleat_angles import sharpest_fold
from gso.ruled.sheet_division import without_overlaps
from gso.ruled.solve import Found, Wanted
from gso.typing import Array, Ints

#: Name of this way in results.
LINES = "lines"
#: Families that are tried, and the ratio of their rank to the smallest up to which.
_FAMILIES, _RATIO = 2, 2.0
#: Share of the best alignment with given directions from which on lines count as aligned.
_ALIGNED = 0.98
#: Ratio of ranks up to which both are tried in any case.
_ALIKE = 1.25
#: Share of the rank up to which the mean distance of sound strips is as good as can be expected.
_GOOD = 0.5
#: Share of the predicted distance up to which the mesh's own rulings give planar enough polygons.
_PLANAR = 0.2
#: Fairness of creases where strips are far away otherwise, and where they are just too far.
_NEARER, _LESS = 0.05, 0.2
#: Fairness of creases where strips are pleated otherwise.
_EVEN, _EVENER = 2.0, 10.0
#: Whether to take the other kind of rulings, and fairness, one after the other until strips have
#: no flaws and are near; half of them for the second family. The lists are for strips that are too
#: far away, just beyond the largest allowed distance, folded, and pleated.
_FIRST = (False, FAIR)
_IF_FAR = ((False, _NEARER), (True, FAIR), (True, _NEARER))
_IF_BEYOND = ((False, _LESS), (False, _NEARER), (True, FAIR), (True, _NEARER))
_IF_FOLDED = ((True, FAIR), (False, _NEARER), (True, _NEARER))
_IF_PLEATED = ((False, _EVEN), (True, _EVEN), (False, _EVENER))
_SETTINGS = 1 + len(_IF_BEYOND)
#: Ratio to the largest allowed distance up to which less fair creases may hold it.
_CLOSE = 1.3
#: Ratio to the distance that is predicted for half as many strips from which others are tried.
_WORSE = 3.0
#: Distance of samples from one another's surfaces at which strips are the mesh.
_SAME = 1e-7
#: Distance at which a mesh counts as developable as it is.
EXACT = 1e-5
#: Ratio of numbers of strips in the search for a bound, and largest number of solves.
_MORE, _SOLVES = 1.3, 10
#: Solves within the distance, in a row, whose strips are pleated and no less than before, after
#: which the search ends.
_PLEATED = 2
#: Fold at a bend in radians, beyond that of the design, of which a few more strips may have less,
#: and the share of it that these may have.
_SHARP, _GENTLER = float(np.radians(20.0)), 0.5
#: Solves without any sound strips after which the search ends.
_FOLDED = 3


class LineStrips:
    """Strips along lines of quad meshes, near a design whose diagonal is one.

    Parameters
    ----------
    mesh : Mesh
        The design. If it has quads only, strips may run along its own lines.
    tell : callable
        Told the number of strips before each solve; returning False ends the search.
    copies : callable
        Returns quad meshes with the same surface, along whose lines strips may run, too. They are
        made where the design's own lines are too few or their strips fail.
    along : callable, optional
        Returns unit directions (m, 3) at the faces of a mesh. Strips run only along the family of
        lines that is the nearest to them.

    Attributes
    ----------
    aligned : float
        Mean cosine of the angles between these lines and the directions; 1 without directions.
    """

    def __init__(
        self,
        mesh: Mesh,
        tell: Callable[[int], bool] = lambda count: True,
        copies: Callable[[], Sequence[Mesh]] = tuple,
        along: Callable[[Mesh], Array] | None = None,
    ):
        self.mesh, self.tell = mesh, tell
        self._copies = copies
        self.stopped = False
        self.results: dict[int, Found] = {}
        self._measured: set[int] = set()
        self.choices: list[Choice] = []
        self._fitters: list[LineFitter] = []
        self.aligned = 1.0
        self._add([mesh])
        if self.least != 1 or along is not None:
            self.add_copies()
        if along is not None:
            aligned = [alignment(c.family, along(c.family.mesh)) for c in self.choices]
            least = _ALIGNED * max(aligned, default=0.0)
            # The design's own lines come first.
            self.choices = [c for c, a in zip(self.choices, aligned, strict=True) if a >= least][:1]
            self.aligned = max(aligned, default=0.0)

    def _add(self, meshes: Sequence[Mesh]) -> None:
        """Add the families of lines of quad meshes."""
        for mesh in meshes:
            with contextlib.suppress(MeshError):
                self.choices += [Choice(family) for family in families(mesh)]

    def add_copies(self) -> bool:
        """Add the lines of copies, and return whether there are more lines now."""
        before, copies, self._copies = len(self.choices), self._copies, tuple
        with contextlib.suppress(MeshError):
            self._add(copies())
        return len(self.choices) > before

    @property
    def least(self) -> int:
        """The smallest number of strips; 0 where there are no lines."""
        return min((choice.least for choice in self.choices), default=0)

    @property
    def most(self) -> int:
        """The largest number of strips; 0 where there are no lines."""
        return max((choice.rows for choice in self.choices), default=0)

    def predicted(self, count: int) -> float:
        """Return the distance that is predicted for a number of strips."""
        found = (choice.lines(count) for choice in self.choices)
        return min((f[1] for f in found if f is not None), default=np.inf)

    def cautious(self, count: int) -> float:
        """Return the predicted distance, and more where rulings are not conjugate to the lines."""
        return min((choice.rank(count) for choice in self.choices), default=np.inf)

    def strips(self, count: int) -> Found | None:
        """Return the best strips of at most a number, which is solved for; None if there are none.

        More strips are never farther away: fewer that were solved before are returned where they
        are nearer. Half as many are solved for where the distance is much larger than predicted.
        """
        self._solve(count)
        known = [k for k in sorted(self.results, reverse=True) if k <= count]
        best = min(known, key=lambda k: _distance(self.results[k]), default=None)
        return None if best is None else self._certain(best)

    def narrow(
        self, number: int, widest: float, aim: float, most: int | None = None
    ) -> Found | None:
        """Return as few strips along a family of lines as are narrow enough, and near by forecast.

        Parameters
        ----------
        number : int
            Number of the family.
        widest : float
            Largest width of a strip.
        aim : float
            Largest distance that is predicted.
        most : int, optional
            Largest number of strips.

        Returns
        -------
        Found or None
            None if there are no lines so close together, or none that are near, or the search was
            ended.
        """
        choice = self.choices[number].narrower(widest)
        rows = 0 if self.stopped else choice.rows
        counts = range(1, 1 + (rows if most is None else min(most, rows)))
        every = (choice.lines(count) for count in counts)
        lines = next((found[0] for found in every if found is not None and found[1] <= aim), None)
        tried = [] if lines is None else self._settled(choice, lines, np.inf)
        best = min(tried, key=lambda found: found.order, default=None)
        return None if best is None else self._measure(best)

    def _solve(self, count: int, aim: float = np.inf) -> None:
        """Solve for a number of strips; their largest distance is that of samples.

        Strips that are no farther than `aim` come first.
        """
        if count in self.results or self.stopped:
            return
        half = max(count // 2, 1)
        limit = _WORSE * self.predicted(half)
        own = len(self.choices)
        tried = self._tried(count, limit, self.choices, aim)
        poor = all(_distance(found) > (0, limit) for found in tried)
        if poor and not self.stopped and self.add_copies():
            tried += self._tried(count, limit, self.choices[own:], aim)
        if tried:
            best = self.results[count] = min(
                tried,
                key=lambda one: (one.surface.flaws, one.surface.farthest > aim, one.order),
            )
            if half >= max(self.least, 2) and _distance(best) > (0, limit):
                self._solve(half)

    def _tried(
        self, count: int, limit: float, choices: Sequence[Choice], aim: float
    ) -> list[Found]:
        """Solve for strips along the best of some families of lines."""
        tried: list[Found] = []
        good, least = 0.0, np.inf
        for place, (choice, lines) in enumerate(_candidates(count, choices)):
            least = min(least, choice.rank(count))
            alike = choice.rank(count) <= _ALIKE * least
            done = (
                not one.surface.flaws and one.mean <= good and not _just_beyond(one, aim)
                for one in tried
            )
            if not alike and any(done):
                break
            tried += self._settled(choice, lines, limit, _SETTINGS >> place, aim)
            good = _GOOD * choice.rank(count)
        return tried

    def _settled(
        self,
        choice: Choice,
        lines: Ints,
        limit: float,
        most: int = _SETTINGS,
        aim: float = np.inf,
    ) -> list[Found]:
        """Solve for strips by one setting after the other, until they have no flaws and are near.

        Near is within `limit`, and not just beyond `aim`. Fairer creases have smaller pleats and
        larger distances, so that they are of no use where strips are pleated and far beyond `aim`.
        """
        tried: list[Found] = []
        settings = [_FIRST]
        for turn in range(most):
            if turn == len(settings):
                break
            found = self._solved(choice, lines, *settings[turn])
            if self.stopped:
                break
            flaws = 2 if found is None else found.surface.flaws
            beyond = found is not None and _just_beyond(found, aim)
            if turn == 0:
                near = _IF_BEYOND if beyond else _IF_FAR
                settings += (near, _IF_PLEATED, _IF_FOLDED)[flaws]
            if found is None:
                continue
            tried.append(found)
            far = found.surface.farthest
            hopeless = flaws == 1 and far > _CLOSE * aim
            if hopeless or (not flaws and not beyond and (turn > 0 or far <= limit)):
                break
        return tried

    def _certain(self, count: int) -> Found:
        """Return solved strips with the largest distance of all points."""
        found = self.results[count]
        # Samples do where strips are the mesh.
        if count not in self._measured and found.surface.farthest > _SAME:
            found = self.results[count] = self._measure(found)
        self._measured.add(count)
        return found

    def _measure(self, found: Found) -> Found:
        """Return strips with the largest distance of all points, from that of samples."""
        surface, far = found.surface, found.surface.deviation
        if far is not None:
            far = far._replace(
                there_max=metrics.farthest(surface.mesh, self.mesh, far.there_max),
                back_max=metrics.farthest(self.mesh, surface.mesh, far.back_max),
            )
        return replace(found, surface=replace(surface, deviation=far))

    def as_it_is(self, wanted: Wanted) -> Found | None:
        """Return strips that are the mesh itself: the wanted number, or one; else None."""
        count = wanted.strips or 1
        if self.predicted(count) > EXACT:
            return None
        found = self.strips(count)
        if found is None or found.surface.farthest > EXACT or not wanted.met(found.surface):
            return None
        return found

    def within(self, wanted: Wanted) -> Found | None:
        """Return as few strips as meet bounds, or else the best."""
        # A single strip is of use where the lines that become rulings are straight.
        least = max(self.least, 1 if self.predicted(1) <= EXACT else 2)
        most = min(wanted.most, self.most)
        low, high = least - 1, None
        aim = np.inf if wanted.max_deviation is None else wanted.max_deviation
        count = next((k for k in range(low + 1, most + 1) if self.predicted(k) <= aim), most)
        hopeless = 0
        pleated: list[float] = []
        for _ in range(_SOLVES):
            if not low < count <= most or self.stopped:
                break
            self._solve(count, aim)
            if not any(one.surface.sound for one in self.results.values()):
                hopeless += 1
                if hopeless == _FOLDED:
                    break
            if count in self.results and self.results[count].surface.farthest <= aim:
                pleated.append(self.results[count].surface.pleat_max)
                least_pleat = min(pleated)
                since = pleated[::-1].index(least_pleat)
                if least_pleat > faults.PLEATED and since >= _PLEATED:
                    # The design itself has teeth, which more strips follow.
                    break
            if self._meets(wanted, count):
                high = count
                count = count - 1 if count - low <= 3 else (low + count) // 2
            else:
                low = count
                more = max(count + 1, round(_MORE * count))
                count = min(more, most) if high is None else (low + high) // 2
        if least == high and self.results[least].divided:
            # Each strip of a spiral becomes several parts, so that one is of use.
            self._solve(1, aim)
        every = sorted(k for k in self.results if k <= most)
        met = [k for k in every if self._meets(wanted, k)]
        if met:
            fewest = min(met, key=lambda k: self.results[k].surface.strips)
            return self._certain(self._gentler(fewest, wanted))
        best = min(every, key=lambda k: _distance(self.results[k]), default=None)
        return None if best is None else self._certain(best)

    def _gentler(self, count: int, wanted: Wanted) -> int:
        """Return a number of strips that are folded less sharply where the design is smooth.

        It is at most a third larger, and the same where strips have no such folds, or others are
        no better.
        """
        sharp = self._sharpest(count)
        last = min(count + count // 3, wanted.most, self.most)
        for more in range(count + 1, 1 + (last if sharp > _SHARP else 0)):
            if self.stopped:
                break
            self._solve(more, wanted.max_deviation or np.inf)
            if self._meets(wanted, more) and self._sharpest(more) <= _GENTLER * sharp:
                return more
        return count

    def _sharpest(self, count: int) -> float:
        """Return the angle by which solved strips are folded more sharply than the mesh."""
        found = self.results[count].surface
        return sharpest_fold(found.mesh, found.strip, found.rulings, found.creases, self.mesh)

    def _meets(self, wanted: Wanted, count: int) -> bool:
        """Return whether a number of strips was solved for and meets bounds."""
        found = self.results.get(count)
        return (
            found is not None
            and wanted.met(found.surface)
            and wanted.met(self._certain(count).surface)
        )

    def _solved(self, choice: Choice, lines: Ints, other: bool, fairness: float) -> Found | None:
        """Solve for strips; with the other kind of rulings than the mesh calls for if asked."""
        fitter = self._fitter(choice.family.mesh)
        v = fitter.mesh.vertices
        try:
            cells = Cells(choice.family, lines)
            polygons = cells.polygons
        except MeshError:
            return None
        count = int(polygons.strip.max()) + 1
        if self.stopped or not self.tell(count):
            self.stopped = True
            return None
        ends = None
        if count == 1:
            one = single(cells, v)
            polygons, ends = (polygons, None) if one is None else one
        elif (_gaps(polygons, v) > _PLANAR * choice.predicted(lines)) != other:
            polygons = free_rulings(cells, v, fitter.normals)
        points = fitter.fit(polygons, v, fairness=fairness)
        if not np.isfinite(points).all():
            return None
        try:
            whole = line_surface(self.mesh, polygons, points, ends)
        except MeshError:
            # Corners that run together leave faces without area.
            return None
        surface = without_overlaps(whole, self.mesh)
        measured = surface.measured(self.mesh, sampled=True)
        return Found.of(measured, LINES, divided=surface is not whole)

    def _fitter(self, mesh: Mesh) -> LineFitter:
        """Return what fits strips along the lines of a mesh."""
        known = next((fitter for fitter in self._fitters if fitter.mesh is mesh), None)
        if known is None:
            known = LineFitter(mesh)
            self._fitters.append(known)
        return known


def _candidates(count: int, choices: Sequence[Choice]) -> list[tuple[Choice, Ints]]:
    """Return the best families by forecast, and their lines."""
    ranked = sorted(choices, key=lambda choice: choice.rank(count))[:_FAMILIES]
    out = []
    for choice in ranked:
        found = choice.lines(count)
        if found is not None and choice.rank(count) <= _RATIO * ranked[0].rank(count):
            out.append((choice, found[0]))
    return out


def _distance(found: Found) -> tuple[int, float]:
    """Sort key: surfaces with fewer flaws first, then by the largest distance."""
    return found.surface.flaws, found.surface.farthest


def _just_beyond(found: Found, aim: float) -> bool:
    """Return whether strips are so little beyond a distance that others may hold it."""
    return bool(aim < found.surface.farthest <= _CLOSE * aim)


def _gaps(polygons: Polygons, points: Array) -> float:
    """Return the root mean square distance of corners from the planes of others."""
    a, b, c, p = points[polygons.planes(points)].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    size = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    gap = np.einsum("kd,kd->k", normal, p - a) / size
    return float(np.sqrt((gap**2).mean())) if len(gap) else 0.0
