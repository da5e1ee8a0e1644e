"""Rulings and curvatures by the discrete Gauss map of Jiang et al. 2020.

The Gauss image of a mesh has the same faces; its vertices are the unit normals at the mesh's
vertices. The shape operator of a face maps the face to its image. It gives the curvatures and
the ruling, the direction in which the surface bends least. If the surface is developable, its
Gauss image is a curve and its rulings are straight lines.

>>> import numpy as np
>>> y, x = np.mgrid[:6, :9] / 8
>>> bent = np.stack([x, y, x**2 / 2], axis=-1)
>>> shape_operator(bent).thickness < 1e-3
True
>>> len(trace(bent, count=5))
5
"""

from __future__ import annotations

from gso.rulings.face_curvature import ShapeOperator, shape_operator, smallest_radius
from gso.rulings.gauss_image import gauss_image
from gso.rulings.ruling_lines import Rulings, trace

__all__ = ["Rulings", "ShapeOperator", "gauss_image", "shape_operator", "smallest_radius", "trace"]
