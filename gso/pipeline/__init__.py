"""One solve: normalise, plan, solve the stages, return to the user's frame, judge."""
