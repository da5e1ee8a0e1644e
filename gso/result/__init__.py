"""The result of a solve, and its files."""

from gso.result.in_words import headline
from gso.result.result import Result

__all__ = ["Result", "headline"]
