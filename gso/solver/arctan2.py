"""The angle of a plane vector, without branches, so that compilers can use vector instructions."""

from __future__ import annotations


def arctan2(y: float, x: float) -> float:
    """Return the angle of the vector (x, y) in radians, to 5e-16; written for Numba.

    Components must be finite and below 1e307; the sign of zero does not count.

    The ratio of the smaller to the larger component is reduced to at most tan(pi/8), where the
    arctangent is a polynomial (minimax, error 1e-18). It is inlined in loops over elements: the
    C library's function would keep the compiler from evaluating several elements at once.

    >>> arctan2(1.0, -1.0) == 0.75 * 3.141592653589793
    True
    """
    height, width = abs(y), abs(x)
    large = width if width > height else height
    small = height if width > height else width
    far = small > 0.41421356237309503 * large
    top = small - large if far else small
    bottom = small + large if far else large
    t = top / bottom if bottom != 0.0 else 0.0
    z = t * t
    series = -0.017805397205419446 * z + 0.03796525745386593
    series = series * z - 0.05035102456601552
    series = series * z + 0.05846878297330872
    series = series * z - 0.06662951813629191
    series = series * z + 0.07692045330902225
    series = series * z - 0.09090896809064027
    series = series * z + 0.11111110744919658
    series = series * z - 0.14285714279250245
    series = series * z + 0.19999999999940893
    series = series * z - 0.3333333333333312
    angle = t * (series * z + 1.0)
    angle = angle + 0.7853981633974483 if far else angle
    angle = 1.5707963267948966 - angle if height > width else angle
    angle = 3.141592653589793 - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle
