"""What is specific to one task of nets."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gso.metrics import SurfaceLike
from gso.typing import Array

if TYPE_CHECKING:
    from gso.net.training.config import Phase
    from gso.net.training.data import Batch
    from gso.net.training.phase_objective import Cost


@dataclass(frozen=True)
class NetTask:
    """A task of nets: their results, training losses and metrics.

    Attributes
    ----------
    name : str
        Name of the task.
    components : {3, 2}
        Components of a result: 3 for surfaces, 2 for flat images.
    default : str
        Net that is used unless another is named.
    score : str
        Metric by which trained nets are compared; lower is better.
    figures : callable
        Metrics of one result, ``figures(design, result)``, for arrays (H, W, 3) and (H, W, d).
        Where `noisy`, the design is the surface without noise.
    terms : tuple of str
        Terms of the loss "published" that can be used.
    energy : callable, optional
        The loss "energy": ``energy(batch, phase, progress)`` returns a function that maps
        results (B, H, W, d) to energies (B,), or to its weighted terms (B,) by name, which the
        training curves then show.
    noisy : bool
        Whether inputs have noise and labels are the surfaces without it. The loss "clean" takes
        the place of "label" and "energy".
    start : str
        Net whose results are starts of the optimiser, unless another is named. Empty where the
        optimiser gains nothing by one: its method is in closed form, or its own start is as good.
    refines : bool
        Whether a net can be trained on the results of another net of the task.
    displacement : float
        Typical displacement, in radii of the unit ball.
    harm : callable, optional
        ``harm(surface)``, for arrays (H, W, 3) and meshes: numbers that no result may raise above
        those of the input.
    """

    name: str
    components: int
    default: str
    score: str
    figures: Callable[[Array, Array], Mapping[str, float]]
    terms: tuple[str, ...]
    energy: Callable[[Batch, Phase, float], Cost] | None = None
    noisy: bool = False
    start: str = ""
    refines: bool = False
    displacement: float = 0.01
    harm: Callable[[SurfaceLike], tuple[float, ...]] | None = None

    @property
    def flat(self) -> bool:
        """Whether results are flat images."""
        return self.components == 2
