"""``gso dataset``: build, inspect and export a dataset of surfaces."""

from __future__ import annotations

import time
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gso.cli import shared_options as shared
from gso.cli.commands import Command
from gso.errors import DatasetError, OptionError

if TYPE_CHECKING:
    from gso.dataset import Dataset

#: Splits whose features are plotted.
_PLOTTED = ("train", "validation", "test", "hard")


@click.group(short_help="Build and inspect sets of surfaces.")
def dataset() -> None:
    """Build, inspect and export datasets of surfaces for training and comparison."""


@dataset.command(
    cls=Command,
    short_help="Build a set of surfaces with labels.",
    example="gso dataset build -o surfaces --n 100 --label none\n"
    "draws a hundred surfaces, without labels",
)
@click.option(
    "-o", "--output", "out", metavar="DIR", required=True, type=click.Path(), help="Folder."
)
@click.option("--n", default=10401, help="Surfaces, without hard and named ones.")
@click.option("--seed", default=0, help="Seed of all random numbers.")
@click.option("--size", default=64, help="Samples along each side.")
@click.option(
    "--label",
    "labels",
    multiple=True,
    type=click.Choice(["developable", "strain", "lengths", "none"]),
    help="Label to make; all when not given. May be repeated. none: surfaces alone, in minutes.",
)
@click.option(
    "--extras/--no-extras",
    default=True,
    help="Small splits of other shapes: analytic surfaces, teapot, terrain.",
)
@click.option(
    "--strata",
    default="curvature",
    type=click.Choice(["curvature", "features"]),
    help="What is stratified: K_A and sigma^2, or all features of the paper.",
)
@click.option(
    "--surfaces",
    default="bezier",
    type=click.Choice(["bezier", "broad"]),
    help="The published ones, or families of other surfaces, held out in validation and test.",
)
@click.option(
    "--reference",
    multiple=True,
    type=click.Choice(["jiang2020"]),
    help="Reference labels to add, also to a set that is there already.",
)
@click.option(
    "--reference-split",
    "reference_splits",
    multiple=True,
    metavar="SPLIT",
    default=("test",),
    help="Split that gets them. May be repeated.",
)
@shared.workers
@shared.scheduler
@click.option(
    "--device", metavar="NAME", help="cpu, cuda ...: label in batches there (needs PyTorch)."
)
@shared.quiet
def build(
    out: str,
    quiet: bool,
    labels: tuple[str, ...],
    n: int,
    seed: int,
    size: int,
    extras: bool,
    strata: str,
    surfaces: str,
    **given: Any,
) -> None:
    """Build a dataset of surfaces in the folder DIR.

    To resume an interrupted build, run the same command again. The finished dataset is
    identical, byte for byte, to that of an uninterrupted build.
    """
    from gso import dataset as sets
    from gso.cli import progress
    from gso.dataset.labels import LABELS

    labels = labels or LABELS
    if "none" in labels and len(labels) > 1:
        raise OptionError("--label none goes with no other label")
    labels = () if labels == ("none",) else labels
    recipe = sets.Recipe(n, seed, size, labels, extras, strata, surfaces)
    start = time.perf_counter()
    with closing(progress.Counts()) as bars:
        data = sets.build(out, recipe, tick=bars.tick, **given)
    if quiet:
        return
    for what, (count, seconds) in bars.spent.items():
        click.echo(
            f"{count} {what} in {seconds:.1f} s, {count / max(seconds, 1e-9):.2f} per second"
        )
    megabytes = sum(e["bytes"] for e in data.manifest["files"]) / 1e6
    click.echo(
        f"{out}: {sum(map(len, data.values()))} surfaces, {megabytes:.0f} MB, "
        f"{time.perf_counter() - start:.1f} s{_memory()}"
    )


def _memory() -> str:
    """Return a text on peak memory, or "" where the system does not report it."""
    try:
        import resource
    except ImportError:  # Windows
        return ""
    here, workers = (
        resource.getrusage(who).ru_maxrss / 1024
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    each = f", {workers:.0f} MiB in the largest worker" if workers else ""
    return f"; at most {here:.0f} MiB in this process{each}"


@dataset.command(
    cls=Command,
    short_help="Say what a set holds.",
    example="gso dataset info surfaces\n"
    "prints how many surfaces are in each split, and how curved they are",
)
@click.argument("folder", metavar="DIR", type=click.Path())
@click.option("--split", help="Split whose labels are shown; test when there is one.")
@click.option("--verify", is_flag=True, help="Compare the checksums of all files.")
@click.option(
    "--json",
    "table",
    metavar="FILE",
    type=click.Path(),
    help="File for the manifest with its statistics, without the list of files.",
)
@click.option(
    "--plot", metavar="PNG", type=click.Path(), help="Picture of the features' histograms."
)
def info(folder: str, split: str | None, verify: bool, table: str | None, plot: str | None) -> None:
    """Print statistics of the dataset in DIR: surfaces per interval, metrics of the labels."""
    from gso import dataset as sets
    from gso.cli.dataset_text import lines
    from gso.dataset.summary import summarise
    from gso.io.json_file import write_json

    data = sets.open(folder)
    summary = data.manifest.get("summary") or summarise(data)
    click.echo("\n".join(lines(data, summary, split)))
    if table is not None:
        kept = {k: v for k, v in data.manifest.items() if k != "files"}
        write_json(table, kept | {"summary": summary})
    if plot is not None:
        _plot(data, plot)
    if verify:
        bad = data.damaged()
        if bad:
            raise DatasetError(
                f"{len(bad)} files are missing or damaged, {bad[0]} first; build the set again "
                "with the same options, which makes those anew"
            )
        click.echo("all files are as they were written")


def _plot(data: Dataset, path: str) -> None:
    from gso.dataset.summary import INTERVALS
    from gso.plot.histogram import plot_histograms

    groups = {n: s.features for n, s in data.items() if n in _PLOTTED or not data.manifest}
    values = {
        name: {group: abs(features[name]) for group, features in groups.items()}
        for name in INTERVALS
    }
    limits = {name: (0.0, edges[-3]) for name, edges in INTERVALS.items()}
    plot_histograms(values, limits, path=path)


@dataset.command(
    cls=Command,
    short_help="Write a set as .npy files.",
    example="gso dataset export surfaces -o arrays\nwrites one .npy file for each surface",
)
@click.argument("folder", metavar="DIR", type=click.Path())
@click.option(
    "-o", "--output", "out", metavar="FOLDER", required=True, type=click.Path(), help="Folder."
)
@click.option(
    "--array",
    default="surface",
    help="What to write: surface, developable, strain, noisy_0.005 ...",
)
@click.option(
    "--split",
    "only",
    multiple=True,
    metavar="SPLIT",
    help="Split; all that have it. May be repeated.",
)
def export(folder: str, out: str, array: str, only: tuple[str, ...]) -> None:
    """Write an array of the dataset in DIR as .npy files: one per surface, a folder per split."""
    from gso import dataset as sets

    count = sets.export(sets.open(folder), Path(out), array=array, only=only)
    click.echo(f"{count} files in {out}")
