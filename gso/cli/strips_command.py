"""``gso strips``: exactly developable strips of planar faces, with bend lines."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from gso.cli import file_options
from gso.cli import shared_options as shared
from gso.cli.commands import Command
from gso.cli.optimize_job import Job
from gso.cli.single_file import single

if TYPE_CHECKING:
    from gso.mesh import Mesh
    from gso.result import Result
    from gso.solver import Callback


class _StripsJob(Job):
    """The settings of ``gso strips``."""

    task = "developable"

    def solve(self, mesh: Mesh, callback: Callback | None = None) -> Result:
        """Make strips of one design."""
        from gso.ruled.paneling.lay_strips import strips as lay

        return lay(mesh, unit=self.unit, **self.keywords, callback=callback)


@click.command(
    cls=Command,
    short_help="Make strips that are exactly developable.",
    example="gso strips facade.obj -o strips.svg --max-deviation 10mm\n"
    "makes strips with straight rulings within 10 mm, as patterns at 1:1",
)
@click.argument("name", metavar="IN", type=click.Path())
@shared.output(
    "File to write. The suffix says the format: .npz is the full result, .svg the patterns at "
    "1:1 with their bend lines; .step, .iges and .3dm are smooth surfaces.",
)
@click.option(
    "--strips",
    metavar="N",
    help='Number of strips side by side, or "auto" for as few as hold --max-deviation and '
    "--max-crease. One where no such limit is given.",
)
@shared.max_deviation
@shared.max_strain
@shared.max_strips
@click.option(
    "--max-crease",
    metavar="DEGREES",
    type=float,
    help="Largest angle at a crease between strips.",
)
@shared.min_radius
@click.option(
    "--no-lines",
    is_flag=True,
    help="No strips along lines of the mesh or of a grid, and without --max-deviation no smooth "
    "design as it is: others become smooth surfaces in CAD files.",
)
@click.option("--flats", is_flag=True, help="A single strip may branch at flat triangles.")
@click.option(
    "--options",
    type=click.Choice(["fast", "balanced", "accurate"]),
    default="balanced",
    help="How much work to do.",
)
@shared.constraints
@click.option(
    "--along",
    metavar="DIRECTION",
    help='Direction that strips run along: x, y, z, or a vector such as "1,1,0".',
)
@shared.max_pieces
@shared.min_neck
@shared.min_size
@shared.symmetric
@shared.seams_along("--seams-along")
@shared.avoid
@shared.seam_effort
@shared.sheet
@shared.workers
@shared.plot
@shared.page
@shared.table
@shared.unit
@file_options.weld
@file_options.chord
@file_options.force
@shared.as_json
@shared.quiet
def strips(
    name: str,
    out: str,
    as_json: bool,
    plot: str | None,
    page: str | None,
    table: str | None,
    constraints: str | None,
    **given: Any,
) -> None:
    """Make strips of planar faces near the design IN, and write them to OUT.

    The design is tried as one surface. Where that does not hold --max-deviation, it is cut into
    pieces, and each piece becomes strips; it is not cut where --strips is a number, or with
    --along, --flats or --constraints. Pieces that no strips follow keep a pattern with a strain of
    at most --max-strain, 0.1 % when it is not given. The exit code is 0 only if the result is
    usable; otherwise the reasons are printed.
    """
    own = {option: given.pop(option) for option in ("unit", "quiet", "weld", "force")}
    count = given["strips"]
    given["strips"] = int(count) if count is not None and count.isdecimal() else count
    given["flats"] = given["flats"] or None
    if given.pop("no_lines"):
        from gso import RuledOptions

        given["options"] = replace(RuledOptions.coerce(given["options"]), lines=False)
    if constraints is not None:
        from gso.constraints import read_constraints

        given["constraints"] = read_constraints(constraints)
    read = constraints, given["seams_along"], given["avoid"]
    for option in ("seams_along", "avoid"):
        said = f"--{option.replace('_', '-')}"
        given[option] = file_options.lines(said, given[option])
    job = _StripsJob.of(given, own, *read)
    good = single(job, name, out, plot=plot, page=page, table=table, as_json=as_json)
    click.get_current_context().exit(0 if good else 1)
