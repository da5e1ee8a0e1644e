"""Pieces with their patterns, what was measured on them, and files of them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gso import parametrization
from gso.cut_pieces import Pieces
from gso.in_browser import show
from gso.mesh import Mesh
from gso.pattern import Bend, Folded, Pattern
from gso.result import Result
from gso.seams.sheets import Sheet
from gso.short_repr import html_repr
from gso.typing import AnyPath, Array, Ints, Json
from gso.verdict import Reason


@dataclass(frozen=True, eq=False, repr=False)
class Segmentation(Pieces):
    """A design cut into pieces that can be laid flat; :func:`gso.pieces` makes it.

    It is :class:`~gso.seams.Pieces`, so it can be given to :func:`gso.tno.optimize`.

    Attributes
    ----------
    sheets : tuple of Sheet or None
        The flat pattern of each piece; None where there is none.
    metrics : dict
        ``pieces``, ``seam`` (relative to the root of the area), ``strain_p99`` and ``strain_max``
        (of the worst piece), ``neck`` (the narrowest place, in the mesh's unit), ``neck_share``
        (the least ratio of a piece's narrowest place and the root of its area), and ``seam_turn``
        (degrees by which seams turn, per cent of the diagonal along them). After a change of shape
        ``deviation_mean`` and ``deviation_max`` (in the mesh's unit), ``dihedral_mean`` with
        ``dihedral_mean_before`` and ``dihedral_max`` (degrees, inside pieces), and on quads
        ``nonplanarity_max`` (distance of the diagonals over the mean edge).
    reasons : tuple of Reason
        Why it is not usable as what was asked for, the most severe first; empty if it is.
    notes : tuple of str
        Remarks.
    result : Result or None
        The solve that changed the shape, where `max_deviation` was given.
    given : Mesh or None
        The design as it was given, from which distances count.
    kept : ndarray of int, (k, 2)
        The edges of it that were to be cut in any case.
    seconds : float
        Time it took.
    """

    sheets: tuple[Sheet | None, ...] = ()
    metrics: dict[str, float] = field(default_factory=dict)
    reasons: tuple[Reason, ...] = ()
    notes: tuple[str, ...] = ()
    result: Result | None = None
    given: Mesh | None = None
    kept: Ints = field(default_factory=lambda: np.empty((0, 2), np.int64))
    seconds: float = 0.0

    @property
    def usable(self) -> bool:
        """Whether there is no reason against it."""
        return not self.reasons

    @property
    def patterns(self) -> list[Pattern | None]:
        """The flat pattern of each piece, in the mesh's unit."""
        return [None if s is None else Pattern.whole(s.mesh, s.flat) for s in self.sheets]

    @property
    def pattern(self) -> Pattern | None:
        """The patterns of all pieces as one, beside each other; None if one is missing."""
        return None if None in self.sheets else self.known_pattern

    @property
    def known_pattern(self) -> Pattern | None:
        """The same of the pieces that have a pattern; None if none has one.

        It has the faces of these pieces only; its vertices are those of the mesh that is cut open.
        """
        own = {k: sheet.flat for k, sheet in enumerate(self.sheets) if sheet is not None}
        if not own:
            return None
        opened = self.opened
        flat = np.zeros((len(opened.vertex), 2))
        for k, placed in zip(own, parametrization.beside([*own.values()]), strict=True):
            flat[self.parts[k].vertices] = placed
        faces = opened.mesh.faces[np.isin(self.of_face, [*own])]
        seams = opened.seams[np.isin(self.sides, [*own]).all(axis=1)]
        return Pattern(flat, faces, opened.vertex, seams)

    @property
    def unchanged(self) -> Mesh:
        """The design with the vertices on seams, before its shape changed."""
        points = self.design.vertices.copy()
        if self.result is not None and self.result.pieces is not None:
            points[self.result.pieces.opened.vertex] = self.result.design.vertices
        return self.design.replaced(points)

    @property
    def folded(self) -> Folded:
        """The edges of :attr:`pattern` to bend along, of gores and of designs that stay."""
        some = [
            (part.vertices[sheet.folded.edges], sheet.folded.angles, sheet.folded.radii)
            for part, sheet in zip(self.parts, self.sheets, strict=True)
            if sheet is not None
        ]
        return Folded(*map(np.concatenate, zip(*some, strict=True))) if some else Folded()

    def alike(self, tolerance: float | None = None) -> list[list[int]]:
        """Group pieces with congruent patterns, mirror images and those with holes apart.

        Patterns are alike if their outlines have the same edge lengths and angles, from some
        starting vertex on: pieces of a design with repeated parts.

        Parameters
        ----------
        tolerance : float, optional
            Largest difference of lengths, in the mesh's unit; a millionth of the diagonal when
            not given.
        """
        allowed = 1e-6 * self.design.diagonal if tolerance is None else tolerance
        groups: list[list[int]] = []
        known: list[Array] = []
        for number, sheet in enumerate(self.sheets):
            if sheet is None or len(sheet.mesh.boundary_loops) > 1:
                groups.append([number])
                known.append(np.empty(0))
                continue
            outline = _outline(sheet)
            for group, other in zip(groups, known, strict=True):
                if _same(outline, other, allowed):
                    group.append(number)
                    break
            else:
                groups.append([number])
                known.append(outline)
        return groups

    def table(self) -> list[Json]:
        """Return a row for each piece: name, faces, area, length, width, strain, darts."""
        from gso.metrics import area

        rows = []
        sides, lengths = self.sides, self.lengths
        for number, piece in enumerate(self):
            sheet = self.sheets[number] if number < len(self.sheets) else None
            row: Json = {
                "name": piece.name,
                "faces": len(piece.faces),
                "area": area(piece.mesh),
                "seam": float(lengths[(sides == number).any(axis=1)].sum()),
                "darts": float(lengths[(sides == number).all(axis=1)].sum()),
            }
            if sheet is not None:
                row |= {
                    "length": sheet.size[0],
                    "width": sheet.size[1],
                    "strain_max": sheet.strain,
                    "strain_p99": sheet.strains["strain_p99"],
                }
            rows.append(row)
        return rows

    def save(self, folder: AnyPath, *, unit: str = "mm") -> list[str]:
        """Write a folder of files, and return their names.

        Patterns that an earlier call wrote to the folder, by its ``pieces.json``, are deleted.
        ``pieces.obj`` has the whole surface with a group for each piece, ``patterns.svg`` and
        ``pattern_NAME.svg`` the patterns at 1:1, where `unit` is the unit of the coordinates, and
        ``pieces.json`` the metrics and the table.
        """
        from gso.seams.piece_files import save

        return save(self, folder, unit)

    _repr_html_ = html_repr
    show = show

    def __repr__(self) -> str:
        said = f"{len(self)} pieces, seam {self.seam_length:.3g}"
        if "strain_max" in self.metrics:
            said += f", largest strain {self.metrics['strain_max']:.2g}"
        if "deviation_max" in self.metrics:
            said += f", at most {self.metrics['deviation_max']:.3g} from the design"
        return f"Segmentation({said}{'' if self.usable else '; not usable'})"


def whole_pattern(found: Segmentation) -> tuple[Mesh, Array, list[Bend]]:
    """Return all pieces as one mesh, their patterns side by side (p, 2), and their bend lines."""
    from gso.parametrization import beside, upright

    own = [s for s in found.sheets if s is not None]
    flats = beside([upright(s.flat) for s in own])
    points = np.concatenate([s.mesh.vertices for s in own])
    start = np.cumsum([0, *(len(s.mesh.vertices) for s in own)])
    wide = max(s.mesh.faces.shape[1] for s in own)
    faces = [
        np.pad(s.mesh.faces, ((0, 0), (0, wide - s.mesh.faces.shape[1])), constant_values=-1)
        for s in own
    ]
    shifted = [np.where(f < 0, -1, f + k) for f, k in zip(faces, start[:-1], strict=True)]
    bends = [bend for s, flat in zip(own, flats, strict=True) for bend in s.folded.lines(flat)]
    return Mesh(points, np.concatenate(shifted)), np.concatenate(flats), bends


def _outline(sheet: Sheet) -> Array:
    """Return edge lengths and turns along the boundary of a pattern, (k, 2)."""
    p = sheet.flat[sheet.outline]
    step = np.roll(p, -1, axis=0) - p
    z = step @ np.array([1.0, 1j])
    turn = np.angle(np.roll(z, -1) / np.where(z == 0, 1, z))
    size = np.abs(z)
    return np.stack([size, turn * 0.5 * (size + np.roll(size, -1))], axis=1)


def _same(one: Array, two: Array, allowed: float) -> bool:
    """Tell whether two closed outlines are equal from some vertex on."""
    if one.shape != two.shape or not len(one):
        return False
    near = np.flatnonzero(np.abs(two - one[0]).max(axis=1) <= allowed)
    return any(bool(np.abs(np.roll(two, -k, axis=0) - one).max() <= allowed) for k in near)
