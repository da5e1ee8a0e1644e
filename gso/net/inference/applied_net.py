"""What a prediction needs of a net, whichever library computes it."""

from __future__ import annotations

from typing import Protocol

from gso.typing import Array


class AppliedNet(Protocol):
    """A net that is ready to be applied to surfaces."""

    @property
    def task(self) -> str:
        """Name of the net's task."""

    @property
    def passes(self) -> int:
        """Number of passes."""

    @property
    def told(self) -> bool:
        """Whether the noise level is an input."""

    def start(self, unit: Array) -> Array:
        """Return what the net displaces, (B, H, W, d), for grids (B, H, W, 3) of the unit ball."""

    def displacements(self, seen: Array, unit: Array, noise: Array | None, passes: int) -> Array:
        """Compute displacements (B, H, W, d).

        Parameters
        ----------
        seen : ndarray, (B, SIZE, SIZE, 3)
            Grids of the unit ball: the input.
        unit : ndarray, (B, H, W, 3)
            The same surfaces, at whose vertices the displacements are evaluated.
        noise : ndarray, (B,), optional
            Standard deviation of the noise, for a net that is told it.
        passes : int
            Number of passes.
        """
