"""The strips that a ruled surface was cut out of."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from gso.ruled.strip_layout import Strips
from gso.short_repr import short_repr
from gso.typing import Array, Ints


@dataclass(frozen=True)
class Untrimmed:
    """Strips before they are cut along an outline.

    Attributes
    ----------
    strips : Strips
        The layout.
    vertices : ndarray, (n, 3)
        Ends of the rulings.
    owner : ndarray of int, (m,)
        For each face of the surface that was cut out, the face of the strips that it is part of.
    """

    strips: Strips
    vertices: Array
    owner: Ints

    __repr__ = short_repr

    def transformed(self, move: Callable[[Array], Array]) -> Untrimmed:
        """Return the strips with moved vertices."""
        return replace(self, vertices=move(self.vertices))

    def arrays(self) -> dict[str, Array]:
        """Return the strips as arrays by name."""
        return {
            "rulings": np.concatenate(self.strips.index),
            "lengths": np.array([len(i) for i in self.strips.index]),
            "flats": self.strips.flats,
            "ends": self.vertices,
            "owner": self.owner,
        }

    @classmethod
    def from_arrays(cls, data: Mapping[str, np.ndarray]) -> Untrimmed:
        """Return the strips that :meth:`arrays` describes.

        Raises
        ------
        KeyError, ValueError
            Arrays are missing or do not fit each other.
        """
        rulings, sizes, flats = data["rulings"], data["lengths"], data["flats"]
        vertices, owner = data["ends"], data["owner"]
        whole = all(x.dtype.kind in "iu" for x in (rulings, sizes, flats, owner))
        if not (whole and rulings.ndim == flats.ndim == 2 and flats.shape[1] == 4):
            raise ValueError("the arrays of the strips do not fit each other")
        ids = np.concatenate([rulings.ravel(), flats.ravel()])
        fits = rulings.size and sizes.size and sizes.min() > 1 and sizes.sum() == len(rulings)
        fits = fits and rulings.shape[1] > 1 and vertices.shape == (len(vertices), 3)
        if not (fits and 0 <= ids.min() <= ids.max() == len(vertices) - 1):
            raise ValueError("the arrays of the strips do not fit each other")
        strips = Strips(tuple(np.split(rulings, np.cumsum(sizes)[:-1])), flats)
        if owner.size and not 0 <= owner.min() <= owner.max() < len(strips.corners):
            raise ValueError("the arrays of the strips do not fit each other")
        return cls(strips, vertices, owner)
