"""The verdict: whether a result is usable for the task, and if not, why and where."""

from gso.verdict.codes import TIGHT, Code, Kind
from gso.verdict.compare import Measurement, compare, failure, merge
from gso.verdict.judge import judge, judge_components
from gso.verdict.reason import Places, Reason, crosses_itself, describe, ordered

__all__ = [
    "TIGHT",
    "Code",
    "Kind",
    "Measurement",
    "Places",
    "Reason",
    "compare",
    "crosses_itself",
    "describe",
    "failure",
    "judge",
    "judge_components",
    "merge",
    "ordered",
]
