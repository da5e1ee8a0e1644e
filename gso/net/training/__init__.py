"""Training of nets."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.first_use import at_first_use

if TYPE_CHECKING:
    from gso.net.training.config import Config, Phase, from_dict, read
    from gso.net.training.data import Batch
    from gso.net.training.phase_objective import Objective
    from gso.net.training.shipped_nets import HOURS
    from gso.net.training.solver_energy import Developable, Strain

__all__ = [
    "HOURS",
    "Batch",
    "Config",
    "Developable",
    "Objective",
    "Phase",
    "Strain",
    "from_dict",
    "read",
]

# The tasks of nets are read without PyTorch.
__getattr__, __dir__ = at_first_use(
    __name__,
    {
        "config": "Config Phase from_dict read",
        "data": "Batch",
        "phase_objective": "Objective",
        "shipped_nets": "HOURS",
        "solver_energy": "Developable Strain",
    },
)
