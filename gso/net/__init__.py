"""Neural networks that approximate the optimiser's results in a forward pass (GSO-Net)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.first_use import at_first_use

if TYPE_CHECKING:
    from gso.net.catalogue import NetLike, available, chain
    from gso.net.inference.prediction import predict
    from gso.net.models.coarse import CoarseNet
    from gso.net.models.gsonet import GSONet
    from gso.net.tasks import add_task
    from gso.net.training.loop import train
    from gso.net.weights import add_kind, load, save

__all__ = [
    "CoarseNet",
    "GSONet",
    "NetLike",
    "add_kind",
    "add_task",
    "available",
    "chain",
    "load",
    "predict",
    "save",
    "train",
]

# PyTorch is loaded only when a net is used.
__getattr__, __dir__ = at_first_use(
    __name__,
    {
        "catalogue": "NetLike available chain",
        "inference.prediction": "predict",
        "models.coarse": "CoarseNet",
        "models.gsonet": "GSONet",
        "tasks": "add_task",
        "training.loop": "train",
        "weights": "add_kind load save",
    },
)
