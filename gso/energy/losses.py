"""Loss functions of residuals: squared, absolute, and robust by distance.

Like residuals they are written for any kind of number; training and batched solves evaluate
them on tensors. Residuals then are (r, e, ...), and parameters may differ along the last axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from gso.geometry import ops
from gso.typing import B


class Loss(Protocol):
    """Loss of the residuals (r, e) of elements; acts on each residual unless stated otherwise."""

    def value(self, r: B) -> B:
        """Return the loss (., e); its sum over the first axis is the total of each element."""

    def weights(self, r: B) -> tuple[B, B]:
        """Return the derivative, and a curvature >= 0 for the Gauss-Newton matrix, (r, e) each."""


@dataclass(frozen=True)
class Squared:
    """Half the square."""

    def value(self, r: B) -> B:
        return 0.5 * r * r

    def weights(self, r: B) -> tuple[B, B]:
        return r, ops.like(r, 1.0)


@dataclass(frozen=True)
class Absolute:
    """``sqrt(r^2 + eps^2) - eps``, as iteratively reweighted least squares.

    The curvature is that of the majorising parabola, ``1 / sqrt(r^2 + eps^2)``.
    """

    eps: float

    def value(self, r: B) -> B:
        return ops.sqrt(r * r + self.eps**2) - self.eps

    def weights(self, r: B) -> tuple[B, B]:
        w = 1.0 / ops.sqrt(r * r + self.eps**2)
        return r * w, w


@dataclass(frozen=True)
class Distance:
    """``eps (sqrt(|r|^2 + eps^2) - eps)`` of an element's residual vector.

    It is isotropic: half the squared length near zero, proportional to the length far away.
    """

    eps: float

    def _root(self, r: B) -> B:
        return ops.sqrt((r * r).sum(0)[None] + self.eps**2)

    def value(self, r: B) -> B:
        return self.eps * (self._root(r) - self.eps)

    def weights(self, r: B) -> tuple[B, B]:
        w = self.eps / self._root(r)
        return r * w, ops.like(r, w)


@dataclass(frozen=True)
class Beyond:
    """Half the square of the excess of ``|r|`` over a limit, zero below it.

    It is isotropic, as :class:`Distance` is, and its curvature is that of the excess along r.
    """

    limit: float

    def _length(self, r: B) -> B:
        return ops.sqrt((r * r).sum(0)[None] + 1e-300)

    def _excess(self, r: B) -> B:
        return ops.maximum(self._length(r) - self.limit, 0.0)

    def value(self, r: B) -> B:
        return 0.5 * self._excess(r) ** 2

    def weights(self, r: B) -> tuple[B, B]:
        excess = self._excess(r)
        active = ops.where(excess > 0.0, excess * 0.0 + 1.0, 0.0)
        return r * (excess / self._length(r)), ops.like(r, active)
