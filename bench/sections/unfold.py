"""Nets of surfaces of flat faces: parts, cuts and times.

Cuts are the length of all cut edges over the diagonal. ``folder=DIR`` unfolds the files in a folder
instead of the generated models; ``effort=X`` is that of the search.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from harness import progress, tabulate, timed
from scipy.spatial import ConvexHull

import gso
from gso.typing import Array, Ints

_Model = tuple[Array, Ints | list[list[int]]]


def nets(folder: str = "", effort: str = "1") -> dict[str, Any]:
    """Unfold low-poly models, or the files in a folder."""
    models: dict[str, Any] = _files(folder) if folder else _models()
    rows = {}
    for name in progress(list(models), "nets"):
        try:
            net, seconds = timed(gso.unfold, models[name], effort=float(effort))
        except gso.GSOError as error:
            print(f"{name}: {error}")
            continue
        rows[name] = {
            "triangles": len(net.mesh.faces),
            "parts": len(net),
            "cuts": net.cut_length / net.mesh.diagonal,
            "folds": len(net.angles),
            "misfit": net.misfit() / net.mesh.diagonal,
            "s": seconds,
        }
    return tabulate("nets", ["model"], rows)


def _files(folder: str) -> dict[str, Path]:
    suffixes = set(gso.io.SUFFIXES) - {".npy", ".npz"}
    return {p.name: p for p in sorted(Path(folder).iterdir()) if p.suffix.lower() in suffixes}


def _models() -> dict[str, _Model]:
    """Make ten models: lumpy balls, stars, twisted columns, tori, a gear and stairs."""
    return {
        "ball 100": _ball(52),
        "ball 500": _ball(252),
        "ball 2000": _ball(1002),
        "ball 5000": _ball(2502),
        "star": _star(),
        "column": _revolved(np.array([3.0, 2.0, 2.5, 1.0, 2.0, 3.0]), 9, 0.3),
        "vase": _revolved(2.0 + np.sin(np.linspace(0.0, 5.0, 16)), 12, 0.0),
        "torus 12 x 8": _torus(12, 8, 3.0),
        "torus 24 x 16": _torus(24, 16, 1.6),
        "gear": _prism(_gear(14)),
        "stairs": _prism(_stairs(12)),
    }


def _hull(points: Array) -> _Model:
    made = ConvexHull(points)
    p = points[made.simplices]
    out = np.einsum(
        "td,td->t", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), made.equations[:, :3]
    )
    return points, np.where((out > 0)[:, None], made.simplices, made.simplices[:, ::-1])


def _ball(n: int) -> _Model:
    k = np.arange(n) + 0.5
    z, a = 1.0 - 2.0 * k / n, np.pi * (1.0 + np.sqrt(5.0)) * k
    p = np.stack([np.sqrt(1 - z * z) * np.cos(a), np.sqrt(1 - z * z) * np.sin(a), z], axis=1)
    lumps = 1.0 + 0.3 * np.sin(5 * p[:, :1]) * np.cos(4 * p[:, 1:2]) * np.sin(1.0 + 3 * p[:, 2:])
    return p * lumps, _hull(p)[1]


def _star() -> _Model:
    """A spike on every face of an icosahedron."""
    gold = 0.5 * (1.0 + np.sqrt(5.0))
    base = [(0, a, b * gold) for a in (1, -1) for b in (1, -1)]
    points, faces = _hull(np.array([np.roll(p, k) for p in base for k in range(3)], float))
    tops = 2.5 * points[np.asarray(faces)].mean(axis=1)
    every = []
    for k, (a, b, c) in enumerate(np.asarray(faces).tolist()):
        top = len(points) + k
        every += [[a, b, top], [b, c, top], [c, a, top]]
    return np.r_[points, tops], every


def _revolved(radii: Array, n: int, twist: float) -> _Model:
    """Rings of n points, closed by a floor and a ceiling; quads are two triangles each."""
    m = len(radii)
    a = 2.0 * np.pi * np.arange(n) / n + twist * np.arange(m)[:, None]
    ring = np.stack([radii[:, None] * np.cos(a), radii[:, None] * np.sin(a)], axis=2)
    z = np.broadcast_to(np.arange(m, dtype=float)[:, None, None], (m, n, 1))
    faces = [list(range(n))[::-1], list(range((m - 1) * n, m * n))]
    for i in range(m - 1):
        for j in range(n):
            p, q = i * n + j, i * n + (j + 1) % n
            faces += [[p, q, q + n], [p, q + n, p + n]]
    return np.concatenate([ring, z], axis=2).reshape(-1, 3), faces


def _torus(m: int, n: int, radius: float) -> _Model:
    u = 2.0 * np.pi * np.arange(m)[:, None] / m
    v = 2.0 * np.pi * np.arange(n)[None] / n
    r = radius + np.cos(v)
    points = np.stack([r * np.cos(u), r * np.sin(u), np.sin(v) + 0 * u], axis=2).reshape(-1, 3)
    faces = []
    for i in range(m):
        for j in range(n):
            p, q = i * n + j, i * n + (j + 1) % n
            r, s = (i + 1) % m * n + j, (i + 1) % m * n + (j + 1) % n
            faces.append([p, r, s, q])
    return points, faces


def _prism(outline: Array) -> _Model:
    n = len(outline)
    points = np.r_[np.pad(outline, ((0, 0), (0, 1))), np.c_[outline, np.full(n, 2.0)]]
    around = [[k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n)]
    return points, [list(range(n))[::-1], list(range(n, 2 * n)), *around]


def _gear(teeth: int) -> Array:
    radii, a = np.tile([6.0, 6.0, 5.0, 5.0], teeth), np.pi * np.arange(4 * teeth) / (2 * teeth)
    return radii[:, None] * np.stack([np.cos(a), np.sin(a)], axis=1)


def _stairs(steps: int) -> Array:
    k = np.arange(1.0, steps + 1.0)
    up = np.stack([np.repeat(k, 2) - np.tile([1.0, 0.0], steps), np.repeat(k, 2)], axis=1)
    return np.r_[[[0.0, 0.0]], up, [[float(steps), 0.0]]][::-1]


SECTIONS = (nets,)
