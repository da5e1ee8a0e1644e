# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the sidebar of the 3D view."""

import bpy

from .operators import METHODS


class GSO_PT_patterns(bpy.types.Panel):
    """Flat patterns of the active mesh"""

    bl_label = "Flat patterns"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "gso"

    def draw(self, context):
        layout, settings = self.layout, context.scene.gso
        column = layout.column(align=True)
        for method, label, _ in METHODS:
            column.operator(f"gso.{method}", text=label)
        column = layout.column()
        for name in ("max_deviation", "max_strain", "max_pieces", "effort", "merge"):
            column.prop(settings, name)
        layout.operator("gso.export")


CLASSES = (GSO_PT_patterns,)
