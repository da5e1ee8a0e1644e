"""Surfaces, patterns and parts as JSON-compatible values."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gso.components import largest_first
from gso.io.json_file import plain
from gso.io.polygons import face_rows
from gso.mesh import Mesh
from gso.pattern import Pattern
from gso.typing import Json
from gso.unfolding import Net
from gso.workshop import Part


def mesh_record(mesh: Mesh) -> Json:
    """Return vertices and faces.

    >>> mesh_record(Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))["faces"]
    [[0, 1, 2]]
    """
    return {"vertices": mesh.vertices.tolist(), "faces": face_rows(mesh.faces)}


def pattern_record(pattern: Pattern) -> Json:
    """Return a flat pattern.

    ``vertices`` are points (p, 2), ``vertex`` has the vertex of the surface of each, ``part`` the
    number of the part of each face, the largest part being 0.
    """
    part = np.empty(len(pattern.faces), np.int64)
    for number, own in enumerate(largest_first(pattern.mesh)):
        part[own.faces] = number
    return {
        "vertices": pattern.flat.tolist(),
        "faces": face_rows(pattern.faces),
        "vertex": pattern.vertex.tolist(),
        "part": part.tolist(),
    }


def net_record(net: Net, faces: Sequence[Sequence[int]] | None) -> Json:
    """Return the pattern of a net, with the given faces and vertices where there are such.

    Faces that are cut inside are triangles. ``face`` has the number of the given face of each.
    """
    known = pattern_record(net.pattern)
    known["vertex"] = net.vertex[net.pattern.vertex].tolist()
    known["face"] = net.face.tolist()
    if faces is None:
        return known
    # The copy of a given vertex in a given face, if there is one only.
    corner = net.pattern.faces.ravel()
    keys = np.stack([np.repeat(net.face, 3), net.vertex[net.pattern.vertex[corner]], corner], 1)
    pairs = np.unique(keys, axis=0).tolist()
    place = {(face, vertex): copy for face, vertex, copy in pairs}
    split = {face for face, vertex, copy in pairs if place[face, vertex] != copy}
    whole, number, owner, done = [], [], [], set()
    for own, triangle, part in zip(known["face"], known["faces"], known["part"], strict=True):
        if own in done:
            continue
        if own in split:
            whole.append(triangle)
        else:
            done.add(own)
            whole.append([place[own, v] for v in faces[own] if (own, v) in place])
        number.append(own)
        owner.append(part)
    return known | {"faces": whole, "face": number, "part": owner}


def part_record(part: Part, unit: float) -> Json:
    """Return a part in another unit of length, of `unit` millimetres.

    Angles are in degrees, positive for mountain folds.
    """
    bends = [
        {
            "line": (np.asarray(bend.line) / unit).tolist(),
            "angle": float(np.degrees(bend.angle)),
            "radius": plain(bend.radius / unit),
        }
        for bend in part.bends
    ]
    return {
        "name": part.name,
        "count": part.count,
        "size": [side / unit for side in part.size],
        "area": part.area / unit**2,
        "outline": (part.outline / unit).tolist(),
        "holes": [(hole / unit).tolist() for hole in part.holes],
        "bends": bends,
        "creases": [(line / unit).tolist() for line in part.creases],
        "marks": [(line / unit).tolist() for line in part.marks],
    }
