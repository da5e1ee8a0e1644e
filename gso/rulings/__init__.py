"""Rulings and curvatures by the discrete Gauss map of Jiang et al. 2020.

The Gauss image of a mesh has its faces, and the unit normals at its vertices for vertices.
How a face and its image differ is its shape operator: curvatures, and the direction in which the
surface bends least, its ruling. A surface is developable when its image is a curve; the
rulings are straight lines then.

>>> import numpy as np
>>> y, x = np.mgrid[:6, :9] / 8
>>> bent = np.stack([x, y, x**2 / 2], axis=-1)
>>> shape_operator(bent).thickness < 1e-3
True
>>> len(trace(bent, count=5))
5
"""

from __future__ import annotations

from gso.rulings.lines import Rulings, trace
from gso.rulings.normals import gauss_image
from gso.rulings.shape import ShapeOperator, shape_operator

__all__ = ["Rulings", "ShapeOperator", "gauss_image", "shape_operator", "trace"]
