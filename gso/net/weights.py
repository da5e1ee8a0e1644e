"""Files of nets: weights as safetensors, with a JSON card that describes net and training."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

import torch
from safetensors import SafetensorError
from safetensors.torch import load as unpacked
from safetensors.torch import save as packed

from gso.errors import GSOError, OptionError, WeightsError
from gso.io.atomic import write_bytes
from gso.io.json_file import write_json
from gso.net.catalogue import FORMAT, card_of, exported, located, modified, verified
from gso.net.models.base import Net, device_of
from gso.net.models.coarse import CoarseNet
from gso.net.models.gsonet import GSONet
from gso.registry import Plugins
from gso.spelling import choices
from gso.typing import AnyPath, Json

#: Kinds of nets, as cards and configurations name them; :func:`add_kind` adds to them.
KINDS: dict[str, type[Net]] = {"coarse": CoarseNet, "gsonet": GSONet}


def _no_net(found: object) -> str:
    is_net = isinstance(found, type) and issubclass(found, Net)
    return "" if is_net else "it is no subclass of gso.net.models.Net"


#: Kinds of nets of installed packages.
_PLUGINS = Plugins("gso.net.kinds", _no_net)


def _kinds() -> dict[str, type[Net]]:
    """Return all kinds, those of installed packages among them."""
    return {**dict(_PLUGINS.items()), **KINDS}


def add_kind(name: str, cls: type[Net]) -> None:
    """Register a kind of nets from outside the package, for this process.

    Parameters
    ----------
    name : str
        Name in configurations and cards.
    cls : type
        Subclass of :class:`gso.net.models.base.Net`; its constructor takes the task and the
        other settings, and passes all of them on to that of the base class.

    Raises
    ------
    OptionError
        The name is taken, or `cls` is not a subclass of Net.
    """
    if name in KINDS or name in _PLUGINS.names():
        raise OptionError(f"{name!r} is taken among the kinds of nets; choose another name")
    if not (isinstance(cls, type) and issubclass(cls, Net)):
        raise OptionError(f"{cls!r} is not a subclass of gso.net.models.base.Net")
    KINDS[name] = cls


def make(settings: Json) -> Net:
    """Make a new net from ``{"kind": ..., "task": ..., ...}``.

    Raises
    ------
    OptionError
        The kind or a setting is unknown, or out of range.

    Examples
    --------
    >>> make({"kind": "gsonet", "task": "flatten", "channels": 8}).settings["channels"]
    8
    """
    rest = dict(settings)
    kind = rest.pop("kind", None)
    cls = KINDS.get(kind) or _PLUGINS.get(kind) if isinstance(kind, str) else None
    if cls is None:
        known = [*KINDS, *_PLUGINS.names()]
        raise OptionError(f"no kind {kind!r} of net; {choices(kind, known)}")
    try:
        made: Net = cls(**rest)
        return made
    except (TypeError, ValueError, AttributeError) as error:
        raise OptionError(f"settings of the net: {error}") from None


def kind_of(net: Net) -> str:
    """Return the kind of a net, as cards name it."""
    return next(name for name, cls in _kinds().items() if type(net) is cls)


def save(
    net: Net,
    path: AnyPath,
    card: Json | None = None,
    *,
    dtype: torch.dtype = torch.float16,
) -> Json:
    """Write a net and its card.

    Parameters
    ----------
    net : Net
        The net, on any device.
    path : path
        The .safetensors file; the card is written beside it with the suffix .json.
    card : dict, optional
        Further entries of the card: data, configuration, hardware, metrics.
    dtype : torch.dtype
        Type of the numbers in the file.

    Returns
    -------
    dict
        The card.
    """
    tensors = {k: v.detach().to("cpu", dtype).contiguous() for k, v in net.state_dict().items()}
    data = packed(tensors)
    record = {
        **(card or {}),
        "format": FORMAT,
        "model": {"kind": kind_of(net), **net.settings},
        "parameters": sum(p.numel() for p in net.parameters()),
        "sha256": hashlib.sha256(data).hexdigest(),
    }
    target = Path(path)
    write_bytes(target, data)
    write_json(card_of(target), record)
    return record


def load(model: AnyPath, device: str | torch.device | None = None) -> Net:
    """Load a net with its weights, an ``nn.Module`` in evaluation mode.

    No code in the files is executed.

    Parameters
    ----------
    model : str or path
        Name of a net that comes with the package (see :func:`gso.net.available`), or a
        .safetensors file with its card beside it.
    device : str or torch.device, optional
        Device of the net: "cpu", "cuda" ...; by default the GPU if there is one.

    Returns
    -------
    Net
        It maps grids (B, H, W, 3) of the unit ball, in single precision, to results
        (B, H, W, 3), or to flat images (B, H, W, 2). :func:`gso.net.predict` applies it to
        surfaces of any size and position.

    Raises
    ------
    OptionError
        There is no such device.
    WeightsError
        The file or its card is missing or damaged, they do not belong together, or the file
        does not hold the net that the card describes.

    Examples
    --------
    >>> net = load("developable", device="cpu")
    >>> net.task, net.training, isinstance(net, torch.nn.Module)
    ('developable', False, True)
    """
    path = located(model)
    if exported(path):
        raise WeightsError(
            f"{path} is an exported net, without weights to load; "
            "give it to gso.net.predict, or load the .safetensors file"
        )
    where = device if isinstance(device, torch.device) else device_of(device)
    card, data = verified(path)
    net = _filled(card["model"], data, path)
    return placed(net, where).eval()


def placed(net: Net, device: str | torch.device) -> Net:
    """Move a net to a device, with weights in the channels-last memory format."""
    return net.to(device=device, memory_format=torch.channels_last)  # type: ignore[call-overload, no-any-return]


def _filled(settings: Json, data: bytes, path: Path) -> Net:
    """Make a net with the weights of a file."""
    try:
        # On the meta device, which allocates no memory: compare the card with the file first.
        with torch.device("meta"):
            shapes = {k: v.shape for k, v in make(settings).state_dict().items()}
        tensors = unpacked(data)
    except (GSOError, SafetensorError, ValueError, TypeError, RuntimeError, MemoryError) as error:
        raise WeightsError(f"{path} holds no net of this package: {error}") from None
    if {k: v.shape for k, v in tensors.items()} != shapes:
        raise WeightsError(f"{path} holds other tensors than the net of its card")
    tensors = {k: v.float() for k, v in tensors.items()}
    if not all(bool(v.isfinite().all()) for v in tensors.values()):
        raise WeightsError(f"{path} has weights that are not finite")
    net = make(settings)
    net.load_state_dict(tensors)
    return net


def cached(path: Path, device: torch.device) -> Net:
    """Load a net with :func:`load`, and cache it by path, device and modification time."""
    return _cached(path, device, modified(path))


@lru_cache(maxsize=16)
def _cached(path: Path, device: torch.device, stamp: int) -> Net:
    return load(path, device=device)
