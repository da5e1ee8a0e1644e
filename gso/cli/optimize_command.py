"""``gso optimize``: optimise one file, or many in parallel."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from gso import tasks
from gso.cli import file_options
from gso.cli import shared_options as shared
from gso.cli.optimize_job import Job, is_cad
from gso.errors import MeshError, OptionError
from gso.quantities import as_length

if TYPE_CHECKING:
    from gso.mesh import Mesh


@click.command(short_help="Make surfaces developable, flatten or denoise them.")
@click.argument("names", metavar="IN...", nargs=-1, required=True, type=click.Path())
@click.option(
    "-o",
    "--output",
    "out",
    metavar="OUT",
    required=True,
    type=click.Path(),
    help="File to write; a folder when there are several inputs. The suffix says the format: "
    ".npz is the full result, .svg the flat pattern at 1:1; .step, .iges and .3dm are the "
    "surface as a B-spline, which is then what is optimised (fitted to the result where something "
    "bounds or constrains it).",
)
@click.option(
    "--task",
    type=click.Choice(tasks.names()),
    default="developable",
    show_default=True,
    help="What to do.",
)
@click.option("--formulation", metavar="NAME", help="Which energy; the task's own by default.")
@click.option(
    "--strips",
    metavar="N",
    help='developable by "ruled": number of strips side by side, or "auto" for as few as hold '
    "--max-deviation. Implies --formulation ruled.",
)
@click.option(
    "--flats",
    is_flag=True,
    help='Developable by "ruled": the strip may branch at flat triangles.',
)
@shared.min_radius
@click.option(
    "--options",
    "preset",
    type=click.Choice(["fast", "balanced", "accurate", "jiang2020"]),
    default="balanced",
    show_default=True,
    help="How much work to do; jiang2020: the classical reference, by isometry.",
)
@shared.max_deviation
@shared.max_strain
@click.option(
    "--target-curvature",
    metavar="K",
    type=float,
    help="developable: mean |K| to reach with the smallest displacement: the loss_gc_worst that "
    "gso info prints, in 1/size^2.",
)
@click.option(
    "--fix-boundary", is_flag=True, help="Keep the boundary where it is; not for flat images."
)
@click.option(
    "--constraints",
    metavar="JSON",
    type=click.Path(),
    help='File with what must hold: a list such as [{"type": "Glue", "pairs": [[0, 9]]}].',
)
@click.option(
    "--method",
    type=click.Choice(["auto", "tno", "net", "hybrid"]),
    default="auto",
    show_default=True,
    help="Who solves: the optimiser, a net alone, the optimiser from a net's result, or that "
    "where it saves time, which is on large grids. Where there is no net, or its result is of no "
    "use, the optimiser does, and a note says so.",
)
@click.option(
    "--net", metavar="NET", help="Name or .safetensors file; the task's own net by default."
)
@click.option("--backend", metavar="NAME", help="Linear solver; the fastest installed by default.")
@shared.workers
@shared.scheduler
@click.option(
    "--suffix", metavar=".EXT", help="Format of many outputs; that of each input by default."
)
@click.option(
    "--plot",
    metavar="PNG",
    type=click.Path(),
    help="Picture to draw (.png, .pdf, .svg); a folder when there are several inputs.",
)
@click.option(
    "--metrics", "table", metavar="JSON", type=click.Path(), help="File for status and metrics."
)
@shared.unit
@file_options.weld
@file_options.force
@shared.quiet
def optimize(names: tuple[str, ...], out: str, **given: Any) -> None:
    """Optimise the surface IN and write it to OUT.

    Several inputs are processed in parallel; OUT is then a folder. The exit code is 0 only
    if all results are usable; otherwise the reasons are printed, with their places.
    """
    if given["net"] is not None and given["method"] in ("auto", "tno"):
        raise OptionError("--net goes with --method net or hybrid")
    job = Job(
        _keywords(given, given["suffix"] or out),
        given["method"],
        given["net"],
        given["unit"],
        given["quiet"],
        given["weld"],
        given["force"],
        tuple(name for name in (given["constraints"], given["net"]) if name is not None),
        _named_unit(given["unit"]),
    )
    if given["table"] is not None:
        from gso.io import check_writable

        check_writable(given["table"])
    if len(names) > 1 or os.path.isdir(out) or out.endswith(("/", os.sep)):
        from gso.cli.many_files import many

        good = many(
            job,
            names,
            out,
            suffix=given["suffix"],
            plots=given["plot"],
            table=given["table"],
            workers=given["workers"],
            scheduler=given["scheduler"],
        )
    else:
        if given["suffix"] is not None:
            raise OptionError("--suffix is for many inputs; name the format in -o")
        if given["scheduler"] is not None:
            raise OptionError("--scheduler is for many inputs; leave it out")
        good = _single(job, names[0], out, given["plot"], given["table"])
    click.get_current_context().exit(0 if good else 1)


def _named_unit(unit: str) -> str:
    """Return the unit if the user gave ``--unit``, else ""."""
    source = click.get_current_context().get_parameter_source("unit")
    return unit if source is click.core.ParameterSource.COMMANDLINE else ""


def _keywords(given: dict[str, Any], out: str) -> dict[str, Any]:
    """Return keywords of :func:`gso.tno.optimize`, checked as far as possible without a mesh."""
    from gso.tno import check

    strips, number = given["strips"], None
    if strips is not None:
        number = int(strips) if strips.isdecimal() else strips
    radius = given["min_radius"]
    if radius is not None:
        radius = as_length(radius, "min_radius", diagonal=float("nan"), unit=given["unit"])
    ruled = {"strips": number, "flats": given["flats"] or None, "min_radius": radius}
    ruled = {name: value for name, value in ruled.items() if value is not None}
    if ruled and given["formulation"] is None:
        given["formulation"] = "ruled"
    begun = check(given["task"], given["formulation"], given["preset"])
    formulation = begun.formulation
    settings: Any = begun.options
    if ruled and formulation != "ruled":
        name = "--" + next(iter(ruled)).replace("_", "-")
        raise OptionError(f"{name} goes with --formulation ruled, not {formulation!r}")
    settings = replace(settings, **ruled)
    if given["backend"] is not None:
        settings = replace(settings, backend=given["backend"])
    # With bounds or constraints the mesh is optimised, and a spline is fitted to the result.
    apart = given["max_deviation"] is not None or given["fix_boundary"]
    apart |= given["max_strain"] is not None
    apart |= given["constraints"] is not None or formulation == "ruled"
    if is_cad(out) and given["task"] == "developable" and not apart:
        settings = replace(settings, variables="surface")
    questions = {k: given[k] for k in ("max_deviation", "max_strain", "target_curvature")}
    check(given["task"], formulation, settings, **questions)
    keywords = {
        "task": given["task"],
        "formulation": given["formulation"],
        "options": settings,
        "unit": given["unit"],
        **questions,
    }
    wanted: list[Any] = []
    if given["constraints"] is not None:
        from gso.constraints import read_constraints

        wanted += read_constraints(given["constraints"])
    if given["fix_boundary"]:
        from gso.constraints import FixedBoundary

        wanted.append(FixedBoundary())
    if wanted:
        keywords["constraints"] = wanted
    return keywords


#: Vertices up to which a single surface is optimised without compiled loops.
_SMALL = 20_000


def _single(job: Job, file: str, out: str, plot: str | None, table: str | None) -> bool:
    """Optimise one surface, and return whether the result is usable."""
    from gso.cli import report
    from gso.cli.progress import iterations
    from gso.solver import loops

    job.check(out, plot)
    job.spare([file], out, plot, table)
    mesh = file_options.load(file, job.weld)
    _check_grid(mesh, out)
    # For one solve of a small mesh, loading compiled loops takes longer than they save.
    small = len(mesh.vertices) <= _SMALL
    with iterations() as callback, report.status_only(), loops.without(small):
        result = job.solve(mesh, callback=callback)
    job.write(result, out, plot)
    record = report.record(file, out, result, job.named)
    if table is not None:
        report.write_json(table, record)
    if not job.quiet:
        click.echo(report.text(record))
    return bool(record["usable"])


def _check_grid(mesh: Mesh, out: str) -> None:
    if out.lower().endswith(".npy") and mesh.grid_shape is None:
        raise MeshError(f"{out}: the mesh is no grid, which is all that .npy holds; use .npz")
