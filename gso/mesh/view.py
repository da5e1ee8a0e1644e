"""Views of surfaces for pictures: projection, light, and colours of parts."""

from __future__ import annotations

import colorsys
from dataclasses import dataclass

import numpy as np

from gso import geometry
from gso.mesh.mesh import Frame, Mesh
from gso.typing import Array

GRAZING = np.array([-0.70, 0.50, 0.50])
"""Light along the surface, which shows every bump: right, up, towards the viewer."""

#: Angles about the vertical axis and above the horizon, degrees.
_TURN, _TILT = 25.0, 48.0


@dataclass(frozen=True)
class View:
    """An orthographic view: `axes` has the columns right, up and towards the viewer."""

    frame: Frame
    axes: Array

    @classmethod
    def of(cls, mesh: Mesh) -> View:
        """Choose a view from the front of a surface.

        A flat surface is seen perpendicularly. Others are seen obliquely from the side of their
        mean normal, with z up. Surfaces that face nearly along z, like a landscape, are instead
        seen obliquely from above, with x or their longest axis to the right.
        """
        points, triangles = mesh.frame.to_unit(mesh.vertices), mesh.triangles
        normals = geometry.area_vectors(points, triangles)
        used = points[np.unique(triangles)]
        _, extent, axes = np.linalg.svd(used - used.mean(axis=0), full_matrices=False)
        total = normals.sum(axis=0)
        if np.linalg.norm(total) < 0.1 * np.linalg.norm(normals, axis=1).sum():
            total = axes[2]
        normal = total / np.linalg.norm(total)
        flat = extent[2] < 1e-6 * extent[0]
        if flat or abs(normal[2]) > 0.8:
            normal = normal if normal[2] >= 0 else -normal
            right = _right(normal, axes[0])
            if flat:
                return cls(mesh.frame, np.stack([right, np.cross(normal, right), normal], axis=1))
            return cls(mesh.frame, _tilted(normal, np.cross(right, normal), np.radians(_TILT)))
        up = np.array([0.0, 0.0, 1.0])
        toward = normal - normal[2] * up
        toward /= np.linalg.norm(toward)
        return cls(mesh.frame, _tilted(up, toward, np.arcsin(normal[2]) + np.radians(20.0)))

    @property
    def behind(self) -> View:
        """The view of the other side."""
        return View(self.frame, self.axes * np.array([-1.0, 1.0, -1.0]))

    def project(self, points: Array) -> Array:
        """Project points (n, 3) to right, up and towards the viewer, in units of the frame."""
        return self.frame.to_unit(points) @ self.axes


def _right(normal: Array, longest: Array) -> Array:
    """Return right in a view from above: x if the normal is along z, else the longest axis."""
    level = np.hypot(normal[0], normal[1]) < 1e-6
    along = np.array([1.0, 0.0, 0.0]) if level else longest
    along = along - (along @ normal) * normal
    along /= np.linalg.norm(along)
    return along if along[np.abs(along).argmax()] > 0 else -along


def _tilted(up: Array, toward: Array, tilt: float) -> Array:
    """Compute the axes of a viewer in the direction `toward`, a bit aside, looking down."""
    turn = np.radians(_TURN)
    side = np.cross(up, toward)
    eye = np.cos(tilt) * (np.cos(turn) * toward + np.sin(turn) * side) + np.sin(tilt) * up
    right = np.cross(up, eye)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(eye, right), eye], axis=1)


def lit(normals: Array, light: Array) -> Array:
    """Return the share of the light (m,), 0 to 1, that falls on faces with normals (m, 3).

    It is the same for both orientations; normals and the direction to the light have any length.
    """
    length = np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
    return np.asarray(np.abs(normals @ light) / (length * np.linalg.norm(light)))


def pale_colours(count: int) -> Array:
    """Return colours (n, 3) of even brightness, 0 to 1, far apart for neighbouring numbers."""
    hue = (0.58 + 0.618034 * np.arange(count)) % 1.0
    return np.array([colorsys.hls_to_rgb(h, 0.74, 0.45) for h in hue]).reshape(-1, 3)
