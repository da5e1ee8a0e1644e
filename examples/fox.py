"""A low-poly fox of flat triangles, closed, for a model of paper. A formula of our own.

The fox looks along x, and z is up. A tube of six-sided rings runs from tail to nose; legs and ears
grow out of its faces. It is 79 units high, and its own mirror image at y = 0.
"""

from __future__ import annotations

import numpy as np
from _write import Faces, Points, parser, write_obj

#: Rings of the tube from tail to nose: x and z of the middle, half width, half height, and the
#: direction of the tube in degrees above the x axis.
RINGS = (
    (-74.0, 44.0, 8.0, 8.0, -10.0),
    (-56.0, 44.0, 9.0, 9.0, -5.0),
    (-40.0, 40.0, 3.5, 3.5, -20.0),
    (-33.0, 38.0, 9.0, 10.0, -10.0),
    (-18.0, 35.0, 10.0, 12.0, 0.0),
    (2.0, 35.0, 9.0, 11.0, 0.0),
    (18.0, 36.0, 11.0, 14.0, 15.0),
    (27.0, 46.0, 7.0, 9.0, 35.0),
    (33.0, 55.0, 13.0, 10.0, 10.0),
    (45.0, 52.0, 9.0, 7.5, -20.0),
    (59.0, 46.0, 2.5, 2.5, -25.0),
)
#: Tip of the tail, and of the nose.
TAIL, NOSE = (-97.0, 50.0), (62.0, 44.5)
#: Middle of each foot, its half sizes, and the ring behind the leg.
FEET, FOOT = (((-29.0, 6.0), 3), ((17.0, 6.5), 5)), (3.0, 2.5)
#: Tip of the left ear, and the ring behind it.
EAR, EAR_RING = (33.0, 12.0, 79.0), 8
#: Points of a ring, from its top to the left: across and up, as shares of its half sizes.
ACROSS = np.array([0.0, 0.9, 0.8, 0.0, -0.8, -0.9])
UP = np.array([1.0, 0.5, -0.55, -1.0, -0.55, 0.5])


def rings() -> Points:
    """Return the points of the tube, (rings, 6, 3)."""
    x, z, wide, high, angle = (column[:, None] for column in np.array(RINGS).T)
    turn = np.radians(angle)
    return np.stack(
        [x - high * UP * np.sin(turn), wide * ACROSS, z + high * UP * np.cos(turn)], axis=-1
    )


def fox() -> tuple[Points, Faces]:
    """Mesh the fox.

    Returns
    -------
    vertices : ndarray, (n, 3)
    faces : ndarray, (m, 3)
        Anticlockwise seen from outside; no boundary.
    """
    tube = rings()
    points = [tuple(p) for p in tube.reshape(-1, 3)]
    faces: list[tuple[int, ...]] = []

    def add(x: float, y: float, z: float) -> int:
        points.append((x, y, z))
        return len(points) - 1

    def quad(a: int, b: int, c: int, d: int, left: bool) -> None:
        """Add a quad as two triangles; the diagonals of both sides are mirror images."""
        faces.extend([(a, b, c), (a, c, d)] if left else [(a, b, d), (b, c, d)])

    def limb(base: tuple[int, ...], end: list[int], left: bool) -> None:
        """Add the sides of a leg between four points and the foot."""
        for k in range(4):
            on = (k + 1) % 4
            # Mirrored limbs have the corners of their bases the other way around.
            quad(base[k], base[on], end[on], end[k], left)
        quad(*end, left)

    legs = {(ring, sector): place for place, ring in FEET for sector in (2, 3)}
    for ring in range(len(tube) - 1):
        for sector in range(6):
            left, on = sector < 3, (sector + 1) % 6
            a, b = 6 * ring + sector, 6 * (ring + 1) + sector
            c, d = 6 * (ring + 1) + on, 6 * ring + on
            side = 1.0 if left else -1.0
            if (ring, sector) in legs:
                (x, y), (long, wide) = legs[ring, sector], FOOT
                corners = [(-long, wide), (long, wide), (long, -wide), (-long, -wide)]
                if not left:
                    corners = [(u, -v) for u, v in corners]
                limb((a, b, c, d), [add(x + u, side * y + v, 0.0) for u, v in corners], left)
            elif ring == EAR_RING and sector in (0, 5):
                tip = add(EAR[0], side * EAR[1], EAR[2])
                faces.extend((p, q, tip) for p, q in ((a, b), (b, c), (c, d), (d, a)))
            else:
                quad(a, b, c, d, left)
    first, last = 0, 6 * (len(tube) - 1)
    tail, nose = add(TAIL[0], 0.0, TAIL[1]), add(NOSE[0], 0.0, NOSE[1])
    for sector in range(6):
        on = (sector + 1) % 6
        faces += [(first + on, tail, first + sector), (last + sector, nose, last + on)]
    return np.array(points), np.array(faces)


def main() -> None:
    """Write the fox."""
    args = parser(__doc__, "fox.obj").parse_args()
    write_obj(args.out, *fox(), "a low-poly fox")


if __name__ == "__main__":
    main()
