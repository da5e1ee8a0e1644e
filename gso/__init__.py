"""Surfaces that can be built from flat sheets: developable, in pieces or strips, laid flat, cut.

>>> import gso
>>> mesh = gso.load("examples/panel.obj")                     # doctest: +SKIP
>>> result = gso.tno.optimize(mesh)                           # doctest: +SKIP
>>> result.save("panel_developable.obj")                      # doctest: +SKIP
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    # The same names for type checkers and editors; they are imported at first use.
    from gso import (
        constraints,
        dataset,
        exact,
        hybrid,
        io,
        metrics,
        net,
        plot,
        recognition,
        rulings,
        seams,
        tno,
    )
    from gso import executors as executors
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
        SchedulerError,
        WeightsError,
    )
    from gso.io import as_mesh, load, save, save_spline
    from gso.mesh import Mesh, topology
    from gso.pattern import Pattern
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
    from gso.unfolding.unfold_mesh import unfold
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
    "Pattern",
    "PlanarFaces",
    "Progress",
    "Result",
    "RuledOptions",
    "Ruling",
    "SchedulerError",
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
    "exact",
    "executors",
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
    "recognition",
    "rulings",
    "save",
    "save_spline",
    "seams",
    "smooth_strips",
    "strips",
    "tno",
    "topology",
    "unfold",
    "verdict",
]

#: Names by their modules.
_PLACES = {
    "gso.constraints": (
        "Fixed FixedBoundary FixedLengths Glue Handle OnCurve PlanarFaces Ruling SlidingBoundary "
        "SmoothCurves SymmetryPlane"
    ),
    "gso.errors": (
        "BackendError ConvergenceWarning DatasetError GSOError MeshError OptionError "
        "SchedulerError WeightsError"
    ),
    "gso.io": "as_mesh load save save_spline",
    "gso.mesh": "Mesh topology",
    "gso.pattern": "Pattern",
    "gso.result": "Result",
    "gso.ruled.loft": "loft",
    "gso.ruled.paneling.lay_strips": "strips",
    "gso.ruled.smooth.smooth_surface": "smooth_strips",
    "gso.seams": "cut pieces",
    "gso.spline": "BSplineSurface",
    "gso.spline.fit": "fit_spline",
    "gso.status": "Progress Status",
    "gso.tasks.options": "Options",
    "gso.unfolding.unfold_mesh": "unfold",
    "gso.workshop.fabricate": "fabricate",
}
_NAMES = {name: module for module, names in _PLACES.items() for name in names.split()}
_OPTIONS = {
    "BendOptions": "gso.tasks.bend",
    "ConformalOptions": "gso.tasks.conformal",
    "DenoiseOptions": "gso.tasks.denoise",
    "DevelopableOptions": "gso.tasks.developable",
    "FlattenOptions": "gso.tasks.flatten",
    "IsometryOptions": "gso.tasks.developable.joint_isometry",
    "RuledOptions": "gso.ruled.paneling.options",
}


def __getattr__(name: str) -> object:
    if name in _NAMES:
        value = getattr(importlib.import_module(_NAMES[name]), name)
    elif name in _OPTIONS:
        value = importlib.import_module(_OPTIONS[name]).Options
    elif name == "__version__":
        from importlib.metadata import version

        value = version("gso")
    elif name in __all__:
        value = importlib.import_module(f"gso.{name}")
    else:
        raise AttributeError(f"module 'gso' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
