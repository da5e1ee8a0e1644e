"""Catalogue of the available nets and their cards; it does not need PyTorch.

A card is the JSON file beside the weights that describes a net and its training.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

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
#: What names a net: a name, a .safetensors file, or the net itself.
NetLike: TypeAlias = "AnyPath | Net"

#: Nets that are applied in sequence, each to the result of the one before.
CHAINS = {"net-cf": ("net-c", "net-f")}


def read_card(path: AnyPath) -> Json:
    """Read the card of a .safetensors file.

    Raises
    ------
    WeightsError
        The card is missing, damaged, or not a card of this package.
    """
    place = Path(path).with_suffix(".json")
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
    """Return the file of a net, given by its name or as a .safetensors file.

    Raises
    ------
    WeightsError
        No net of this name comes with the package, or the name stands for several nets.
    """
    name = str(model)
    if Path(name).suffix == ".safetensors":
        return Path(name)
    if name in CHAINS:
        parts = " or ".join(CHAINS[name])
        raise WeightsError(f"{name!r} is several nets, one after the other; take {parts}")
    path = FOLDER / f"{name}.safetensors"
    if Path(name).name != name or not path.exists():
        raise WeightsError(
            f"no net {name!r} comes with the package; {choices(name, available())}; "
            "or give a .safetensors file"
        )
    return path


def chain(model: AnyPath | None, task: str) -> tuple[Path, ...]:
    """Return the files of the nets that a name stands for, in the order of application."""
    kind = tasks.get(task)
    name = kind.default if model is None else model
    parts = CHAINS.get(name, (name,)) if isinstance(name, str) else (name,)
    return tuple(located(part) for part in parts)
