"""Designs and flat parts that are copies of each other: moved and turned, but not mirrored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gso.mesh import Mesh
from gso.typing import Array, Ints
from gso.workshop.part import Part

#: Largest distance between copies, relative to the diagonal.
_SAME = 1e-6
#: Largest distance between parts that are the same, in millimetres and relative to their size.
_PARTS = (0.01, 1e-5)
#: Largest distance of their guide lines, relative to their size.
_GUIDES = 0.01
#: Largest difference of their angles of bends, in radians.
_ANGLE = 1e-3


def origins(meshes: Sequence[Mesh]) -> list[int]:
    """Return for each mesh the number of the first one that it is a copy of, or its own.

    Copies have the same faces in the same order.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [2, 0, 0], [0, 1, 0]])
    >>> turned = points[:, [1, 0, 2]] * [1, -1, 1]
    >>> one, two = (Mesh(p, [[0, 1, 2]]) for p in (points, turned + 5.0))
    >>> origins([one, two, Mesh(2 * points, [[0, 1, 2]])])
    [0, 0, 2]
    """
    known: dict[bytes, list[int]] = {}
    out = []
    for k, mesh in enumerate(meshes):
        same = known.setdefault(mesh.faces.tobytes(), [])
        like = next((j for j in same if congruent(meshes[j], mesh)), None)
        if like is None:
            same.append(k)
        out.append(k if like is None else like)
    return out


def congruent(one: Mesh, two: Mesh) -> bool:
    """Tell whether a motion without mirroring maps one mesh to another, vertex by vertex.

    Source: Kabsch 1976, A solution for the best rotation to relate two sets of vectors.
    """
    if one.vertices.shape != two.vertices.shape:
        return False
    a, b = (m.vertices - m.vertices.mean(axis=0) for m in (one, two))
    u, _, v = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ v))]) @ v
    return bool(np.linalg.norm(a @ turn - b, axis=1).max() <= _SAME * one.diagonal)


def united(parts: Sequence[Part]) -> tuple[list[Part], dict[str, str]]:
    """Unite parts that are the same, and add up how many are needed.

    They have the same outline, holes, bends, guide lines, marks, notches and numbers of seams;
    their names do not matter.

    Returns
    -------
    parts : list of Part
        One of each.
    same : dict
        For the name of each part that was left out, that of the one it is the same as.
    """
    kept: list[Part] = []
    alike: dict[tuple[object, ...], list[int]] = {}
    same: dict[str, str] = {}
    for part in parts:
        own = (part.holes, part.bends, part.guides, part.creases, part.marks)
        lines = tuple(len(x) for x in own)
        numbers = (x.text for x in part.labels if x.text.isdigit() and x.text != part.name)
        texts = (*sorted(notch.text for notch in part.notches), *sorted(numbers))
        others = alike.setdefault((lines, texts, part.grain is None), [])
        for k in others:
            if _same(kept[k], part):
                same[part.name] = kept[k].name
                kept[k] = replace(kept[k], count=kept[k].count + part.count)
                break
        else:
            others.append(len(kept))
            kept.append(part)
    return kept, same


def _same(one: Part, two: Part) -> bool:
    """Tell whether two parts are the same, each with its long side along x."""
    size = max(one.size)
    most = max(_PARTS[0], _PARTS[1] * size)
    if abs(one.area - two.area) > 4.0 * most * sum(one.size):
        return False
    if np.abs(np.subtract(one.size, two.size)).max() > most:
        return False
    square = abs(one.size[0] - one.size[1]) <= most and one.grain is None
    one = one.shifted(-one.low)
    for turn in (0.0, 0.5, 1.0, 1.5) if square else (0.0, 1.0):
        other = two.turned(turn * np.pi)
        if _equal(one, other.shifted(-other.low), most):
            return True
    return False


def _equal(one: Part, two: Part, most: float) -> bool:
    """Tell whether all lines of two parts are in the same places."""
    import shapely

    rings = [[shapely.LinearRing(x) for x in (p.outline, *p.holes)] for p in (one, two)]
    if shapely.hausdorff_distance(*(shapely.MultiLineString(r) for r in rings)) > most:
        return False
    for name in ("creases", "marks"):
        lines = [[shapely.LineString(x) for x in getattr(p, name)] for p in (one, two)]
        if lines[0] and shapely.hausdorff_distance(*map(shapely.MultiLineString, lines)) > most:
            return False
    pairs = _paired([n.at for n in one.notches], [n.at for n in two.notches], most)
    if pairs is None or any(
        n.text != two.notches[k].text for n, k in zip(one.notches, pairs.tolist(), strict=True)
    ):
        return False
    if not _guided_alike(one, two, most):
        return False
    middles = [[bend.line.mean(axis=0) for bend in p.bends] for p in (one, two)]
    pairs = _paired(middles[0], middles[1], most)
    if pairs is None:
        return False
    for bend, k in zip(one.bends, pairs.tolist(), strict=True):
        other = two.bends[k]
        ends = min(np.abs(bend.line - other.line[::way]).max() for way in (1, -1))
        if ends > most or abs(bend.angle - other.angle) > _ANGLE:
            return False
    return True


def _guided_alike(one: Part, two: Part, most: float) -> bool:
    """Tell whether the guide lines of two parts are in the same places."""
    import shapely

    if not one.guides:
        return not two.guides
    lines = [[shapely.LineString(guide.line) for guide in p.guides] for p in (one, two)]
    # They are traced, and drawn with fewer points: their ends are less exact than outlines.
    far = shapely.hausdorff_distance(*map(shapely.MultiLineString, lines))
    return bool(far <= max(most, _GUIDES * max(one.size)))


def _paired(one: Sequence[Array], two: Sequence[Array], most: float) -> Ints | None:
    """Return the point of `two` at each point of `one`; None if there is not one for each."""
    if not len(one):
        return np.empty(0, np.int64)
    away = np.linalg.norm(np.array(one)[:, None] - np.array(two), axis=2)
    nearest = away.argmin(axis=1)
    near = away[np.arange(len(one)), nearest].max() <= most
    return nearest if near and len(np.unique(nearest)) == len(nearest) else None
