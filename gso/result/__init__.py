"""The result of a solve, and its files."""

from gso.result.result import Result
from gso.result.summary import headline

__all__ = ["Result", "headline"]
