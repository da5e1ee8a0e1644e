"""A result as plain values, without its geometry."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.io.json_file import plain
from gso.result.in_words import headline
from gso.typing import Json

if TYPE_CHECKING:
    from gso.result.result import Result


def record_of(result: Result, unit: str = "") -> Json:
    """Summarise a result without its geometry; `unit` names its unit of length, if known."""
    return {
        "task": result.task,
        "formulation": result.formulation,
        "status": result.status.name,
        "message": str(result.status),
        "usable": result.usable,
        "headline": headline(result, unit),
        "reasons": [reason.record(unit) for reason in result.reasons],
        "iterations": result.iterations,
        "seconds": result.seconds.get("total", 0.0),
        "backend": result.backend,
        "notes": list(result.notes),
        "spline": result.details.get("spline"),
        "details": {k: v for k, v in result.details.items() if isinstance(v, (int, float, str))},
        "metrics": plain(result.metrics),
    }
