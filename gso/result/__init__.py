"""The result of a solve, and its files."""

from gso.result.result import Result
from gso.result.strips_result import StripsResult
from gso.result.summary import headline

__all__ = ["Result", "StripsResult", "headline"]
