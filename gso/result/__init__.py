"""The result of a solve, and its files."""

from gso.result.result import Result

__all__ = ["Result"]
