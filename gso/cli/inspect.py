"""``gso metrics``, ``gso info`` and ``gso plot``: inspect surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gso.cli import file_options
from gso.cli import shared_options as shared
from gso.cli.commands import Command
from gso.errors import GSOError, OptionError

if TYPE_CHECKING:
    from gso.mesh import Mesh


@click.command(
    cls=Command,
    short_help="Compare two surfaces.",
    example="gso metrics panel.obj panel_developable.obj\n"
    "prints curvature, distances and strains of the second, relative to the first",
)
@click.argument("before", type=click.Path())
@click.argument("after", type=click.Path())
@file_options.weld
@shared.as_json
def metrics(before: str, after: str, weld: float | None, as_json: bool) -> None:
    """Print metrics of the surface AFTER, relative to the surface BEFORE.

    If AFTER is flat (constant z) and has the same faces as BEFORE, the metrics of a flat
    pattern of BEFORE are printed too.
    """
    from gso.cli import report

    design, result = file_options.load(before, weld), file_options.load(after, weld)
    values, notes = _compare(design, result)
    if as_json:
        record = {"before": before, "after": after, "metrics": values, "notes": notes}
        shared.tell_json(record)
        return
    click.echo("\n".join(report.table(values)))
    for note in notes:
        click.echo(f"note: {note}")


def _compare(before: Mesh, after: Mesh) -> tuple[dict[str, float | None], list[str]]:
    """Compute the metrics that apply to a pair of surfaces, and notes on omitted ones."""
    import numpy as np

    from gso import metrics as measure
    from gso.components import average
    from gso.io.json_file import plain
    from gso.pipeline.lay_flat import strains_of
    from gso.tasks.evaluation import compute_metrics

    flat = np.ptp(after.vertices[:, 2]) <= 1e-9 * after.diagonal
    values = {} if flat else strains_of(after)
    values |= compute_metrics("developable", before, after, None)
    notes = []
    same = np.array_equal(before.faces, after.faces)
    if same and not flat:
        values["theta"] = float(average(measure.normal_angle, before, after))
    if same and flat:
        values |= compute_metrics("flatten", before, after, after.vertices[:, :2])
        notes.append(
            "AFTER is flat: measured as the flat pattern of BEFORE too; how far it lies from "
            "BEFORE means nothing then"
        )
    elif flat:
        notes.append("AFTER is flat, but its faces are not those of BEFORE: strains left out")
    return plain(values), notes


@click.command(
    cls=Command,
    short_help="Say what a mesh file holds.",
    example="gso info panel.obj\nprints its size, holes and curvature",
)
@click.argument("names", metavar="FILE...", nargs=-1, required=True, type=click.Path())
@shared.unit
@file_options.weld
@shared.as_json
def info(names: tuple[str, ...], unit: str, weld: float | None, as_json: bool) -> None:
    """Print properties of mesh files: size, connectivity, curvature. - is standard input.

    Lengths have a unit if --unit says which, or if the file does. If a file cannot be read, an
    error is printed for it and the exit code is 1.
    """
    from gso import io
    from gso.cli import report
    from gso.mesh_facts import facts, facts_record

    given = shared.named_unit(unit)
    failed, found = False, []
    for number, file in enumerate(names):
        try:
            own = "mm" if io.suffix_of(file) in io.SPLINE_SUFFIXES else given
            rows = facts(file_options.load(file, weld), own)
        except GSOError as error:
            click.echo(f"gso: error: {' '.join(str(error).split())}", err=True)
            failed = True
            continue
        if as_json:
            found.append({"file": file, "unit": own or None, **facts_record(rows)})
            continue
        if number:
            click.echo()
        click.echo(file)
        click.echo("\n".join(f"  {line}" for line in report.columns(rows)))
    if as_json:
        shared.tell_json(found)
    if failed:
        click.get_current_context().exit(1)


@click.command(
    cls=Command,
    short_help="Draw a surface or a result.",
    example="gso plot panel_developable.obj --before panel.obj -o both.png\n"
    "draws both, coloured by their curvature",
)
@click.argument("file", type=click.Path())
@click.option(
    "-o", "--output", "out", metavar="PNG", required=True, type=click.Path(), help="Picture."
)
@click.option("--before", metavar="FILE", type=click.Path(), help="Surface to draw beside it.")
@click.option(
    "--color",
    "colour",
    type=click.Choice(["curvature", "distance", "strain", "none"]),
    help="What the colours show: curvature unless said otherwise; distance to, and strain of "
    "the map from, the surface before.",
)
@click.option(
    "--rulings",
    metavar="N",
    type=click.IntRange(min=1),
    help="Draw so many ruling lines instead, and the Gauss image: a curve if developable.",
)
@file_options.weld
@file_options.force
def plot(
    file: str,
    out: str,
    before: str | None,
    colour: str | None,
    rulings: int | None,
    weld: float | None,
    force: bool,
) -> None:
    """Draw the surface FILE as a picture (.png, .pdf, .svg).

    A full result (.npz of gso optimize or gso strips) is drawn beside its design, unless --before
    or --color is given.
    """
    from gso import io
    from gso import plot as pictures
    from gso.result import Result

    pictures.require()
    io.check_writable(out, pictures.SUFFIXES)
    file_options.spare((file, before), [out], force)
    if rulings is not None and colour is not None:
        raise OptionError("--rulings and --color cannot be drawn in one picture; give one of them")
    if before is None and colour is None and file.lower().endswith(".npz"):
        try:
            result = Result.load(file)
        except GSOError:
            pass  # an .npz mesh, or a bad file: file_options.load reports that
        else:
            if rulings is None:
                pictures.plot_result(result, out)
            else:
                pictures.plot_rulings(result.mesh, path=out, count=rulings, before=result.design)
            return
    first = None if before is None else file_options.load(before, weld)
    if rulings is not None:
        pictures.plot_rulings(file_options.load(file, weld), path=out, count=rulings, before=first)
        return
    pictures.plot_surface(
        file_options.load(file, weld), colour or "curvature", before=first, path=out
    )
