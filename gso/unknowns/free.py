"""Every coordinate of the layout is an unknown: free vertices, plane images, or both.

With a layout of one block "surface" these are three unknowns per vertex, with "flat"
two (planar), with both five (joint).
"""

from __future__ import annotations

import numpy as np

from gso.unknowns.base import Layout, Variables


def free(layout: Layout) -> Variables:
    """Make every coordinate an unknown."""
    return Variables(layout, None, np.zeros(layout.size))
