"""The broad set: surfaces of several families, of which some are held out for validation and test.

A new family is a function in :mod:`gso.dataset.broad.families` and its line in `FAMILIES`.
"""

from gso.dataset.broad.draws import CURVED, LARGEST, SMALLEST, SPLITS, draw, families, family
from gso.dataset.broad.families import FAMILIES, Family, Surface

__all__ = [
    "CURVED",
    "FAMILIES",
    "LARGEST",
    "SMALLEST",
    "SPLITS",
    "Family",
    "Surface",
    "draw",
    "families",
    "family",
]
