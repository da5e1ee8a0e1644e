"""``gso train``: train a net from a configuration and a dataset."""

from __future__ import annotations

import ctypes
import os
from contextlib import closing
from typing import TYPE_CHECKING, Any

import click

from gso.cli import progress
from gso.cli import shared_options as shared
from gso.cli.commands import Command
from gso.errors import OptionError

if TYPE_CHECKING:
    from gso.net.training.loop import Report
    from gso.typing import Json

#: Metrics that are shown beside the progress bar, if the task has them.
_SHOWN = ("loss_gc", "K_A_r", "d_H", "strain_mean", "loss_iso_cell", "theta")
#: glibc's M_MMAP_THRESHOLD and M_TRIM_THRESHOLD, and the largest value for the former (bytes).
_MAPPED, _TRIMMED, _LARGE = -3, -1, 2**25


@click.command(
    cls=Command,
    short_help="Train a net.",
    example="gso train developable --data surfaces --out run --minutes 180\n"
    "trains the default net for three hours",
)
@click.argument("config", type=click.Path())
@click.option("--data", metavar="DIR", required=True, type=click.Path(), help="Set of surfaces.")
@click.option("--out", metavar="RUN", required=True, type=click.Path(), help="Folder of the run.")
@click.option("--minutes", metavar="M", type=float, help="Length of the run, instead of its steps.")
@click.option(
    "--hours", metavar="[NET=]H", multiple=True, help="all: hours of every net, or of one."
)
@click.option("--steps", metavar="N", type=int, help="Steps of the run.")
@click.option("--epochs", metavar="N", type=int, help="Passes over the surfaces, instead of steps.")
@click.option("--seed", metavar="N", type=int, help="Seed of all random numbers.")
@click.option("--fresh", metavar="N", type=int, help="Surfaces to draw beside those of the set.")
@click.option("--broad", metavar="N", type=int, help="Surfaces of the broad set to learn from.")
@click.option("--sigma", metavar="S", type=float, help="denoise: the only noise to train for.")
@click.option("--init", metavar="NET", help="Net to begin with.")
@click.option("--through", metavar="NET", help="Net whose results take the surfaces' place.")
@click.option("--teacher", metavar="NET", help="Net whose results are the labels.")
@click.option("--validate-every", metavar="SECONDS", type=float, help="Time between validations.")
@click.option("--device", metavar="NAME", help="cpu, cuda ...; the GPU when there is one.")
@shared.quiet
def train(
    config: str,
    data: str,
    out: str,
    minutes: float | None,
    hours: tuple[str, ...],
    sigma: float | None,
    device: str | None,
    quiet: bool,
    **changes: Any,
) -> None:
    """Train the net that CONFIG describes, a .toml or .json file or a name.

    CONFIG all trains every net of the package, one after the other, each in a folder of RUN. To
    resume an interrupted run, give the same command again. To train with several
    processes, use torchrun: torchrun --nproc-per-node 2 -m gso train CONFIG ...
    """
    # Set before torch is imported: busily waiting threads slow each other on shared cores.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    _keep_memory()
    from gso.net.training.config import read
    from gso.net.training.loop import MODEL
    from gso.net.training.loop import train as run

    if config == "all":
        given = {"minutes": minutes, "sigma": sigma}
        wrong = [f"--{k}" for k, value in given.items() if value is not None]
        wrong += [f"--{k}" for k in ("init", "through", "teacher") if changes.pop(k) is not None]
        if wrong:
            raise OptionError(f"{', '.join(wrong)} does not go with all")
        _all(data, out, _hours(hours), device, quiet, changes)
        return
    if hours:
        raise OptionError("--hours goes with all; give --minutes")
    made = read(config, **changes, sigma=None if sigma is None else [sigma, sigma])
    with closing(progress.Counts()) as bars, progress.share("training") as show:
        card = run(
            made,
            data,
            out,
            minutes=minutes,
            device=device,
            show=lambda report: show(report.progress, _text(report), report.left),
            tick=bars.tick,
        )
    if not quiet and card:
        _tell(f"{out}/{MODEL}", card)


def _all(
    data: str,
    out: str,
    hours: float | dict[str, float] | None,
    device: str | None,
    quiet: bool,
    changes: dict[str, Any],
) -> None:
    """Train every net of the package."""
    from gso.net.training.loop import MODEL
    from gso.net.training.shipped_nets import train_all

    with closing(progress.Counts()) as bars, progress.share("training") as show:
        cards = train_all(
            data,
            out,
            hours=hours,
            device=device,
            show=lambda name, report: show(
                report.progress, f"{name}: {_text(report)}", report.left
            ),
            tick=bars.tick,
            **changes,
        )
    for name, card in cards.items():
        if not quiet and card:
            _tell(f"{out}/{name}/{MODEL}", card)


def _hours(given: tuple[str, ...]) -> float | dict[str, float] | None:
    """Read hours: one number for all nets, or NET=H for some; None for none."""
    named: dict[str, float] = {}
    try:
        if len(given) == 1 and "=" not in given[0]:
            return float(given[0])
        for word in given:
            name, value = word.split("=")
            named[name] = float(value)
    except ValueError:
        raise OptionError(
            f"--hours {' '.join(given)}: give one number, or NET=H for each net, such as net-c=1.5"
        ) from None
    return named or None


def _tell(file: str, card: Json) -> None:
    """Print what a run has come to."""
    found = ", ".join(f"{name} {value:.4g}" for name, value in card["validation"].items())
    click.echo(f"{file}: {card['steps']} steps, {card['hours']} hours; {found}")


def _keep_memory() -> None:
    """Let glibc keep freed memory: each step reallocates it, and mapping pages is slow."""
    try:
        keep = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return
    for setting, value in ((_MAPPED, _LARGE), (_TRIMMED, 2**31 - 1)):
        keep(setting, value)


def _text(report: Report) -> str:
    """Format the progress of a run."""
    shown = "".join(f", {n} {v:.4g}" for n, v in report.figures.items() if n in _SHOWN)
    return f"step {report.step}, loss {report.loss:.4g}{shown}"
