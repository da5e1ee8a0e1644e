# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators on the active mesh."""

import os

import bpy
from bpy.props import EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from .exchange import UNIT, add_objects, mesh_of
from .gso_client import Client, GsoError, why_not

METHODS = (
    ("unfold", "Unfold", "Lay flat faces out in one plane, with folds"),
    ("strips", "Strips", "Make strips of planar faces that are exactly developable"),
    ("pieces", "Pieces", "Cut the surface into few pieces that can be laid flat"),
    ("flatten", "Flatten", "Lay the surface flat as it is, with the least strain"),
)


def command_of(context):
    """Return the command in the preferences; None if there is none."""
    addon = context.preferences.addons.get(__package__)
    given = addon.preferences.command if addon else ""
    return bpy.path.abspath(given) if given else None


def asked(context, method):
    """Return the parameters of a method by the settings of the scene."""
    settings, scale = context.scene.gso, context.scene.unit_settings.scale_length
    params = {"unit": UNIT, "weld": 0.0 if settings.merge else None}
    if method == "unfold":
        params["effort"] = settings.effort
    elif method in ("strips", "pieces"):
        params["max_deviation"] = scale * settings.max_deviation or None
        params["max_strain"] = 0.01 * settings.max_strain or None
        params["max_pieces"] = settings.max_pieces or None
    return params


class Run:
    """What the operators share."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context):
        obj = context.active_object
        if obj is None or obj.type != "MESH":
            cls.poll_message_set("Select a mesh")
            return False
        return True

    def solve(self, context, method, output=None):
        """Return the result of a method; None after an error, which is reported."""
        obj, manager = context.active_object, context.window_manager
        scale = context.scene.unit_settings.scale_length
        manager.progress_begin(0, 1)

        def progress(share, text):
            if share is not None:
                manager.progress_update(share)

        try:
            with Client(command_of(context)) as gso:
                mesh = mesh_of(obj, scale)
                result = gso.call(
                    method,
                    progress,
                    mesh=mesh,
                    name=obj.name,
                    output=output,
                    **asked(context, method),
                )
        except GsoError as error:
            self.report({"ERROR"}, str(error))
            return None
        finally:
            manager.progress_end()
        for text in why_not(result):
            self.report({"WARNING"}, text)
        for text in result["notes"]:
            self.report({"INFO"}, text)
        return result


def operator(method, label, description):
    """Make the operator of a method."""

    def execute(self, context):
        result = self.solve(context, method)
        if result is None:
            return {"CANCELLED"}
        scale = context.scene.unit_settings.scale_length
        obj = context.active_object
        add_objects(context, obj, method, result, scale)
        parts = len(result.get("parts", ()))
        self.report({"INFO"}, f"{obj.name}: {parts} part{'' if parts == 1 else 's'}")
        return {"FINISHED"}

    content = {
        "__doc__": description,
        "bl_idname": f"gso.{method}",
        "bl_label": label,
        "execute": execute,
    }
    return type(f"GSO_OT_{method}", (Run, bpy.types.Operator), content)


class GSO_OT_export(Run, bpy.types.Operator, ExportHelper):
    """Write the flat pattern of the active mesh as a drawing at 1:1"""

    bl_idname = "gso.export"
    bl_label = "Export DXF/PDF"

    filename_ext = ".dxf"
    check_extension = None
    filter_glob: StringProperty(default="*.dxf;*.pdf;*.svg", options={"HIDDEN"})
    method: EnumProperty(name="Method", items=METHODS)

    def execute(self, context):
        path = bpy.path.abspath(self.filepath)
        if not os.path.splitext(path)[1]:
            path += self.filename_ext
        result = self.solve(context, self.method, output=path)
        if result is None:
            return {"CANCELLED"}
        self.report({"INFO"}, f"{path} written")
        return {"FINISHED"}


CLASSES = (*(operator(*method) for method in METHODS), GSO_OT_export)
