# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of Blender as those of gso, and results as objects."""

import bpy
from mathutils import Vector

#: gso gets metres, so that drawings are at 1:1.
UNIT = "m"


def mesh_of(obj, scale):
    """Return an object's mesh in world coordinates times a scale, with its seams."""
    obj.update_from_editmode()
    mesh, matrix = obj.data, obj.matrix_world
    return {
        "vertices": [[scale * c for c in matrix @ v.co] for v in mesh.vertices],
        "faces": [list(face.vertices) for face in mesh.polygons],
        "seams": [list(edge.vertices) for edge in mesh.edges if edge.use_seam],
    }


def add_objects(context, obj, method, result, scale):
    """Add the surface and the flat parts of a result as objects of a new collection.

    Parts lie at z = 0 beside the object. Faces of the surface have the number of their part as the
    attribute ``gso_part``, vertices of the parts that of their vertex as ``gso_vertex``.
    """
    collection = bpy.data.collections.new(f"{obj.name} {method}")
    context.scene.collection.children.link(collection)
    corners = [obj.matrix_world @ Vector(corner) for corner in obj.bound_box]
    right = max(corner.x for corner in corners)
    front = min(corner.y for corner in corners)
    long = max(obj.dimensions)
    if "mesh" in result and method != "flatten":
        surface = _object(
            f"{obj.name} surface", result["mesh"]["vertices"], result["mesh"]["faces"], scale
        )
        if "flat" in result and len(result["flat"]["part"]) == len(surface.data.polygons):
            own = surface.data.attributes.new("gso_part", "INT", "FACE")
            own.data.foreach_set("value", result["flat"]["part"])
        collection.objects.link(surface)
    for number, part in enumerate(result.get("parts", ())):
        made = _part(part["name"], result["flat"], number, scale)
        made["gso_area"] = part["area"]
        # Beside the object, each at the place that it has in the pattern.
        made.location = (right + 0.1 * long, front, 0.0)
        collection.objects.link(made)
    return collection


def _part(name, flat, number, scale):
    """Make the object of one part of a pattern."""
    faces = [f for f, own in zip(flat["faces"], flat["part"]) if own == number]
    used = sorted({corner for face in faces for corner in face})
    index = {corner: k for k, corner in enumerate(used)}
    points = [[*flat["vertices"][corner], 0.0] for corner in used]
    made = _object(name, points, [[index[c] for c in face] for face in faces], scale)
    own = made.data.attributes.new("gso_vertex", "INT", "POINT")
    own.data.foreach_set("value", [flat["vertex"][corner] for corner in used])
    return made


def _object(name, vertices, faces, scale):
    """Make an object of vertices that are divided by a scale."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([[c / scale for c in point] for point in vertices], [], faces)
    mesh.update()
    return bpy.data.objects.new(name, mesh)
