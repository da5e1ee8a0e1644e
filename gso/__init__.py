"""Optimise quad and grid surfaces: make them developable, flatten them, denoise them.

>>> import gso
>>> mesh = gso.load("examples/panel.obj")                     # doctest: +SKIP
>>> result = gso.tno.optimize(mesh)                           # doctest: +SKIP
>>> result.save("panel_developable.obj")                      # doctest: +SKIP
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    # The same names for type checkers and editors; they are imported at first use.
    from gso import constraints, dataset, hybrid, io, metrics, net, plot, rulings, seams, tno
    from gso import verdict as verdict
    from gso.constraints import (
        Fixed,
        FixedBoundary,
        FixedLengths,
        Glue,
        Handle,
        OnCurve,
        PlanarFaces,
        Ruling,
        SlidingBoundary,
        SmoothCurves,
        SymmetryPlane,
    )
    from gso.errors import (
        BackendError,
        ConvergenceWarning,
        DatasetError,
        GSOError,
        MeshError,
        OptionError,
        WeightsError,
    )
    from gso.io import as_mesh, load, save, save_spline
    from gso.mesh import Mesh, topology
    from gso.result import Result
    from gso.ruled.loft import loft
    from gso.ruled.paneling.lay_strips import strips
    from gso.ruled.paneling.options import Options as RuledOptions
    from gso.ruled.smooth.smooth_surface import smooth_strips
    from gso.seams import cut, pieces
    from gso.spline import BSplineSurface
    from gso.spline.fit import fit_spline
    from gso.status import Progress, Status
    from gso.tasks.bend import Options as BendOptions
    from gso.tasks.conformal import Options as ConformalOptions
    from gso.tasks.denoise import Options as DenoiseOptions
    from gso.tasks.developable import Options as DevelopableOptions
    from gso.tasks.developable.joint_isometry import Options as IsometryOptions
    from gso.tasks.flatten import Options as FlattenOptions
    from gso.tasks.options import Options
    from gso.workshop.fabricate import fabricate

    __version__: str

__all__ = [
    "BSplineSurface",
    "BackendError",
    "BendOptions",
    "ConformalOptions",
    "ConvergenceWarning",
    "DatasetError",
    "DenoiseOptions",
    "DevelopableOptions",
    "Fixed",
    "FixedBoundary",
    "FixedLengths",
    "FlattenOptions",
    "GSOError",
    "Glue",
    "Handle",
    "IsometryOptions",
    "Mesh",
    "MeshError",
    "OnCurve",
    "OptionError",
    "Options",
    "PlanarFaces",
    "Progress",
    "Result",
    "RuledOptions",
    "Ruling",
    "SlidingBoundary",
    "SmoothCurves",
    "Status",
    "SymmetryPlane",
    "WeightsError",
    "__version__",
    "as_mesh",
    "constraints",
    "cut",
    "dataset",
    "fabricate",
    "fit_spline",
    "hybrid",
    "io",
    "load",
    "loft",
    "metrics",
    "net",
    "pieces",
    "plot",
    "rulings",
    "save",
    "save_spline",
    "seams",
    "smooth_strips",
    "strips",
    "tno",
    "topology",
    "verdict",
]

_NAMES = {
    "Mesh": "gso.mesh",
    "load": "gso.io",
    "save": "gso.io",
    "save_spline": "gso.io",
    "fit_spline": "gso.spline.fit",
    "BSplineSurface": "gso.spline",
    "as_mesh": "gso.io",
    "Result": "gso.result",
    "Status": "gso.status",
    "Progress": "gso.status",
    "GSOError": "gso.errors",
    "MeshError": "gso.errors",
    "OptionError": "gso.errors",
    "BackendError": "gso.errors",
    "WeightsError": "gso.errors",
    "DatasetError": "gso.errors",
    "ConvergenceWarning": "gso.errors",
    "Options": "gso.tasks.options",
    "cut": "gso.seams",
    "pieces": "gso.seams",
    "fabricate": "gso.workshop.fabricate",
    "loft": "gso.ruled.loft",
    "strips": "gso.ruled.paneling.lay_strips",
    "smooth_strips": "gso.ruled.smooth.smooth_surface",
    "Fixed": "gso.constraints",
    "FixedBoundary": "gso.constraints",
    "FixedLengths": "gso.constraints",
    "Glue": "gso.constraints",
    "Handle": "gso.constraints",
    "OnCurve": "gso.constraints",
    "PlanarFaces": "gso.constraints",
    "Ruling": "gso.constraints",
    "SlidingBoundary": "gso.constraints",
    "SmoothCurves": "gso.constraints",
    "SymmetryPlane": "gso.constraints",
}
_OPTIONS = {
    "DevelopableOptions": "gso.tasks.developable",
    "IsometryOptions": "gso.tasks.developable.joint_isometry",
    "RuledOptions": "gso.ruled.paneling.options",
    "FlattenOptions": "gso.tasks.flatten",
    "DenoiseOptions": "gso.tasks.denoise",
    "BendOptions": "gso.tasks.bend",
    "ConformalOptions": "gso.tasks.conformal",
}
_MODULES = (
    "constraints",
    "tno",
    "verdict",
    "metrics",
    "topology",
    "io",
    "dataset",
    "net",
    "hybrid",
    "plot",
    "rulings",
    "seams",
)


#: Modules whose public name differs from their place.
_MOVED = {"topology": "gso.mesh.topology"}


def __getattr__(name: str) -> Any:
    if name in _NAMES:
        value = getattr(importlib.import_module(_NAMES[name]), name)
    elif name in _OPTIONS:
        value = importlib.import_module(_OPTIONS[name]).Options
    elif name == "__version__":
        from importlib.metadata import version

        value = version("gso")
    elif name in _MODULES:
        value = importlib.import_module(_MOVED.get(name, f"gso.{name}"))
    else:
        raise AttributeError(f"module 'gso' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
