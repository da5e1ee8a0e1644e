"""From designs to a folder that a workshop can use."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gso import cluster, io, metrics, parallel
from gso.errors import GSOError, MeshError, OptionError
from gso.io.svg import MILLIMETRES
from gso.mesh import Mesh
from gso.spelling import choices, known_keywords
from gso.workshop import writers
from gso.workshop.asking import Ask
from gso.workshop.certificate import design_record, digest, plain, versions
from gso.workshop.congruent import origins, united
from gso.workshop.designs import Design, designs_of
from gso.workshop.finish import Finish
from gso.workshop.making import made as make
from gso.workshop.nesting import checked_sheet, nest
from gso.workshop.panels import Made
from gso.workshop.part import Drawing, Part
from gso.workshop.parts import parts_of, scaled
from gso.workshop.work import key, store, stored, work_on
from gso.workshop.writing import written


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
    """

    folder: Path
    parts: tuple[Part, ...]
    sheets: tuple[Drawing, ...]
    certificate: dict[str, Any]
    files: tuple[str, ...] = field(default=())

    @property
    def usable(self) -> bool:
        """Whether everything can be made as it was asked for."""
        return bool(self.certificate["usable"])

    @property
    def reasons(self) -> list[str]:
        """Why not."""
        return list(self.certificate["reasons"])


@known_keywords()
def fabricate(
    designs: Any,
    folder: str | PathLike[str],
    *,
    unit: str = "mm",
    formulation: str = "ruled",
    max_deviation: float | str = "1%",
    max_strain: float = 1e-3,
    max_strips: int = 8,
    darts: bool = False,
    keep_groups: bool = False,
    min_radius: float | None = None,
    finish: Finish = Finish(),  # noqa: B008
    marks: Sequence[ArrayLike] = (),
    holes: Sequence[ArrayLike] = (),
    sheet: tuple[float, float] | None = None,
    spacing: float = 2.0,
    rotations: Any = (0, 180),
    seconds: float = 10.0,
    formats: Sequence[str] = ("dxf", "svg"),
    layers: str = "operations",
    paper: str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    callback: Callable[[str], None] | None = None,
) -> Fabrication:
    """Make designs of flat parts, and write what a workshop needs to a folder.

    Every component of a design is made developable within `max_deviation`, in one piece or in
    several, and laid flat. The folder gets the parts, the sheets, the surfaces, a certificate and
    a page to look at. A call that was ended goes on where it was.

    Parameters
    ----------
    designs : mesh, path, or sequence of them
        What :func:`gso.as_mesh` takes.
    folder : path
    unit : {"mm", "um", "cm", "dm", "m", "in", "ft", "yd"}
        Unit of the coordinates.
    formulation : {"ruled", "curvature", "isometry", "flatten"}
        "ruled": exactly developable strips, with bend lines; pieces that no strips follow are
        only nearly developable. "curvature", "isometry": all of them are nearly developable.
        "flatten": the shape stays as it is.
    max_deviation : float or str
        Largest distance from the design, in its unit, or such as "0.5%" of its diagonal.
    max_strain : float
        Largest strain of the patterns (99th percentile).
    max_strips : int
        Largest number of strips side by side of one piece.
    darts : bool
        Whether cuts may end inside a piece.
    keep_groups : bool
        Whether to cut between the groups of faces (``g``) of an OBJ file in any case.
    min_radius : float, optional
        Smallest radius of a bend, in the design's unit.
    finish : Finish
        Kerf, allowance, notches, holes, tabs, labels, thickness; in millimetres.
    marks, holes : sequence of array_like, (k, 3)
        Lines to engrave, and closed lines to cut, on the designs' surfaces and in their unit.
    sheet : (float, float), optional
        Length and width of the sheets to nest on, in millimetres.
    spacing : float
        Distance between parts on a sheet, in millimetres.
    rotations : sequence of float, int or "any"
        Rotations on the sheet, see :func:`gso.workshop.nesting.nest`.
    seconds : float
        Time for nesting, in all.
    formats : sequence of str
        Formats of parts and sheets.
    layers : {"operations", "astm"}
        Names of layers.
    paper : str, optional
        Also write all parts as a PDF on pages of this size, such as "A4".
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
    if unit not in MILLIMETRES:
        raise OptionError(f"unknown unit {unit!r}; {choices(unit, MILLIMETRES)}")
    scale = MILLIMETRES[unit]
    for name in formats:
        writers.get(name)
    if not isinstance(finish, Finish):
        raise OptionError(f"finish is {finish!r}; it must be a gso.workshop.finish.Finish")
    most = None
    if sheet is not None:
        long, wide = (checked_sheet(sheet) / scale).tolist()
        most = (long, wide)
    ask = Ask(formulation, max_deviation, max_strain, max_strips, darts, most, min_radius)
    say = callback or (lambda said: None)
    place = Path(os.fsdecode(folder))
    try:
        (place / "work").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MeshError(f"{place}: {error.strerror}; -o names a folder") from None
    every = designs_of(designs, keep_groups=keep_groups)
    meshes = [design.mesh for design in every]
    # Marks are on one of several copies, so that these differ.
    alone = len(marks) or len(holes) or any(len(design.kept) for design in every)
    first = list(range(len(meshes))) if alone else origins(meshes)
    drawn = [(given, _nearest(meshes, given)) for given in (marks, holes)]
    chosen = sorted(set(first))
    found, failed = _made(every, chosen, ask, place, workers, scheduler, say)
    say("parts")
    parts: list[Part] = []
    records: list[dict[str, Any]] = []
    for k in chosen:
        copies = [every[j].name for j, origin in enumerate(first) if origin == k]
        if k not in found:
            records.append({"name": every[k].name, "copies": copies, "reasons": [failed[k]]})
            continue
        one = found[k]
        lines = ([x for x, n in zip(given, on, strict=True) if n == k] for given, on in drawn)
        own = [replace(p, count=len(copies)) for p in parts_of(one, scale, finish, *lines)]
        panels = scaled(one.panels, scale, finish)
        records.append(
            design_record(one, panels, own, scale, finish, copies) | {"digest": digest(meshes[k])}
        )
        parts += own
    parts, same = united(parts)
    for record in records:
        for entry in record.get("parts", ()):
            entry["same_as"] = same.get(entry["name"])
    certificate = {
        "unit": "mm",
        "asked": plain({"unit": unit, **ask.record(), "finish": finish.record()}),
        "versions": versions(),
        "designs": records,
        "sheets": [],
        "reasons": [f"{r['name']}: {why}" for r in records for why in r["reasons"]],
    }
    sheets: list[Drawing] = []
    if sheet is not None and parts:
        say("nesting")
        try:
            nested = nest(
                parts,
                sheet,
                spacing=spacing,
                rotations=rotations,
                seconds=seconds,
                callback=callback,
            )
        except OptionError as error:
            certificate["reasons"].append(str(error))
        else:
            sheets = list(nested.sheets)
            certificate["sheets"] = [{"utilisation": u} for u in nested.utilisation]
            certificate["nesting"] = plain(
                {
                    "method": nested.method,
                    "density": nested.density,
                    "spacing": spacing,
                    "sheet": list(sheet),
                    "notes": list(nested.notes),
                }
            )
    certificate["usable"] = not certificate["reasons"]
    certificate["parts"] = sum(part.count for part in parts)
    say("files")
    files = written(place, parts, sheets, found.values(), certificate, formats, layers, paper)
    certificate["files"] = files
    certificate["seconds"] = time.perf_counter() - clock
    with io.replacing(place / "certificate.json") as file:
        file.write(json.dumps(certificate, indent=2).encode() + b"\n")
    return Fabrication(place, tuple(parts), tuple(sheets), certificate, tuple(files))


def _nearest(meshes: Sequence[Mesh], lines: Sequence[ArrayLike]) -> list[int]:
    """Return the number of the design that each line is nearest to."""
    out = []
    for line in lines:
        points = np.asarray(line, float)
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise OptionError(f"a mark or hole has shape {points.shape}; it must be points (k, 3)")
        out.append(int(np.argmin([metrics.point_to_surface(points, m).mean() for m in meshes])))
    return out


def _made(
    designs: Sequence[Design],
    chosen: Iterable[int],
    ask: Ask,
    place: Path,
    workers: int | None,
    scheduler: str | None,
    say: Callable[[str], None],
) -> tuple[dict[int, Made], dict[int, str]]:
    """Make designs, or read what an earlier call made; return what failed too."""
    found: dict[int, Made] = {}
    failed: dict[int, str] = {}
    todo = []

    def read(design: Design) -> Made | None:
        return stored(design.name, key(design, ask), place / "work" / f"{design.name}.npz")

    for k in chosen:
        one = read(designs[k])
        if one is None:
            todo.append(k)
        else:
            found[k] = one
    # The largest first, so that no large one runs alone at the end.
    todo.sort(key=lambda k: -len(designs[k].mesh.vertices))
    if workers is None and len(todo) == 1:
        workers = 0
    if workers == 0 and scheduler is None:
        for number, k in enumerate(todo, start=1):
            own = designs[k]
            say(f"{own.name}: design {number} of {len(todo)}")
            try:
                one = make(own, ask, say)
            except GSOError as error:
                failed[k] = str(error)
                continue
            store(one, key(own, ask), place / "work" / f"{own.name}.npz")
            found[k] = one
        return found, failed
    work = partial(work_on, ask, str((place / "work").resolve()))
    items = (designs[k] for k in todo)
    if scheduler is None:
        spread = parallel.spread(work, items, workers=workers, caller=False)
    else:
        spread = cluster.spread(work, items, scheduler=scheduler)
    total = len(found) + len(todo)
    say(f"designs: {len(found)} of {total}")
    with closing(spread) as results:
        for done in results:
            k = todo[done.index]
            if done.error is not None:
                failed[k] = done.error
                continue
            one = read(designs[k])
            if one is None:
                failed[k] = "its file in the folder work is missing; is the folder shared?"
            else:
                found[k] = one
            say(f"designs: {len(found) + len(failed)} of {total}")
    return found, failed
