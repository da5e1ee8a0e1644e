"""Designs that are flat or developable as they are: patterns with folds and bend lines."""

from gso.exact.folded_pattern import FoldedPattern, folded_pattern

__all__ = ["FoldedPattern", "folded_pattern"]
