"""Catalogue of the available nets, their files and cards; it does not need PyTorch.

A card is the JSON file beside the weights that describes a net and its training:
``NAME.json`` of ``NAME.safetensors``, ``NAME.onnx.json`` of ``NAME.onnx``.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, cast

from gso.errors import WeightsError
from gso.net import tasks
from gso.spelling import choices
from gso.typing import AnyPath, Json

if TYPE_CHECKING:
    from gso.net.models.base import Net

#: Nets that come with the package: NAME.safetensors and NAME.json.
FOLDER = Path(__file__).parent / "weights"
#: Version of the card's format.
FORMAT = 1
#: Samples along each side at which nets are trained.
SIZE = 64
#: Suffix of exported nets.
EXPORTED = ".onnx"
#: Size limit of files in bytes, far above that of any net of this package.
_LARGEST = 1 << 30
#: What names a net: a name, a .safetensors or .onnx file, or the net itself; a sequence of
#: these is applied one after the other.
NetLike: TypeAlias = "AnyPath | Net | Sequence[AnyPath | Net]"

#: Nets that are applied in sequence, each to the result of the one before.
CHAINS = {"net-cf": ("net-c", "net-f")}


def exported(model: object) -> bool:
    """Tell whether something is the path of an exported net, a .onnx file.

    >>> exported("developable"), exported("developable.onnx")
    (False, True)
    """
    return isinstance(model, str | Path) and Path(model).suffix == EXPORTED


def in_turn(model: NetLike | None) -> Sequence[AnyPath | Net | None]:
    """Return the nets that are given to be applied in turn: those of a sequence, or the one.

    >>> in_turn(["net-c", "second.onnx"]), in_turn(None)
    (['net-c', 'second.onnx'], [None])
    """
    return model if isinstance(model, list | tuple) else [cast("AnyPath | Net | None", model)]


def card_of(path: AnyPath) -> Path:
    """Return the place of the card of a net's file.

    The card of an exported net has another name than that of the .safetensors file beside it.
    """
    place = Path(path)
    return place.with_suffix(".onnx.json" if exported(place) else ".json")


def missing_packages(model: NetLike | None) -> str:
    """Say which packages are missing for a net, and what to do; empty if none is.

    Parameters
    ----------
    model : str, path, Net or sequence
        The net; None for one that comes with the package.
    """
    known = [exported(one) for one in in_turn(model)]
    if any(known) and find_spec("onnxruntime") is None:
        return 'exported nets need onnxruntime: pip install ".[onnx]" in the folder of gso'
    if not all(known) and (find_spec("torch") is None or find_spec("safetensors") is None):
        return (
            'nets need torch and safetensors: pip install ".[net]" in the folder of gso, or give '
            "an exported net (a .onnx file, see gso.net.export)"
        )
    return ""


def verified(path: Path) -> tuple[Json, bytes]:
    """Read the card of a net's file, and the file's content, which must match the card.

    Raises
    ------
    WeightsError
        The file or its card is missing or damaged, or they do not belong together.
    """
    card = read_card(path)
    try:
        size = path.stat().st_size
        if size > _LARGEST:
            raise WeightsError(f"{path} has {size} bytes: no net of this package")
        data = path.read_bytes()
    except OSError as error:
        raise WeightsError(f"{path} cannot be read: {error.strerror}") from None
    if hashlib.sha256(data).hexdigest() != card["sha256"]:
        raise WeightsError(f"{path} is damaged: it is not the file that its card describes")
    return card, data


def modified(path: Path) -> int:
    """Return the time of a file's last change in nanoseconds, 0 if there is no such file."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def read_card(path: AnyPath) -> Json:
    """Read the card of a .safetensors or .onnx file.

    Raises
    ------
    WeightsError
        The card is missing, damaged, or not a card of this package.
    """
    place = card_of(path)
    try:
        card: Json = json.loads(place.read_bytes())
    except OSError as error:
        raise WeightsError(f"{place} cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise WeightsError(f"{place} is no card of a net: {error}") from None
    if not isinstance(card, dict) or card.get("format") != FORMAT:
        raise WeightsError(f"{place} is no card of a net in format {FORMAT}; get the file anew")
    if not isinstance(card.get("model"), dict) or not isinstance(card.get("sha256"), str):
        raise WeightsError(f"{place} does not say which net it belongs to; get the file anew")
    return card


def available(task: str | None = None) -> list[str]:
    """List the names of the nets that come with the package, all or those of a task.

    >>> set(available("flatten")) <= set(available())
    True
    """
    found = sorted(path.stem for path in FOLDER.glob("*.safetensors"))
    found += [name for name, parts in CHAINS.items() if set(parts) <= set(found)]
    if task is None:
        return found
    first = {name: CHAINS.get(name, (name,))[0] for name in found}
    return [n for n in found if read_card(located(first[n]))["model"].get("task") == task]


def located(model: AnyPath) -> Path:
    """Return the file of a net, given by its name or as a .safetensors or .onnx file.

    Raises
    ------
    WeightsError
        No net of this name comes with the package, or the name stands for several nets.
    """
    name = str(model)
    if Path(name).suffix in (".safetensors", EXPORTED):
        return Path(name)
    if name in CHAINS:
        parts = " or ".join(CHAINS[name])
        raise WeightsError(f"{name!r} is several nets, one after the other; take {parts}")
    path = FOLDER / f"{name}.safetensors"
    if Path(name).name != name or not path.exists():
        raise WeightsError(
            f"no net {name!r} comes with the package; {choices(name, available())}; "
            "or give a .safetensors or .onnx file"
        )
    return path


def chain(model: AnyPath | None, task: str) -> tuple[Path, ...]:
    """Return the files of the nets that a name stands for, in the order of application."""
    name = tasks.get(task).default if model is None else model
    return tuple(located(part) for part in parts(name))


def parts(model: AnyPath) -> tuple[AnyPath, ...]:
    """Return the names of the nets that a name stands for, in the order of application.

    >>> parts("net-cf"), parts("net-c")
    (('net-c', 'net-f'), ('net-c',))
    """
    return CHAINS.get(model, (model,)) if isinstance(model, str) else (model,)
