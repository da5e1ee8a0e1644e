"""Neural networks that approximate the optimiser's results in a forward pass (GSO-Net)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.first_use import at_first_use

if TYPE_CHECKING:
    from gso.net.catalogue import CHAINS, available, located, read_card
    from gso.net.foreign_weights import import_weights
    from gso.net.inference.prediction import predict
    from gso.net.models.coarse import CoarseNet
    from gso.net.models.gsonet import GSONet
    from gso.net.onnx_file import export
    from gso.net.tasks import add_task
    from gso.net.training.loop import train
    from gso.net.training.shipped_nets import train_all
    from gso.net.weights import KINDS, add_kind, kind_of, load, make, save

__all__ = [
    "CHAINS",
    "KINDS",
    "CoarseNet",
    "GSONet",
    "add_kind",
    "add_task",
    "available",
    "export",
    "import_weights",
    "kind_of",
    "load",
    "located",
    "make",
    "predict",
    "read_card",
    "save",
    "train",
    "train_all",
]

# PyTorch is loaded only when a net is used.
__getattr__, __dir__ = at_first_use(
    __name__,
    {
        "catalogue": "CHAINS available located read_card",
        "foreign_weights": "import_weights",
        "onnx_file": "export",
        "inference.prediction": "predict",
        "models.coarse": "CoarseNet",
        "models.gsonet": "GSONet",
        "tasks": "add_task",
        "training.loop": "train",
        "training.shipped_nets": "train_all",
        "weights": "KINDS add_kind kind_of load make save",
    },
)
