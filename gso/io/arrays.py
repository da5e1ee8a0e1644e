"""NumPy files: grids of points as .npy, vertices and faces as .npz; pickled data is refused."""

from __future__ import annotations

import io
import math
import zipfile
from typing import IO, Any, BinaryIO

import numpy as np

from gso.errors import MeshError
from gso.io.raw_surface import Surface
from gso.mesh import Mesh
from gso.mesh.attributes import Attributes

# Largest expansion factor of a deflate stream.
_DEFLATE_RATIO = 1032


def read_npy(data: bytes) -> Surface:
    """Read a grid of points (H, W, 3) from the bytes of a .npy file."""
    return Surface(_array(io.BytesIO(data), len(data)), None)


def write_npy(mesh: Mesh, file: BinaryIO) -> None:
    """Write a grid's points (H, W, 3) row by row, independent of the vertex numbering."""
    if mesh.grid is None:
        raise MeshError("the mesh is no grid, which is all that .npy holds; use .npz or .obj")
    np.lib.format.write_array(file, mesh.grid, allow_pickle=False)


def read_npz(data: bytes) -> Surface:
    """Read `vertices` and `faces` (or V and F), or one grid (H, W, 3), from a .npz file."""
    members = read_arrays(data)
    chosen = {name.lower(): array for name, array in members.items()}
    v = next((chosen[k] for k in ("vertices", "v") if k in chosen), None)
    f = next((chosen[k] for k in ("faces", "f") if k in chosen), None)
    if v is not None and f is not None:
        return Surface(v, f, attributes=_attributes(members, f))
    if len(members) != 1:
        names = ", ".join(sorted(members)) or "nothing"
        raise MeshError(
            f"a .npz file holds 'vertices' and 'faces', or one grid (H, W, 3); this one has {names}"
        )
    return Surface(next(iter(members.values())), None)


def read_arrays(data: bytes) -> dict[str, np.ndarray]:
    """Read all arrays of a .npz file, by name."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = [m for m in archive.infolist() if m.filename.endswith(".npy")]
            return {m.filename[:-4]: _member(archive, m) for m in members}
    except (MeshError, MemoryError):
        raise
    # The reader may raise any exception on a damaged file.
    except Exception as error:
        raise MeshError(f"is no intact .npz file: {error}; write it again") from None


def write_npz(mesh: Mesh, file: BinaryIO) -> None:
    """Write `vertices`, `faces` and the face attributes."""
    more: dict[str, Any] = {} if mesh.attributes is None else mesh.attributes.arrays()
    np.savez(file, vertices=mesh.vertices, faces=mesh.faces, **more)


def _attributes(members: dict[str, np.ndarray], faces: np.ndarray) -> Attributes | None:
    """Return the face attributes, None unless the file was written by :func:`write_npz`."""
    try:
        return Attributes.from_arrays(members, faces)
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise MeshError(f"the attributes of its faces are damaged: {error}") from None


def _member(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    packed = member.compress_type == zipfile.ZIP_DEFLATED
    if not packed and member.compress_type != zipfile.ZIP_STORED:
        raise MeshError(f"{member.filename} is packed by a method that NumPy does not write")
    if member.file_size > member.compress_size * (_DEFLATE_RATIO if packed else 1) + 64:
        raise MeshError(f"{member.filename} claims an impossible size; the file is damaged")
    with archive.open(member) as stream:
        return _array(stream, member.file_size)


def _array(stream: IO[bytes], size: int) -> np.ndarray:
    """Read one numeric array from a stream of `size` bytes; check the header against them."""
    try:
        version = np.lib.format.read_magic(stream)
        read_header = {
            (1, 0): np.lib.format.read_array_header_1_0,
            (2, 0): np.lib.format.read_array_header_2_0,
        }[version]
        shape, fortran, dtype = read_header(stream)
        if dtype.kind not in "fiu":
            raise MeshError(f"the array holds {dtype}, no plain numbers")
        wanted = math.prod(shape) * dtype.itemsize
        if min(shape, default=0) < 0 or wanted > size:
            raise MeshError(f"the header claims an array {shape}, but the file ends before")
        raw = stream.read(wanted)
        if len(raw) < wanted:
            raise MeshError("the file is cut off; write it again")
        return np.frombuffer(raw, dtype).reshape(shape, order="F" if fortran else "C")
    except (MeshError, MemoryError):
        raise
    # The reader of headers may raise any exception on a damaged one.
    except Exception as error:
        raise MeshError(f"is no intact array of NumPy: {str(error)[:200]}") from None
