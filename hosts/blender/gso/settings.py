# SPDX-License-Identifier: GPL-3.0-or-later
"""Preferences, and the settings of a scene."""

import bpy
from bpy.props import BoolProperty, FloatProperty, IntProperty, StringProperty


class GsoPreferences(bpy.types.AddonPreferences):
    """Where gso is."""

    bl_idname = __package__

    command: StringProperty(
        name="Command",
        description="Path of the program gso; empty for GSO_COMMAND or the search path",
        subtype="FILE_PATH",
    )

    def draw(self, context):
        self.layout.prop(self, "command")
        self.layout.label(text="Install it with: pip install gso (Python 3.11)")


class GsoSettings(bpy.types.PropertyGroup):
    """What the methods are asked for."""

    max_deviation: FloatProperty(
        name="Max deviation",
        description="Largest distance between design and result; 0: the shape stays as it is "
        "(pieces), or no bound (strips)",
        default=0.0,
        min=0.0,
        subtype="DISTANCE",
        unit="LENGTH",
    )
    max_strain: FloatProperty(
        name="Max strain %",
        description="Largest strain of the patterns of pieces and strips, in per cent; "
        "0: that of gso",
        default=0.0,
        min=0.0,
        max=100.0,
    )
    max_pieces: IntProperty(
        name="Max pieces", description="Budget of pieces; 0 for none", default=0, min=0
    )
    effort: FloatProperty(
        name="Effort", description="Factor of the time that Unfold searches", default=1.0, min=0.0
    )
    merge: BoolProperty(
        name="Merge vertices", description="Merge vertices with equal coordinates", default=False
    )


CLASSES = (GsoPreferences, GsoSettings)
