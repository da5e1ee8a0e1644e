"""The designs of a fabrication: read from files, and divided into components."""

from __future__ import annotations

from collections.abc import Sequence, Sized
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from gso import io
from gso.components import split
from gso.constraints import Constraint, compile_constraints
from gso.errors import MeshError, OptionError
from gso.faults import crossings
from gso.mesh import Mesh
from gso.seams.edge_prices import Avoid, Follow, edges_to_follow, faces_to_avoid
from gso.seams.kinds import Groups
from gso.sheet_metal import sheet_solid
from gso.typing import Ints, MeshLike
from gso.unfolding.edge_lines import edges_along
from gso.unfolding.manifold import edges_between, manifold_mesh
from gso.unfolding.unfold_mesh import polylines_of
from gso.verdict import Code, Measurement, Reason, compare
from gso.workshop.job_folder import path_of
from gso.workshop.names import different, spelled

#: One or several designs.
Designs: TypeAlias = "MeshLike | Sequence[MeshLike]"


def _no_edges() -> Ints:
    return np.empty((0, 2), np.int64)


@dataclass(frozen=True, eq=False)
class Design:
    """One component of what was given.

    Attributes
    ----------
    name : str
    mesh : Mesh
        One side of a solid of sheet metal.
    kept, uncut : ndarray of int, (k, 2)
        Edges that are cut in any case, and that are not.
    along : ndarray of int, (k, 2)
        Edges that seams should follow.
    avoid : ndarray of int, (k,)
        Faces that seams should keep away from.
    constraints : tuple of Constraint
        What must hold where the shape changes, in the numbering of the mesh.
    notes : tuple of str
        What was changed or found in the file.
    reasons : tuple of Reason
        Why what was given cannot be built: components of it pass through each other.
    sheet : float or None
        Thickness of a solid of sheet metal, in the unit of the mesh.
    """

    name: str
    mesh: Mesh
    kept: Ints = field(default_factory=_no_edges)
    notes: tuple[str, ...] = ()
    reasons: tuple[Reason, ...] = ()
    sheet: float | None = None
    uncut: Ints = field(default_factory=_no_edges)
    along: Ints = field(default_factory=_no_edges)
    avoid: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    constraints: tuple[Constraint, ...] = ()

    @property
    def is_marked(self) -> bool:
        """Whether something is asked of this design that is not asked of its copies."""
        return bool(len(self.kept) or len(self.along) or len(self.avoid) or self.constraints)


def designs_of(
    given: Designs,
    *,
    cut: ArrayLike | None = None,
    keep: ArrayLike | None = None,
    keep_groups: bool = False,
    along: Follow | None = None,
    avoid: Avoid | None = None,
    constraints: Sequence[Constraint] = (),
    scale: float = 1.0,
) -> list[Design]:
    """Read designs, and divide them into components.

    They are scaled first. Solids of sheet metal in CAD files become one of their sides, and
    several have the names that the file gives them.

    Raises
    ------
    MeshError
        A design cannot be read, is a heap of loose faces, has no groups to cut between, or is a
        sheet whose thickness is not the same everywhere.
    OptionError
        What names places of a design is wrong, or there are several designs.
    """
    many = several(given)
    places = {"cut": cut, "keep": keep, "along": along, "avoid": avoid, "constraints": constraints}
    named = [name for name, value in places.items() if not _is_empty(value)]
    if len(many) > 1 and named:
        raise OptionError(f"{named[0]} is about places of one design; give one design with it")
    out: list[Design] = []
    for number, one in enumerate(many, start=1):
        path = path_of(one)
        suffix = number if len(many) > 1 else ""
        stem = f"design{suffix}" if path is None else path.stem
        mesh, vertex = manifold_mesh(one)
        mesh.check_joined()
        follow, away = edges_to_follow(mesh, along), faces_to_avoid(mesh, avoid)
        drawn, leaves = edges_along(mesh.vertices, mesh.edges, polylines_of(one))
        if scale != 1.0:
            mesh = mesh.replaced(scale * mesh.vertices)
        kept, uncut = (
            edges_between(mesh, vertex, pairs, name)
            for pairs, name in ((cut, "cut"), (keep, "keep"))
        )
        kept = np.concatenate([kept, drawn, *([Groups().edges(mesh)] if keep_groups else [])])
        components = split(mesh)
        if constraints:
            if len(components) > 1 or len(vertex) != len(np.unique(vertex)):
                raise OptionError(
                    f"constraints are about one surface, and {stem} has {len(components)} "
                    "components; give one of them"
                )
            # Errors in them are found before anything is made.
            compile_constraints(constraints, mesh)
        notes = tuple(f"{stem}: {note}" for note in (*mesh.notes, *leaves))
        met = np.zeros(len(mesh.faces), bool)
        if len(components) > 1:
            pairs = crossings(mesh)
            own = mesh.components[mesh.faces[:, 0]]
            met[pairs[own[pairs[:, 0]] != own[pairs[:, 1]]]] = True
        local = np.full(len(mesh.vertices), -1)
        for k, part in enumerate(components, start=1):
            local[:] = -1
            local[part.vertices] = np.arange(len(part.vertices))
            seams, held = local[kept], local[uncut]
            name = f"{stem}-{k}" if len(components) > 1 else stem
            through = Measurement.count("face", part.faces[met[part.faces]])
            reasons = compare({Code.CROSSES_ITSELF: through}, {})
            solid = None
            if path is not None and io.suffix_of(path) in io.SPLINE_SUFFIXES:
                said = None if mesh.attributes is None else mesh.attributes.labels.get("o")
                if said is not None and len(components) > 1:
                    index = int(said.of_face[part.faces[0]])
                    name = said.names[index] if index >= 0 else name
                try:
                    solid = sheet_solid(part.mesh)
                except MeshError as error:
                    raise MeshError(f"{path}: {error}") from None
            if solid is None:
                edges = seams[(seams >= 0).all(axis=1)]
                held = held[(held >= 0).all(axis=1)]
                lines = local[follow]
                out.append(
                    Design(
                        spelled(name),
                        part.mesh,
                        edges,
                        notes,
                        reasons,
                        None,
                        held,
                        lines[(lines >= 0).all(axis=1)],
                        np.flatnonzero(np.isin(part.faces, away)),
                        tuple(constraints),
                    )
                )
            else:
                out.append(
                    Design(
                        spelled(name),
                        solid.side,
                        notes=notes,
                        reasons=reasons,
                        sheet=solid.thickness,
                    )
                )
    names = different(design.name for design in out)
    return [replace(design, name=name) for design, name in zip(out, names, strict=True)]


def _is_empty(given: object) -> bool:
    """Whether an option was not given, or with nothing in it."""
    return given is None or (isinstance(given, Sized) and len(given) == 0)


def several(given: Designs) -> Sequence[MeshLike]:
    """Return what was given as a sequence of designs."""
    some: Any = given
    return some if isinstance(some, list | tuple) and not _is_mesh(some) else [some]


def _is_mesh(given: object) -> bool:
    """Whether a tuple is vertices and faces rather than several designs."""
    if not (isinstance(given, tuple) and len(given) == 2):
        return False
    return isinstance(given[0], list) or len(getattr(given[0], "shape", ())) == 2
