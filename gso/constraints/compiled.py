"""All constraints of a mesh, checked against it and against each other."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np

from gso.constraints.base import Constraint, Subject
from gso.constraints.conflicts import check
from gso.constraints.equations import Part, Pins
from gso.constraints.linear import Reduction, reduce
from gso.errors import OptionError
from gso.hierarchy import Transfer
from gso.mesh import Frame, Mesh
from gso.typing import Array, Ints

Kind = TypeVar("Kind", bound=Part)

#: Largest violation of a hard constraint, in the unit ball, that counts as satisfied.
TIGHT = 1e-6


class Miss(NamedTuple):
    """The most violated equation of a constraint: its violation (a length) and its vertices."""

    length: float
    vertices: Ints
    hard: bool


@dataclass(frozen=True)
class Compiled:
    """The equations of all constraints, in the frame and numbering of one mesh.

    Attributes
    ----------
    parts : tuple of Part
        Equations.
    names : tuple of str
        Names of the constraints in messages, by number.
    flat : bool
        Whether the constraints apply to the flat image.
    """

    parts: tuple[Part, ...] = ()
    names: tuple[str, ...] = ()
    flat: bool = False

    @property
    def empty(self) -> bool:
        """Whether there are no equations."""
        return not self.parts

    @property
    def block(self) -> str:
        """Name of the coordinate block that is constrained."""
        return "flat" if self.flat else "surface"

    def of(self, kind: type[Kind], *, hard: bool) -> list[Kind]:
        """Return the hard or the soft parts of one kind."""
        return [p for p in self.parts if isinstance(p, kind) and p.hard is hard]

    @cached_property
    def reduction(self) -> Reduction | None:
        """Elimination of the hard linear parts; None when there are none."""
        return reduce(self.parts)

    @property
    def hard_ids(self) -> Ints:
        """Vertices with a hard position, each once."""
        return self._pins(True)[0]

    @property
    def hard_positions(self) -> Array:
        """Positions (k, dim) of :attr:`hard_ids`."""
        return self._pins(True)[1]

    @property
    def pinned_positions(self) -> tuple[Ints, Array]:
        """Vertices with a hard or soft position, each once, and the positions (k, dim)."""
        return self._pins(True, False)

    def _pins(self, *hard: bool) -> tuple[Ints, Array]:
        pins = [p for kind in hard for p in self.of(Pins, hard=kind)]
        if not pins:
            return np.zeros(0, np.int64), np.zeros((0, 2 if self.flat else 3))
        ids, at = np.unique(np.concatenate([p.ids for p in pins]), return_index=True)
        return ids, np.concatenate([p.positions for p in pins])[at]

    @property
    def anchored(self) -> tuple[Part, ...]:
        """Parts that refer to absolute positions: all but glue, planarity and lengths."""
        return tuple(p for p in self.parts if p.anchored)

    def mapped(self, frame: Frame, order: Ints) -> Compiled:
        """Return the constraints in the unit of a frame, with vertex i numbered ``order[i]``."""
        return replace(self, parts=tuple(p.mapped(frame, order) for p in self.parts))

    def on(self, transfer: Transfer) -> Compiled | None:
        """Return the constraints on a coarser copy of the design.

        None where a hard part cannot be imposed on it; soft ones are then left out.
        """
        found = [(part, part.on(transfer)) for part in self.parts]
        if any(part.hard and copy is None for part, copy in found):
            return None
        kept = (copy for _, copy in found if copy is not None and copy.count)
        return replace(self, parts=tuple(kept))

    @property
    def links(self) -> Ints:
        """Pairs of vertices (k, 2) that an equation couples."""
        rows = [p.vertices for p in self.parts]
        pairs = [np.stack([v[:, 0], v[:, k]], axis=1) for v in rows for k in range(1, v.shape[1])]
        return np.concatenate(pairs) if pairs else np.zeros((0, 2), np.int64)

    def within(self, ids: Ints, count: int) -> Compiled:
        """Return the equations on vertices `ids` of `count`, numbered by their place in `ids`."""
        number = np.full(count, -1)
        number[ids] = np.arange(len(ids))
        frame = Frame(np.zeros(2 if self.flat else 3), 1.0)
        kept = (p.kept(np.all(number[p.vertices] >= 0, axis=1)) for p in self.parts)
        return replace(self, parts=tuple(p.mapped(frame, number) for p in kept if p.count))

    def violations(self, points: Array) -> dict[str, Miss]:
        """Return the most violated equation of each constraint, by name, at vertices (n, dim)."""
        out = {name: Miss(0.0, np.zeros(0, np.int64), False) for name in self.names}
        for p in self.parts:
            violation = p.violation(points)
            at, name = int(violation.argmax()), self.names[p.owner]
            if not violation[at] < out[name].length:
                out[name] = Miss(float(violation[at]), p.vertices[at], p.hard)
        return out


def listed(constraints: Iterable[Constraint] | Constraint) -> list[Constraint]:
    """Return the user's constraints, or a single one, as a list.

    Raises
    ------
    OptionError
        The argument is not iterable, or an entry is not a constraint.
    """
    if isinstance(constraints, Constraint):
        return [constraints]
    try:
        given = list(constraints)
    except TypeError:
        raise OptionError(f"constraints is {constraints!r}; it must be a list of them") from None
    for number, c in enumerate(given):
        if not isinstance(c, Constraint):
            name = _name(number, c)
            raise OptionError(f"{name} is none of those in gso.constraints, such as gso.Fixed")
    return given


def _name(number: int, constraint: object) -> str:
    return f"constraint {number} ({type(constraint).__name__})"


def compile_constraints(
    constraints: Iterable[Constraint] | Constraint | Compiled, mesh: Mesh, *, flat: bool = False
) -> Compiled:
    """Check constraints against a mesh and against each other, and compile them.

    Parameters
    ----------
    constraints : iterable of Constraint, or one, or Compiled
        The user's constraints; a `Compiled` is returned unchanged.
    mesh : Mesh
        The design.
    flat : bool
        Whether the constraints apply to its flat image.

    Raises
    ------
    OptionError
        An index or a shape is wrong, a constraint does not apply to this task, or hard linear
        constraints contradict each other; the message names them and a vertex.
    """
    if isinstance(constraints, Compiled):
        return constraints
    parts: list[Part] = []
    names = []
    for number, c in enumerate(listed(constraints)):
        names.append(_name(number, c))
        parts += c.parts(Subject(mesh, flat, number, names[-1]))
    check(parts, names, mesh)
    return Compiled(tuple(p for p in parts if p.count), tuple(names), flat)
