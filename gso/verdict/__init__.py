"""Whether a result can be used as what was asked for, and if not, why and where."""

from gso.verdict.asked import Asked, asked_curvature
from gso.verdict.judge import judge
from gso.verdict.wording import headline

__all__ = ["Asked", "asked_curvature", "headline", "judge"]
