"""GLB (binary glTF 2.0) through trimesh: triangles in single precision."""

from __future__ import annotations

import io
import json
from typing import Any, BinaryIO

import numpy as np

from gso.errors import MeshError
from gso.io.raw_surface import Surface, merged
from gso.io.source import doubles
from gso.mesh import Mesh

_HEAD = 20
# Instances of a mesh take no space in the file; this bounds the vertices after expansion.
_MOST_VERTICES = 50_000_000


def read(data: bytes) -> Surface:
    """Read all meshes of a GLB file as one surface, with the transforms of their nodes.

    Duplicate vertices at texture or shading seams of a mesh are merged. Vertices of
    different nodes are never merged: each node gives its own components.
    """
    import trimesh

    _check(data)
    points: list[np.ndarray] = []
    faces: list[np.ndarray] = []
    notes: tuple[str, ...] = ()
    total = 0
    try:
        with np.errstate(all="ignore"):
            scene: Any = trimesh.load(
                io.BytesIO(data),
                file_type="glb",
                force="scene",
                process=False,
                skip_materials=True,
            )
        for node in scene.graph.nodes_geometry:
            transform, name = scene.graph[node]
            part = scene.geometry[name]
            if not isinstance(part, trimesh.Trimesh):
                continue
            corners = np.asarray(part.faces, np.int64)
            if corners.size and not 0 <= corners.min() <= corners.max() < len(part.vertices):
                raise MeshError(f"the mesh {name!r} has corners outside its vertices")
            v, f, said = merged(doubles(np.asarray(part.vertices)), corners)
            if total + len(v) > _MOST_VERTICES:
                raise MeshError(f"the scene has more than {_MOST_VERTICES} vertices")
            mirrored = np.linalg.det(transform[:3, :3]) < 0
            points.append(v @ transform[:3, :3].T + transform[:3, 3])
            faces.append(total + (f[:, ::-1] if mirrored else f))
            total += len(v)
            notes += said
    except MeshError:
        raise
    # The reader may raise any exception on a damaged file.
    except Exception as error:
        raise MeshError(f"is no intact GLB file: {type(error).__name__}: {error}") from error
    if not faces:
        raise MeshError("the GLB file has no triangles; export the scene with its meshes")
    return Surface(np.concatenate(points), np.concatenate(faces), notes)


def _check(data: bytes) -> None:
    """Reject files that would make the reader fetch other files or allocate without bound."""
    if data[:4] != b"glTF":
        raise MeshError("is no GLB file: it does not start with 'glTF'")
    version, length, size = (int.from_bytes(data[k : k + 4], "little") for k in (4, 8, 12))
    if version != 2:
        raise MeshError(f"the file is glTF {version}; export it as glTF 2.0")
    if len(data) < max(length, _HEAD + size):
        raise MeshError("the GLB file is cut off; export it again")
    try:
        header = json.loads(data[_HEAD : _HEAD + size])
        outside = [b for b in header.get("buffers", []) if "uri" in b]
        loose = [a for a in header.get("accessors", []) if "bufferView" not in a]
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        raise MeshError(f"the header of the GLB file is damaged: {error}") from None
    if outside:
        raise MeshError("the GLB file refers to other files; export it with everything inside")
    if loose:
        raise MeshError("the GLB file is compressed; export it without compression")


def write(mesh: Mesh, file: BinaryIO) -> None:
    """Write the triangulated mesh as GLB, in single precision."""
    import trimesh

    if np.abs(mesh.vertices).max() > np.finfo(np.float32).max:
        raise MeshError("the coordinates are too large for the single precision of GLB")
    body = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
    file.write(trimesh.exchange.gltf.export_glb(trimesh.Scene(body)))
