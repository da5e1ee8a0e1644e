"""The verdict: whether a result is usable for the task, and if not, why and where."""

from gso.verdict.asked import asked_curvature
from gso.verdict.judge import judge
from gso.wording import headline

__all__ = ["asked_curvature", "headline", "judge"]
