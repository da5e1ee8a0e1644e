# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat patterns of meshes: Unfold, Strips, Pieces and Flatten on the active object.

The add-on starts ``gso serve --stdio`` and talks to it. Edges marked as seams are cut.
"""

import bpy

from . import operators, panel, settings

CLASSES = (*settings.CLASSES, *operators.CLASSES, *panel.CLASSES)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.gso = bpy.props.PointerProperty(type=settings.GsoSettings)


def unregister():
    del bpy.types.Scene.gso
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
