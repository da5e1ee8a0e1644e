"""Face names and texture coordinates that a file stores beside the geometry of a mesh.

They are kept so that they can be written again with the result.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from gso.mesh.given_surfaces import GivenSurfaces
from gso.typing import Array, Ints

#: OBJ keywords that label the faces listed after them, and the kind of each label.
LABELS = {"o": "objects", "g": "groups", "s": "smoothing groups", "usemtl": "materials"}


@dataclass(frozen=True, eq=False)
class Labels:
    """Labels of one kind (one OBJ keyword), each for a run of consecutive faces.

    Attributes
    ----------
    names : tuple of str
        In the order of the file, one entry per occurrence of the keyword.
    of_face : ndarray of int, (m,)
        Index in `names` of each face's label; -1 for faces before the first label.
    """

    names: tuple[str, ...]
    of_face: Ints


@dataclass(frozen=True, eq=False)
class Attributes:
    """Labels of faces and texture coordinates of face corners.

    They belong to faces and corners, not to vertices, so they stay valid when vertices are
    moved, merged or duplicated.

    Attributes
    ----------
    libraries : tuple of str
        Material files (``mtllib``), as written in the file.
    labels : dict of str to Labels
        Labels by OBJ keyword: "o", "g", "s", "usemtl".
    texture : ndarray, (t, 1 to 3), or None
        Texture coordinates (``vt``).
    texture_corners : ndarray of int, shaped like the faces, or None
        Row of `texture` of each corner; -1 for none.
    surfaces : GivenSurfaces or None
        Surfaces of a CAD file that the faces lie on; files do not keep them.
    """

    libraries: tuple[str, ...] = ()
    labels: Mapping[str, Labels] = field(default_factory=dict)
    texture: Array | None = None
    texture_corners: Ints | None = None
    surfaces: GivenSurfaces | None = None

    @property
    def empty(self) -> bool:
        """Whether there are no material files, labels or texture coordinates."""
        return not (self.libraries or self.labels or self.texture_corners is not None)

    def taken(self, faces: Ints, turns: Ints | None = None) -> Attributes:
        """Select the attributes of some of the faces.

        Parameters
        ----------
        faces : ndarray of int, (p,)
            Indices of the selected faces, in the new order.
        turns : ndarray of int, (p, k), optional
            Permutation of the corners within each face: for each new corner the column of
            the old one; -1 where there is no corner.
        """
        corners = self.texture_corners
        if corners is not None:
            corners = corners[faces]
            if turns is not None:
                corners = np.where(turns < 0, -1, np.take_along_axis(corners, turns, axis=1))
        labels = {k: replace(said, of_face=said.of_face[faces]) for k, said in self.labels.items()}
        surfaces = None if self.surfaces is None else self.surfaces.taken(faces, turns)
        return replace(self, labels=labels, texture_corners=corners, surfaces=surfaces)

    def __str__(self) -> str:
        parts = [
            f"{len(set(said.names))} {LABELS[k]} ({k})"
            for k, said in self.labels.items()
            if k in LABELS
        ]
        parts += ["files of materials (mtllib)"] if self.libraries else []
        parts += ["texture coordinates (vt)"] if self.texture_corners is not None else []
        return ", ".join(parts) or "nothing"

    def arrays(self) -> dict[str, np.ndarray]:
        """Convert to plain arrays for a .npz file."""
        words = {
            "libraries": self.libraries,
            "labels": {k: v.names for k, v in self.labels.items()},
        }
        out: dict[str, np.ndarray] = {
            "attributes": np.frombuffer(json.dumps(words).encode(), np.uint8)
        }
        out |= {f"attributes_{k}": said.of_face for k, said in self.labels.items()}
        if self.texture is not None and self.texture_corners is not None:
            out |= {"texture": self.texture, "texture_corners": self.texture_corners}
        return out

    @classmethod
    def from_arrays(cls, data: Mapping[str, np.ndarray], faces: Ints) -> Attributes | None:
        """Restore from the output of :meth:`arrays`; None where `data` has no attributes.

        Raises
        ------
        ValueError
            The arrays do not fit the faces, or each other.

        Examples
        --------
        >>> panels = Labels(("left", "right"), np.array([0, 1]))
        >>> data = Attributes(labels={"g": panels}).arrays()
        >>> str(Attributes.from_arrays(data, np.array([[0, 1, 2], [2, 1, 3]])))
        '2 groups (g)'
        """
        if "attributes" not in data:
            return None
        said = json.loads(data["attributes"].tobytes())
        labels = {}
        for keyword, names in said["labels"].items():
            of_face = _checked(data[f"attributes_{keyword}"], (len(faces),), len(names))
            if keyword not in LABELS:
                raise ValueError(f"there are no labels {keyword!r}")
            labels[keyword] = Labels(tuple(map(str, names)), of_face)
        texture = corners = None
        if "texture" in data:
            texture = np.array(data["texture"], np.float64)
            if texture.ndim != 2 or not 1 <= texture.shape[1] <= 3:
                raise ValueError(f"texture coordinates are an array {texture.shape}")
            corners = _checked(data["texture_corners"], faces.shape, len(texture))
        return cls(tuple(map(str, said["libraries"])), labels, texture, corners)


def _checked(index: np.ndarray, shape: tuple[int, ...], count: int) -> Ints:
    """Convert to integers; check the shape and the range -1 ... count - 1."""
    table = np.array(index, np.int64)
    if table.shape != shape or (table >= count).any() or (table < -1).any():
        raise ValueError(f"attributes are an array {table.shape} that does not fit the faces")
    return table
