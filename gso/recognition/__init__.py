"""Faces of shapes in meshes: planes, cylinders, cones, torsal surfaces; flat images, bend lines.

>>> import numpy as np
>>> box = ([[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0], [0, 3, 2], [4, 3, 2]],
...        [[0, 1, 2, 3], [3, 2, 5, 4]])
>>> [face.kind for face in recognise(box).faces]
['plane', 'plane']
"""

from gso.recognition.bend_lines import BendLine, bend_step_of
from gso.recognition.facet_graph import coordinate_step
from gso.recognition.fold_diagonals import fold_triangles
from gso.recognition.recognise import has_rows, recognise
from gso.recognition.round_surface import RoundSurface
from gso.recognition.shape_face import Recognised, ShapeFace

__all__ = [
    "BendLine",
    "Recognised",
    "RoundSurface",
    "ShapeFace",
    "bend_step_of",
    "coordinate_step",
    "fold_triangles",
    "has_rows",
    "recognise",
]
