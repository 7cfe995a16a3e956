"""Hides differences between Blender versions."""

import bpy


def input_of(principled, name):
    """Returns a socket of the Principled shader by its Blender 3 name."""
    later = {"Emission": "Emission Color", "Transmission": "Transmission Weight", "Specular": "Specular IOR Level"}
    found = principled.inputs.get(name)
    return found if found is not None else principled.inputs[later[name]]


def group_socket(tree, name, kind, is_input):
    if hasattr(tree, "interface"):
        tree.interface.new_socket(name, in_out="INPUT" if is_input else "OUTPUT", socket_type=kind)
    else:
        (tree.inputs if is_input else tree.outputs).new(kind, name)


def set_faces(mesh, starts, corners_of_each):
    """Sets each face's first corner, and its corner count, which Blender 3.6 and later derive."""
    mesh.polygons.foreach_set("loop_start", starts)
    if bpy.app.version < (3, 6, 0):
        mesh.polygons.foreach_set("loop_total", corners_of_each)


def shade_flat(mesh):
    """Shades faces flat, which is not the default from Blender 4.1 on."""
    if hasattr(mesh, "shade_flat"):
        mesh.shade_flat()
