"""One solve: normalise, plan, solve the stages, return to the user's frame, judge."""

from gso.pipeline.case import Case
from gso.pipeline.judgement import add_verdict
from gso.pipeline.lay_flat import lay_out, strains_of
from gso.pipeline.normalise import Canonical
from gso.pipeline.run import Run

__all__ = ["Canonical", "Case", "Run", "add_verdict", "lay_out", "strains_of"]
