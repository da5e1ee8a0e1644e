"""``gso optimize``: optimise one file, or many in parallel."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import click

from gso import tasks
from gso.cli import files
from gso.cli.files import source, spare
from gso.errors import MeshError, OptionError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from gso.mesh import Mesh
    from gso.result import Result
    from gso.tno.batch import Item

#: Units of :func:`gso.io.save_flat`.
UNITS = ("um", "mm", "cm", "dm", "m", "in", "ft", "yd")


@dataclass(frozen=True)
class Job:
    """Settings of a run of ``gso optimize``, shared by all inputs.

    Attributes
    ----------
    keywords : dict
        Keyword arguments of :func:`gso.tno.optimize`.
    method : {"auto", "tno", "net", "hybrid"}
        Solver. "tno": the optimiser. "net": a net alone. "hybrid": the optimiser, warm-started
        from a net's result. "auto": "hybrid" where it saves time, otherwise "tno".
    net : str, optional
        Name or file of the net.
    unit : str
        Unit of the coordinates, for drawings and CAD files.
    quiet : bool
        Print nothing but errors.
    weld : float, optional
        Vertices within this distance of each other are merged.
    force : bool
        Whether outputs may replace inputs.
    inputs : tuple of str
        Other files that are read: constraints, net.
    named : str
        The unit if ``--unit`` was given, else "": lengths are then printed without a unit.
    """

    keywords: dict[str, Any] = field(default_factory=dict)
    method: str = "auto"
    net: str | None = None
    unit: str = "mm"
    quiet: bool = False
    weld: float | None = None
    force: bool = False
    inputs: tuple[str, ...] = ()
    named: str = ""

    def spare(self, files: Iterable[str], *outputs: str | None) -> None:
        """Raise an error if an output is also an input, unless `force` is set."""
        spare((*files, *self.inputs), outputs, self.force)

    def solve(self, mesh: Any, **more: Any) -> Result:
        """Optimise one surface."""
        if self.method == "tno":
            from gso.tno import optimize

            return optimize(mesh, **self.keywords, **more)
        from gso.hybrid import solve

        return solve(mesh, **self._with_net(), **more)

    def solve_many(self, files: Iterable[str], workers: int | None) -> Iterator[Item]:
        """Optimise many surfaces in parallel."""
        meshes = [source(file, self.weld) for file in files]
        if self.method == "tno":
            from gso.tno import optimize_many

            return optimize_many(meshes, workers=workers, **self.keywords)
        from gso.hybrid import solve_many

        return solve_many(meshes, workers=workers, **self._with_net())

    def _with_net(self) -> dict[str, Any]:
        more = {"net": self.net, "polish": self.method != "net", "sparing": self.method == "auto"}
        return {**self.keywords, **more}

    def check(self, out: str, plot: str | None = None) -> None:
        """Raise an error if an output cannot be written, before anything is computed."""
        from gso import io

        if out.lower().endswith(".svg"):
            task = self.keywords["task"]
            if task != "developable" and getattr(tasks.get(task), "BLOCK", "surface") != "flat":
                raise OptionError(
                    f"{out}: only a flat pattern is drawn as SVG; use --task flatten or "
                    "--task developable"
                )
            io.check_writable(out)
        elif _is_cad(out):
            if self.keywords["task"] != "developable":
                raise OptionError(
                    f"{out}: only developable surfaces are written as splines; "
                    "use --task developable"
                )
            io.check_spline(out, self.unit)
        else:
            io.check_writable(out, io.SUFFIXES)
        if plot is not None:
            from gso import plot as pictures

            pictures.require()
            io.check_writable(plot, pictures.SUFFIXES)

    def write(self, result: Result, out: str, plot: str | None = None) -> None:
        """Write a result and its picture."""
        if _is_cad(out) and result.spline is None and result.ruled is None:
            from gso.spline.fit import fit_spline

            result.spline = fit_spline(result.mesh)
            far = max(result.spline.gap or (0.0,))
            result.notes += (f"the spline was fitted to the result, {far:.3g} away at most",)
        result.save(out, unit=self.unit)
        if plot is not None:
            from gso.plot import plot_result

            plot_result(result, plot)


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
@click.option(
    "--options",
    "preset",
    type=click.Choice(["fast", "balanced", "accurate", "jiang2020"]),
    default="balanced",
    show_default=True,
    help="How much work to do; jiang2020: the classical reference, by isometry.",
)
@click.option(
    "--max-deviation",
    metavar="L",
    type=float,
    help="developable: largest distance from the input, both ways, in its unit of length.",
)
@click.option(
    "--max-strain",
    metavar="S",
    type=float,
    help="developable: largest strain of the flat pattern, such as 0.005.",
)
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
@click.option(
    "--workers",
    metavar="N",
    type=click.IntRange(0),
    help="Processes for many inputs; all cores by default, 0 for none beside this one.",
)
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
@click.option(
    "--unit",
    type=click.Choice(UNITS),
    default="mm",
    show_default=True,
    help="Unit of the coordinates, for .svg, .step, .iges and .3dm, and for what is printed.",
)
@files.weld
@files.force
@click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")
def optimize(names: tuple[str, ...], out: str, **given: Any) -> None:
    """Optimise the surface IN and write it to OUT.

    Several inputs are processed in parallel; OUT is then a folder. The exit code is 0 only
    if all results are usable; otherwise notes say why a result is not usable, and where.
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
        from gso.cli.batch import many

        good = many(
            job,
            names,
            out,
            suffix=given["suffix"],
            plots=given["plot"],
            table=given["table"],
            workers=given["workers"],
        )
    else:
        if given["suffix"] is not None:
            raise OptionError("--suffix is for many inputs; name the format in -o")
        good = _single(job, names[0], out, given["plot"], given["table"])
    click.get_current_context().exit(0 if good else 1)


def _named_unit(unit: str) -> str:
    """Return the unit if the user gave ``--unit``, else ""."""
    source = click.get_current_context().get_parameter_source("unit")
    return unit if source is click.core.ParameterSource.COMMANDLINE else ""


def _is_cad(out: str) -> bool:
    """Tell whether a file name, or a suffix with or without its dot, is that of a CAD file."""
    from gso.io import SPLINE_SUFFIXES

    return f".{out.lower().rpartition('.')[2]}" in SPLINE_SUFFIXES


def _keywords(given: dict[str, Any], out: str) -> dict[str, Any]:
    """Return keywords of :func:`gso.tno.optimize`, checked as far as possible without a mesh."""
    from gso.tno import check

    strips = given["strips"]
    if (strips is not None or given["flats"]) and given["formulation"] is None:
        given["formulation"] = "ruled"
    formulation, kind = tasks.choose(
        tasks.get(given["task"]), given["formulation"], given["preset"]
    )
    settings: Any = kind.coerce(given["preset"])
    if strips is not None or given["flats"]:
        if formulation != "ruled":
            name = "--flats" if strips is None else "--strips"
            raise OptionError(f"{name} goes with --formulation ruled, not {formulation!r}")
        number = int(strips) if strips is not None and strips.isdecimal() else strips
        settings = replace(settings, strips=number, flats=given["flats"])
    if given["backend"] is not None:
        settings = replace(settings, backend=given["backend"])
    # With bounds or constraints the mesh is optimised, and a spline is fitted to the result.
    apart = given["max_deviation"] is not None or given["fix_boundary"]
    apart |= given["max_strain"] is not None
    apart |= given["constraints"] is not None or formulation == "ruled"
    if _is_cad(out) and given["task"] == "developable" and not apart:
        settings = replace(settings, variables="surface")
    questions = {k: given[k] for k in ("max_deviation", "max_strain", "target_curvature")}
    check(given["task"], formulation, settings, **questions)
    keywords = {
        "task": given["task"],
        "formulation": given["formulation"],
        "options": settings,
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


def _single(job: Job, file: str, out: str, plot: str | None, table: str | None) -> bool:
    """Optimise one surface, and return whether the result is usable."""
    from gso.cli import report
    from gso.cli.progress import iterations

    job.check(out, plot)
    job.spare([file], out, plot, table)
    mesh = files.load(file, job.weld)
    _check_grid(mesh, out)
    with iterations() as callback, report.status_only():
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
