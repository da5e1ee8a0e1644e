"""Large designs, decimated for the solve."""

from __future__ import annotations

from dataclasses import dataclass, replace

from gso import decimation
from gso.mesh import Mesh
from gso.result import Result, StripsResult
from gso.ruled.paneling.strips_request import StripsRequest
from gso.ruled.paneling.surface_strips import wanted
from gso.status import Status

#: Number of triangles that a larger design is decimated to, and the share of the allowed distance
#: within which.
_LIGHT, _NEAR = 6_000, 0.35


@dataclass(frozen=True)
class LightDesign:
    """A design, the mesh that is solved in its place, and the distance allowed from that.

    Attributes
    ----------
    design, mesh : Mesh
        The same mesh where nothing is decimated.
    allowed : float or None
    """

    design: Mesh
    mesh: Mesh
    allowed: float | None

    @classmethod
    def of(cls, design: Mesh, allowed: float | None, *, named: bool = False) -> LightDesign:
        """Decimate a large design, unless vertices of it are named or no distance is allowed."""
        if allowed is None or named:
            return cls(design, design, allowed)
        light, away = decimation.within(design, _NEAR * allowed, _LIGHT)
        return cls(design, light, allowed - away)

    def whole(self, result: Result, request: StripsRequest) -> Result:
        """Return strips of the light mesh as strips of the design."""
        if self.mesh is self.design:
            return result
        if not isinstance(result, StripsResult):
            return replace(result, design=self.design, mesh=self.design, flat=None, pattern=None)
        surface = result.ruled.on(self.design)
        status = result.status
        if status is not Status.CANCELLED:
            met = wanted(request.options, request.max_deviation, 1.0).met(surface)
            status = Status.CONVERGED if met else Status.TARGET_MISSED
        return replace(
            result, design=self.design, status=status, **StripsResult.attributes(surface)
        )
