"""A design continued beyond its outline, as a target for strips."""

from __future__ import annotations

import numpy as np

from gso import geometry
from gso.geometry.vectors import lengths, unit
from gso.mesh import Nearest
from gso.ruled.domain import Domain
from gso.ruled.polygon import resampled
from gso.typing import Array

#: Points around the outline in each ring of the continuation; rings, in margins.
_AROUND, _RINGS = 96, (0.5, 1.0, 1.6)
#: Weight of the continuation, relative to the design.
_WEIGHT = 0.1


class Extended:
    """The design and its continuation as one triangulated surface.

    Parameters
    ----------
    domain : Domain
        The design over its flat image.
    """

    def __init__(self, domain: Domain):
        from scipy.spatial import Delaunay

        self.domain = domain
        outline, normals = resampled(domain.flat[domain.outline], _AROUND)
        rings = [outline + k * domain.margin * normals for k in _RINGS]
        places = np.concatenate([domain.flat[domain.outline], *rings[:-1], rings[-1]])
        ring = np.repeat(np.r_[0.0, _RINGS], [len(domain.outline), *[_AROUND] * len(_RINGS)])
        gap = np.linalg.norm(domain.sample(domain.normals, places)[1] - places, axis=1)
        kept = np.flatnonzero(gap >= 0.9 * ring * domain.margin)
        places = places[kept]
        triangles = Delaunay(places).simplices
        middle = places[triangles].mean(axis=1)
        away = np.linalg.norm(domain.sample(domain.normals, middle)[1] - middle, axis=1)
        triangles = triangles[(away > 1e-3 * domain.margin) & (away < _RINGS[-1] * domain.margin)]
        ids = np.where(
            kept < len(domain.outline),
            domain.outline[np.minimum(kept, len(domain.outline) - 1)],
            -1,
        )
        new = np.flatnonzero(ids < 0)
        n = len(domain.mesh.vertices)
        ids[new] = n + np.arange(len(new))
        vertices = np.concatenate([domain.mesh.vertices, domain.points(places[new])])
        triangles = ids[triangles]
        flat = np.concatenate([domain.flat, places[new]])
        turned = geometry.signed_areas(flat, triangles) < 0
        triangles[turned] = triangles[turned][:, ::-1]
        every = np.concatenate([domain.mesh.triangles, triangles])
        self.weights = np.r_[np.ones(n), np.full(len(new), _WEIGHT)]
        area = geometry.area_vectors(vertices, every)
        total = np.stack(
            [np.bincount(every.ravel(), np.repeat(area[:, d], 3), len(vertices)) for d in range(3)],
            1,
        )
        normal = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)
        normal[:n][domain.mesh.used] = (
            domain.normals[domain.mesh.used]
            * np.sign((normal[:n] * domain.normals).sum(axis=1))[domain.mesh.used, None]
        )
        self.vertices, self.triangles, self.normals, self.flat = vertices, every, normal, flat
        self._near = Nearest.of(vertices, every)
        rim = domain.points(outline + domain.margin * normals)
        self._rim = rim
        self._out = rim - domain.sample(domain.mesh.vertices, outline)[0]
        #: Mean width of the continuation.
        self.margin = float(lengths(self._out).mean())
        self._step = np.roll(rim, -1, axis=0) - rim
        self._length = np.maximum(lengths(self._step), 1e-300)

    def feet(self, points: Array) -> tuple[Array, Array, Array]:
        """Return the nearest points to points (k, 3), unit normals and weights there."""
        triangle, shares, foot = self._near.locate(points)
        ids = self.triangles[triangle]
        normal = np.einsum("kj,kjd->kd", shares, self.normals[ids])
        return foot, unit(normal), (shares * self.weights[ids]).sum(axis=1)

    def rim_feet(self, points: Array) -> tuple[Array, Array, Array]:
        """Return the nearest points of the continued outline to points (k, 3).

        Also returned are its tangents there, and the vectors from the outline to it.
        """
        away = points[:, None] - self._rim
        s = np.einsum("kld,ld->kl", away, self._step) / self._length**2
        s = np.minimum(np.maximum(s, 0.0), 1.0)
        off = away - s[:, :, None] * self._step
        at = np.einsum("kld,kld->kl", off, off).argmin(axis=1)
        s = s[np.arange(len(points)), at, None]
        out = (1.0 - s) * self._out[at] + s * self._out[(at + 1) % len(self._out)]
        return self._rim[at] + s * self._step[at], self._step[at] / self._length[at, None], out
