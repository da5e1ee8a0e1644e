"""Import of GSO-Net weights from other implementations, such as the authors' files."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import torch
from safetensors import SafetensorError
from safetensors.torch import load as unpacked
from torch import Tensor

from gso.errors import WeightsError
from gso.net import weights
from gso.net.models.gsonet import GSONet
from gso.typing import AnyPath, Json

#: Size limit of files in bytes: an optimiser's state may be beside the weights.
_LARGEST = 1 << 30


def import_weights(
    path: AnyPath,
    out: AnyPath,
    *,
    task: str = "developable",
    channels: int = 16,
    blocks: int = 4,
    tanh: bool = False,
) -> Json:
    """Convert the weights of a GSO-Net from another implementation, and write them with a card.

    Tensors are matched by their order and shape; their names do not matter. The order is that
    of the published architecture: first convolution; from fine to coarse the blocks of a level
    and the convolution below them; the coarsest blocks; from coarse to fine a transposed
    convolution and the blocks above it; last convolution. In a block the three distilling
    convolutions come first, then the last 3 x 3 one, then the 1 x 1 one.

    Parameters
    ----------
    path : path
        A state dict written by ``torch.save``, also as an entry of a checkpoint, or a
        .safetensors file. Only tensors are unpickled, no other objects. Safetensors files do
        not keep the order of tensors: there it is that of the names, with numbers as numbers.
    out : path
        The .safetensors file to write, in single precision; the card is written beside it.
    task : str
        Task of the net. A flatten net has 2 output channels, the others 3.
    channels, blocks, tanh
        Settings of the architecture; see :class:`gso.net.GSONet`.

    Returns
    -------
    dict
        The card.

    Raises
    ------
    WeightsError
        The file is missing or unsafe, or a tensor does not fit; the message names it.
    OptionError
        The task or a setting is unknown or out of range.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> net = GSONet("flatten", channels=4, blocks=1)
    >>> renamed = {f"layer.{k}": v for k, v in enumerate(net.state_dict().values())}
    >>> torch.save(renamed, folder / "theirs.pth")
    >>> out = folder / "ours.safetensors"
    >>> card = import_weights(folder / "theirs.pth", out, task="flatten", channels=4, blocks=1)
    >>> card["parameters"] == sum(p.numel() for p in net.parameters())
    True
    """
    place = Path(path)
    net = GSONet(task, channels=channels, blocks=blocks, tanh=tanh)
    try:
        if place.stat().st_size > _LARGEST:
            raise WeightsError(f"{place} has over {_LARGEST:,} bytes: no net of this architecture")
        data = place.read_bytes()
    except OSError as error:
        raise WeightsError(f"{place} cannot be read: {error.strerror}") from None
    net.load_state_dict(_matched(_tensors(place, data), net.state_dict(), place))
    card: Json = {
        "name": Path(out).stem,
        "imported": {"file": place.name, "sha256": hashlib.sha256(data).hexdigest()},
    }
    return weights.save(net, out, card, dtype=torch.float32)


def _tensors(place: Path, data: bytes) -> dict[str, Tensor]:
    """Return the tensors of a file by name, in order."""
    if place.suffix == ".safetensors":
        try:
            found = unpacked(data)
        except (SafetensorError, ValueError, RuntimeError) as error:
            raise WeightsError(f"{place} is no safetensors file: {error}") from None
        return {name: found[name] for name in sorted(found, key=_natural)}
    try:
        # Others store weights like this. With weights_only PyTorch makes tensors and plain
        # containers only, and refuses every other object, so that no code of the file runs.
        state = torch.load(place, map_location="cpu", weights_only=True)  # noqa: TID251
    except Exception as error:  # a file that is none may fail anywhere in the reader
        raise WeightsError(
            f"{place} is no state dict of tensors only ({str(error).splitlines()[0]}); write one "
            "with torch.save(net.state_dict(), FILE)"
        ) from None
    dicts = [state, *state.values()] if isinstance(state, dict) else []
    given = [d for d in dicts if isinstance(d, dict) and d and all(map(_is_weight, d.items()))]
    if len(given) != 1:
        raise WeightsError(
            f"{place} has {len(given)} dictionaries of named tensors; it must have one: write "
            "torch.save(net.state_dict(), FILE)"
        )
    return given[0]


def _is_weight(item: tuple[object, object]) -> bool:
    return isinstance(item[0], str) and isinstance(item[1], Tensor)


def _natural(name: str) -> list[tuple[int, str]]:
    """Key that sorts names with numbers as numbers."""
    return [(int(p), "") if p.isdigit() else (-1, p) for p in re.split(r"(\d+)", name)]


def _matched(given: dict[str, Tensor], wanted: dict[str, Tensor], place: Path) -> dict[str, Tensor]:
    """Return the tensors under the names of the net."""
    found: dict[str, Tensor] = {}
    for number, ((theirs, tensor), (ours, like)) in enumerate(
        zip(given.items(), wanted.items(), strict=False), 1
    ):
        if tensor.shape != like.shape:
            raise WeightsError(
                f"{place}: tensor {number}, {theirs!r}, is {_shape(tensor)}; there the net has "
                f"{ours!r}, {_shape(like)}: it is another architecture, order or task"
            )
        if not bool(tensor.isfinite().all()):
            raise WeightsError(f"{place}: tensor {number}, {theirs!r}, has numbers not finite")
        found[ours] = tensor.float()
    for names, what in ((given, "nothing in the net fits"), (wanted, "the file has nothing for")):
        if len(names) > len(found):
            first = [*names][len(found)]
            raise WeightsError(
                f"{place} has {len(given)} tensors, the net {len(wanted)}: {what} {first!r}"
            )
    return found


def _shape(tensor: Tensor) -> str:
    return " x ".join(map(str, tensor.shape)) or "a number"
