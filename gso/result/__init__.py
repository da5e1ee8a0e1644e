"""The result of a solve, and its files."""

from gso.result.in_words import headline
from gso.result.result import Result
from gso.result.result_record import record_of
from gso.result.strips_result import StripsResult

__all__ = ["Result", "StripsResult", "headline", "record_of"]
