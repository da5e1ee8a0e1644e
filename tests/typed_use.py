"""What a user writes, with types: ``mypy --strict`` has nothing to say against it.

``tests/test_typing.py`` checks this file, and runs it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import gso
from gso.verdict import Code, Reason


def bump(n: int = 9) -> gso.Mesh:
    """Return a grid of n by n vertices that is curved both ways."""
    u, v = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    points: NDArray[np.float64] = np.stack([u, v, 0.2 * (1 - u * u) * (1 - v * v)], axis=-1)
    return gso.Mesh.from_grid(points)


def developable(mesh: gso.Mesh) -> gso.Result:
    """Return the mesh made developable, with options, a constraint and a callback."""
    seen: list[int] = []

    def watch(progress: gso.Progress) -> bool:
        seen.append(progress.iteration)
        return True

    options = gso.DevelopableOptions(iterations=4)
    corner = gso.Fixed([0])
    result = gso.tno.optimize(mesh, options=options, constraints=[corner], callback=watch)
    assert seen
    return result


def against(result: gso.Result) -> dict[Code, float | None]:
    """Return the values of the reasons against a result."""
    reasons: tuple[Reason, ...] | list[Reason] = result.reasons
    return {reason.code: reason.value for reason in reasons}


def main(folder: Path) -> float:
    """Optimise, flatten, unfold, make strips, save; return the largest strain."""
    mesh = bump()
    result = developable(mesh)
    against(result)
    result.save(folder / "bump.npz")
    again: gso.Mesh = gso.load(folder / "bump.npz")
    vertices: NDArray[np.float64] = again.vertices
    flat = gso.tno.optimize(again, task="flatten")
    strips = gso.strips(mesh, strips=2)
    strips.save(folder / "strips.svg")
    net = gso.unfold(gso.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2], [0, 1, 3]]))
    curvature: float = gso.metrics.loss_gc_worst(result.mesh)
    assert len(vertices) == 81 and curvature >= 0.0 and net.misfit() < 1e-9
    return float(flat.metrics["strain_max"])
