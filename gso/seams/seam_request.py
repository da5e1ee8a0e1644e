"""What is asked of seams that strips and fabrications have searched for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from gso.mesh import Mesh
from gso.seams.mirror_plane import mirror_of
from gso.seams.options import CHANGES, PieceSettings, effort_named
from gso.seams.sheets import Sheet
from gso.typing import Flags, Ints, Keywords
from gso.verdict import Code, Measurement, Reason, compare


@dataclass(frozen=True, eq=False)
class SeamRequest:
    """Budgets and preferences that are passed on to :func:`gso.pieces`, in the design's unit.

    Attributes
    ----------
    max_pieces : int or None
        Largest number of pieces.
    min_neck, min_size : float or None
        Smallest width of a part at its narrowest place, and smallest length of a part.
    symmetric : bool
        Whether seams are to be symmetric.
    effort : {"draft", "standard", "best"}
        How long to search.
    along : ndarray of int, (k, 2)
        Edges of the design that seams should follow.
    avoid : ndarray of int, (k,)
        Faces of the design that seams should keep away from.
    """

    max_pieces: int | None = None
    min_neck: float | None = None
    min_size: float | None = None
    symmetric: bool = False
    effort: str = "standard"
    along: Ints = field(default_factory=lambda: np.empty((0, 2), np.int64))
    avoid: Ints = field(default_factory=lambda: np.empty(0, np.int64))

    def __post_init__(self) -> None:
        # The search has the same checks.
        PieceSettings(
            max_strain=CHANGES,
            max_deviation=None,
            max_pieces=self.max_pieces,
            seam=None,
            darts=False,
            min_neck=self.min_neck,
            min_size=self.min_size,
            max_size=None,
            say=lambda said: None,
            effort=effort_named(self.effort),
        )

    @property
    def preferences(self) -> tuple[str, ...]:
        """Names of the preferences that say where seams should be."""
        given = {"symmetric": self.symmetric, "along": len(self.along), "avoid": len(self.avoid)}
        return tuple(name for name, value in given.items() if value)

    def check_symmetric(self, design: Mesh, allowed: float | None) -> None:
        """Raise an error if seams are to be symmetric, and the design is not.

        Parameters
        ----------
        design : Mesh
        allowed : float or None
            Distance within which its shape may change.

        Raises
        ------
        OptionError
            It is not.
        """
        if not self.symmetric:
            return
        # These import SciPy.
        from gso.seams.revolution import Revolution
        from gso.seams.symmetry import plane_of

        mesh = self.searched(design, allowed)
        if self._at_scale(mesh, allowed):
            plane_of(mesh)
        elif allowed is None or Revolution.of(mesh, allowed) is None:
            mirror_of(mesh)

    def searched(self, design: Mesh, allowed: float | None) -> Mesh:
        """Return the mesh to search: triangles, whose seams need not follow edge rows.

        Where a design has to be symmetric vertex by vertex, the triangles of quads are not, so that
        quads are kept.
        """
        triangles = design
        if not design.is_triangles:
            triangles = Mesh(design.vertices, design.triangles)
        return design if self.symmetric and not self._at_scale(triangles, allowed) else triangles

    @staticmethod
    def _at_scale(mesh: Mesh, allowed: float | None) -> bool:
        # This imports SciPy.
        from gso.seams.reshaping import at_scale

        return at_scale(mesh, allowed)

    def keywords(self, design: Mesh, mesh: Mesh, *, gores: bool) -> Keywords:
        """Return keywords of :func:`gso.pieces` for a mesh on the vertices of the design.

        With `gores`, bodies of revolution may be cut into gores, a new surface.
        """
        return {
            "max_pieces": self.max_pieces,
            "min_neck": self.min_neck,
            "min_size": self.min_size,
            "symmetric": self.symmetric if gores else "mirror" if self.symmetric else False,
            "effort": self.effort,
            "along": self.along,
            "avoid": faces_within(design, self.avoid, mesh),
        }

    def reasons(
        self, pieces: int, parts: Sequence[Sheet], names: Sequence[str] = ()
    ) -> tuple[Reason, ...]:
        """Return the reasons if budgets are not held, by a number of pieces or by parts."""
        measured = {Code.PIECES: Measurement(pieces)}
        if self.min_neck is not None:
            necks = np.array([part.neck(2.0 * self.min_neck) for part in parts])
            measured[Code.NECK] = Measurement(necks, "part", names)
        if self.min_size is not None:
            sizes = np.array([part.size[0] for part in parts])
            measured[Code.TOO_SHORT] = Measurement(sizes, "part", names)
        limits = {
            Code.PIECES: self.max_pieces,
            Code.NECK: self.min_neck,
            Code.TOO_SHORT: self.min_size,
        }
        return compare(measured, limits)


def without_seams(preferences: Sequence[str]) -> str:
    """Return a note on preferences about seams of a design that needs none."""
    return f"no seams were searched for, so that {', '.join(preferences)} had no effect"


def faces_within(design: Mesh, faces: Ints, mesh: Mesh) -> Flags:
    """Tell which faces of a mesh on the same vertices are within some faces of a design."""
    corners = design.faces[faces]
    inside = np.zeros(len(mesh.vertices) + 1, bool)
    inside[corners[corners >= 0]] = True
    # The number of a corner that triangles lack is -1.
    inside[-1] = True
    return np.asarray(inside[mesh.faces].all(axis=1))
