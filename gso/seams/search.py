"""The search for seams."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from gso import exact
from gso.cut_pieces import Pieces
from gso.errors import ConvergenceWarning, GSOError, OptionError
from gso.executors import open_executor, processors
from gso.mesh import Mesh
from gso.quantities import Length, Strain, as_length, as_sheet, as_strain
from gso.result import Result
from gso.seams.candidates import (
    Candidate,
    cuts,
    joined,
    measured,
    neck_of,
    ranked,
)
from gso.seams.cutting import cut
from gso.seams.dartless import dartless
from gso.seams.design_noise import noise, without_noise
from gso.seams.edge_prices import Avoid, Follow, pairs_of, prices
from gso.seams.exact_pieces import exact_pieces
from gso.seams.gores import advised, bent, in_gores
from gso.seams.kinds import Edges, Seam
from gso.seams.mirror_plane import mirror_of
from gso.seams.options import CHANGES, STAYS, PieceSettings, effort_named, too_large
from gso.seams.potential import Potential
from gso.seams.reshaping import at_scale, reshaped
from gso.seams.revolution import Revolution
from gso.seams.search_result import packed
from gso.seams.segmentation import Segmentation
from gso.seams.straight import straight
from gso.seams.symmetry import plane_of
from gso.seams.tree import Ground
from gso.typing import Array, Ints, MeshLike
from gso.unfolding.manifold import edges_between, manifold_mesh
from gso.verdict import crosses_itself
from gso.wording import logged

#: Seams that stay: what :func:`gso.cut` takes, or an earlier result for the same mesh.
Kept: TypeAlias = "Seam | Iterable[Seam] | ArrayLike | Pieces | None"

#: Ratio of the estimated to the measured strain of a first attempt.
_RATIO = 1.3
#: Share of the allowed strain from which on an attempt is not loosened any more.
_CLOSE = 0.93
_ATTEMPTS = 6
#: Share of the allowed strain that is aimed at before seams are straightened.
_ROOM = 0.97
#: Distance, relative to the diagonal, up to which vertices count as the same.
_SAME = 1e-9


def pieces(
    mesh: MeshLike,
    *,
    max_strain: Strain | None = None,
    max_deviation: Length | None = None,
    max_pieces: int | None = None,
    fewer_than: int | None = None,
    seam: float | None = None,
    darts: bool = False,
    symmetric: bool | str = False,
    min_neck: Length | None = None,
    min_size: Length | None = None,
    sheet: tuple[Length, Length] | None = None,
    unit: str = "mm",
    keep: Kept = None,
    along: Follow | None = None,
    avoid: Avoid | None = None,
    denoise: bool | str = False,
    as_it_is: bool = True,
    effort: str = "standard",
    workers: int | None = None,
    callback: Callable[[str], None] | None = None,
) -> Segmentation:
    """Find seams along which a design can be cut into pieces that can be laid flat.

    A design that is flat or developable as it is, within `max_strain`, is kept: it is unfolded
    into few parts along its own faces, and its folds and rulings are the lines to bend along
    (:attr:`Segmentation.folded`).

    Otherwise seams are searched for. Without `max_deviation` the shape stays as it is, and the
    seams are as short as the strain allows. With it the shape changes within that distance: the
    pieces become developable.

    Parameters
    ----------
    mesh : Mesh, array_like or path
        The design: closed or with boundary loops, with handles, of one or more components. Quads
        are cut along edge rows. Where their shape may change, and that holds less of what is
        allowed, seams cross faces. Where more than two faces share an edge, or parts of the surface
        share a vertex only, it is divided into sheets, and one-sided surfaces are cut open: the
        vertices keep their numbers, their copies follow, and a note says how many there are.
    max_strain : float or str, optional
        Largest strain ``|s - 1|`` of every pattern, such as 0.01 or "1%". By default 1 % where
        the shape stays, and 0.1 % where it may change.
    max_deviation : float or str, optional
        Largest distance between design and result, both ways: a number in the mesh's unit, or a
        text such as "5mm" or "0.5%" (of the diagonal of the bounding box).
    max_pieces : int, optional
        Budget of pieces.
    fewer_than : int, optional
        Number of parts that there are without this search. It ends early where the shape of a mesh
        of 1,000 vertices or more may change and the pieces will not be fewer.
    seam : float, optional
        Budget of the length of all seams, relative to the root of the design's area.
    darts : bool
        Whether seams may end inside a piece, as in cloth and paper.
    symmetric : bool or "mirror"
        Make the seams symmetric. A body of revolution whose shape may change is cut into gores,
        strips along its meridians that are all alike, as few as are within `max_deviation`, unless
        its profile is straight, or seams are given by `keep`, `along` or `avoid`. Other designs,
        and with "mirror" all of them, have seams that are symmetric about a plane. They have to be
        symmetric, too: as a surface, where a mesh of 1,000 vertices or more may change
        its shape, and otherwise vertex by vertex; then pieces that overlap themselves are cut, and
        not joined again elsewhere.
    min_neck : float or str, optional
        Smallest width of a piece, as for `max_deviation`. When not given, a tenth of the root of
        the area is aimed at, and less is taken where the strain cannot be held otherwise.
    min_size : float or str, optional
        Smallest length of a piece, as for `max_deviation`. Shorter ones are joined to a neighbour
        where the strain allows it.
    sheet : (float, float), optional
        Length and width of a sheet that every pattern must fit on, in millimetres, or texts such
        as "3m".
    unit : {"mm", "um", "cm", "dm", "m", "in", "ft", "yd"}
        Unit of the coordinates.
    keep : Seam, iterable of Seam, array_like (e, 2), or Pieces, optional
        Seams that stay: what :func:`gso.cut` takes, or an earlier result for the same mesh.
    along : array_like of int (k, 2), array_like (k, 3), Seam, or sequence of these, optional
        What seams should follow: edges, the points of polylines, or seams such as
        :class:`gso.seams.Polyline`. Points are moved to the nearest vertices, and polylines to
        edges close to them; they are at most 5 % of the diagonal from the surface.
    avoid : array_like of int (k,), of bool (m,), or (k, 3), Polyline, or sequence, optional
        What seams should keep away from: faces, a mask of all faces, or polylines, which are the
        faces that they pass over.
    denoise : bool or "auto"
        Denoise the design first, such as a scan; "auto": only if it is noisy, and no farther than
        its noise is large. A note says how far vertices moved.
    as_it_is : bool
        Ask first whether the design is developable as it is. Symmetric seams, and seams `along`
        edges or away from faces, are searched for in any case.
    effort : {"draft", "standard", "best"}
        How long to search where the shape of a mesh of 1,000 vertices or more may change:
        a first look, the usual, or for fewer pieces.
    workers : int, optional
        Number of processes, which a search with `max_deviation` uses; one for each processor by
        default, 0 for this one alone. The result does not depend on it.
    callback : callable, optional
        Called with what is being done, in words.

    Returns
    -------
    Segmentation
        The pieces, their patterns, and the reasons if they are not what was asked for.

    Raises
    ------
    MeshError
        The mesh cannot be read or used: coordinates that are not finite, faces without area, faces
        that are there twice, vertices on edges of other faces. Or the pieces will not be fewer
        than `fewer_than`.
    OptionError
        A parameter is wrong.

    Examples
    --------
    >>> import numpy as np, gso
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 17), np.linspace(-1, 1, 17), indexing="ij")
    >>> dome = np.stack([u, v, 0.5 - 0.25 * (u * u + v * v)], axis=-1)
    >>> found = gso.pieces(dome, max_strain=0.01)
    >>> len(found), found.usable, found.metrics["strain_max"] <= 0.01
    (2, True, True)

    Notes
    -----
    The cut is chosen by an estimate of the strain (:mod:`gso.seams.potential`), then the
    pieces are laid flat with the least largest strain and measured, and the estimate's bound is
    adapted.
    """
    clock = time.perf_counter()
    design, vertex = manifold_mesh(mesh, sheets=True)
    said = design.notes
    copies = len(vertex) - len(np.unique(vertex))
    if len(design.faces) > copies:
        # Otherwise it is the division that has taken most faces apart.
        design.check_joined()
    if copies:
        keep = _of_copies(design, vertex, keep)
        if (pairs := pairs_of(along)) is not None:
            along = edges_between(design, vertex, pairs, "along")

    def length(value: Length | None, name: str) -> float | None:
        if value is None:
            return None
        return as_length(value, name, diagonal=design.diagonal, unit=unit)

    default = STAYS if max_deviation is None else CHANGES
    settings = PieceSettings(
        max_strain=default if max_strain is None else as_strain(max_strain, "max_strain"),
        max_deviation=length(max_deviation, "max_deviation"),
        max_pieces=max_pieces,
        fewer_than=fewer_than,
        seam=seam,
        darts=darts,
        min_neck=length(min_neck, "min_neck"),
        min_size=length(min_size, "min_size"),
        max_size=as_sheet(sheet, unit),
        say=logged(callback),
        effort=effort_named(effort),
    )
    if symmetric not in (False, True, "mirror"):
        raise OptionError(f'symmetric is {symmetric!r}; it must be True, False or "mirror"')
    design, kept, done = _read(design, keep, denoise)
    said = (*said, *done)
    factor = prices(design, along, avoid)
    free = not len(kept) and factor is None
    body = _turned(design, settings.max_deviation) if symmetric is True and free else None
    out = None
    stays = as_it_is and factor is None and (body is not None or not symmetric)
    if stays:
        out = _exact(design, kept, settings)
    if out is None or not (out.usable or crosses_itself(out.reasons)):
        try:
            other = None if body is None else in_gores(design, body, settings)
            if other is None:
                other = _searched(design, kept, factor, bool(symmetric), settings, workers)
                if free and not symmetric:
                    other = _advised(other, design, settings.max_deviation)
            if stays and out is None:
                in_rows = _exact(design, kept, settings, rows=True)
                if in_rows is not None and _is_better(in_rows, other):
                    other = in_rows
            out = other if out is None or other.usable else out
        except GSOError:
            if out is None:
                raise
    return replace(out, notes=(*said, *out.notes), seconds=time.perf_counter() - clock)


def _exact(
    design: Mesh, kept: Ints, settings: PieceSettings, *, rows: bool = False
) -> Segmentation | None:
    """Return the parts of a design that is developable as it is."""
    found = exact_pieces(design, kept, settings, rows=rows)
    if found is None:
        return None
    out = packed(found, None, design, kept, settings)
    return replace(out, notes=(*out.notes, exact.as_it_is(found.strain)))


def _is_better(in_rows: Segmentation, other: Segmentation) -> bool:
    """Whether exact pieces can be used, and are few beside others, if these can be."""
    return in_rows.usable and (exact.keeps_rows(len(in_rows), len(other)) or not other.usable)


def _turned(design: Mesh, distance: float | None) -> Revolution | None:
    """Return a design as a body of revolution, if it is one and its shape may change."""
    return None if distance is None else Revolution.of(design, distance)


def _advised(found: Segmentation, design: Mesh, distance: float | None) -> Segmentation:
    """Add a note if the design could be made of gores."""
    body = _turned(design, distance)
    if body is None or distance is None or not bent(body, distance):
        return found
    return replace(found, notes=(*found.notes, advised(body, distance)))


def _of_copies(design: Mesh, vertex: Ints, keep: Kept) -> Kept:
    """Return seams of a surface that was divided, with all copies of their edges."""
    if keep is None or isinstance(keep, Pieces):
        return keep
    seams: Any = keep if isinstance(keep, Iterable) else [keep]
    seams = list(seams)
    if not any(isinstance(one, Seam) for one in seams):
        return edges_between(design, vertex, seams, "keep")
    return [
        Edges(edges_between(design, vertex, one.pairs, "keep")) if isinstance(one, Edges) else one
        for one in seams
    ]


def _searched(
    design: Mesh,
    kept: Ints,
    factor: Array | None,
    symmetric: bool,
    settings: PieceSettings,
    workers: int | None,
) -> Segmentation:
    """Search for seams, and judge the pieces."""
    scaled = at_scale(design, settings.max_deviation)
    plane = plane_of(design) if symmetric and scaled else None
    mirror = mirror_of(design) if symmetric and not scaled else None
    ground = Ground.of(design, factor, kept, mirror)
    ground = replace(ground, kept=ground.mirrored(kept))
    max_size, aim = settings.max_size, settings
    if max_size is not None and too_large(ground.mesh, max_size):
        # The pieces are not cut to size in vain; the reason names the largest.
        aim = replace(settings, max_size=None)
    said = noise(ground.mesh, ground.potential)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        if settings.max_deviation is None:
            changed: tuple[Candidate, Result | None] = _as_is(ground, aim), None
        else:
            # This process does its share.
            others = max((processors() if workers is None else workers) - 1, 0)
            with open_executor(others) as executor:
                changed = reshaped(ground, replace(aim, executor=executor), plane)
        out = packed(*changed, ground.mesh, ground.kept, settings)
    notes = [said] if said else []
    if out.design.is_triangles and not ground.mesh.is_triangles:
        notes.append("seams cross faces, which were divided into triangles")
    return replace(out, notes=(*out.notes, *notes))


def _read(design: Mesh, keep: Kept, denoise: bool | str) -> tuple[Mesh, Ints, list[str]]:
    """Return the design to cut, the edges of it (k, 2) that are cut in any case, and notes."""
    kept, notes = np.empty((0, 2), np.int64), []
    if isinstance(keep, Pieces):
        design, kept = _again(design, keep), keep.edges
    if denoise not in (False, True, "auto"):
        raise OptionError(f'denoise is {denoise!r}; it must be True, False or "auto"')
    if denoise is True or (denoise == "auto" and noise(design, Potential(design))):
        design, said = without_noise(design, within=denoise == "auto")
        notes.append(said)
    if keep is not None and not isinstance(keep, Pieces):
        begun = cut(design, keep)
        design, kept = begun.design, begun.edges
    return design, kept, notes


def _again(design: Mesh, keep: Pieces) -> Mesh:
    """Return a design with the vertices that were inserted on the seams of its earlier pieces."""
    if np.array_equal(design.faces, keep.design.faces):
        return design
    own, earlier = design.vertices, keep.design.vertices[: len(design.vertices)]
    if len(earlier) == len(own):
        far = np.linalg.norm(own - earlier, axis=1)
        if far.max(initial=0.0) <= _SAME * design.diagonal:
            return keep.design
    raise OptionError(
        "keep: the seams are of pieces of another mesh; give their own design, "
        "gso.pieces(found.design, keep=found), or seams as edges"
    )


def _as_is(ground: Ground, settings: PieceSettings) -> Candidate:
    """Find seams of a shape that does not change."""
    if settings.darts:
        return straight(ground, _darted(ground, settings), settings)
    return dartless(ground, settings)


def _darted(ground: Ground, settings: PieceSettings) -> Candidate:
    """Cut with darts, and adapt the bound on the estimated strain to the measured one."""
    # The strain of triangle meshes changes when seams are straightened.
    most = (_ROOM if ground.mesh.is_triangles else 1.0) * settings.max_strain
    ratio = _RATIO
    found: list[Candidate] = []
    for attempt in range(_ATTEMPTS):
        settings.say(f"seams, attempt {attempt + 1}")
        last = measured(
            ground, cuts(ground, settings, ratio * most), settings.max_size, settings.say
        )
        found.append(last)
        good = any(one.strain <= most and one.sound for one in found)
        whole = len(last.pieces.edges) == len(ground.kept)
        if good and (_CLOSE * most < last.strain <= most or attempt >= 3):
            break
        if whole and last.strain <= most:
            break
        ratio *= float(np.clip(0.985 * most / max(last.strain, 1e-300), 0.5, 1.6))
    best = min(found, key=lambda one: (one.strain > most or not one.sound, *ranked(one, settings)))
    if best.strain > most:
        return best
    return joined(ground, best, most, neck_of(ground, settings), settings)
