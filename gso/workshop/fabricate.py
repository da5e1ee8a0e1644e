"""From designs to a folder that a workshop can use."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from gso.constraints import Constraint, listed, record_of
from gso.errors import OptionError
from gso.in_browser import in_notebook, open_file, picture
from gso.io import check_unit
from gso.io.json_file import plain, write_json
from gso.mesh import Mesh
from gso.quantities import (
    Length,
    Strain,
    as_length,
    as_positive,
    as_sheet,
    as_strain,
    millimetres,
    size_notes,
)
from gso.seams.edge_prices import Avoid, Follow
from gso.short_repr import short_repr
from gso.typing import AnyPath, Array, Json
from gso.verdict import Code, Reason, failure
from gso.wording import logged, places
from gso.workshop.assembly_view import front
from gso.workshop.certificate import add_sheets, nesting_record, versions
from gso.workshop.congruent import origins, united
from gso.workshop.constrained import check_formulation
from gso.workshop.designs import Design, Designs, designs_of, several
from gso.workshop.fabrication_settings import FabricationSettings
from gso.workshop.finish import Finish
from gso.workshop.finished_design import FinishedDesign, recorded
from gso.workshop.job_folder import CERTIFICATE, PAGE, SOLIDS, WORK, opened, path_of
from gso.workshop.marks import check_lines
from gso.workshop.names import different
from gso.workshop.nesting import Rotations, checked_options, nest
from gso.workshop.output_files import Drawings, beside, written
from gso.workshop.page_data import Shown
from gso.workshop.page_views import Views
from gso.workshop.panels import Made
from gso.workshop.part import Drawing, Part
from gso.workshop.part_notes import book_notes, guide_notes
from gso.workshop.work import made_all
from gso.workshop.writers.pdf import room


@dataclass(frozen=True, eq=False)
class Fabrication:
    """What :func:`fabricate` made.

    Attributes
    ----------
    folder : Path
    parts : tuple of Part
        The parts, in millimetres, each with how many of it are needed.
    sheets : tuple of Drawing
        The sheets with their parts in place; empty without nesting.
    certificate : dict
        What ``certificate.json`` has.
    files : tuple of str
        Names of the files, relative to the folder.
    shown : tuple of Shown
        What was made of the designs, as the page shows it.
    """

    folder: Path
    parts: tuple[Part, ...]
    sheets: tuple[Drawing, ...]
    certificate: Json
    files: tuple[str, ...] = field(default=())
    shown: tuple[Shown, ...] = field(default=(), repr=False)

    __repr__ = short_repr

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the representation, and the first design from the front."""
        return f"<pre>{escape(repr(self))}</pre>" + "".join(
            f'<img style="max-width: 100%" src="{front(one.made).source()}" alt="">'
            for one in self.shown[:1]
        )

    def show(self) -> None:
        """Open the page in a browser; in a notebook, show a picture of the first design.

        Raises
        ------
        GSOError
            There is no browser.
        """
        if in_notebook():
            picture(self)
        else:
            open_file(self.folder / PAGE)

    @property
    def usable(self) -> bool:
        """Whether everything can be made as it was asked for."""
        return bool(self.certificate["usable"])

    @property
    def reasons(self) -> tuple[Reason, ...]:
        """Why not, the most severe first; lengths in millimetres."""
        return tuple(map(Reason.read, self.certificate["reasons"]))


def fabricate(
    designs: Designs,
    folder: AnyPath,
    *,
    unit: str = "mm",
    scale: float = 1.0,
    formulation: str = "ruled",
    max_deviation: Length | None = None,
    max_strain: Strain | None = None,
    max_strips: int = 64,
    darts: bool = False,
    cut: ArrayLike | None = None,
    keep: ArrayLike | None = None,
    keep_groups: bool = False,
    max_pieces: int | None = None,
    min_neck: Length | None = None,
    min_size: Length | None = None,
    symmetric: bool = False,
    along: Follow | None = None,
    avoid: Avoid | None = None,
    effort: str = "standard",
    constraints: Sequence[Constraint] = (),
    min_radius: Length | None = None,
    finish: Finish = Finish(),  # noqa: B008
    marks: Sequence[ArrayLike] = (),
    holes: Sequence[ArrayLike] = (),
    sheet: tuple[Length, Length] | None = None,
    spacing: float = 2.0,
    rotations: Rotations = (0, 180),
    seconds: float = 10.0,
    formats: Sequence[str] = ("dxf", "svg"),
    layers: str = "operations",
    paper: str | None = None,
    bend_text: bool = False,
    bend_step: Length | None = None,
    step: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    callback: Callable[[str], None] | None = None,
) -> Fabrication:
    """Make designs of flat parts, and write what a workshop needs to a folder.

    A component that is flat or developable as it is keeps its shape
    (:func:`gso.exact.folded_pattern`). Any other is made developable within `max_deviation`, in one
    piece or in several, and laid flat. The folder gets the parts, the sheets, the surfaces, a
    certificate and a page to look at. A call that was ended goes on where it was.

    Parameters
    ----------
    designs : mesh, path, or sequence of them
        What :func:`gso.as_mesh` takes.
    folder : path
        A new or empty folder, or that of an earlier run, whose drawings are replaced.
    unit : {"mm", "um", "cm", "dm", "m", "in", "ft", "yd"}
        Unit of the coordinates; CAD files are read in millimetres.
    scale : float
        Factor by which designs, marks and holes are scaled before anything else.
    formulation : {"ruled", "curvature", "isometry", "flatten"}
        "ruled": exactly developable strips, with bend lines; pieces that no strips follow are
        only nearly developable. "curvature", "isometry": all of them are nearly developable.
        "flatten": the shape stays as it is.
    max_deviation : float or str, optional
        Largest distance between design and result, both ways: a number in the design's unit, or a
        text such as "5mm" or "0.5%" (of the diagonal of the bounding box); 1 % by default.
    max_strain : float or str, optional
        Largest strain of the patterns, such as 0.01 or "1%". By default 1 % where the shape stays
        ("flatten"), and 0.1 % where it may change.
    max_strips : int
        Largest number of strips side by side of one piece.
    darts : bool
        Whether cuts may end inside a piece.
    cut, keep : array_like of int, (k, 2), optional
        Edges of the design, by their vertices, that are cut in any case, and that are not: these
        only for designs that keep their shape.
    keep_groups : bool
        Whether to cut between the groups of faces (``g``) of an OBJ file in any case; without
        two of them, between its objects (``o``) or materials (``usemtl``).
    max_pieces : int, optional
        Budget of pieces that a design is cut into; each of them may be several strips.
    min_neck, min_size : float or str, optional
        Smallest width of a part at its narrowest place, and smallest length of a part, as for
        `max_deviation`; a share is of the diagonal of all designs together.
    symmetric : bool
        Make the seams symmetric, see :func:`gso.pieces`.
    along, avoid : array_like, Seam, or sequence of these, optional
        What seams should follow, and what they should keep away from, on one design and in its
        unit: edges or faces, or polylines as for :func:`gso.pieces`, such as mullions. Designs
        that keep their shape are cut along their own faces.
    effort : {"draft", "standard", "best"}
        How long to search for seams, see :func:`gso.pieces`.
    constraints : sequence of Constraint
        What must hold, as for :func:`gso.tno.optimize`, on one design of one component; positions
        are those of the scaled design. By "curvature" and "isometry" the pieces are found without
        them and solved again with them. Strips ("ruled") take those of :func:`gso.strips`, and are
        then not cut into pieces. "flatten" takes none.
    min_radius : float or str, optional
        Smallest radius that the surface may be bent to, as for `max_deviation`; a share is of the
        diagonal of all designs together.
    finish : Finish
        Kerf, allowance, notches, holes, tabs, labels, thickness; in millimetres.
    marks, holes : sequence of array_like, (k, 3)
        Lines to engrave, and closed lines to cut (the last point is the first), on the designs'
        surfaces and in their unit.
    sheet : (float, float), optional
        Length and width of the sheets to nest on, in millimetres, or texts such as "3m".
    spacing : float
        Distance between parts on a sheet, in millimetres.
    rotations : sequence of float, int or "any"
        Rotations on the sheet, see :func:`gso.workshop.nesting.nest`.
    seconds : float
        Time for nesting, in seconds in all.
    formats : sequence of str
        Formats of parts and sheets.
    layers : {"operations", "astm"}
        Names of layers.
    paper : str, optional
        Also write all parts as a PDF on pages of this size, such as "A4": a part that fits has a
        page of its own. With tabs and without `sheet`, designs that keep their shape are cut so
        that every part fits, where no face is larger than a page.
    bend_text : bool
        Also write the direction, angle and radius beside each bend.
    bend_step : float or str, optional
        Angle between the bend lines of cylinders and cones, in degrees (15 or "15deg"), or how far
        chords between them may be from the surface ("0.5mm"); by default 2 to 15 degrees, by the
        radius.
    step : bool
        Also write the folded parts as solids of the sheet's thickness to one STEP file,
        ``folded.step``. Bends that are cylinders or cones between two rulings and two circles are
        so there; others have flat facets as the designs have them.
    workers : int, optional
        Number of processes; one for each processor when not given, 0 for none.
    scheduler : str, optional
        Address of a Dask scheduler whose workers make the parts instead.
    callback : callable, optional
        Called with what is being done, in words.

    Returns
    -------
    Fabrication

    Raises
    ------
    MeshError
        A design cannot be read or used.
    OptionError
        An option is wrong.

    Examples
    --------
    >>> import tempfile, numpy as np, gso
    >>> t = np.linspace(0, np.pi / 2, 17)
    >>> arch = np.stack(np.broadcast_arrays(np.cos(t), np.sin(t), 2 * t[:, None]), axis=-1)
    >>> job = gso.fabricate(arch, tempfile.mkdtemp(), unit="m", formats=("svg",), workers=0)
    >>> job.usable, len(job.parts), [round(x) for x in job.parts[0].size]
    (True, 1, [3142, 1571])
    """
    clock = time.perf_counter()
    as_positive(scale, "scale")
    per_unit = millimetres(unit)
    if not isinstance(finish, Finish):
        raise OptionError(f"finish is {finish!r}; it must be a gso.workshop.finish.Finish")
    drawings = Drawings(tuple(dict.fromkeys(formats)), layers, paper, bend_text, step)
    most = page = None
    size = as_sheet(sheet, "mm")
    if size is None and paper is not None and finish.tabs is not None:
        page = finish.room(room(paper), per_unit)
    if size is not None:
        checked_options(size, spacing, 0.0, rotations, seconds)
        most = finish.room(size, per_unit)
    say = logged(callback)
    for path in filter(None, map(path_of, several(designs))):
        check_unit(path, unit)
    place = Path(os.fsdecode(folder))
    held = tuple(listed(constraints))
    every = designs_of(
        designs,
        cut=cut,
        keep=keep,
        keep_groups=keep_groups,
        along=along,
        avoid=avoid,
        constraints=held,
        scale=scale,
    )
    thin = [design.name for design in every if step and design.sheet is None]
    if thin and finish.thickness is None:
        raise OptionError(
            f"{thin[0]} is no solid of sheet metal, so that its parts have no thickness as solids; "
            "give the thickness, or leave out step"
        )
    meshes = [design.mesh for design in every]
    settings = FabricationSettings(
        formulation,
        "1%" if max_deviation is None else max_deviation,
        None if max_strain is None else as_strain(max_strain, "max_strain"),
        max_strips,
        darts,
        most,
        _length(min_radius, "min_radius", meshes, unit),
        unit,
        bend_step,
        finish.pressed(per_unit),
        page,
        max_pieces,
        _length(min_neck, "min_neck", meshes, unit),
        _length(min_size, "min_size", meshes, unit),
        symmetric,
        effort,
    )
    for design in every:
        check_formulation(design, settings)
    marks, holes = ([scale * np.asarray(line, float) for line in x] for x in (marks, holes))
    drawn: list[tuple[Sequence[Array], list[int]]] = [
        (given, check_lines(given, meshes, what, closed=what == "hole"))
        for given, what in ((marks, "mark"), (holes, "hole"))
    ]
    earlier = opened(place, several(designs))
    # Marks are on one of several copies, so that these differ.
    alone = len(marks) or len(holes) or any(design.is_marked for design in every)
    alone = alone or len({design.sheet for design in every}) > 1
    first = list(range(len(meshes))) if alone else origins(meshes)
    chosen = sorted(set(first))
    found, failed = made_all(every, chosen, settings, place / WORK, workers, scheduler, say)
    found = _named(found)
    say("parts")
    finished: list[FinishedDesign] = []
    for k in chosen:
        copies = [every[j] for j, origin in enumerate(first) if origin == k]
        if k not in found:
            finished.append(FinishedDesign.failed(copies, failed[k]))
            continue
        marked, bored = ([x for x, n in zip(*both, strict=True) if n == k] for both in drawn)
        finished.append(
            FinishedDesign.of(
                copies, found[k], settings, finish, marked, bored, step=step, paper=paper
            )
        )
    notes = [note for design in every for note in design.notes]
    notes += [note for design in every for note in _size_notes(design, settings)]
    notes += [note for one in finished for note in one.notes]
    records = [one.record for one in finished]
    reasons = [reason for one in finished for reason in one.reasons]
    shown = [one.shown for one in finished if one.shown is not None]
    solids = [solid for one in finished for solid in one.solids]
    if faceted := [solid.name for solid in solids if solid.faceted]:
        notes.append(
            f"{SOLIDS}: {places('part', faceted)} {'has' if len(faceted) == 1 else 'have'} flat "
            "facets in place of round faces that do not end at rulings and circles"
        )
    parts = _different([(every[k].sheet, one) for k, one in zip(chosen, finished, strict=True)])
    certificate = {
        "unit": "mm",
        "asked": plain(
            {
                "unit": unit,
                "scale": scale,
                **settings.record(),
                "constraints": [record_of(one) for one in held],
                "finish": finish.record(),
            }
        ),
        "versions": dict(versions()),
        "designs": records,
        "sheets": [],
        "notes": [*dict.fromkeys(notes), *guide_notes(records, settings)],
    }
    sheets: list[Drawing] = []
    if size is not None and parts:
        say("nesting")
        try:
            nested = nest(
                parts,
                size,
                spacing=spacing,
                rotations=rotations,
                seconds=seconds,
                callback=callback,
            )
        except OptionError as error:
            reasons.append(failure(Code.NOT_NESTED, str(error)))
        else:
            sheets = list(nested.sheets)
            certificate |= nesting_record(nested, spacing, size)
    add_sheets(records, sheets)
    certificate["reasons"], certificate["usable"] = recorded(reasons), not reasons
    certificate["parts"] = sum(part.count for part in parts)
    say("files")
    views = Views(shown, certificate)
    if paper is not None:
        certificate["notes"] += book_notes(beside(parts), paper, len(views.step_texts()))
    files = written(place, parts, sheets, views, certificate, drawings, earlier, solids)
    certificate["files"] = files
    certificate["seconds"] = time.perf_counter() - clock
    write_json(place / CERTIFICATE, certificate)
    return Fabrication(place, tuple(parts), tuple(sheets), certificate, tuple(files), tuple(shown))


def _size_notes(design: Design, settings: FabricationSettings) -> list[str]:
    sides = np.ptp(design.mesh.vertices, axis=0).tolist()
    said = size_notes(sides, settings.unit, settings.distance(design.mesh.diagonal))
    return [f"{design.name}: {note}" for note in said]


def _length(given: Length | None, name: str, meshes: Sequence[Mesh], unit: str) -> float | None:
    """Return a length; a share is of the diagonal of all designs together."""
    if given is None:
        return None
    points = np.concatenate([mesh.vertices for mesh in meshes])
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    return as_length(given, name, diagonal=diagonal, unit=unit)


def _different(finished: Sequence[tuple[float | None, FinishedDesign]]) -> list[Part]:
    """Return the parts of designs, alike ones once, and say in the records which are the same.

    Parts are the same only if their sheets are: each design comes with the thickness of its own.
    """
    of_sheet: dict[float | None, list[Part]] = {}
    for thick, one in finished:
        of_sheet.setdefault(thick, []).extend(one.parts)
    parts: list[Part] = []
    same: dict[str, str] = {}
    for some in of_sheet.values():
        different_parts, also = united(some)
        parts += different_parts
        same |= also
    for _, one in finished:
        for entry in one.record.get("parts", ()):
            entry["same_as"] = same.get(entry["name"])
    return parts


def _named(found: dict[int, Made]) -> dict[int, Made]:
    """Give the panels of all designs names that differ."""
    # In the order of the designs, whichever of them an earlier run had made.
    in_order = dict(sorted(found.items()))
    names = iter(different(panel.name for one in in_order.values() for panel in one.panels))
    return {k: one.named([next(names) for _ in one.panels]) for k, one in in_order.items()}
