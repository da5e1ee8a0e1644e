"""Handles of a session: their arrays, and their new positions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gso.constraints import Constraint, Handle, Pins
from gso.constraints.base import Subject
from gso.constraints.conflicts import check
from gso.errors import OptionError
from gso.mesh import Mesh


def pins_of(handle: Handle, mesh: Mesh, name: str) -> Pins:
    """Return indices (k,) and positions (k, 3) of a handle, in the user's numbering and unit.

    Raises
    ------
    OptionError
        The handle is invalid; the message begins with `name`.
    """
    parts = handle.parts(Subject(mesh, False, 0, name))
    check(parts, [name], mesh)
    pins = [p for p in parts if isinstance(p, Pins)]
    return pins[0] if pins else Pins(0, np.zeros(0, np.int64), np.zeros((0, 3)))


def move_handles(constraints: list[Constraint], mesh: Mesh, target: Pins) -> list[Constraint]:
    """Return the constraints with their handles moved to given positions.

    Raises
    ------
    OptionError
        A vertex has no handle.
    """
    loose = np.ones(len(target.ids), bool)
    out = []
    for c in constraints:
        if isinstance(c, Handle):
            pins = pins_of(c, mesh, "a handle")
            at, which = np.nonzero(pins.ids[:, None] == target.ids)
            pins.positions[at] = target.positions[which]
            loose[which] = False
            c = replace(c, ids=pins.ids, positions=pins.positions)
        out.append(c)
    if loose.any():
        vertex = target.ids[loose].min()
        raise OptionError(f"vertex {vertex} has no handle; name one with constrain()")
    return out
