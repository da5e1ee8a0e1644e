"""Whole designs to be cut into pieces: sphere, helmet, hull, canopy, dome and teapot.

Sources: the teapot is Newell's (see ``teapot.py``), its patches welded. All others are
formulas of our own, given with each function. Units are millimetres; z is up.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations

import numpy as np
import teapot as newell
from _sheets import beside, disc, edges_of, even, hexagon, join, quad_disc, relax, rim, strip
from _write import Faces, Points, parser, write_obj
from scipy.integrate import cumulative_trapezoid
from scipy.spatial import cKDTree

SPHERE_RADIUS = 500.0
HELMET_LENGTH = 300.0
HULL_LENGTH = 6000.0
# The pot is 3.15 units high and 6.43 long.
TEAPOT_UNIT = 50.0
# First patches of the fours that are joined: body, handle, spout, lid.
TEAPOT_PIECES = ((0, 4, 8, 28), (12,), (16,), (20, 24))


def sphere(steps: int = 4) -> tuple[Points, Faces]:
    """Mesh a sphere of 1 m across: an icosahedron whose triangles are cut in four, repeatedly.

    Parameters
    ----------
    steps : int
        There are 20 * 4^steps triangles. Twelve vertices have valence 5, all others 6.

    Returns
    -------
    vertices : ndarray, (n, 3)
    faces : ndarray, (m, 3)
        Anticlockwise seen from outside; no boundary.
    """
    golden = (1 + 5**0.5) / 2
    corners = [(0, y, z * golden) for y in (-1, 1) for z in (-1, 1)]
    points = np.array([np.roll(c, k) for k in range(3) for c in corners], float)
    points *= SPHERE_RADIUS / np.hypot(1, golden)
    near = np.linalg.norm(points[:, None] - points, axis=-1) < 1.1 * SPHERE_RADIUS
    # Of the two orders of each triangle, the one that is anticlockwise from outside.
    turns = np.array([t for t in permutations(range(12), 3) if t[0] == min(t)])
    joined = near[turns, np.roll(turns, -1, axis=1)].all(axis=1)
    faces = turns[joined & (np.linalg.det(points[turns]) > 0)]
    for _ in range(steps):
        edges, number = edges_of(faces)
        middle = len(points) + number
        points = np.concatenate([points, points[edges].mean(axis=1)])
        points *= SPHERE_RADIUS / np.linalg.norm(points, axis=1)[:, None]
        outer = np.stack([faces, middle, np.roll(middle, 1, axis=1)], axis=-1)
        faces = np.concatenate([outer.reshape(-1, 3), middle])
    return points, faces


def helmet(rings: int = 22) -> tuple[Points, Faces]:
    """Mesh a helmet, 300 mm long: a shell like half an ellipsoid whose rim turns outwards.

    Its profile has length 1 from the top to the rim and falls off at an angle of
    144 s (1 - (s / 1.15)^4) degrees: as on a circle at first, 88 at s = 0.77, 62 at the rim.
    The plan is an oval that is narrower in front, at +x; the nape is lower than the brow.
    The plane y = 0 is a plane of symmetry.

    Parameters
    ----------
    rings : int
        There are 6 rings^2 triangles.

    Returns
    -------
    vertices : ndarray, (n, 3)
    faces : ndarray, (m, 3)
        Anticlockwise seen from outside; one boundary loop.
    """
    plan, faces = disc(rings)
    s = np.linspace(0.0, 1.0, 64 * rings + 1)
    angle = np.radians(144) * s * (1 - (s / 1.15) ** 4)
    out, up = cumulative_trapezoid([np.cos(angle), -np.sin(angle)], s, initial=0)
    radius = np.hypot(*plan.T)
    x, y = plan.T * np.interp(radius, s, out) / np.maximum(radius, 1e-12)
    z = np.interp(radius, s, up)
    wide, high = 0.82 * (1 - 0.1 * x / out[-1]), 0.66 * (1 - 0.1 * x / out[-1])
    return np.stack([x, wide * y, high * z], axis=-1) * (HELMET_LENGTH / 2 / out[-1]), faces


def hull(rows: int = 14) -> tuple[Points, Faces]:
    """Mesh the hull of a boat, 6 m long, open on top, with a pointed bow and a round stern.

    At the fraction t of the length from the bow, which is at +x, the sheer is at the height
    h = 450 (1-t)^2 + 120 t^2 and has the half breadth b = 1100 (1 - (1-t)^3) sqrt(1 - t^4);
    the keel is d = 900 (1 - (1-t)^6) sqrt(1 - t^4) below it. A section is half an ellipse
    that flares upwards: y = b sin w (1 - 0.2 cos w), z = h - d cos w, w from -90 to 90
    degrees. The plane y = 0 is a plane of symmetry.

    Parameters
    ----------
    rows : int
        Rows of triangles from the keel to the sheer; there are some 13.4 rows^2 triangles.

    Returns
    -------
    vertices : ndarray, (n, 3)
    faces : ndarray, (m, 3)
        Anticlockwise seen from outside; one boundary loop.
    """
    lattice, faces = hexagon(round(27 / 7 * rows), rows)
    at = even(_hull_at, _on_disc(lattice, faces, _hull_at), faces)
    # The descent ends near the symmetric minimum, not on it.
    other = cKDTree(lattice).query(lattice * [1, -1])[1]
    at = (at + at[other] * [1, -1]) / 2
    return _hull_at(at), faces[:, ::-1]


def _hull_at(at: Points) -> Points:
    """Points of the hull over the unit disc: bow at (1, 0), stern at (-1, 0), sheer the circle."""
    # The disc is the stereographic image of the lower half of a sphere, whose axis is the
    # length of the hull; the half circles across the axis are its sections.
    square = np.sum(at**2, axis=1)
    x, y, z = np.stack([2 * at[:, 0], 2 * at[:, 1], square - 1]) / (1 + square)
    t = np.sqrt(np.maximum(1 - x, 0.0) / 2)
    radius = 2 * t * np.sqrt(1 - t**2)
    # b and d over the radius: the factors t and sqrt(1 - t^2) are divided out.
    full = np.sqrt(1 + t**2) / 2
    breadth = 1100 * full * sum((1 - t) ** k for k in range(3))
    depth = 900 * full * sum((1 - t) ** k for k in range(6))
    flare = 1 + 0.2 * z / np.maximum(radius, 1e-12)
    sheer = 450 * (1 - t) ** 2 + 120 * t**2
    return np.stack([HULL_LENGTH * (0.5 - t), breadth * flare * y, sheer + depth * z], axis=-1)


def canopy(rows: int = 26) -> tuple[Points, Faces]:
    """Mesh a free-form canopy, 20 m long and 11 m wide, over a plan like a bean.

    The plan is the ellipse e = 1.7 p + i q, p^2 + q^2 <= 1, bent by the complex map
    e + 0.16 i e^2; the height is 0.9 - 0.35 q^2 + 0.16 cos(4.6 p + 0.5). One unit is 5.6 m.
    The waves along p make it convex on their crests and saddles in their troughs.

    Parameters
    ----------
    rows : int
        Half the rows of triangles across; there are some 8.9 rows^2 triangles.

    Returns
    -------
    vertices : ndarray, (n, 3)
    faces : ndarray, (m, 3)
        Anticlockwise seen from above; one boundary loop.
    """
    lattice, faces = hexagon(round(71 / 26 * rows), rows)
    at = even(_canopy_at, _on_disc(lattice, faces, _canopy_at), faces)
    return _canopy_at(at), faces


def _canopy_at(at: Points) -> Points:
    p, q = at.T
    ellipse = 1.7 * p + 1j * q
    plan = ellipse + 0.16j * ellipse**2
    height = 0.9 - 0.35 * q**2 + 0.16 * np.cos(4.6 * p + 0.5)
    return 5600.0 * np.stack([plan.real, plan.imag, height], axis=-1)


def _on_disc(lattice: Points, faces: Faces, surface: Callable[[Points], Points]) -> Points:
    """Lay a hexagon into the unit disc, the ends of its middle row on (1, 0) and (-1, 0).

    On either side its rim is spread over the half circle so that the edges on the surface
    are equally long.
    """
    loop = rim(faces)
    loop = np.roll(loop, -int(np.argmax(lattice[loop, 0])))
    half = len(loop) // 2
    at = np.zeros_like(lattice)
    for sign, side in ((1, loop[: half + 1]), (-1, np.append(loop[half:], loop[0])[::-1])):
        turn = sign * np.linspace(0.0, np.pi, 4001)
        along = _lengths(surface(np.stack([np.cos(turn), np.sin(turn)], axis=-1)))
        angle = np.interp(np.linspace(0.0, along[-1], half + 1), along, turn)
        at[side] = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return relax(at, faces, steps=1)


def quad_dome(side: int = 28) -> tuple[Points, Faces]:
    """Mesh a dome over an ellipse of 14 m by 11 m, 3 m high, with quads.

    A square patch on top has four sectors about it, as five sides of a cube; its corners
    have valence 3. The dome is the elliptic paraboloid z = 3 (1 - (x/7)^2 - (y/5.5)^2) m.

    Parameters
    ----------
    side : int
        Quads along a side of the square; there are some 2.14 side^2 quads.

    Returns
    -------
    vertices : ndarray, (n, 3)
    faces : ndarray, (m, 4)
        Anticlockwise seen from above; one boundary loop.
    """
    plan, faces = quad_disc(side, round(2 / 7 * side))
    plan = relax(plan, faces)
    height = 3000.0 * (1 - np.sum(plan**2, axis=1))
    return np.column_stack([plan * [7000.0, 5500.0], height]), faces


def teapot(around: int = 16) -> tuple[Points, Faces]:
    """Mesh the Utah teapot, 158 mm high: all of its patches, welded where they meet.

    It stays open where Newell left it open, and is in four pieces: the body with its rim
    and its bottom, the handle, the spout, and the lid with its knob.

    Parameters
    ----------
    around : int
        Edges along a quarter of the mouth. Where the pot is narrower there are fewer, and
        nowhere less than a quarter.

    Returns
    -------
    vertices : ndarray, (n, 3)
    faces : ndarray, (m, 3)
        Anticlockwise seen from outside; one boundary loop on the body and on the lid, two
        on the handle and on the spout.
    """
    pieces = [
        join(*zip(*(_teapot_patch(k, around) for first in piece for k in range(first, first + 4))))
        for piece in TEAPOT_PIECES
    ]
    points, faces = beside(*zip(*pieces))
    return TEAPOT_UNIT * points, faces


def _teapot_patch(k: int, around: int) -> tuple[Points, Faces]:
    """Triangulate a patch by rows at equal distances along its middle, in Newell's units.

    A row has as many edges as fit into it, and two patches that meet in a row agree.
    """
    # Handle and spout are narrow, and the lip of the spout is bent sharply.
    edge = 2.2 / around * (0.6 if 12 <= k < 20 else 1.0)
    t = np.linspace(0.0, 1.0, 201)
    along = _lengths(newell.point(k, t, 0.5))
    n = max(4, round(along[-1] / (0.866 * edge)))
    u = np.interp(np.linspace(0.0, along[-1], n + 1), along, t)
    across = np.array([_lengths(newell.point(k, r, t))[-1] for r in u])
    counts = np.clip(np.rint(across / edge), -(-around // 4), around) * (across > 1e-9)
    row, fraction, faces = strip(counts.astype(int).tolist())
    return newell.point(k, u[row], 1 - fraction), faces


def _lengths(line: Points) -> Points:
    """Length along a polyline from its start to each of its points."""
    return np.insert(np.linalg.norm(np.diff(line, axis=0), axis=1).cumsum(), 0, 0.0)


DESIGNS = {make.__name__: make for make in (sphere, helmet, hull, canopy, quad_dome, teapot)}


def main() -> None:
    """Write all designs, or those named, as OBJ."""
    command = parser(__doc__, "whole")
    command.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(DESIGNS)}")
    args = command.parse_args()
    for name in args.names:
        if name not in DESIGNS:
            command.error(f"there is no design {name!r}; there are {', '.join(DESIGNS)}")
    for name in args.names or DESIGNS:
        write_obj(args.out / f"{name}.obj", *DESIGNS[name](), f"{name}, whole, millimetres")


if __name__ == "__main__":
    main()
