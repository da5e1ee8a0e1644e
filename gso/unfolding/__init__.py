"""Nets of surfaces of flat faces: flat parts that fold up to the surface.

:func:`gso.unfold` makes the net of a mesh. :func:`join_patches` joins any rigid flat patches, such
as unrolled cylinders beside flat faces.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gso.first_use import at_first_use

if TYPE_CHECKING:
    from gso.unfolding.manifold import manifold_mesh
    from gso.unfolding.patch_joining import Joined, join_patches
    from gso.unfolding.planar_faces import PlanarFaces
    from gso.unfolding.polyhedral_net import Net
    from gso.unfolding.unfold_mesh import net_of, unfold

__all__ = ["Joined", "Net", "PlanarFaces", "join_patches", "manifold_mesh", "net_of", "unfold"]

# These import SciPy.
__getattr__, __dir__ = at_first_use(
    __name__,
    {
        "manifold": "manifold_mesh",
        "patch_joining": "Joined join_patches",
        "planar_faces": "PlanarFaces",
        "polyhedral_net": "Net",
        "unfold_mesh": "net_of unfold",
    },
)
