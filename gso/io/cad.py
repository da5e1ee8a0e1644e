"""CAD files: faces are read as triangles; splines, whole and trimmed, and planar faces written."""

from __future__ import annotations

import importlib
import os
from collections.abc import Sequence
from typing import NamedTuple

from gso.errors import GSOError, MeshError, OptionError
from gso.io.atomic import check_writable, replacing, suffix_of
from gso.io.raw_surface import Surface
from gso.mesh import Mesh
from gso.quantities import as_positive, millimetres
from gso.spline import BSplineSurface, TrimmedSpline
from gso.typing import AnyPath, Array, Ints


class _Kit(NamedTuple):
    """Modules with ``write(content, unit, suffix)`` and ``read(data, suffix, chord)``.

    And the package that they need.
    """

    writer: str
    reader: str
    package: str
    name: str


_CASCADE = _Kit("opencascade", "brep", "OCP", "OpenCASCADE (cadquery-ocp-novtk)")
_KITS = dict.fromkeys((".step", ".stp", ".iges", ".igs"), _CASCADE)
_KITS[".3dm"] = _Kit("rhino", "rhino", "rhino3dm", "rhino3dm")


class Turned(NamedTuple):
    """A face of a plane, cylinder or cone: a line (2, 3) that is turned about an axis.

    By an angle in radians, about the unit vector `axis` through the point `centre`.
    """

    line: Array
    centre: Array
    axis: Array
    angle: float


class Solid(NamedTuple):
    """A solid with a name: a closed mesh, and what is round in it.

    The faces `turned` take the place of the triangles that are not among `kept` (k,). With
    `faceted`, some triangles are facets of a round surface.
    """

    name: str
    mesh: Mesh
    turned: Sequence[Turned] = ()
    kept: Ints | None = None
    faceted: bool = False


SPLINE_SUFFIXES = tuple(_KITS)
"""Suffixes of the CAD files that are read and written."""


def read_faces(data: bytes, suffix: str, chord: float | None = None) -> Surface:
    """Read the faces in a CAD file as triangles, in millimetres.

    Parameters
    ----------
    data : bytes
    suffix : str
        One of :data:`SPLINE_SUFFIXES`.
    chord : float, optional
        Largest distance between triangles and faces, in millimetres; 1e-4 of the size when not
        given.

    Raises
    ------
    MeshError
        The file is damaged, or has no faces.
    GSOError
        The package that reads the format is not installed.
    """
    if chord is not None:
        chord = as_positive(chord, "chord")
    check_package(suffix)
    module = importlib.import_module(f"gso.io.{_KITS[suffix].reader}")
    found: Surface = module.read(data, suffix, chord)
    return found


def check_spline(path: AnyPath, unit: str = "mm") -> None:
    """Reject a CAD file that cannot be written, before anything is computed.

    Raises
    ------
    MeshError
        Unknown suffix, no such folder, no permission.
    OptionError
        Unknown unit.
    GSOError
        The package that writes the format is not installed, or a system library that it
        needs is missing (OpenCASCADE: libGL). The message says which.
    """
    check_writable(path, SPLINE_SUFFIXES)
    millimetres(unit)
    try:
        check_package(suffix_of(path))
    except GSOError as error:
        raise GSOError(f"{os.fsdecode(path)}: {error}") from None


def check_unit(path: AnyPath, unit: str) -> None:
    """Raise an OptionError if a unit is given for a CAD file, which has one of its own.

    >>> check_unit("panel.obj", "m")
    >>> check_unit("bracket.step", "mm")
    """
    if unit != "mm" and suffix_of(path) in SPLINE_SUFFIXES:
        raise OptionError(
            f"{os.fsdecode(path)}: CAD files have a unit of their own, and are read in "
            "millimetres; leave out the unit"
        )


def check_package(suffix: str) -> None:
    """Raise an error if the package for a CAD format, by its suffix, cannot be used."""
    kit = _KITS[suffix]
    try:
        importlib.import_module(kit.package)
        return
    except ModuleNotFoundError:
        what = 'pip install ".[cad]" in the folder of gso'
    except ImportError as error:
        what = f"it is there but cannot be loaded: {error}"
    raise GSOError(f"{suffix} files need {kit.name}: {what}")


def save_spline(spline: BSplineSurface, path: AnyPath, *, unit: str = "mm") -> None:
    """Write a B-spline surface to a CAD file: the same control net, knots and degrees.

    An existing file is replaced only when the new one is complete.

    Parameters
    ----------
    spline : BSplineSurface
        From :func:`gso.fit_spline`, or the `spline` of a result.
    path : str or PathLike
        A .step, .stp, .iges, .igs or .3dm file.
    unit : {"mm", "um", "cm", "dm", "m", "in", "ft", "yd"}
        Unit of the control points; it is written into the file. STEP and IGES do not support
        "dm" and "yd": the surface is then converted to millimetres.

    Raises
    ------
    MeshError
        Unknown suffix, a path that cannot be written, or a surface that the format cannot
        store. The message names the file.
    OptionError
        Unknown unit, or `spline` is not a :class:`BSplineSurface`.
    GSOError
        The package that writes the format is not installed: ``pip install ".[cad]"`` in the
        folder of gso.

    Examples
    --------
    >>> import gso, numpy as np
    >>> u, v = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9), indexing="ij")
    >>> spline = gso.fit_spline(np.stack([u, v, 0.3 * u * v], axis=-1), controls=4)
    >>> gso.save_spline(spline, "panel.step", unit="m")              # doctest: +SKIP
    """
    if not isinstance(spline, BSplineSurface):
        raise OptionError(
            f"a spline is needed, not {type(spline).__name__}; gso.fit_spline makes one of a grid"
        )
    _write(path, unit, spline)


def save_faces(mesh: Mesh, path: AnyPath, *, unit: str = "mm") -> None:
    """Write the planar faces of a mesh to a CAD file, as faces that share their edges.

    An existing file is replaced only when the new one is complete.

    Parameters
    ----------
    mesh : Mesh
        A mesh of planar faces, such as that of a ruled surface.
    path : str or PathLike
        A .step, .stp, .iges, .igs or .3dm file.
    unit : {"mm", "um", "cm", "dm", "m", "in", "ft", "yd"}
        Unit of the coordinates, as in :func:`save_spline`.

    Raises
    ------
    MeshError
        Unknown suffix, a path that cannot be written, or a face that is not planar. The message
        names the file.
    OptionError
        Unknown unit.
    GSOError
        The package that writes the format is not installed: ``pip install ".[cad]"`` in the
        folder of gso.
    """
    _write(path, unit, mesh)


def save_patches(patches: Sequence[TrimmedSpline], path: AnyPath, *, unit: str = "mm") -> None:
    """Write trimmed splines to a CAD file, such as those of :func:`gso.smooth_strips`.

    In STEP files they share their edges. In 3DM files the surfaces are whole, and their
    outlines are on a layer of their own. An existing file is replaced only when the new one is
    complete.

    Parameters
    ----------
    patches : sequence of TrimmedSpline
    path : str or PathLike
        A .step, .stp, .iges, .igs or .3dm file.
    unit : {"mm", "um", "cm", "dm", "m", "in", "ft", "yd"}
        Unit of the coordinates, as in :func:`save_spline`.

    Raises
    ------
    MeshError
        Unknown suffix, a path that cannot be written, no surfaces, or one whose outline crosses
        itself or is not closed. The message names the file.
    OptionError
        Unknown unit.
    GSOError
        The package that writes the format is not installed: ``pip install ".[cad]"`` in the
        folder of gso.
    """
    if not any(patch.faces for patch in patches):
        raise MeshError(f"{os.fsdecode(path)}: there are no surfaces to write")
    _write(path, unit, patches)


def save_solids(solids: Sequence[Solid | tuple[str, Mesh]], path: AnyPath) -> None:
    """Write solids in millimetres to one STEP file, with their names.

    Triangles in one plane become one face. Where round faces do not fit between the triangles, the
    solid has facets instead. An existing file is replaced only when the new one is
    complete.

    Parameters
    ----------
    solids : sequence of Solid, or of (str, Mesh)
    path : str or PathLike
        A .step or .stp file.

    Raises
    ------
    MeshError
        Another suffix, a path that cannot be written, or faces that are not joined. The message
        names the file.
    GSOError
        OpenCASCADE is not installed: ``pip install ".[cad]"`` in the folder of gso.
    """
    check_writable(path, (".step", ".stp"))
    check_package(suffix_of(path))
    from gso.io.opencascade import write_solids

    with replacing(path) as file:
        try:
            file.write(write_solids(solids))
        except MeshError as error:
            raise MeshError(f"{os.fsdecode(path)}: {error}") from None


def _write(
    path: AnyPath, unit: str, content: BSplineSurface | Mesh | Sequence[TrimmedSpline]
) -> None:
    check_spline(path, unit)
    module = importlib.import_module(f"gso.io.{_KITS[suffix_of(path)].writer}")
    with replacing(path) as file:
        try:
            file.write(module.write(content, unit, suffix_of(path)))
        except MeshError as error:
            raise MeshError(f"{os.fsdecode(path)}: {error}") from None
