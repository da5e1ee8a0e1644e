"""Make a surface developable, by its curvature or by isometry to its flat image."""

from gso.tasks.developable.curvature import (
    FORMULATIONS,
    IMPLIES,
    OPTIONS,
    Options,
    flat_metrics,
    metrics,
    plan,
)

__all__ = ["FORMULATIONS", "IMPLIES", "OPTIONS", "Options", "flat_metrics", "metrics", "plan"]
