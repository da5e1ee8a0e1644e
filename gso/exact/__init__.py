"""Designs that are flat or developable as they are: patterns with folds and bend lines."""

from gso.exact.developable_design import (
    EXACT,
    FoldedPattern,
    as_it_is,
    folded_pattern,
    keeps_rows,
)
from gso.exact.developable_parts import developable_parts

__all__ = [
    "EXACT",
    "FoldedPattern",
    "as_it_is",
    "developable_parts",
    "folded_pattern",
    "keeps_rows",
]
