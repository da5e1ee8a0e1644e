"""``gso fabricate``: from designs to a folder that a workshop can use."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from gso.cli import file_options
from gso.cli import shared_options as shared
from gso.cli.commands import Command
from gso.errors import OptionError

if TYPE_CHECKING:
    from gso.typing import Array
    from gso.workshop.fabricate import Fabrication


@click.command(
    cls=Command,
    short_help="Make designs of flat parts, for the cutter.",
    example="gso fabricate design.obj -o job --max-deviation 5mm --thickness 2 --sheet 2500 1250\n"
    "writes drawings of all parts and of the sheets that they are cut from, and a page",
)
@click.argument("inputs", metavar="IN...", nargs=-1, required=True, type=click.Path())
@shared.output(
    "Folder to write to: parts, sheets, surfaces, certificate.json, index.html. Started "
    "again, the command goes on where it was.",
    "folder",
    "DIR",
)
@shared.unit
@shared.scale
@shared.height
@shared.up
@click.option(
    "--formulation",
    type=click.Choice(("ruled", "curvature", "isometry", "flatten")),
    default="ruled",
    help="How surfaces are made developable; flatten: the shape stays as it is.",
)
@shared.max_deviation
@shared.max_strain
@shared.max_strips
@shared.darts
@shared.cut
@shared.keep
@shared.keep_groups
@shared.max_pieces
@shared.min_neck
@shared.min_size
@shared.symmetric
@shared.seams_along("--along")
@shared.avoid
@shared.seam_effort
@shared.constraints
@shared.min_radius
@click.option("--thickness", metavar="MM", type=shared.MM, help="Thickness of the sheet.")
@click.option(
    "--k-factor",
    metavar="K",
    default=0.5,
    help="Where the neutral surface is: its distance from a bend's inner face over the thickness.",
)
@click.option(
    "--face",
    type=click.Choice(("middle", "outside", "inside")),
    default="middle",
    help="The face of the sheet that the design's surface is; outside: the one from which its "
    "faces are anticlockwise.",
)
@click.option(
    "--bend-radius",
    metavar="MM",
    type=float,
    help="Inner radius of the tool that folds the bends; without it the sheet is rolled.",
)
@click.option(
    "--bend-table",
    metavar="FILE",
    type=click.Path(),
    help="Bend deductions (CSV): rows of the angle of bending in degrees, 0 for flat, and a length "
    "in mm.",
)
@click.option("--kerf", metavar="MM", default=0.0, help="Width that the cutter removes.")
@click.option("--allowance", metavar="MM", default=0.0, help="Width added about parts.")
@click.option(
    "--notches",
    metavar="MM",
    default=50.0,
    help="Distance of the notches along seams: an odd number of them, at most 51, one in the "
    "middle.",
)
@click.option("--no-notches", is_flag=True, help="No notches along seams.")
@click.option(
    "--holes",
    metavar="D MM",
    type=float,
    nargs=2,
    help="Registration holes beside the notches, on both sides of a seam: their diameter, and "
    "their distance from the seam.",
)
@shared.tabs
@shared.seam_overlap
@shared.seam_flange
@shared.numbers
@click.option("--labels", metavar="MM", default=6.0, help="Height of the names on parts.")
@click.option("--no-labels", is_flag=True, help="No names on parts.")
@click.option("--grain", is_flag=True, help="The grain runs along each part.")
@click.option(
    "--inside-up",
    is_flag=True,
    help="Draw the inside of the surface, mirrored; otherwise the "
    "outside, from which its faces are anticlockwise.",
)
@shared.sheet
@click.option("--spacing", metavar="MM", default=2.0, help="Distance between parts on a sheet.")
@click.option(
    "--rotations",
    metavar="N",
    default="2",
    help="Number of rotations on the sheet, evenly, or any.",
)
@click.option("--seconds", metavar="S", default=10.0, help="Time for nesting.")
@click.option(
    "--format",
    "formats",
    metavar="NAME",
    multiple=True,
    default=("dxf", "svg"),
    help="Format of the drawings, dxf, svg or pdf; may be given several times.",
)
@click.option(
    "--layers",
    type=click.Choice(("operations", "astm")),
    default="operations",
    help="Names of layers: CUT, BEND_UP and so on, or the numbers of ASTM D6673.",
)
@click.option("--bend-text", is_flag=True, help="Write angle and radius beside each bend.")
@click.option(
    "--bend-step",
    metavar="ANGLE",
    help="Angle between the bend lines of cylinders and cones, such as 15deg, or how far chords "
    "between them may be from the surface, such as 0.5mm.",
)
@click.option(
    "--step",
    is_flag=True,
    help="Also write the folded parts as solids of the sheet's thickness: folded.step.",
)
@click.option(
    "--paper",
    metavar="A4",
    help="Also write all parts as a PDF on pages of this size, one part a page where it fits.",
)
@shared.workers
@shared.scheduler
@file_options.weld
@file_options.chord
@shared.as_json
@shared.quiet
def fabricate(
    inputs: tuple[str, ...],
    folder: str,
    weld: float | None,
    as_json: bool,
    quiet: bool,
    rotations: str,
    **given: Any,
) -> None:
    """Make the designs IN of flat parts, and write what a workshop needs to DIR.

    A design that is flat or developable as it is keeps its shape; others are changed.
    --max-deviation is 1 % of the diagonal when it is not given, and --max-strain 0.1 %. With
    --formulation flatten the shape stays as it is, and --max-strain is 1 % when it is not given.
    The exit code is 0 only if everything can be made as it was asked for; otherwise the reasons
    are printed, and DIR has the best that was found.
    """
    from gso.cli.progress import words
    from gso.workshop import fabricate as make
    from gso.workshop.finish import Finish

    _check_together(inputs)
    for name in ("notches", "labels"):
        if given.pop(f"no_{name}"):
            given[name] = None

    def taken(*names: str) -> dict[str, Any]:
        return {name: given.pop(name) for name in names}

    finish = Finish(
        **taken("kerf", "allowance", "notches", "tabs", "numbers", "labels", "grain"),
        **taken("seam_overlap", "seam_flange"),
        registration=given.pop("holes"),
        face="inside" if given.pop("inside_up") else "outside",
        **_thickness(**taken("thickness", "k_factor", "face", "bend_radius", "bend_table")),
    )
    for option in ("along", "avoid"):
        given[option] = file_options.lines(f"--{option}", given[option])
    if (held := given.pop("constraints")) is not None:
        from gso.constraints import read_constraints

        given["constraints"] = read_constraints(held)
    meshes = [file_options.source(name, weld) for name in inputs]
    if rotations != "any" and not rotations.isdecimal():
        raise OptionError(f"--rotations is {rotations!r}; it must be a number or any")
    turns = rotations if rotations == "any" else int(rotations)
    given["scale"] = file_options.scale_of(
        meshes, **taken("scale", "height", "up"), unit=given["unit"]
    )
    with words() as say:
        done = make.fabricate(meshes, folder, finish=finish, rotations=turns, callback=say, **given)
    if as_json:
        shared.tell_json(done.certificate)
    else:
        shared.tell(text(done), quiet=quiet)
    click.get_current_context().exit(0 if done.usable else 1)


def text(done: Fabrication) -> list[str]:
    """Format what was made as a table, with the reasons against it."""
    from gso.cli.report import columns
    from gso.verdict import describe
    from gso.workshop.certificate import codes

    rows: list[tuple[str, ...]] = [
        ("design", "copies", "parts", "mean mm", "largest mm", "allowed mm", "strain", "usable")
    ]
    for one in done.certificate["designs"]:
        sizes = [one.get(k) for k in ("deviation_mean", "deviation_max", "allowed")]
        strain = one.get("strain_max")
        rows.append(
            (
                one["name"],
                str(len(one["copies"])),
                str(len(one.get("parts", []))),
                *("-" if x is None else f"{x:.3g}" for x in sizes),
                "-" if strain is None else f"{100 * strain:.2g} %",
                f"no: {codes(one['reasons'])}" if one["reasons"] else "yes",
            )
        )
    lines = columns(rows)
    lines.append(f"parts to cut: {done.certificate['parts']}")
    nesting = done.certificate.get("nesting")
    if nesting is not None:
        lines.append(
            f"sheets: {len(done.sheets)}, parts take {100 * nesting['density']:.1f} % of the area "
            "of the sheets up to the last cut"
        )
        lines += [f"note: {note}" for note in nesting["notes"]]
    lines += [f"note: {note}" for note in done.certificate["notes"]]
    lines.append(f"page to look at: {done.folder / 'index.html'}")
    return [*lines, *(f"not usable: {describe(reason, 'mm')}" for reason in done.reasons)]


#: Options that say something only together with another one.
_NEEDED = {
    "thickness": ("k_factor", "face", "bend_radius", "bend_table"),
    "sheet": ("spacing", "rotations", "seconds"),
}


#: Options that say something about solids, too, which have a thickness of their own.
_OF_SOLIDS = ("k_factor", "bend_table")


def _check_together(inputs: tuple[str, ...]) -> None:
    """Raise an error if an option would be ignored."""
    from gso.io import SPLINE_SUFFIXES, suffix_of

    solids = any(suffix_of(name) in SPLINE_SUFFIXES for name in inputs)
    context = click.get_current_context()

    def is_given(name: str) -> bool:
        return context.get_parameter_source(name) is not ParameterSource.DEFAULT

    for needed, names in _NEEDED.items():
        for name in filter(is_given, names):
            if not is_given(needed) and not (solids and name in _OF_SOLIDS):
                option = name.replace("_", "-")
                raise OptionError(f"--{option} needs --{needed}; give both or none")


def _thickness(
    thickness: float | None,
    k_factor: float,
    face: str,
    bend_radius: float | None,
    bend_table: str | None,
) -> dict[str, Any]:
    """Return how sheets bend; solids have a thickness of their own."""
    from gso.workshop.thickness import Thickness

    table = None if bend_table is None else _table(bend_table)
    out: dict[str, Any] = {"k_factor": k_factor, "bend_table": table}
    if thickness is not None:
        out["thickness"] = Thickness(thickness, k_factor, face, bend_radius, table)
    return out


def _table(name: str) -> Array:
    """Read a table of bend deductions."""
    import numpy as np

    try:
        with warnings.catch_warnings():
            # NumPy warns of empty files.
            warnings.simplefilter("ignore", UserWarning)
            rows = np.loadtxt(name, delimiter=",", ndmin=2)
    except OSError as error:
        raise OptionError(f"{name}: {error.strerror or error}") from None
    except ValueError as error:
        raise OptionError(
            f"{name} is no table of angles and deductions: {error}; begin a heading with #"
        ) from None
    if rows.shape[1] != 2 or not len(rows):
        raise OptionError(
            f"{name} has {len(rows)} rows of {rows.shape[1]} columns; it must have rows of an "
            "angle and a length"
        )
    return rows * [np.pi / 180.0, 1.0]
