"""Designs that are flat or developable as they are: patterns with folds and bend lines."""

from gso.exact.developable_design import FoldedPattern, folded_pattern

__all__ = ["FoldedPattern", "folded_pattern"]
