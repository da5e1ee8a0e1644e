"""``gso optimize``: optimise one file, or many in parallel."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any

import click

from gso import tasks
from gso.cli import file_options
from gso.cli import shared_options as shared
from gso.cli.commands import Command
from gso.cli.optimize_job import Job, is_cad
from gso.cli.single_file import single
from gso.errors import OptionError


@click.command(
    cls=Command,
    short_help="Make surfaces developable, flatten or denoise them.",
    example="gso optimize panel.obj -o panel_developable.obj --plot panel.png\n"
    "makes a panel developable, and draws both",
)
@click.argument("names", metavar="IN...", nargs=-1, required=True, type=click.Path())
@shared.output(
    "File to write; a folder when there are several inputs. The suffix says the format: "
    ".npz is the full result, .svg the flat pattern at 1:1; .step, .iges and .3dm are the "
    "surface as a B-spline, which is then what is optimised (fitted to the result where something "
    "bounds or constrains it).",
)
@click.option("--task", type=click.Choice(tasks.names()), default="developable", help="What to do.")
@click.option("--formulation", metavar="NAME", help="Which energy; the task's own by default.")
@click.option(
    "--options",
    "preset",
    type=click.Choice(["fast", "balanced", "accurate", "jiang2020"]),
    default="balanced",
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
@shared.constraints
@click.option(
    "--method",
    type=click.Choice(["auto", "tno", "net", "hybrid"]),
    default="auto",
    help="Who solves: the optimiser, a net alone, the optimiser from a net's result, or that "
    "where it saves time, which is on large grids. Where there is no net, or its result is of no "
    "use, the optimiser does, and a note says so.",
)
@click.option(
    "--net",
    metavar="NET",
    help="Name, or .safetensors or .onnx file; the task's own net by default.",
)
@click.option("--backend", metavar="NAME", help="Linear solver; the fastest installed by default.")
@shared.workers
@shared.scheduler
@click.option(
    "--suffix", metavar=".EXT", help="Format of many outputs; that of each input by default."
)
@shared.plot
@shared.page
@shared.table
@shared.unit
@file_options.weld
@file_options.chord
@file_options.force
@shared.as_json
@shared.quiet
def optimize(names: tuple[str, ...], out: str, as_json: bool, **given: Any) -> None:
    """Optimise the surface IN and write it to OUT.

    Several inputs are processed in parallel; OUT, and the PNG of --plot, are then folders. With
    --max-deviation alone, the largest strain must be 0.5 % or less. IN and OUT may be -, for
    standard input and output (OBJ). The exit code is 0 only if all results are usable; otherwise
    the reasons are printed, with their places.
    """
    if given["net"] is not None and given["method"] in ("auto", "tno"):
        raise OptionError("--net goes with --method net or hybrid")
    keywords = _keywords(given, given["suffix"] or out)
    job = Job.of(keywords, given, given["constraints"], given["net"])
    if len(names) > 1 or os.path.isdir(out) or out.endswith(("/", os.sep)):
        from gso.cli.many_files import many

        if given["page"] is not None:
            raise OptionError(
                "--page is for one input; gso view makes the page of each .npz of several results"
            )
        spread = ("suffix", "plot", "table", "workers", "scheduler")
        good = many(job, names, out, as_json=as_json, **{k: given[k] for k in spread})
    else:
        if given["suffix"] is not None:
            raise OptionError("--suffix is for many inputs; name the format in -o")
        if given["scheduler"] is not None:
            raise OptionError("--scheduler is for many inputs; leave it out")
        files = {k: given[k] for k in ("plot", "page", "table")}
        good = single(job, names[0], out, **files, as_json=as_json)
    click.get_current_context().exit(0 if good else 1)


def _keywords(given: dict[str, Any], out: str) -> dict[str, Any]:
    """Return keywords of :func:`gso.tno.optimize`, checked as far as possible without a mesh."""
    from gso.tno import check

    begun = check(given["task"], given["formulation"], given["preset"])
    settings: Any = begun.options
    if given["backend"] is not None:
        settings = replace(settings, backend=given["backend"])
    # With bounds or constraints the mesh is optimised, and a spline is fitted to the result.
    apart = given["max_deviation"] is not None or given["fix_boundary"]
    apart |= given["max_strain"] is not None
    apart |= given["constraints"] is not None or begun.formulation == "ruled"
    if is_cad(out) and given["task"] == "developable" and not apart:
        settings = replace(settings, variables="surface")
    questions = {k: given[k] for k in ("max_deviation", "max_strain", "target_curvature")}
    check(given["task"], begun.formulation, settings, **questions)
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
