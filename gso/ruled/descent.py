"""Levenberg's method for strips: with a penalty on planarity, or among planar strips."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gso.ruled.diagonal_gap import planarity
from gso.ruled.strip_energy import Energy
from gso.ruled.strip_weights import Measured, Weights
from gso.ruled.system import System
from gso.typing import Array

#: Longest step of a vertex, relative to the mean width of the faces: the planarity of a quad is
#: far from linear beyond it.
_REACH = 0.5
#: Damping, relative to the mean diagonal, at the start and at most.
_DAMPING, _MOST = 1e-2, 1e4
#: Relative decrease of the energy at which a phase ends.
_TOLERANCE = 1e-4
#: Distance between diagonals that counts as zero in the result and on the way; largest number
#: of steps towards it.
_PLANAR, _NEARLY, _STEPS = 1e-15, 1e-9, 8
#: Gaps must not fall below this share of the bound that the energy keeps.
_CROSSED = 0.02


def planarised(system: System, vertices: Array, tolerance: float = _PLANAR) -> Array:
    """Make the quads planar by Newton steps of least norm."""
    for _ in range(_STEPS):
        value, slope = planarity(vertices[system.quads])
        if np.abs(value).max(initial=0.0) <= tolerance:
            break
        right = np.zeros(system.size)
        right[system.multipliers] = -value
        matrix = system.constrained(system.identity, slope)
        vertices = vertices + system.solve(matrix, right)[system.unknowns]
    return vertices


class Stopped(Exception):
    """The caller does not want the solve to go on."""


#: Gets the number of an iteration, the largest number of them, the energy, and the number of
#: strips; returns whether to go on.
Tell = Callable[[int, int, float, int], bool]


def descend(
    energy: Energy,
    vertices: Array,
    w: Weights,
    iterations: int,
    tolerance: float = _TOLERANCE,
    tell: Tell | None = None,
) -> Array:
    """Minimise the energy from given vertices; the best are returned.

    Raises
    ------
    Stopped
        `tell` returned False.
    """
    system, damping, growth = energy.system, _DAMPING, 2.0
    diagonal = system.diagonal
    here = energy.measure(vertices)
    # With a penalty, faces may be far from planar, and their outlines then have no meaning.
    tangled = 0 if w.planar else int(energy.strips.tangled(vertices).sum())
    bound = _CROSSED * w.least * energy.width
    for iteration in range(iterations):
        scale = max(float(np.abs(here.height[: energy.count]).max()), 1e-12)
        value = energy.value(vertices, here, w, here.back_weight, scale)
        if tell is not None and not tell(iteration, iterations, value, energy.strips.count):
            raise Stopped
        gradient, matrix = energy.derivatives(vertices, here, w, scale)
        mean = float(matrix[diagonal].mean())
        right = np.zeros(system.size)
        right[system.unknowns] = -gradient
        slope = None
        if not w.planar:
            off, slope = planarity(vertices[system.quads])
            right[system.multipliers] = -off
        matrix = system.constrained(matrix, slope)
        while True:
            damped = matrix.copy()
            damped[diagonal] += damping * mean
            step = energy.even_step(system.solve(damped, right)[system.unknowns])
            longest = float(np.abs(step).max())
            fall, trial, knots = -1.0, vertices, 0
            there: Measured | None = None
            if longest <= _REACH * energy.width:
                trial = vertices + step
                if not w.planar:
                    trial = planarised(system, trial, _NEARLY)
                least = float(energy.gaps(trial, here.up)[0].min())
                knots = 0 if w.planar else int(energy.strips.tangled(trial).sum())
                if least >= min(bound, float(here.gap.min())) and knots <= tangled:
                    there = energy.measure(trial)
                    fall = value - energy.value(trial, there, w, here.back_weight, scale)
            if there is not None and fall > 0:
                break
            if damping >= _MOST:
                return vertices
            if there is None:
                damping *= 3.0
            else:
                damping, growth = damping * growth, growth * 2.0
        predicted = -0.5 * float((gradient * step).sum())
        ratio = fall / max(predicted, 1e-300)
        damping = max(damping * max(1.0 / 3.0, 1.0 - (2.0 * min(ratio, 1.5) - 1.0) ** 3), 1e-9)
        growth = 2.0
        vertices, here, tangled = trial, there, knots
        if fall < tolerance * value:
            break
    return vertices
