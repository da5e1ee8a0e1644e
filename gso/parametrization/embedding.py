"""Plane embeddings of disk-like meshes without inverted faces."""

from __future__ import annotations

import numpy as np

from gso import geometry
from gso.errors import MeshError
from gso.linalg import spd
from gso.mesh import Mesh
from gso.mesh.topology import edge_graph
from gso.parametrization.arap import strain_level
from gso.typing import Array, Ints


def embeddings(mesh: Mesh, triangles: Ints, oriented: Ints) -> list[Array]:
    """Compute plane images (n, 2) of a mesh, the least strained first; components may overlap.

    Three maps are computed per component: least-squares conformal (Levy et al. 2002), harmonic
    to a circle (Eck et al. 1995), and Tutte's, whose faces are convex. Holes are allowed. Only
    the maps with the fewest inverted triangles are kept, sorted by strain; Tutte's map always
    exists. All are scaled to the area of the surface.

    Parameters
    ----------
    mesh : Mesh
        Components with a boundary and without handles.
    triangles : ndarray of int, (t, 3)
        Triangles on which strain is measured.
    oriented : ndarray of int, (u, 3)
        Triangles that must not be inverted.

    Returns
    -------
    list of ndarray, (n, 2)
        Centred at the origin, where vertices of no face are put. If components have different
        numbers of images, the last image of a component is repeated.

    Raises
    ------
    MeshError
        A component is closed or has handles.
    """
    found = []
    for ids in parts(mesh):
        part, local = mesh.restricted(ids)
        _check(part, int(ids[0]))
        own = (local[t[local[t[:, 0]] >= 0]] for t in (triangles, oriented))
        found.append((ids, _embed(part, *own)))
    flat = np.zeros((max(len(images) for _, images in found), len(mesh.vertices), 2))
    for ids, images in found:
        for k in range(len(flat)):
            flat[k, ids] = images[min(k, len(images) - 1)]
    return list(flat)


def flattens(mesh: Mesh) -> bool:
    """Tell whether every component has a boundary and no handle, so that it has a plane image.

    >>> flattens(Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    True
    """
    every = parts(mesh)
    try:
        for ids in every:
            _check(mesh.restricted(ids)[0] if len(every) > 1 else mesh, int(ids[0]))
    except MeshError:
        return False
    return True


def parts(mesh: Mesh) -> list[Ints]:
    """List the vertices of each component, without those of no face."""
    labels, used = mesh.components, mesh.used
    return [np.flatnonzero(labels == k) for k in np.unique(labels[used])]


def _embed(mesh: Mesh, triangles: Ints, oriented: Ints) -> list[Array]:
    outer = max(mesh.boundary_loops, key=lambda loop: _perimeter(mesh.vertices[loop]))
    circle = _circle(mesh.vertices[outer])
    images = [
        _conformal(mesh, outer),
        _harmonic(mesh, outer, circle),
        _tutte(mesh, outer, circle),
    ]
    rated = []
    for image in images:
        if image is None or not np.isfinite(image).all():
            continue
        scaled = _scaled(mesh, image)
        flipped = int((geometry.signed_areas(scaled, oriented) <= 0).sum())
        rated.append((flipped, strain_level(mesh.vertices, triangles, scaled), scaled))
    rated.sort(key=lambda r: r[:2])
    return [image for flipped, _, image in rated if flipped == rated[0][0]]


def _check(mesh: Mesh, name: int) -> None:
    """Raise if a component cannot be mapped to the plane without a cut."""
    where = f"the part with vertex {name}"
    loops = len(mesh.boundary_loops)
    if loops == 0:
        raise MeshError(
            f"{where} is closed: it has no boundary to lay it out by; cut it open along seams that "
            "you mark or that gso pieces finds, or delete a face"
        )
    handles = (2 - loops - mesh.euler_characteristic) // 2
    if handles > 0:
        raise MeshError(
            f"{where} has {handles} handle{'s' if handles > 1 else ''} (Euler characteristic "
            f"{mesh.euler_characteristic}, {loops} boundary loop{'s' if loops > 1 else ''}), which "
            "do not unroll into the plane; cut it open into disks, along seams that you mark or "
            "that gso pieces finds"
        )


def _perimeter(points: Array) -> float:
    return float(np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1).sum())


def _scaled(mesh: Mesh, image: Array) -> Array:
    """Scale an image to the area of the surface and centre it at the origin."""
    v, t = mesh.vertices, mesh.triangles
    space = geometry.doubled_areas(v, t)
    plane = np.abs(geometry.signed_areas(image, t)).sum()
    return np.asarray((image - image.mean(axis=0)) * np.sqrt(space.sum() / max(plane, 1e-300)))


def _circle(points: Array) -> Array:
    """Place the vertices of a loop on the unit circle, spaced by its edge lengths."""
    length = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    angle = 2.0 * np.pi * np.r_[0.0, np.cumsum(length)[:-1]] / length.sum()
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _conformal(mesh: Mesh, loop: Ints) -> Array | None:
    """Compute the least-squares conformal map, with two distant boundary vertices fixed."""
    import igl

    points = mesh.vertices[loop]
    far = int(np.linalg.norm(points - points[0], axis=1).argmax())
    held = np.array([loop[0], loop[far]], np.int64)
    span = float(np.linalg.norm(points[far] - points[0]))
    at = np.array([[0.0, 0.0], [span, 0.0]])
    try:
        image: Array | None = igl.lscm(mesh.vertices.copy(), mesh.triangles.copy(), held, at)[0]
        return image
    except RuntimeError:
        return None


def spanned(mesh: Mesh, loop: Ints, at: Array) -> Array:
    """Compute a plane image (n, 2) of one component without handles, with given boundary.

    The harmonic map, or Tutte's if the harmonic map inverts triangles.

    Parameters
    ----------
    mesh : Mesh
    loop : ndarray of int, (b,)
        Its outer boundary loop, with the surface to the left.
    at : ndarray, (b, 2)
        Positions of the loop's vertices: on a convex curve, anticlockwise.
    """
    image = _harmonic(mesh, loop, at)
    if (
        image is not None
        and np.isfinite(image).all()
        and (geometry.signed_areas(image, mesh.triangles) > 0).all()
    ):
        return image
    return _tutte(mesh, loop, at)


def _harmonic(mesh: Mesh, loop: Ints, at: Array) -> Array | None:
    """Compute the harmonic map with cotangent weights and fixed boundary loop."""
    import igl

    try:
        image: Array | None = igl.harmonic(
            mesh.vertices.copy(), mesh.triangles.copy(), loop.copy(), at, 1
        )
        return image
    except RuntimeError:
        return None


def _tutte(mesh: Mesh, loop: Ints, at: Array) -> Array:
    """Compute Tutte's map (1963): inner vertices at the mean of their neighbours, loop fixed.

    Other loops are filled with a central vertex. On a 3-connected mesh the faces of the image
    are convex.
    """
    n = len(mesh.vertices)
    a, b = mesh.edges.T
    holes = [h for h in mesh.boundary_loops if h is not loop]
    for number, hole in enumerate(holes):
        a, b = np.r_[a, hole], np.r_[b, np.full(len(hole), n + number)]
    return centred(n + len(holes), a, b, loop, at)[:n]


def centred(count: int, a: Ints, b: Ints, loop: Ints, at: Array) -> Array:
    """Place nodes of a graph (count, 2) at the means of their neighbours, with some nodes fixed.

    Parameters
    ----------
    count : int
        Number of nodes; those without edges are put at the origin.
    a, b : ndarray of int, (e,)
        Ends of the edges, each edge once.
    loop : ndarray of int, (f,)
        The fixed nodes, of which each other node can be reached.
    at : ndarray, (f, 2)
        Their positions.

    Examples
    --------
    >>> centred(3, np.array([0, 1]), np.array([1, 2]), np.array([0, 2]), np.eye(2))[1]
    array([0.5, 0.5])
    """
    from scipy.sparse import diags

    image = np.zeros((count, 2))
    image[loop] = at
    inner = np.setdiff1d(np.r_[a, b], loop)
    if inner.size:
        links = edge_graph(count, a, b)
        rows = (links + links.T)[inner]
        matrix = diags(np.asarray(rows.sum(axis=1)).ravel()) - rows[:, inner]
        image[inner] = spd(matrix)(rows @ image)
    return image
