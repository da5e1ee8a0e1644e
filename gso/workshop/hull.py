"""Hulls of developable panels between the lines of a table of offsets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gso.errors import MeshError, OptionError
from gso.geometry.vectors import cross
from gso.mesh import Attributes, Labels, Mesh, Nearest
from gso.ruled.loft import loft
from gso.ruled.ruled_surface import RuledSurface
from gso.typing import Array

#: Largest offset from the plane of symmetry, relative to the size, of a line that is in it.
_IN_PLANE = 1e-9


@dataclass(frozen=True, eq=False)
class HullPanel:
    """A developable panel between two lines.

    Attributes
    ----------
    name : str
    surface : RuledSurface
        Its outside is the side from which faces are anticlockwise.
    off : float
        Largest distance of the panel from its two lines.
    """

    name: str
    surface: RuledSurface
    off: float

    def faults(self, allowed: float) -> list[str]:
        """Return the reasons against the panel: lines to bend along that cross, and distance.

        Parameters
        ----------
        allowed : float
            Largest distance from its lines.
        """
        why = [] if self.surface.sound else ["rulings cross"]
        return why + ([] if self.off <= allowed else ["no developable panel is on both lines"])


def hull_panels(
    lines: Mapping[str, Array], *, mirrored: bool | None = None, rulings: int = 33
) -> list[HullPanel]:
    """Loft a developable panel between each two lines that follow each other.

    Parameters
    ----------
    lines : mapping of str to ndarray, (n, 3)
        Points of each line from one end to the other: keel, chines, sheer. All begin at the same
        end.
    mirrored : bool, optional
        Whether there is a mirror image of each panel across the plane y = 0. By default there is if
        all lines are on one side of the plane.
    rulings : int
        Number of rulings of each panel.

    Raises
    ------
    MeshError
        A line has no four different points; the message names it.
    OptionError
        There are fewer than two lines.

    Examples
    --------
    >>> x = np.linspace(0.0, 4.0, 9)
    >>> keel = np.stack([x, 0.0 * x, 0.05 * (x - 2.0) ** 2], axis=1)
    >>> sheer = np.stack([x, 1.0 - 0.2 * (x - 2.0) ** 2, 1.0 + 0.0 * x], axis=1)
    >>> [panel.name for panel in hull_panels({"keel": keel, "sheer": sheer})]
    ['keel-sheer', 'keel-sheer-mirrored']
    """
    if len(lines) < 2:
        raise OptionError(f"there are {len(lines)} lines; a panel needs two")
    every = np.concatenate([np.asarray(line, float) for line in lines.values()])
    if mirrored is None:
        tiny = _IN_PLANE * float(np.ptp(every, axis=0).max())
        mirrored = bool((every[:, 1] >= -tiny).all() or (every[:, 1] <= tiny).all())
    middle = every.mean(axis=0) * ([1.0, 0.0, 1.0] if mirrored else 1.0)
    flip = np.array([1.0, -1.0, 1.0])
    own = {name: np.asarray(line, float) for name, line in lines.items()}
    found = []
    for (first, one), (second, other) in pairwise(own.items()):
        try:
            found.append(_panel(f"{first}-{second}", one, other, rulings, middle))
        except MeshError as error:
            said = str(error).replace("`one`", f"`{first}`").replace("`other`", f"`{second}`")
            raise MeshError(said) from None
        if mirrored:
            name = f"{first}-{second}-mirrored"
            found.append(_panel(name, one * flip, other * flip, rulings, middle))
    return found


def _panel(name: str, one: Array, other: Array, rulings: int, middle: Array) -> HullPanel:
    """Loft a panel whose normals point away from a point."""
    surface = loft(one, other, rulings=rulings)
    mesh = surface.mesh
    corner = mesh.vertices[mesh.triangles]
    normal = cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    if ((corner.mean(axis=1) - middle) * normal).sum() < 0.0:
        surface = loft(other, one, rulings=rulings)
    away = Nearest(surface.mesh).distances(np.concatenate([one, other]))
    return HullPanel(name, surface, float(away.max()))


def whole_hull(panels: list[HullPanel]) -> Mesh:
    """Return all panels as one mesh, with a group of faces (``g``) for each."""
    points, faces, label, first = [], [], [], 0
    for k, panel in enumerate(panels):
        mesh = panel.surface.mesh
        points.append(mesh.vertices)
        faces.append(mesh.triangles + first)
        label.append(np.full(len(mesh.triangles), k))
        first += len(mesh.vertices)
    names = tuple(panel.name for panel in panels)
    labels = {"g": Labels(names, np.concatenate(label))}
    return Mesh(np.concatenate(points), np.concatenate(faces), attributes=Attributes(labels=labels))
