"""Training of all nets that come with the package, each after the nets that it needs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from gso.errors import OptionError
from gso.net.training.config import read
from gso.net.training.data import Tick
from gso.net.training.loop import MODEL, Report, train
from gso.quantities import as_positive
from gso.spelling import choices
from gso.typing import AnyPath, Json

#: Hours of each net, on two processor cores. The order is that of training.
HOURS = {
    "developable-fast": 5.2,
    "developable": 1.25,
    "developable-start": 1.1,
    "flatten-strain": 1.25,
    "net-c": 2.35,
    "net-f": 0.85,
    "flatten": 1.25,
    "denoise": 0.75,
    "net-s": 0.85,
    "flatten-w": 0.5,
}
#: Settings of a configuration that name another net.
_NETS = ("init", "through", "teacher")


def train_all(
    data: AnyPath,
    out: AnyPath,
    *,
    hours: float | Mapping[str, float] | None = None,
    device: str | None = None,
    show: Callable[[str, Report], None] | None = None,
    tick: Tick | None = None,
    **changes: object,
) -> dict[str, Json]:
    """Train every net of the package, or resume where an interrupted call stopped.

    Each net has the configuration of its name. Where that names another net, the one trained
    here is used in its place. Nets that are complete are validated again, but not trained.

    Parameters
    ----------
    data : path
        Dataset with the splits train and validation, and with labels.
    out : path
        Folder; the run of each net is in a folder of its name.
    hours : float or mapping, optional
        Hours of every net, or of some by name; the others have those of :data:`HOURS`.
    device : str, optional
        As of :func:`gso.net.train`.
    show : callable, optional
        Progress callback, called with the name of the net and its :class:`Report`.
    tick : callable, optional
        Progress callback for preparations, as of :func:`gso.net.train`.
    changes
        Settings that replace those of all configurations, unless they are None. `steps` and
        `epochs` replace the hours, too.

    Returns
    -------
    dict
        The card of each net by name.

    Raises
    ------
    OptionError
        `hours` names no net or is not positive, or it is given beside steps or epochs; or an
        error of :func:`gso.net.train`, as are all others.
    """
    minutes = _minutes(hours, counted=any(changes.get(k) is not None for k in ("steps", "epochs")))
    cards: dict[str, Json] = {}
    for name in HOURS:
        config = read(name, **changes)
        used = {word: getattr(config, word) for word in _NETS}
        files = {word: str(Path(out, net, MODEL)) for word, net in used.items() if net in cards}
        cards[name] = train(
            replace(config, **files),  # type: ignore[arg-type]
            data,
            Path(out, name),
            minutes=minutes.get(name),
            device=device,
            show=None if show is None else _named(show, name),
            tick=tick,
        )
    return cards


def _named(show: Callable[[str, Report], None], name: str) -> Callable[[Report], None]:
    return lambda report: show(name, report)


def _minutes(hours: float | Mapping[str, float] | None, *, counted: bool) -> dict[str, float]:
    """Return the minutes of each net; none where the length is counted in steps."""
    if counted and hours is not None:
        raise OptionError("hours, steps and epochs all give the length of the runs; take one")
    if isinstance(hours, Mapping):
        for name in hours:
            if name not in HOURS:
                raise OptionError(f"hours: no net {name!r}; {choices(name, HOURS)}")
        given = HOURS | {**hours}
    elif hours is not None:
        given = dict.fromkeys(HOURS, hours)
    else:
        given = {} if counted else HOURS
    return {name: 60.0 * as_positive(value, f"hours of {name}") for name, value in given.items()}
